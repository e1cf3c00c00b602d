"""The channels of one topic: all that are listed, and any that a path names."""

import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np

from chladni.io.batch_messages import BatchLayout, column_names, column_units, recognised_layout
from chladni.io.channel_source import ChannelSource, channel_of, measured_fields
from chladni.io.decoding import FieldInfo
from chladni.io.decoding.columns import Column, Strings
from chladni.io.decoding.schema import Dimension
from chladni.io.field_selector import (
    NAME_FIELDS,
    ElementChoice,
    FieldFilter,
    FieldSelector,
    names_beside,
    resolve_fields,
)
from chladni.io.known_schemas import MAX_LISTED_ELEMENTS, has_signals, is_signal
from chladni.io.loss import Unread
from chladni.io.message_path import (
    FieldStep,
    IndexStep,
    MessagePath,
    element_text,
    in_quotes,
    quoted,
    topic_text,
)
from chladni.io.number_lists import NumberLists
from chladni.io.publishers import at_once
from chladni.io.selected_numbers import element_names, list_places, select
from chladni.io.topic import Topic
from chladni.signals.errors import LogError
from chladni.signals.wording import near_matches

_MARK: Final = re.compile(r'"(?:[^"\\]|\\.)*"|\[\]')

Names = TypeVar("Names", str, tuple[str, ...])

FRAME_FIELDS: Final = ("header.frame_id", "frame_id")
"""Where messages say which of several sensors of one kind they come from."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TopicChannels:
    """What can be read from a topic.

    Attributes
    ----------
    topic
        The topic, with its head.
    layout
        How its batch messages are laid out; None when each message holds one sample.
    names, units
        Names of the columns of batch messages, and their units where the messages say (else empty).
    elements
        Indices of the elements of each array of numbers, in each list that it's in: those that the schema fixes, or
        that the head holds. None for an array of more than are listed.
    joints
        Names of array elements, by the leaf that holds them: every distinct list of names that the head holds, but
        for those that only one message has.
    frames
        Filters on the frame's name, one for each of several publishers that send at once; else empty.
    """

    topic: Topic
    layout: BatchLayout | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    elements: dict[str, tuple[tuple[int, ...], ...] | None]
    joints: dict[str, tuple[tuple[str, ...], ...]]
    frames: tuple[FieldFilter, ...] = ()

    @property
    def publishers(self) -> tuple[str, ...]:
        """Beginnings of the paths of each of several publishers that send at once; empty where there's one."""
        return tuple(f"{topic_text(self.topic.name)}{_written(frame)}" for frame in self.frames)

    def listed(self) -> Iterator[ChannelSource]:
        """Give every channel that is a signal, in the order of the schema."""
        measured = measured_fields(self.topic.metadata)
        sources = self._columns() if self.layout is not None else self._leaves()
        wanted = (source for source in sources if measured is None or source.field in measured)
        if not self.frames:
            return wanted
        every = list(wanted)
        return (self._of_frame(source, frame) for frame in self.frames for source in every)

    def resolve(self, path: MessagePath) -> ChannelSource:
        """Find the channel that a path names; its name is the path as it was written.

        Raises
        ------
        LogError
            When there's no such channel; near ones are named.
        """
        if self.layout is not None:
            return self._column_source(path)
        if path.rest in self.topic.unread:
            raise LogError(f"{path.text!r} {self.topic.unread[path.rest]}")
        selector = self._called(resolve_fields(path, self.topic.fields), path)
        self._require_one_element(selector, path)
        return self._leaf_source(selector, field=self._spelling(path, selector), name=path.text)

    @property
    def element_names(self) -> frozenset[str]:
        """All names that the first messages give to elements of their arrays."""
        return frozenset(name for lists in self.joints.values() for names in lists for name in names)

    def number_lists(self) -> Iterator[NumberLists]:
        """Give the lists of numbers of its messages, those beside one another together."""
        found: dict[str, dict[str, int]] = {}
        beside: dict[str, str | None] = {}
        for info in self.topic.fields if self.layout is None and has_signals(self.topic.schema_name) else ():
            elements = self.elements.get(info.path) if is_signal(info) and info.dims else None
            # Of a list of lists the first one.
            inner = {indices[-1] for indices in elements or () if not any(indices[:-1])}
            if inner:
                place, _, field = info.path.replace("[]", "[0]").rpartition(".")
                found.setdefault(place, {})[field] = max(inner) + 1
                beside[place] = names_beside(info, self.topic.by_path)
        for place, elements_of in found.items():
            leaf = beside[place]
            for prefix in self.publishers or (topic_text(self.topic.name),):
                yield NumberLists(
                    topic=prefix,
                    schema_name=self.topic.schema_name,
                    place=place,
                    names=self._names_of_message() if leaf is None else self.joints.get(leaf, ()),
                    named_in_message=leaf is not None,
                    elements=elements_of,
                )

    def _names_of_message(self) -> tuple[tuple[str, ...], ...]:
        """Names at the top of the messages, of lists that lie deeper."""
        for name in NAME_FIELDS:
            info = self.topic.by_path.get(name)
            if info is not None and info.kind == "string" and len(info.dims) == 1:
                columns = [part.columns[name].select(~part.bad) for part in self.topic.decode_head([name])]
                return _recurring([names for column in columns for names in _lists(column.strings)])
        return ()

    def may_hold(self, source: ChannelSource) -> bool:
        """Whether the first messages have the elements that a channel names."""
        filters = () if source.selector is None else source.selector.element_filters
        named = [one.value for one in filters if one.leaf in self.joints and one.operator == "=="]
        return self.element_names.issuperset(map(str, named))

    def unread(self, messages: int | None) -> Iterator[Unread]:
        """Say what no channel is made of: fields that can't be read, or all of a topic of `messages` messages."""
        if not any(self.listed()):
            yield self._nothing_listed(messages)
            return
        for path, reason in self.topic.unread.items():
            yield Unread(topic=self.topic.name, field=path, reason=reason)
        for path, reason in self._unlisted():
            yield Unread(topic=self.topic.name, field=path, reason=reason)

    def _nothing_listed(self, messages: int | None) -> Unread:
        hidden = next(iter(self.topic.unread.values()), None)
        numbers = any(info.kind == "number" for info in self.topic.fields)
        if hidden is not None:
            reason = hidden
        elif numbers:
            reason = "none of its numbers is listed as a signal; single ones can be read by path"
        else:
            reason = "holds no number"
        return Unread(topic=self.topic.name, reason=reason, messages=messages, complete=hidden is None)

    def _unlisted(self) -> Iterator[tuple[str, str]]:
        """Numeric arrays that aren't listed element by element, and why."""
        for info in self.topic.fields if self.layout is None else ():
            if info.kind != "number" or not info.dims:
                continue
            if self.elements[info.path] is None:
                yield info.path, "an array this long isn't listed; single elements can be read by path"
            elif is_signal(info) and self._identified_by_text(info):
                yield info.path, "elements with text in them aren't listed; single ones can be read by path or filter"

    # --- batch messages ---

    def _columns(self) -> Iterator[ChannelSource]:
        for index, name in enumerate(self.names):
            yield self._column(index, f"{topic_text(self.topic.name)}.{quoted(name)}")

    def _column(self, index: int, name: str) -> ChannelSource:
        if self.layout is None:
            raise AssertionError("only batch messages have columns")
        leaf = self.layout.samples[index if len(self.layout.samples) > 1 else 0]
        unit = self.units[index] if len(self.units) == len(self.names) else self.layout.unit
        field = self.names[index]
        channel, factor, unread = channel_of(self.topic, name=name, field=field, leaf=leaf, unit=unit)
        return ChannelSource(
            topic=self.topic.name, field=field, channel=channel, factor=factor, column=index, unread_unit=unread
        )

    def _column_source(self, path: MessagePath) -> ChannelSource:
        match path.steps:
            case (IndexStep(index=int() as index),) if index < len(self.names):
                return self._column(index, path.text)
            case (FieldStep(name=name),) if name in self.names:
                return self._column(self.names.index(name), path.text)
        if path.rest in self.names:
            # A column's name may hold dots and brackets of its own.
            return self._column(self.names.index(path.rest), path.text)
        near = near_matches(path.rest, [*map(quoted, self.names)])
        raise LogError(f"{path.text!r}: {self.topic.name} holds blocks of samples; no column {path.rest!r}, {near}")

    # --- one sample a message ---

    def _leaves(self) -> Iterator[ChannelSource]:
        for info in self.topic.fields if has_signals(self.topic.schema_name) else ():
            if is_signal(info) and not info.dims:
                yield self._listed(info.path, FieldSelector(leaf=info))
            elif is_signal(info):
                yield from self._elements(info)

    def _elements(self, info: FieldInfo) -> Iterator[ChannelSource]:
        elements = self.elements.get(info.path) or ()
        if self._identified_by_text(info):
            # Which element is which differs from message to message: they can be read by filter.
            return
        names_leaf = names_beside(info, self.topic.by_path)
        lists = self.joints.get(names_leaf, ()) if names_leaf is not None else ()
        if names_leaf is not None and len(lists) > 1 and len(info.dims) == 1 and elements:
            for joint in filter(None, dict.fromkeys(joint for names in lists for joint in names)):
                by_name = FieldFilter(leaf=names_leaf, operator="==", value=joint)
                selector = FieldSelector(leaf=info, elements=((by_name,),))
                yield self._listed(f"{info.path}{element_text(joint)}", selector)
            return
        for indices in elements:
            selector = FieldSelector(leaf=info, elements=indices, names_leaf=names_leaf)
            selector = self._with_name(selector, self._names_at(selector))
            written = None if selector.called is None else f"{info.path}{element_text(selector.called)}"
            # What was written under its name is listed so: its unit is kept under that.
            kept = measured_fields(self.topic.metadata) or frozenset()
            path = written if written is not None and written in kept else _with_indices(info.path, indices)
            yield self._listed(path, selector)

    def _called(self, selector: FieldSelector, path: MessagePath) -> FieldSelector:
        """Say what the names call the element at an index.

        Raises
        ------
        LogError
            When they call it differently in different messages.
        """
        called = self._names_at(selector)
        if len(called) > 1:
            told = " and ".join(sorted(called)[:4])
            raise LogError(
                f"{path.text!r}: element {selector.elements[-1]} is called {told} in different messages; read it by "
                f"name, {selector.leaf.path}{element_text(min(called))}"
            )
        return self._with_name(selector, called)

    def _names_at(self, selector: FieldSelector) -> tuple[str, ...]:
        """All names that the first messages give the element at an index."""
        if selector.names_leaf is None:
            return ()
        lists = self.joints.get(selector.names_leaf, ())
        if len(selector.elements) > 1:
            return self._names_inside(selector, frozenset(name for names in lists for name in names))
        index = selector.elements[0]
        found = [names[index] for names in lists if isinstance(index, int) and index < len(names)]
        return tuple(filter(None, dict.fromkeys(found)))

    def _names_inside(self, selector: FieldSelector, known: Collection[str]) -> tuple[str, ...]:
        """The same of an array in an array, which another one beside it may name otherwise."""
        found: dict[str | None, None] = {}
        for decoded in self.topic.decode_head(selector.leaves):
            names, codes = element_names(decoded, selector, ~decoded.bad)
            found |= dict.fromkeys(names[code] for code in codes.tolist())
        return tuple(name for name in found if name is not None and name in known)

    def _with_name(self, selector: FieldSelector, called: tuple[str, ...]) -> FieldSelector:
        return replace(selector, called=called[0]) if len(called) == 1 else selector

    @np.errstate(invalid="ignore")  # a damaged number may be a NaN that signals
    def _require_one_element(self, selector: FieldSelector, path: MessagePath) -> None:
        """Refuse filters that leave several elements, in most of the first messages."""
        if not selector.element_filters:
            return
        messages, several = 0, Counter[str]()
        for decoded in self.topic.decode_head(selector.leaves):
            messages += len(decoded.bad)
            several.update(select(decoded, selector, ~decoded.bad).lost)
        for reason, count in several.most_common(1):
            if 2 * count > messages:
                raise LogError(f"{path.text!r}: {reason}")

    def _listed(self, field: str, selector: FieldSelector) -> ChannelSource:
        return self._leaf_source(selector, field=field, name=f"{topic_text(self.topic.name)}.{field}")

    def _of_frame(self, source: ChannelSource, frame: FieldFilter) -> ChannelSource:
        if source.selector is None:
            raise AssertionError("columns of batch messages aren't told apart by frames")
        return replace(
            source,
            field=f"{_written(frame)}.{source.field}",
            channel=replace(source.channel, name=f"{topic_text(self.topic.name)}{_written(frame)}.{source.field}"),
            selector=replace(source.selector, message_filters=(frame,)),
        )

    def _identified_by_text(self, info: FieldInfo) -> bool:
        """Whether elements are messages with text inside (a frame's name, say) and no fixed number."""
        prefix, mark, _ = info.path.partition("[]")
        return bool(mark) and prefix in self.topic.lists_with_text

    def _leaf_source(self, selector: FieldSelector, *, field: str, name: str) -> ChannelSource:
        leaf = selector.leaf
        # A log's writer knows fields, and no filter on whose they are.
        known_as = field.partition("}.")[2] if field.startswith("{") else field
        channel, factor, unread = channel_of(self.topic, name=name, field=known_as, leaf=leaf.path, unit=None)
        if leaf.kind in ("time", "duration"):
            factor = 1e-9
        return ChannelSource(
            topic=self.topic.name, field=field, channel=channel, factor=factor, selector=selector, unread_unit=unread
        )

    def _spelling(self, path: MessagePath, selector: FieldSelector) -> str:
        """Field in the spelling of the list: by index where a name always stands in the same place."""
        if selector.message_filters or selector.publisher is not None:
            return path.rest
        indices = [self._index_of(choice) for choice in selector.elements]
        known = tuple(index for index in indices if index is not None)
        return _with_indices(selector.leaf.path, known) if len(known) == len(indices) else path.rest

    def _index_of(self, choice: ElementChoice) -> int | None:
        """Index of the element that is chosen, where that's the same in all messages."""
        if isinstance(choice, int):
            return choice
        only = choice[0]
        lists = self.joints.get(only.leaf, ())
        if len(choice) == len(lists) == 1 and only.operator == "==" and lists[0].count(str(only.value)) == 1:
            return lists[0].index(str(only.value))
        return None


def _written(frame: FieldFilter) -> str:
    return f"{{{frame.leaf}=={in_quotes(str(frame.value))}}}"


def _with_indices(leaf: str, indices: tuple[int, ...]) -> str:
    """Path of an element: an index for each list on the way, and behind the leaf for its own."""
    rest = iter(indices)
    # A quoted name may hold brackets of its own.
    marked = _MARK.sub(lambda found: found[0] if found[0] != "[]" else f"[{next(rest)}]", leaf)
    return marked + "".join(f"[{index}]" for index in rest)


def topic_channels(topic: Topic, layout: BatchLayout | None = None) -> TopicChannels:
    """Look at a topic's first messages to learn what can be read from it.

    Parameters
    ----------
    topic
        With its head.
    layout
        Of its batch messages, when a setup file gives it; otherwise well-known ones are recognised.

    Raises
    ------
    LogError
        When columns of batch messages have the same name.
    """
    layout = layout or recognised_layout(topic.schema_name, topic.fields)
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    if layout is not None:
        heads = topic.decode_head(layout.leaves)
        names, units = column_names(layout, heads), column_units(layout, heads)
    return TopicChannels(
        topic=topic,
        layout=layout,
        names=names,
        units=units,
        elements={} if layout is not None else _elements(topic),
        joints={} if layout is not None else _joints(topic),
        frames=() if layout is not None else _frames(topic),
    )


def _elements(topic: Topic) -> dict[str, tuple[tuple[int, ...], ...] | None]:
    """Indices of the elements of each array of numbers, as far as there aren't too many."""
    arrays = [info for info in topic.fields if info.dims and info.kind == "number"]
    counted = [info.path for info in arrays if "dynamic" in info.dims]
    seen: dict[str, list[Column]] = {path: [] for path in counted}
    for decoded in topic.decode_head(counted) if counted else ():
        for path in counted:
            seen[path].append(decoded.columns[path].select(~decoded.bad))
    return {info.path: _indices(info.dims, seen.get(info.path, ())) for info in arrays}


def _indices(dims: Sequence[Dimension], seen: Sequence[Column]) -> tuple[tuple[int, ...], ...] | None:
    """Indices that the schema fixes, or that lists of these lengths have; None for more than are listed."""
    found: list[tuple[int, ...]] = [()]
    for size in dims:
        below: list[tuple[int, ...]] = []
        for above in found:
            longest = size if isinstance(size, int) else max((_longest(column, above) for column in seen), default=0)
            if len(below) + longest > MAX_LISTED_ELEMENTS:
                return None
            below += [(*above, index) for index in range(longest)]
        found = below
    return tuple(found)


def _longest(column: Column, above: Sequence[int]) -> int:
    """Length of the longest of the lists that lie in the elements at these indices."""
    lengths = column.lengths
    messages = len(lengths[0])
    place, present = list_places(column, [np.full(messages, index) for index in above], messages)
    own = lengths[len(above)]
    return int(own[place[present]].max(initial=0)) if own.size else 0


def _frames(topic: Topic) -> tuple[FieldFilter, ...]:
    """Filters on the frame's name where the first messages are of several publishers at once with different ones."""
    leaf = next((info.path for info in topic.fields if info.path in FRAME_FIELDS and info.kind == "string"), None)
    head = [] if leaf is None else topic.head_with([leaf])
    if leaf is None or not head:
        return ()
    parts = topic.decode_head([leaf])
    names = np.array([name for part in parts for name in _texts(part.columns[leaf].select(~part.bad).strings)])
    logged = np.concatenate([batch.log_time_ns[~part.bad] for batch, part in zip(head, parts, strict=True)])
    recurring = np.isin(names, _recurring(names.tolist()))
    names, logged = names[recurring], logged[recurring]
    order = np.argsort(logged, kind="stable")
    known, label = np.unique(names[order], return_inverse=True)
    if len(known) < 2 or not at_once(logged[order], label):
        return ()
    return tuple(FieldFilter(leaf=leaf, operator="==", value=str(name)) for name in dict.fromkeys(names.tolist()))


def _texts(strings: Strings) -> list[str]:
    return [str(strings[place]) for place in range(len(strings))]


def _joints(topic: Topic) -> dict[str, tuple[tuple[str, ...], ...]]:
    """Distinct lists of names, but for those that only one message has: it may be damaged."""
    known = {info.path: info for info in topic.fields}
    leaves = {names_beside(info, known) for info in topic.fields if info.dims}
    wanted = sorted(leaf for leaf in leaves if leaf is not None)
    heads = topic.decode_head(wanted) if wanted else []
    joints = {}
    for leaf in wanted:
        lists = [names for part in heads for names in _lists(part.columns[leaf].select(~part.bad).strings)]
        joints[leaf] = _recurring(lists)
    return joints


def _recurring(values: Sequence[Names]) -> tuple[Names, ...]:
    """Distinct values, but for those that come once, where most come more often."""
    counts = Counter(values)
    once = [value for value, count in counts.items() if count == 1]
    return tuple(value for value in counts if 2 * len(once) > len(values) or counts[value] > 1)


def _lists(strings: Strings) -> list[tuple[str, ...]]:
    entries = [strings.table[code] for code in strings.codes.reshape(-1).tolist()]
    return [(entry,) if isinstance(entry, str) else entry for entry in entries]
