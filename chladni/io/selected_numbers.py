"""From the columns of a batch of messages to the one number a message that a selector names."""

import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.decoding.columns import Column, Decoded, Strings
from chladni.io.field_selector import ElementChoice, FieldFilter, FieldSelector
from chladni.io.message_path import Operator
from chladni.signals.arrays import Mask, Whole
from chladni.signals.wording import shown

_COMPARISONS: Mapping[Operator, Callable[[Any, Any], Any]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def kept_messages(decoded: Decoded, filters: Sequence[FieldFilter]) -> Mask:
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
    present: Mask | None = None
    lost: Mapping[str, int] = field(default_factory=dict)


def select(decoded: Decoded, selector: FieldSelector, wanted: Mask) -> Selected:
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


def _chosen(decoded: Decoded, elements: Sequence[ElementChoice], wanted: Mask) -> tuple[list[Whole], dict[str, int]]:
    """Index in each list of each message, -1 where none is meant; and the messages where several are, by reason."""
    chosen: list[Whole] = []
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
    decoded: Decoded, selector: FieldSelector, wanted: Mask
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


def _elements(column: Column, chosen: Sequence[Whole]) -> tuple[NDArray[Any], Mask]:
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


def _places(lengths: Sequence[Whole], chosen: Sequence[Whole]) -> tuple[Whole, Mask]:
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
    above: Sequence[Whole],
    wanted: Mask,
) -> tuple[Whole, int]:
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

    owner: Whole
    within: Whole
    passes: Mask


def _element_masks(decoded: Decoded, one: FieldFilter, above: Sequence[Whole], wanted: Mask) -> _Masks:
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


def list_places(column: Column, above: Sequence[Whole], messages: int) -> tuple[Whole, Mask]:
    """Number of each message's list among all lists that lie in the elements chosen so far."""
    if above:
        return _places(column.lengths[: len(above)], above)
    return np.arange(messages), np.ones(messages, np.bool_)


def _ragged(
    flat: Mask,
    starts: Whole,
    sizes: Whole,
    lists: NDArray[np.integer],
    present: Mask,
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
    # A message may call an element anything.
    told = "otherwise" if one is None else shown(one)
    first = "nothing" if selector.called is None else shown(selector.called)
    return (
        f"element {selector.elements[-1]} of {selector.names_leaf} is called {told}, in the first messages {first}; "
        "read it by name"
    )
