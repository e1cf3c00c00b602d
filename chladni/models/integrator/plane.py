"""Memory of the kernels: addresses and shapes in place of arrays, all of them written down in one book."""

import operator
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, lower_builtin, make_attribute_wrapper, models, register_model, type_callable
from numpy.typing import NDArray

# numba declares few types.
_TYPES: Any = types
_LOWER: Any = lower_builtin
_MODEL: Any = register_model
_INTRINSIC: Any = intrinsic
_ATTRIBUTE: Any = make_attribute_wrapper
_TYPED: Any = type_callable
#: Arrays of a record, by their number of axes; kernels see them as planes.
Numbers1 = Annotated[NDArray[np.float64], 1]
Numbers2 = Annotated[NDArray[np.float64], 2]
Numbers3 = Annotated[NDArray[np.float64], 3]
Numbers4 = Annotated[NDArray[np.float64], 4]
Numbers5 = Annotated[NDArray[np.float64], 5]
Integers1 = Annotated[NDArray[np.int64], 1]
Integers2 = Annotated[NDArray[np.int64], 2]


class PlaneType(types.Type):
    """What a kernel knows of an array: the type of its numbers, and its axes; rows lie one after the other."""

    def __init__(self, number: Any, axes: int) -> None:
        self.number, self.axes = number, axes
        initialise: Any = super().__init__
        initialise(name=f"Plane({number}, {axes})")


@_MODEL(PlaneType)
class _PlaneModel(models.StructModel):
    def __init__(self, manager: Any, kind: PlaneType) -> None:
        data, shape = _TYPES.CPointer(kind.number), _TYPES.UniTuple(types.intp, kind.axes)
        initialise: Any = super().__init__
        initialise(manager, kind, [("data", data), ("shape", shape), ("size", types.intp)])


for _name in ("shape", "size"):
    _ATTRIBUTE(PlaneType, _name, _name)


def _type_get(_context: Any) -> Callable[..., Any]:
    return lambda plane, index: plane.number if _fits(plane, index) else None


def _type_set(_context: Any) -> Callable[..., Any]:
    return lambda plane, index, _value: types.none if _fits(plane, index) else None


def _fits(plane: Any, index: Any) -> bool:
    return isinstance(plane, PlaneType) and plane.axes == (len(index) if isinstance(index, _TYPES.BaseTuple) else 1)


def _place(context: Any, builder: Any, index: Any, plane_value: Any, index_value: Any) -> Any:
    """Pointer to one number; no check of bounds, and no counting from the end."""
    if isinstance(index, _TYPES.BaseTuple):
        parts = [(kind, builder.extract_value(index_value, place)) for place, kind in enumerate(index.types)]
    else:
        parts = [(index, index_value)]
    offset = None
    for axis, (kind, value) in enumerate(parts):
        step = context.cast(builder, value, kind, types.intp)
        if offset is None:
            offset = step
        else:
            rows = builder.extract_value(plane_value, [1, axis])
            offset = builder.add(builder.mul(offset, rows, flags=["nsw"]), step, flags=["nsw"])
    return builder.gep(builder.extract_value(plane_value, 0), [offset], inbounds=True)


def _get(context: Any, builder: Any, called: Any, values: Any) -> Any:
    return builder.load(_place(context, builder, called.args[1], *values))


def _set(context: Any, builder: Any, called: Any, values: Any) -> Any:
    plane, index, kind = called.args
    number = context.cast(builder, values[2], kind, plane.number)
    builder.store(number, _place(context, builder, index, *values[:2]))
    return context.get_dummy_value()


_TYPED(operator.getitem)(_type_get)
_TYPED(operator.setitem)(_type_set)
_LOWER(operator.getitem, PlaneType, _TYPES.Any)(_get)
_LOWER(operator.setitem, PlaneType, _TYPES.Any, _TYPES.Any)(_set)


class BookType(types.Type):
    """Address of a book, in the version of the kernels that read it.

    numba keeps a kernel on disk by its types and its own file: with the digest of all sources of kernels in the type,
    a part that has changed in another file doesn't go on running as it was.
    """

    def __init__(self, version: str) -> None:
        initialise: Any = super().__init__
        initialise(name=f"Book({version})")


@_MODEL(BookType)
class _BookModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: BookType) -> None:
        initialise: Any = super().__init__
        initialise(manager, kind, ir.IntType(64))


def _version() -> str:
    sources = sorted(Path(__file__).parent.glob("*.py"))
    return sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]


BOOK = BookType(_version())


def book(*records: NamedTuple) -> NDArray[np.int64]:
    """Write down address and shape of every array of some records, which must outlive the book."""
    words: list[int] = []
    for record in records:
        for kind, array in zip(_planes(type(record)), record, strict=True):
            if array.dtype.kind != ("i" if kind.number is types.int64 else "f") or array.ndim != kind.axes:
                raise TypeError(f"{type(record).__name__}: {array.dtype} of shape {array.shape}, not {kind}")
            if not array.flags.c_contiguous:
                raise TypeError(f"{type(record).__name__}: an array that isn't contiguous")
            words += [array.ctypes.data, *array.shape]
    return np.array(words, dtype=np.int64)


@cache
def _planes(record: type) -> tuple[PlaneType, ...]:
    # Once for each kind of record: evaluating annotations takes longer than a short run.
    kinds = []
    for hint in get_type_hints(record, include_extras=True).values():
        array, axes = get_args(hint)
        number = types.int64 if array == NDArray[np.int64] else types.float64
        kinds.append(PlaneType(number, axes))
    return tuple(kinds)


def opener(*records: type) -> Callable[[int], Any]:
    """Give what opens a book in a kernel: from its address to the records, in the order they were written."""
    kinds = [_TYPES.NamedTuple(_planes(record), record) for record in records]
    result = _TYPES.Tuple(kinds)

    def generate(context: Any, builder: Any, _called: Any, values: Any) -> Any:
        page = builder.inttoptr(values[0], ir.IntType(64).as_pointer())
        place, made = 0, []
        for kind in kinds:
            planes = []
            for plane in kind.types:
                planes.append(_opened(context, builder, plane, page, place))
                place += 1 + plane.axes
            made.append(context.make_tuple(builder, kind, planes))
        return context.make_tuple(builder, result, made)

    def open_book(_context: Any, _address: Any) -> tuple[Any, Callable[..., Any]]:
        return result(BOOK), generate

    opened: Callable[[int], Any] = _INTRINSIC(open_book)
    return opened


def _opened(context: Any, builder: Any, plane: PlaneType, page: Any, place: int) -> Any:
    address, *shape = (
        builder.load(builder.gep(page, [context.get_constant(types.intp, place + shift)]))
        for shift in range(1 + plane.axes)
    )
    size = shape[0]
    for length in shape[1:]:
        size = builder.mul(size, length)
    whole = ir.Constant(context.get_value_type(plane), ir.Undefined)
    data = builder.inttoptr(address, context.get_value_type(_TYPES.CPointer(plane.number)))
    whole = builder.insert_value(builder.insert_value(whole, data, 0), size, 2)
    for axis, length in enumerate(shape):
        whole = builder.insert_value(whole, length, [1, axis])
    return whole
