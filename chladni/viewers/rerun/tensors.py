"""Many vectors of one length as one Arrow column of rerun tensors.

Rerun's own converter makes a Python object a vector and takes three milliseconds for each; an hour of spectra is
tens of thousands of them. This builds the same Arrow array (the tests compare them) from one block of memory.
"""

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

_ELEMENT = "F32"


class TensorColumn:
    """A batch of one-dimensional tensors, one for each row of a matrix.

    Parameters
    ----------
    vectors
        ``[row, element]``; written as 32-bit floats.
    """

    def __init__(self, vectors: NDArray[np.float32]) -> None:
        self._array = _tensors(np.ascontiguousarray(vectors, dtype=np.float32))

    def as_arrow_array(self) -> pa.Array:
        """Give the batch as rerun asks for it."""
        return self._array


def _tensors(vectors: NDArray[np.float32]) -> pa.Array:
    count, length = vectors.shape
    # The one-element tensor is made by rerun, so that the type is rerun's whatever the version.
    kind = rr.components.TensorDataBatch(rr.encodings.TensorData(array=np.zeros(1, np.float32))).as_arrow_array().type
    shape, names, buffer = (kind.field(place).type for place in range(3))
    shapes = _lists(shape, np.full((count, 1), length, dtype=np.uint64))
    return pa.Array.from_buffers(
        kind, count, [None], children=[shapes, pa.nulls(count, names), _union(buffer, vectors)]
    )


def _union(kind: pa.DataType, vectors: NDArray[np.float32]) -> pa.Array:
    """Elements of every tensor, all in the one variant of the union that holds 32-bit floats."""
    count = vectors.shape[0]
    variants = [kind.field(place) for place in range(kind.num_fields)]
    code = [variant.name for variant in variants].index(_ELEMENT)
    children = [_lists(v.type, vectors) if v.name == _ELEMENT else pa.array([], v.type) for v in variants]
    codes = pa.py_buffer(np.full(count, code, dtype=np.int8))
    places = pa.py_buffer(np.arange(count, dtype=np.int32))
    return pa.Array.from_buffers(kind, count, [None, codes, places], children=children)


def _lists(kind: pa.DataType, rows: NDArray[np.generic]) -> pa.Array:
    count, length = rows.shape
    offsets = np.arange(count + 1, dtype=np.int32) * np.int32(length)
    return pa.Array.from_buffers(
        kind, rows.shape[0], [None, pa.py_buffer(offsets)], children=[pa.array(rows.ravel())]
    )
