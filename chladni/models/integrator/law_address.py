"""Laws as machine code: each function is compiled once, and called by its address."""

from threading import Lock
from typing import Any

from numba import cfunc
from numba.core.errors import NumbaError

from chladni.models.core.port_law import LawFunction
from chladni.models.integrator.cache_folder import CACHED
from chladni.models.integrator.machine_code import LAW_SIGNATURE
from chladni.signals.errors import ModelError

# The compiled law must live as long as its address is in use.
_COMPILED: dict[LawFunction, Any] = {}
_LOCK = Lock()


def law_address(function: LawFunction) -> int:
    """Address of the compiled law; compiles it when it's met for the first time.

    Parameters
    ----------
    function
        See `chladni.models.core.port_law.PortLaw`.

    Raises
    ------
    ModelError
        When the function isn't written in the subset of Python that can be compiled.
    """
    with _LOCK:
        if function not in _COMPILED:
            _COMPILED[function] = _compile(function)
        return int(_COMPILED[function].address)


def _compile(function: LawFunction) -> Any:
    name = getattr(function, "__name__", repr(function))
    try:
        return _compile_cached(function) if CACHED else _compile_once(function)
    except NumbaError as error:
        reason = " ".join(str(getattr(error, "msg", error)).split())[:200]
        raise ModelError(
            f"law {name!r} can't be compiled: {reason}; write it with math, arithmetic, branches, loops and indexing"
        ) from error


def _compile_cached(function: LawFunction) -> Any:
    try:
        return cfunc(LAW_SIGNATURE, cache=True, error_model="numpy")(function)
    except RuntimeError:
        # numba finds no place for a law that was typed into a shell, or whose folder can't be written to.
        return _compile_once(function)


def _compile_once(function: LawFunction) -> Any:
    return cfunc(LAW_SIGNATURE, error_model="numpy")(function)
