"""How kernels are compiled, and how they call a law by its address."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba as nb
from llvmlite import ir
from numba.core import config, types
from numba.extending import intrinsic

from chladni.models.integrator.cache_folder import CACHED
from chladni.models.integrator.part_compiler import PartCompiler

FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])

# numba declares fewer options than it takes.
_JIT: Any = nb.njit
_TYPES: Any = types
_CONFIG: Any = config
_POINTER = _TYPES.CPointer(types.float64)
#: Signature of a law in machine code.
LAW_SIGNATURE = types.float64(types.float64, types.float64, types.float64, _POINTER, _POINTER, _POINTER)

_WORD, _NUMBER = types.int64, types.float64
#: Signatures of `march` and `march_implicit`, of `inside`, of `implicit_step`.
MARCH_SIGNATURE = _WORD(_WORD, _NUMBER, _WORD, _WORD, _WORD, _WORD)
INSIDE_SIGNATURE = _WORD(_WORD, _WORD, _WORD, _NUMBER, _NUMBER)
PART_SIGNATURE = _WORD(_WORD, _WORD, _NUMBER, _NUMBER)

_OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy", "_nrt": False}


def _stamp(beside: Path) -> tuple[float, int]:
    """Newest time and total size of the sources of these kernels, and of those beside another one."""
    found = [path.stat() for folder in {Path(__file__).parent, beside} for path in folder.glob("*.py")]
    return max(each.st_mtime for each in found), sum(each.st_size for each in found)


def machine_code(function: FunctionT) -> FunctionT:
    """Compile a kernel when it's first called; the result is kept on disk where that is possible.

    Kernels allocate nothing, so they need no reference counts.
    """
    compiled: FunctionT = _JIT(cache=CACHED, **_OPTIONS)(function)
    # numba looks at the file of a kernel only: a part that changed in another file would go on running as it was.
    kept = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if kept is not None:
        vars(kept)["_source_stamp"] = _stamp(Path(function.__code__.co_filename).parent)
    return compiled


def part_code(function: FunctionT) -> FunctionT:
    """Compile a part that only kernels call, into each kernel that does; it's kept on disk with them alone."""
    return _part(function, inline=False)


def inlined_code(function: FunctionT) -> FunctionT:
    """Compile a part in place of each of its calls: for what is done in every step, where a call takes its time."""
    return _part(function, inline=True)


def _part(function: FunctionT, *, inline: bool) -> FunctionT:
    doors = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    compiled: FunctionT = _JIT(forceinline=inline, pipeline_class=PartCompiler, **doors, **_OPTIONS)(function)
    return compiled


def make_ready(kernel: Any, signature: Any) -> None:
    """Compile a kernel for a signature unless it is, or load it from disk.

    Without vector instructions: loops over a handful of states gain nothing, and they take a fifth of the time.
    """
    before = _CONFIG.LOOP_VECTORIZE
    _CONFIG.LOOP_VECTORIZE = 0
    try:
        kernel.compile(signature.args)
    finally:
        _CONFIG.LOOP_VECTORIZE = before


def address_of(kernel: Any, signature: Any) -> int:
    """Address of a kernel for `caller`, compiled for a signature when it's first asked for.

    A part is optimised and emitted again inside every kernel that calls it; what is called by address, once.
    """
    make_ready(kernel, signature)
    made = kernel.overloads[signature.args]
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name))


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


def _typed_call(_context: Any, *_arguments: Any) -> tuple[Any, Callable[..., Any]]:
    integer, number = types.int64, types.float64
    signature = number(integer, number, number, number, integer, integer, integer)
    return signature, _generate_call


def _generate_call(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
    number = ir.DoubleType()
    pointer = number.as_pointer()
    kind = ir.FunctionType(number, [number, number, number, pointer, pointer, pointer])
    law = builder.inttoptr(arguments[0], kind.as_pointer())
    return builder.call(law, [*arguments[1:4], *(builder.inttoptr(each, pointer) for each in arguments[4:])])


@intrinsic
def call_law(
    context: Any, address: Any, d: Any, s: Any, t: Any, parameters: Any, state: Any, rates: Any
) -> tuple[Any, Callable[..., Any]]:
    """``call_law(address, d, s, t, parameters, state, rates) -> force``; the last three are addresses too."""
    return _typed_call(context, address, d, s, t, parameters, state, rates)
