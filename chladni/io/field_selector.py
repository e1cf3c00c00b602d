"""From the columns of a batch of messages to the one number a message that a path names."""

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.decoding.columns import Column, Decoded, Strings
from chladni.io.decoding.schema import FieldInfo
from chladni.io.message_path import (
    FieldStep,
    FilterStep,
    FilterValue,
    IndexStep,
    KeyStep,
    MessagePath,
    Operator,
    near_matches,
    quoted,
)
from chladni.signals.errors import LogError

NAME_FIELDS = ("name", "names", "joint_names", "channel_names")
"""Fields whose strings name the elements of the arrays beside them (sensor_msgs/JointState and its kin)."""

_COMPARISONS: Mapping[Operator, Callable[[Any, Any], Any]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldFilter:
    """One comparison on a leaf of the message."""

    leaf: str
    operator: Operator
    value: FilterValue


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldSelector:
    """Where in a message a number stands.

    Attributes
    ----------
    leaf
        Leaf of the schema.
    index
        Element of the array that the leaf is in, or None.
    names_leaf
        Strings that name the elements, to be checked when an index is used; None when the message has none.
    message_filters
        Messages that fail one of them don't belong to the channel.
    element_filters
        Which element of the array is meant, when it isn't said by index.
    publisher
        Which of several publishers, told apart by their stamps, from 1; None for all messages.
    """

    leaf: FieldInfo
    index: int | None = None
    names_leaf: str | None = None
    message_filters: tuple[FieldFilter, ...] = ()
    element_filters: tuple[FieldFilter, ...] = ()
    publisher: int | None = None

    @property
    def leaves(self) -> tuple[str, ...]:
        """Every leaf that must be decoded."""
        names = () if self.names_leaf is None else (self.names_leaf,)
        filters = self.message_filters + self.element_filters
        return tuple(dict.fromkeys((self.leaf.path, *names, *(one.leaf for one in filters))))


# --- from path to selector ---------------------------------------------------------------------------------------


def resolve_fields(path: MessagePath, fields: Sequence[FieldInfo]) -> FieldSelector:
    """Find the leaf that a path names.

    Parameters
    ----------
    path
        A path whose topic is known.
    fields
        Leaves of that topic's messages.

    Raises
    ------
    LogError
        When there's no such field (near ones are named), when it's text, or when an index is missing or too much.
    """
    walk = _Walk(path, fields)
    for step in path.steps:
        walk.take(step)
    return walk.selector()


class _Walk:
    """State of the walk down one path."""

    def __init__(self, path: MessagePath, fields: Sequence[FieldInfo]) -> None:
        self._path = path
        self._known = {info.path: info for info in fields}
        self._prefix = ""
        self._index: int | None = None
        self._in_array = False
        self._open_slice = False
        self._at_slice = False
        self._names: str | None = None
        self._message_filters: list[FieldFilter] = []
        self._element_filters: list[FieldFilter] = []
        self._publisher: int | None = None

    def take(self, step: FieldStep | IndexStep | KeyStep | FilterStep) -> None:
        match step:
            case FieldStep(name=name):
                self._prefix = _joined(self._prefix, quoted(name))
                self._at_slice = False
            case IndexStep(index=index):
                self._enter_array()
                self._index = index
                self._open_slice = self._at_slice = index is None
            case KeyStep(name=name):
                names = self._names_beside()
                self._enter_array()
                self._element_filters.append(FieldFilter(leaf=names, operator="==", value=name))
            case FilterStep():
                self._filter(step)

    def selector(self) -> FieldSelector:
        leaf = self._known.get(self._prefix)
        if leaf is None:
            raise self._unknown(self._prefix)
        if leaf.kind == "string":
            raise LogError(f"{self._path.text!r}: {leaf.path} is text, not a number; use it in a filter")
        if self._open_slice:
            raise LogError(f"{self._path.text!r}: a slice gives many numbers; name one by [index] or by a filter")
        if leaf.array is not None and not self._in_array:
            raise LogError(f"{self._path.text!r}: {leaf.path} is an array; name an element, {self._path.text}[0]")
        return FieldSelector(
            leaf=leaf,
            index=self._index,
            names_leaf=self._names if self._index is not None else None,
            message_filters=tuple(self._message_filters),
            element_filters=tuple(self._element_filters),
            publisher=self._publisher,
        )

    def _enter_array(self) -> None:
        if self._in_array:
            raise LogError(f"{self._path.text!r}: an array inside an array can't be read; only one index is possible")
        marked = f"{self._prefix}[]"
        if any(path.startswith(marked) for path in self._known):
            self._prefix = marked
        elif self._prefix not in self._known:
            raise self._unknown(self._prefix)
        elif self._known[self._prefix].array is None:
            raise LogError(
                f"{self._path.text!r}: {self._prefix} is a single value, not an array; leave out the index"
            )
        else:
            self._names = names_beside(self._prefix, self._known)
        self._in_array = True

    def _names_beside(self) -> str:
        names = names_beside(self._prefix, self._known)
        if names is None:
            raise LogError(
                f"{self._path.text!r}: no field {' or '.join(NAME_FIELDS)} beside {self._prefix} names its elements; "
                "give a number as index"
            )
        return names

    def _filter(self, step: FilterStep) -> None:
        if step.field.startswith("@"):
            self._publisher = self._number_of_publisher(step)
            return
        leaf = _joined(self._prefix, step.field)
        if leaf not in self._known:
            raise self._unknown(leaf)
        is_text = self._known[leaf].kind == "string"
        if is_text != isinstance(step.value, str) or (is_text and step.operator not in ("==", "!=")):
            kind = "text: compare it by == or != with a quoted value" if is_text else "a number: leave out the quotes"
            raise LogError(f"{self._path.text!r}: {leaf} in the filter is {kind}")
        comparison = FieldFilter(leaf=leaf, operator=step.operator, value=step.value)
        if self._at_slice:
            self._element_filters.append(comparison)
            self._open_slice = False
        elif self._in_array:
            raise LogError(f"{self._path.text!r}: a filter follows [:], not an element that is already chosen")
        elif self._known[leaf].array is not None:
            raise LogError(
                f"{self._path.text!r}: {leaf} is an array; a filter on elements is written array[:]{{...}}"
            )
        else:
            self._message_filters.append(comparison)

    def _number_of_publisher(self, step: FilterStep) -> int:
        """What isn't in the message: who sent it."""
        number = step.value if isinstance(step.value, float) else 0.0
        known = step.field == "@publisher" and step.operator == "==" and not self._prefix
        if known and number >= 1 and number.is_integer():
            return int(number)
        topic = self._path.topic
        raise LogError(
            f"{self._path.text!r}: {step.field} is no field of a message; right behind the topic, "
            f"{topic}{{@channel==1}} is one MCAP channel, by its number in the log, of a topic that has several, and "
            f"{topic}{{@publisher==1}} the first publisher of those that their stamps tell apart"
        )

    def _unknown(self, leaf: str) -> LogError:
        near = near_matches(leaf, self._known)
        return LogError(f"{self._path.text!r}: messages of {self._path.topic} have no field {leaf!r}; {near}")


def names_beside(leaf: str, known: Mapping[str, FieldInfo]) -> str | None:
    """Leaf with the strings that name the elements of an array, or None."""
    parent = leaf.rpartition(".")[0]
    for name in NAME_FIELDS:
        info = known.get(_joined(parent, name))
        if info is not None and info.kind == "string" and info.array is not None:
            return info.path
    return None


def _joined(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix else name


# --- from columns to numbers -------------------------------------------------------------------------------------


def kept_messages(decoded: Decoded, filters: Sequence[FieldFilter]) -> NDArray[np.bool_]:
    """Messages that were decoded and pass every filter.

    Returns
    -------
    bool array ``[message]``
    """
    keep = ~decoded.bad
    for one in filters:
        column = decoded.columns[one.leaf].values
        if isinstance(column, Strings):
            passes = [_COMPARISONS[one.operator](text, one.value) for text in column.table]
            keep &= np.array(passes, np.bool_)[column.codes]
        else:
            keep &= _COMPARISONS[one.operator](column, one.value)
    return keep


def select(decoded: Decoded, selector: FieldSelector) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
    """Take one number out of each message.

    Parameters
    ----------
    decoded
        With all `selector.leaves`.
    selector
        Which number; its message filters are not applied here.

    Returns
    -------
    values : ndarray ``[message]``
        Number, or anything where it isn't present.
    present : bool array ``[message]`` or None
        Whether the message holds it; None when all do.

    Raises
    ------
    LogError
        When several elements pass the filters, or when the element at the index has different names.
    """
    column = decoded.columns[selector.leaf.path]
    if selector.element_filters:
        return _elements(column, _filtered_index(decoded, selector))
    if selector.index is None:
        return column.numbers, None
    if selector.names_leaf is not None:
        _require_one_name(decoded.columns[selector.names_leaf].strings, selector.leaf.path, selector.index)
    return _elements(column, np.full(len(decoded.bad), selector.index))


def _elements(column: Column, index: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    numbers = column.numbers
    if column.counts is None:
        present = (index >= 0) & (index < numbers.shape[1])
        if not numbers.shape[1]:
            return np.zeros(len(index)), present
        return numbers[np.arange(len(index)), np.where(present, index, 0)], present
    present = (index >= 0) & (index < column.counts)
    if not numbers.size:
        return np.zeros(len(index)), present
    starts = np.cumsum(column.counts) - column.counts
    return numbers[np.where(present, starts + index, 0)], present


def _filtered_index(decoded: Decoded, selector: FieldSelector) -> NDArray[np.int64]:
    """Index of the element that passes all filters, -1 where none does."""
    only = selector.element_filters[0]
    column = decoded.columns[only.leaf]
    if len(selector.element_filters) == 1 and isinstance(column.values, Strings) and _holds_lists(column):
        # Few distinct lists of names, many messages: each list is searched once.
        lookup = [_index_in(_passing(names, only), selector) for names in column.values.table]
        return np.array(lookup, np.int64)[column.values.codes]
    masks = [_element_masks(decoded.columns[one.leaf], one) for one in selector.element_filters]
    together = (np.logical_and.reduce(parts) for parts in zip(*masks, strict=True))
    return np.array([_index_in(mask, selector) for mask in together], np.int64)


def _holds_lists(column: Column) -> bool:
    """Whether each message has one list of strings (an array of text), and not one string an element."""
    values = column.values
    return isinstance(values, Strings) and values.codes.ndim == 1 and column.counts is None


def _element_masks(column: Column, one: FieldFilter) -> list[NDArray[np.bool_]]:
    """For each message which of its elements pass."""
    if not isinstance(column.values, Strings):
        flat, counts = column.per_message()
        return np.split(_COMPARISONS[one.operator](flat, one.value), np.cumsum(counts)[:-1])
    if _holds_lists(column):
        lists = [_passing(names, one) for names in column.values.table]
        return [lists[code] for code in column.values.codes]
    passes = np.array([_COMPARISONS[one.operator](text, one.value) for text in column.values.table], np.bool_)
    elements: NDArray[np.bool_] = passes[column.values.codes]
    return list(elements) if column.counts is None else np.split(elements, np.cumsum(column.counts)[:-1])


def _passing(names: str | tuple[str, ...], one: FieldFilter) -> NDArray[np.bool_]:
    return np.array([_COMPARISONS[one.operator](name, one.value) for name in names], np.bool_)


def _index_in(mask: NDArray[np.bool_], selector: FieldSelector) -> int:
    found = np.flatnonzero(mask)
    if found.size > 1:
        told = " and ".join(f"{one.leaf} {one.operator} {one.value!r}" for one in selector.element_filters)
        raise LogError(f"{selector.leaf.path}: {found.size} elements of one message pass {told}; add another filter")
    return int(found[0]) if found.size else -1


def _require_one_name(names: Strings, leaf: str, index: int) -> None:
    different = {entry[index] for entry in names.table if index < len(entry)}
    if len(different) > 1:
        told = " and ".join(sorted(different)[:4])
        raise LogError(
            f"{leaf}[{index}]: element {index} is called {told} in different messages; "
            f"read it by name, {leaf}[{min(different)}]"
        )
