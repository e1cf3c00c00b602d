"""From the columns of a batch of messages to the one number a message that a path names."""

import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
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

_NAME_LENGTH = 60
"""Characters of a name that a sentence holds: a message may call an element anything."""

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


ElementChoice = int | tuple[FieldFilter, ...]
"""Which element of a list is meant: the one at an index, or the one that passes all filters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldSelector:
    """Where in a message a number stands.

    Attributes
    ----------
    leaf
        Leaf of the schema.
    elements
        Which element is meant of each list that the leaf is in, the outermost first.
    names_leaf
        Strings that name the elements of the innermost list, to be checked when an index is used; None when the
        message has none.
    called
        What they call the element at that index; None where they call it nothing.
    message_filters
        Messages that fail one of them don't belong to the channel.
    publisher
        Which of several publishers, told apart by their stamps, from 1; None for all messages.
    """

    leaf: FieldInfo
    elements: tuple[ElementChoice, ...] = ()
    names_leaf: str | None = None
    called: str | None = None
    message_filters: tuple[FieldFilter, ...] = ()
    publisher: int | None = None

    @property
    def indices(self) -> tuple[int, ...] | None:
        """Index in each list; None where filters choose an element."""
        found = tuple(one for one in self.elements if isinstance(one, int))
        return found if len(found) == len(self.elements) else None

    @property
    def element_filters(self) -> tuple[FieldFilter, ...]:
        """All filters that choose elements."""
        return tuple(one for choice in self.elements if not isinstance(choice, int) for one in choice)

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
        self._elements: list[ElementChoice] = []
        self._at_slice = False
        self._names: str | None = None
        self._message_filters: list[FieldFilter] = []
        self._publisher: int | None = None

    def take(self, step: FieldStep | IndexStep | KeyStep | FilterStep) -> None:
        match step:
            case FieldStep(name=name):
                self._prefix = _joined(self._prefix, quoted(name))
                self._at_slice = False
            case IndexStep(index=index):
                self._enter_array(() if index is None else index)
                self._at_slice = index is None
            case KeyStep(name=name):
                names = self._names_beside()
                self._enter_array((FieldFilter(leaf=names, operator="==", value=name),))
            case FilterStep():
                self._filter(step)

    def selector(self) -> FieldSelector:
        leaf = self._known.get(self._prefix)
        if leaf is None:
            raise self._unknown(self._prefix)
        if leaf.kind == "string":
            raise LogError(f"{self._path.text!r}: {leaf.path} is text, not a number; use it in a filter")
        if () in self._elements:
            raise LogError(f"{self._path.text!r}: a slice gives many numbers; name one by [index] or by a filter")
        if len(self._elements) < len(leaf.dims):
            raise LogError(f"{self._path.text!r}: {leaf.path} is an array; name an element, {self._path.text}[0]")
        return FieldSelector(
            leaf=leaf,
            elements=tuple(self._elements),
            names_leaf=self._names if self._elements and isinstance(self._elements[-1], int) else None,
            message_filters=tuple(self._message_filters),
            publisher=self._publisher,
        )

    def _enter_array(self, choice: ElementChoice) -> None:
        marked = f"{self._prefix}[]"
        if any(path.startswith(marked) for path in self._known):
            self._prefix = marked
        elif self._prefix not in self._known:
            raise self._unknown(self._prefix)
        elif len(self._known[self._prefix].dims) == len(self._elements):
            what = "takes an index for each array it is in" if self._elements else "is a single value, not an array"
            raise LogError(f"{self._path.text!r}: {self._prefix} {what}; leave out the index")
        else:
            self._names = names_beside(self._known[self._prefix], self._known)
        self._elements.append(choice)

    def _names_beside(self) -> str:
        leaf = self._known.get(self._prefix)
        names = None if leaf is None else names_beside(leaf, self._known)
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
        chosen = self._elements[-1] if self._at_slice else None
        if self._elements and not isinstance(chosen, tuple):
            raise LogError(f"{self._path.text!r}: a filter follows [:], not an element that is already chosen")
        if len(self._known[leaf].dims) > len(self._elements):
            raise LogError(
                f"{self._path.text!r}: {leaf} is an array; a filter on elements is written array[:]{{...}}"
            )
        if isinstance(chosen, tuple):
            self._elements[-1] = (*chosen, comparison)
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
        for known in self._known:
            if known.replace("[]", "") == leaf.replace("[]", ""):
                example = known.replace("[]", "[0]")
                return LogError(f"{self._path.text!r}: {known} takes an index for each [], as {example}")
        near = near_matches(leaf, self._known)
        return LogError(f"{self._path.text!r}: messages of {self._path.topic} have no field {leaf!r}; {near}")


def names_beside(leaf: FieldInfo, known: Mapping[str, FieldInfo]) -> str | None:
    """Leaf with the strings that name the elements of an array, or None."""
    parent = leaf.path.rpartition(".")[0]
    for name in NAME_FIELDS:
        info = known.get(_joined(parent, name))
        if info is not None and info.kind == "string" and info.dims and len(info.dims) == len(leaf.dims):
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selected:
    """One number out of each message.

    Attributes
    ----------
    values
        ``[message]``, the number, or anything where it isn't present.
    present
        ``[message]``, whether the message holds it; None when all do.
    lost
        Messages that hold it and contradict the others, by the reason.
    """

    values: NDArray[Any]
    present: NDArray[np.bool_] | None = None
    lost: Mapping[str, int] = field(default_factory=dict)


@np.errstate(invalid="ignore")  # a damaged number may be a NaN that signals
def select(decoded: Decoded, selector: FieldSelector, wanted: NDArray[np.bool_]) -> Selected:
    """Take one number out of each message.

    Parameters
    ----------
    decoded
        With all `selector.leaves`.
    selector
        Which number; its message filters are not applied here.
    wanted
        ``[message]``, those that are looked at.
    """
    column = decoded.columns[selector.leaf.path]
    if not selector.elements:
        return Selected(values=column.numbers)
    chosen, lost = _chosen(decoded, selector.elements, wanted)
    values, present = _elements(column, chosen)
    if selector.names_leaf is not None:
        names, codes = element_names(decoded, selector, present & wanted)
        other = np.array([name is not None and name != selector.called for name in names])[codes]
        if other.any():
            found = {names[code] for code in np.unique(codes[other]).tolist()}
            lost[_otherwise_called(selector, found)] = int(np.count_nonzero(other))
            present = present & ~other
    return Selected(values=values, present=present, lost=lost)


def _chosen(
    decoded: Decoded, elements: Sequence[ElementChoice], wanted: NDArray[np.bool_]
) -> tuple[list[NDArray[np.int64]], dict[str, int]]:
    """Index in each list of each message, -1 where none is meant; and the messages where several are, by reason."""
    chosen: list[NDArray[np.int64]] = []
    lost: dict[str, int] = {}
    for choice in elements:
        if isinstance(choice, int):
            chosen.append(np.full(len(wanted), choice))
        else:
            positions, several = _positions(decoded, choice, chosen, wanted)
            chosen.append(positions)
            if several:
                lost[_several(choice)] = several
    return chosen, lost


def element_names(
    decoded: Decoded, selector: FieldSelector, wanted: NDArray[np.bool_]
) -> tuple[list[str | None], NDArray[np.integer]]:
    """What messages call the element at the selector's last index.

    Returns
    -------
    names : list
        Distinct ones; None for no name, which contradicts nothing, and for messages that aren't wanted.
    codes : int array ``[message]``
        Index into `names`.
    """
    *above, index = selector.elements
    if selector.names_leaf is None or not isinstance(index, int):
        return [None], np.zeros(len(wanted), np.int32)
    column = decoded.columns[selector.names_leaf]
    place, present = list_places(column, _chosen(decoded, above, wanted)[0], len(wanted))
    names = [(entry[index] or None) if index < len(entry) else None for entry in column.strings.table]
    codes = np.append(column.strings.codes.reshape(-1), np.int32(len(names)))
    return [*names, None], codes[np.where(present & wanted, place, -1)]


def _elements(column: Column, chosen: Sequence[NDArray[np.int64]]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    numbers = column.numbers
    if column.counts is None and len(chosen) == 1:
        index = chosen[0]
        present = (index >= 0) & (index < numbers.shape[1])
        if not numbers.shape[1]:
            return np.zeros(len(index)), present
        return numbers[np.arange(len(index)), np.where(present, index, 0)], present
    place, present = _places(column.lengths, chosen)
    flat, _ = column.per_message()
    return (flat[place] if flat.size else np.zeros(len(place))), present


def _places(
    lengths: Sequence[NDArray[np.int64]], chosen: Sequence[NDArray[np.int64]]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number of the element that is chosen in each message, among all of its level; 0 where there's none."""
    place = np.arange(len(lengths[0]) if lengths else 0)
    present = np.ones(len(place), np.bool_)
    for length, index in zip(lengths, chosen, strict=False):
        if not length.size:
            return np.zeros_like(index), np.zeros(len(index), np.bool_)
        present = present & (index >= 0) & (index < length[place])
        place = np.where(present, (np.cumsum(length) - length)[place] + index, 0)
    return place, present


def _positions(
    decoded: Decoded,
    filters: Sequence[FieldFilter],
    above: Sequence[NDArray[np.int64]],
    wanted: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], int]:
    """Index of the element that passes all filters in each message's list, -1 where none does, or several do.

    Also how many wanted messages have several.
    """
    masks = [_element_masks(decoded, one, above, wanted) for one in filters]
    owner, within = masks[0].owner, masks[0].within
    passing = np.flatnonzero(np.logical_and.reduce([one.passes for one in masks]))
    count = np.bincount(owner[passing], minlength=len(wanted))
    positions = np.full(len(wanted), -1)
    positions[owner[passing]] = within[passing]
    return np.where(count == 1, positions, -1), int(np.count_nonzero(count > 1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Masks:
    """Which elements of one list of each message pass a filter: ``[element]``, with their message and index."""

    owner: NDArray[np.int64]
    within: NDArray[np.int64]
    passes: NDArray[np.bool_]


def _element_masks(
    decoded: Decoded, one: FieldFilter, above: Sequence[NDArray[np.int64]], wanted: NDArray[np.bool_]
) -> _Masks:
    column = decoded.columns[one.leaf]
    place, present = list_places(column, above, len(wanted))
    present = present & wanted
    compared = _COMPARISONS[one.operator]
    if isinstance(column.values, Strings):
        table = column.values.table
        codes = column.values.codes.reshape(-1)
        if len(column.lengths) == len(above):
            # One list of names is one value; each distinct list is looked through once.
            passing = [np.array([compared(name, one.value) for name in names], np.bool_) for names in table]
            sizes = np.array([part.size for part in passing])
            lists = codes[place] if codes.size else np.zeros(len(place), np.int64)
            return _ragged(np.concatenate(passing), np.cumsum(sizes) - sizes, sizes, lists, present)
        flat = np.array([compared(text, one.value) for text in table], np.bool_)[codes]
    else:
        flat = compared(column.per_message()[0], one.value)
    length = column.lengths[len(above)]
    return _ragged(flat, np.cumsum(length) - length, length, place, present)


def list_places(
    column: Column, above: Sequence[NDArray[np.int64]], messages: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number of each message's list among all lists that lie in the elements chosen so far."""
    if above:
        return _places(column.lengths[: len(above)], above)
    return np.arange(messages), np.ones(messages, np.bool_)


def _ragged(
    flat: NDArray[np.bool_],
    starts: NDArray[np.int64],
    sizes: NDArray[np.int64],
    lists: NDArray[np.integer],
    present: NDArray[np.bool_],
) -> _Masks:
    """Lay out what belongs to the list of each message; nothing where it isn't present."""
    if not sizes.size:
        nothing = np.zeros(0, np.int64)
        return _Masks(owner=nothing, within=nothing, passes=np.zeros(0, np.bool_))
    each = np.where(present, sizes[lists], 0)
    owner = np.repeat(np.arange(len(each)), each)
    within = np.arange(len(owner)) - (np.cumsum(each) - each)[owner]
    return _Masks(owner=owner, within=within, passes=flat[starts[lists][owner] + within])


def _several(filters: Sequence[FieldFilter]) -> str:
    told = " and ".join(f"{one.leaf} {one.operator} {one.value!r}" for one in filters)
    return f"several elements of one message pass {told}; add another filter"


def _otherwise_called(selector: FieldSelector, names: Collection[str | None]) -> str:
    (one,) = names if len(names) == 1 else (None,)
    told = "otherwise" if one is None else repr(one[:_NAME_LENGTH])
    first = "nothing" if selector.called is None else repr(selector.called[:_NAME_LENGTH])
    return (
        f"element {selector.elements[-1]} of {selector.names_leaf} is called {told}, in the first messages {first}; "
        "read it by name"
    )
