"""How the hidden physics is compiled: the only file of the withheld check that knows numba."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba as nb

from chladni.models.integrator.cache_folder import CACHED

FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])
_JIT: Any = nb.njit(cache=CACHED, nogil=True, fastmath=False, error_model="numpy")
_SOURCES = [path.stat() for path in sorted(Path(__file__).parent.glob("*.py"))]
_STAMP = max(each.st_mtime for each in _SOURCES), sum(each.st_size for each in _SOURCES)


def compiled(function: FunctionT) -> FunctionT:
    """Compile a function when it's first called, and keep the result where that is possible."""
    made: FunctionT = _JIT(function)
    # numba looks at one file only: a loop would go on with a law that has changed in another file.
    kept = getattr(getattr(made, "_cache", None), "_cache_file", None)
    if kept is not None:
        vars(kept)["_source_stamp"] = _STAMP
    return made
