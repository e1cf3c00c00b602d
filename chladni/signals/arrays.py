"""What arrays of numbers are called in annotations: one word for each kind of number."""

import numpy as np
from numpy.typing import NDArray

#: Real and complex numbers in double precision: what everything here computes with.
Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Whole numbers: stamps in ns, counts, sample numbers.
Whole = NDArray[np.int64]
#: Where something lies in another array, as NumPy's own searches and sorts answer.
Index = NDArray[np.intp]
#: What is chosen, line by line or sample by sample.
Mask = NDArray[np.bool_]
#: Contents of files and messages.
Bytes = NDArray[np.uint8]
