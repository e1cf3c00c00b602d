"""The channels of one topic: all that are listed, and any that a path names."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.batch_messages import BatchLayout, column_names, column_units, recognised_layout
from chladni.io.channel_source import ChannelSource, channel_of, measured_fields
from chladni.io.decoding import FieldInfo
from chladni.io.decoding.columns import Strings
from chladni.io.field_selector import FieldFilter, FieldSelector, names_beside, resolve_fields
from chladni.io.known_schemas import MAX_LISTED_ELEMENTS, has_signals, is_signal
from chladni.io.loss import Unread
from chladni.io.message_path import FieldStep, IndexStep, MessagePath, near_matches, quoted
from chladni.io.publishers import at_once
from chladni.io.topic import Topic
from chladni.signals.errors import LogError

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
    lengths
        Longest length seen of each array that is counted in the message.
    joints
        Names of array elements, by the leaf that holds them: every distinct list of names that the head holds.
    frames
        Filters on the frame's name, one for each of several publishers that send at once; else empty.
    """

    topic: Topic
    layout: BatchLayout | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    lengths: dict[str, int]
    joints: dict[str, tuple[tuple[str, ...], ...]]
    frames: tuple[FieldFilter, ...] = ()

    @property
    def publishers(self) -> tuple[str, ...]:
        """Beginnings of the paths of each of several publishers that send at once; empty where there's one."""
        return tuple(f"{self.topic.name}{_written(frame)}" for frame in self.frames)

    def listed(self) -> Iterator[ChannelSource]:
        """Give every channel that is a signal, in the order of the schema."""
        measured = measured_fields(self.topic.metadata)
        sources = self._columns() if self.layout is not None else self._leaves()
        wanted = [source for source in sources if measured is None or source.field in measured]
        if not self.frames:
            return iter(wanted)
        return (self._of_frame(source, frame) for frame in self.frames for source in wanted)

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
        selector = resolve_fields(path, self.topic.fields)
        return self._leaf_source(selector, field=self._spelling(path, selector), name=path.text)

    @property
    def element_names(self) -> frozenset[str]:
        """All names that the first messages give to elements of their arrays."""
        return frozenset(name for lists in self.joints.values() for names in lists for name in names)

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
        for path in self._long_arrays():
            reason = "an array this long isn't listed; single elements can be read by path"
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

    def _long_arrays(self) -> Iterator[str]:
        """Numeric arrays that are too long to be listed element by element."""
        for info in self.topic.fields if self.layout is None else ():
            if info.kind == "number" and info.array is not None and self._length(info) > MAX_LISTED_ELEMENTS:
                yield info.path

    # --- batch messages ---

    def _columns(self) -> Iterator[ChannelSource]:
        for index, name in enumerate(self.names):
            yield self._column(index, f"{self.topic.name}.{quoted(name)}")

    def _column(self, index: int, name: str) -> ChannelSource:
        if self.layout is None:
            raise AssertionError("only batch messages have columns")
        leaf = self.layout.samples[index if len(self.layout.samples) > 1 else 0]
        unit = self.units[index] if len(self.units) == len(self.names) else self.layout.unit
        field = self.names[index]
        channel, factor = channel_of(self.topic, name=name, field=field, leaf=leaf, unit=unit)
        return ChannelSource(topic=self.topic.name, field=field, channel=channel, factor=factor, column=index)

    def _column_source(self, path: MessagePath) -> ChannelSource:
        match path.steps:
            case (IndexStep(index=int() as index),) if index < len(self.names):
                return self._column(index, path.text)
            case (FieldStep(name=name),) if name in self.names:
                return self._column(self.names.index(name), path.text)
        if path.rest in self.names:
            # A column's name may hold dots and brackets of its own.
            return self._column(self.names.index(path.rest), path.text)
        near = near_matches(path.rest, self.names)
        raise LogError(f"{path.text!r}: {self.topic.name} holds blocks of samples; no column {path.rest!r}, {near}")

    # --- one sample a message ---

    def _leaves(self) -> Iterator[ChannelSource]:
        for info in self.topic.fields if has_signals(self.topic.schema_name) else ():
            if not is_signal(info) or self._length(info) > MAX_LISTED_ELEMENTS:
                continue
            if info.array is None:
                yield self._listed(info.path, FieldSelector(leaf=info))
            else:
                yield from self._elements(info)

    def _elements(self, info: FieldInfo) -> Iterator[ChannelSource]:
        names_leaf = names_beside(info.path, {one.path: one for one in self.topic.fields})
        lists = self.joints.get(names_leaf, ()) if names_leaf is not None else ()
        if info.path.count("[]") > 1 or self._identified_by_text(info):
            # Which element is which differs from message to message: they can be read by filter.
            return
        if names_leaf is not None and len(lists) > 1 and self._length(info):
            for joint in dict.fromkeys(joint for names in lists for joint in names):
                by_name = FieldFilter(leaf=names_leaf, operator="==", value=joint)
                yield self._listed(f"{info.path}[{joint}]", FieldSelector(leaf=info, element_filters=(by_name,)))
            return
        for index in range(self._length(info)):
            selector = FieldSelector(leaf=info, index=index, names_leaf=names_leaf)
            yield self._listed(_with_index(info.path, index), selector)

    def _listed(self, field: str, selector: FieldSelector) -> ChannelSource:
        return self._leaf_source(selector, field=field, name=f"{self.topic.name}.{field}")

    def _of_frame(self, source: ChannelSource, frame: FieldFilter) -> ChannelSource:
        if source.selector is None:
            raise AssertionError("columns of batch messages aren't told apart by frames")
        return replace(
            source,
            field=f"{_written(frame)}.{source.field}",
            channel=replace(source.channel, name=f"{self.topic.name}{_written(frame)}.{source.field}"),
            selector=replace(source.selector, message_filters=(frame,)),
        )

    def _identified_by_text(self, info: FieldInfo) -> bool:
        """Whether elements are messages with text inside (a frame's name, say) and no fixed number."""
        prefix, mark, _ = info.path.partition("[]")
        return bool(mark) and any(
            one.kind == "string" and one.path.startswith(f"{prefix}[].") for one in self.topic.fields
        )

    def _length(self, info: FieldInfo) -> int:
        return info.array if isinstance(info.array, int) else self.lengths.get(info.path, 0)

    def _leaf_source(self, selector: FieldSelector, *, field: str, name: str) -> ChannelSource:
        leaf = selector.leaf
        # A log's writer knows fields, and no filter on whose they are.
        known_as = field.partition("}.")[2] if field.startswith("{") else field
        channel, factor = channel_of(self.topic, name=name, field=known_as, leaf=leaf.path, unit=None)
        if leaf.kind in ("time", "duration"):
            factor = 1e-9
        return ChannelSource(topic=self.topic.name, field=field, channel=channel, factor=factor, selector=selector)

    def _spelling(self, path: MessagePath, selector: FieldSelector) -> str:
        """Field in the spelling of the list: by index where a name always stands in the same place."""
        if selector.message_filters or selector.publisher is not None:
            return path.rest
        if selector.index is not None:
            return _with_index(selector.leaf.path, selector.index)
        if len(selector.element_filters) == 1:
            only = selector.element_filters[0]
            lists = self.joints.get(only.leaf, ())
            if only.operator == "==" and len(lists) == 1 and lists[0].count(str(only.value)) == 1:
                return _with_index(selector.leaf.path, lists[0].index(str(only.value)))
        return path.rest


def _written(frame: FieldFilter) -> str:
    escaped = str(frame.value).replace("\\", "\\\\").replace('"', '\\"')
    return f'{{{frame.leaf}=="{escaped}"}}'


def _with_index(leaf: str, index: int) -> str:
    return leaf.replace("[]", f"[{index}]") if "[]" in leaf else f"{leaf}[{index}]"


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
        for decoded in topic.decode_head(layout.leaves):
            names = names or column_names(layout, decoded)
            units = units or column_units(layout, decoded)
        if not names and not isinstance(layout.names, str):
            names = layout.samples if layout.names is None else layout.names
    return TopicChannels(
        topic=topic,
        layout=layout,
        names=names,
        units=units,
        lengths={} if layout is not None else _lengths(topic),
        joints={} if layout is not None else _joints(topic),
        frames=() if layout is not None else _frames(topic),
    )


def _lengths(topic: Topic) -> dict[str, int]:
    counted = [info.path for info in topic.fields if info.array == "dynamic" and info.kind == "number"]
    lengths = dict.fromkeys(counted, 0)
    if not counted:
        return lengths
    for decoded in topic.decode_head(counted):
        for path in counted:
            _, counts = decoded.columns[path].per_message()
            good = counts[~decoded.bad]
            lengths[path] = max(lengths[path], int(good.max(initial=0)))
    return lengths


def _frames(topic: Topic) -> tuple[FieldFilter, ...]:
    """Filters on the frame's name where the first messages are of several publishers at once with different ones."""
    leaf = next((info.path for info in topic.fields if info.path in FRAME_FIELDS and info.kind == "string"), None)
    head = [] if leaf is None else topic.head_with([leaf])
    if leaf is None or not head:
        return ()
    names = np.array([name for part in topic.decode_head([leaf]) for name in _texts(part.columns[leaf].strings)])
    logged = np.concatenate([batch.log_time_ns for batch in head])
    order = np.argsort(logged, kind="stable")
    known, label = np.unique(names[order], return_inverse=True)
    if len(known) < 2 or not at_once(logged[order], label):
        return ()
    return tuple(FieldFilter(leaf=leaf, operator="==", value=str(name)) for name in dict.fromkeys(names.tolist()))


def _texts(strings: Strings) -> list[str]:
    return [str(strings[place]) for place in range(len(strings))]


def _joints(topic: Topic) -> dict[str, tuple[tuple[str, ...], ...]]:
    known = {info.path: info for info in topic.fields}
    leaves = {names_beside(info.path, known) for info in topic.fields if info.array is not None}
    wanted = sorted(leaf for leaf in leaves if leaf is not None)
    seen: dict[str, dict[tuple[str, ...], None]] = {leaf: {} for leaf in wanted}
    for decoded in topic.decode_head(wanted) if wanted else ():
        for leaf in wanted:
            seen[leaf].update(dict.fromkeys(_lists(decoded.columns[leaf].strings, ~decoded.bad)))
    return {leaf: tuple(lists) for leaf, lists in seen.items()}


def _lists(strings: Strings, good: NDArray[np.bool_]) -> list[tuple[str, ...]]:
    entries = [strings.table[code] for code in np.unique(strings.codes[good])]
    return [(entry,) if isinstance(entry, str) else entry for entry in entries]
