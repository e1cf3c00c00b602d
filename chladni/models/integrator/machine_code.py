"""Machine code: how kernels, their parts and laws are compiled, and how they call each other by address.

All of it is numba's public interface: `njit`, `cfunc`, `numba.extending`.
"""

import ctypes
from collections.abc import Callable
from threading import Lock
from typing import Any, TypeVar

import numba as nb
from llvmlite import ir
from numba import errors, types
from numba.extending import intrinsic

from chladni.models.core.port_law import LawFunction
from chladni.models.integrator.plane import BOOK
from chladni.signals.cache_folder import CACHED
from chladni.signals.errors import ModelError

FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])

# numba declares fewer options than it takes.
_JIT: Any = nb.njit
_TYPES: Any = types
_OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}
_POINTER = _TYPES.CPointer(types.float64)
_WORD, _NUMBER = types.int64, types.float64
_LAW = _NUMBER(_NUMBER, _NUMBER, _NUMBER, _POINTER, _POINTER, _POINTER)
#: Signatures of kernels that march, that look inside a step, that make one, that march either way, that ask laws,
#: that go along one window.
MARCH = _WORD(BOOK, _NUMBER, _WORD, _WORD, _WORD, _WORD)
INSIDE = _WORD(BOOK, _WORD, _WORD, _NUMBER, _NUMBER)
STEP = _WORD(BOOK, _WORD, _NUMBER, _NUMBER)
ALTERNATE = _WORD(BOOK, _WORD, _WORD, _WORD, *MARCH.args[1:])
ASK = _WORD(BOOK, _NUMBER, _WORD)
ALONG = _WORD(BOOK, _NUMBER, _NUMBER)
_LOCK = Lock()
# A compiled law must live as long as its address is in use.
_LAWS: dict[LawFunction, Any] = {}


def machine_code(function: FunctionT) -> FunctionT:
    """Compile a function of arrays when it's first called; its parts stand in the same file, which numba looks at."""
    compiled: FunctionT = _JIT(cache=CACHED, **_OPTIONS)(function)
    return compiled


def part_code(function: FunctionT) -> FunctionT:
    """Compile a part that only kernels call; it's kept on disk with them alone."""
    compiled: FunctionT = _JIT(no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)
    return compiled


def inlined_code(function: FunctionT) -> FunctionT:
    """Compile a part in place of each of its calls: for what is done in every step, where a call takes its time."""
    compiled: FunctionT = _JIT(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)
    return compiled


class Kernel:
    """A function of a book, see `book`: compiled when it's first asked for, and called by its address.

    A part is optimised and emitted again inside every kernel that calls it; what is called by address, once.
    """

    def __init__(self, function: Callable[..., int | None], signature: Any) -> None:
        self._function, self._signature = function, signature
        self._call: Any = None
        self._made: Any = None

    @property
    def address(self) -> int:
        """Address of the machine code."""
        with _LOCK:
            if self._made is None:
                self._made = nb.cfunc(self._signature, cache=CACHED, **_OPTIONS)(self._function)
            return int(self._made.address)

    def __call__(self, *arguments: float) -> int:
        """Run the kernel: address of the book, and numbers."""
        if self._call is None:
            kinds = [ctypes.c_double if kind is types.float64 else ctypes.c_int64 for kind in self._signature.args]
            self._call = ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(self.address)
        return int(self._call(*arguments))


def kernel(signature: Any) -> Callable[[Callable[..., int]], Kernel]:
    """Make a function of a book a kernel."""
    return lambda function: Kernel(function, signature)


def law_address(function: LawFunction) -> int:
    """Address of a law's machine code; compiles it when it's met for the first time.

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
        if function not in _LAWS:
            _LAWS[function] = _compiled_law(function)
        return int(_LAWS[function].address)


def _compiled_law(function: LawFunction) -> Any:
    name = getattr(function, "__name__", repr(function))
    try:
        if not CACHED:
            return nb.cfunc(_LAW, error_model="numpy")(function)
        try:
            return nb.cfunc(_LAW, cache=True, error_model="numpy")(function)
        except RuntimeError:
            # numba finds no place for a law that was typed into a shell, or whose folder can't be written to.
            return nb.cfunc(_LAW, error_model="numpy")(function)
    except errors.NumbaError as error:
        reason = " ".join(str(getattr(error, "msg", error)).split())[:200]
        raise ModelError(
            f"law {name!r} can't be compiled: {reason}; write it with math, arithmetic, branches, loops and indexing"
        ) from error


def caller(signature: Any) -> Callable[..., int]:
    """Give what calls machine code of a signature in a kernel: ``call(address, arguments)``, these a tuple."""
    arguments = _TYPES.Tuple(signature.args)

    def generate(context: Any, builder: Any, _called: Any, values: Any) -> Any:
        kinds = [context.get_value_type(each) for each in signature.args]
        kind = ir.FunctionType(context.get_value_type(signature.return_type), kinds)
        code = builder.inttoptr(values[0], kind.as_pointer())
        return builder.call(code, [builder.extract_value(values[1], place) for place in range(len(kinds))])

    @intrinsic
    def call(_context: Any, _address: Any, _arguments: Any) -> tuple[Any, Callable[..., Any]]:
        return signature.return_type(types.int64, arguments), generate

    given: Callable[..., int] = call
    return given


def _generate_call(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
    number = ir.DoubleType()
    pointer = number.as_pointer()
    kind = ir.FunctionType(number, [number, number, number, pointer, pointer, pointer])
    law = builder.inttoptr(arguments[0], kind.as_pointer())
    return builder.call(law, [*arguments[1:4], *(builder.inttoptr(each, pointer) for each in arguments[4:])])


@intrinsic
def _call_law(
    _context: Any, _address: Any, _d: Any, _s: Any, _t: Any, _parameters: Any, _state: Any, _rates: Any
) -> tuple[Any, Callable[..., Any]]:
    return _NUMBER(_WORD, _NUMBER, _NUMBER, _NUMBER, _WORD, _WORD, _WORD), _generate_call


#: In a kernel: ``call_law(address, d, s, t, parameters, state, rates) -> force``; the last three are addresses too.
call_law: Callable[..., float] = _call_law
