"""Memory of the kernels: addresses and shapes in place of arrays, which take ten times as long to compile."""

import operator
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin, lower_getattr
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numpy.typing import NDArray

# numba declares few types.
_TYPES: Any = types
_LOWER: Any = lower_builtin
_LOWER_ATTRIBUTE: Any = lower_getattr
_TOOLS: Any = cgutils
_MODEL: Any = register_model
_INTRINSIC: Any = intrinsic
_SIGNATURE: Any = signature
_TEMPLATE: Any = infer_global
_ATTRIBUTES: Any = infer_getattr
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
        members = [("data", _TYPES.CPointer(kind.number)), ("shape", _TYPES.UniTuple(types.intp, kind.axes))]
        initialise: Any = super().__init__
        initialise(manager, kind, members)


@_TEMPLATE(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        plane, index = arguments
        return _SIGNATURE(plane.number, plane, index) if _fits(plane, index) else None


@_TEMPLATE(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        plane, index, _ = arguments
        return _SIGNATURE(types.none, plane, index, plane.number) if _fits(plane, index) else None


def _fits(plane: Any, index: Any) -> bool:
    return isinstance(plane, PlaneType) and plane.axes == (len(index) if isinstance(index, _TYPES.BaseTuple) else 1)


@_ATTRIBUTES
class _Attributes(AttributeTemplate):
    key = PlaneType

    def resolve_shape(self, plane: PlaneType) -> Any:
        return _TYPES.UniTuple(types.intp, plane.axes)

    def resolve_size(self, _plane: PlaneType) -> Any:
        return types.intp


def _place(context: Any, builder: Any, _plane: Any, index: Any, plane_value: Any, index_value: Any) -> Any:
    """Pointer to one number; no check of bounds, and no counting from the end."""
    if isinstance(index, _TYPES.BaseTuple):
        parts = list(zip(index.types, _TOOLS.unpack_tuple(builder, index_value), strict=True))
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
    return builder.load(_place(context, builder, *called.args, *values))


def _set(context: Any, builder: Any, called: Any, values: Any) -> Any:
    builder.store(values[2], _place(context, builder, *called.args[:2], *values[:2]))
    return context.get_dummy_value()


def _shape(_context: Any, builder: Any, _kind: Any, value: Any) -> Any:
    return builder.extract_value(value, 1)


def _size(_context: Any, builder: Any, kind: PlaneType, value: Any) -> Any:
    shape = builder.extract_value(value, 1)
    size = builder.extract_value(shape, 0)
    for axis in range(1, kind.axes):
        size = builder.mul(size, builder.extract_value(shape, axis))
    return size


_LOWER(operator.getitem, PlaneType, _TYPES.Any)(_get)
_LOWER(operator.setitem, PlaneType, _TYPES.Any, _TYPES.Any)(_set)
_LOWER_ATTRIBUTE(PlaneType, "shape")(_shape)
_LOWER_ATTRIBUTE(PlaneType, "size")(_size)


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
        word = context.get_value_type(types.int64)
        page = builder.inttoptr(values[0], word.as_pointer())
        place, made = 0, []
        for kind in kinds:
            planes = []
            for plane in kind.types:
                planes.append(_opened(context, builder, plane, page, place))
                place += 1 + plane.axes
            made.append(context.make_tuple(builder, kind, planes))
        return context.make_tuple(builder, result, made)

    def open_book(_context: Any, _address: Any) -> tuple[Any, Callable[..., Any]]:
        return result(types.int64), generate

    opened: Callable[[int], Any] = _INTRINSIC(open_book)
    return opened


def _opened(context: Any, builder: Any, plane: PlaneType, page: Any, place: int) -> Any:
    words = [
        builder.load(builder.gep(page, [context.get_constant(types.intp, place + shift)]))
        for shift in range(1 + plane.axes)
    ]
    data = builder.inttoptr(words[0], context.get_value_type(_TYPES.CPointer(plane.number)))
    whole = ir.Constant(context.get_value_type(plane), ir.Undefined)
    whole = builder.insert_value(whole, data, 0)
    return builder.insert_value(whole, _TOOLS.pack_array(builder, words[1:]), 1)
