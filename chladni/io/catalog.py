"""What a log holds: topics, which time each is stamped with, and the channels, as the setup file refines them."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Final

import numpy as np

from chladni.io.arrival import arrival_order
from chladni.io.batch_messages import BatchLayout
from chladni.io.channel_source import ChannelSource
from chladni.io.loss import Unread
from chladni.io.message_path import MessagePath, parse_message_path, starts_with_topic
from chladni.io.messages import Messages
from chladni.io.number_lists import NumberLists
from chladni.io.publishers import at_once, evenly_in_turn
from chladni.io.setup import ChannelSetup, Setup, refined
from chladni.io.stamps import (
    StampChoice,
    StampRequest,
    TopicHead,
    choose_stamp,
    clock_shifts_ns,
    find_own_stamp,
    head_of,
)
from chladni.io.stream import Stream
from chladni.io.topic import Topic, apart, read_arrivals, read_earlier_heads, read_heads, topics_of
from chladni.io.topic_channels import TopicChannels, topic_channels
from chladni.signals.channel import labelled
from chladni.signals.channel_names import is_pattern, places_of, unknown
from chladni.signals.errors import EstimateError, LogError, SetupError
from chladni.signals.wording import near_matches

#: Channels that a log may list; MCAP numbers its own with 16 bits.
MOST_LISTED: Final = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Catalog:
    """What can be read from a log.

    Attributes
    ----------
    file
        Name of the file, for messages.
    topics
        Topics that can be decoded.
    choices
        Which time of a topic's messages is their samples'.
    refused
        Why the other topics, or some channels of these, can't be read.
    unread
        The same and all else that no channel was made of, in the order of the file.
    channels
        Every channel that is listed, in the order of the file.
    setups
        What the setup file says, by topic and field.
    lags_ns
        Least and most time between a topic's samples and their log time in its first messages; None where the two
        don't run together, so that a time window can't be found by log time.
    start_ns
        Earliest sample of the topics with channels, else the first message: zero of all times in seconds. 0 for an
        empty log.
    publishers
        Names of the publishers of topics that several publish on at once, by topic. Each is listed as a topic of its
        own.
    in_turn
        Names of the MCAP channels of topics where they send evenly in turn, by topic, and are read as one source.
    """

    file: str
    topics: Mapping[str, TopicChannels]
    choices: Mapping[str, StampChoice]
    refused: Mapping[str, str]
    unread: tuple[Unread, ...]
    channels: tuple[ChannelSource, ...]
    setups: Mapping[tuple[str, str], ChannelSetup]
    lags_ns: Mapping[str, tuple[int, int] | None]
    start_ns: int
    publishers: Mapping[str, tuple[str, ...]]
    in_turn: Mapping[str, tuple[str, ...]]

    def named(self, words: Sequence[str]) -> tuple[ChannelSource, ...]:
        """Find the channels that words name: a message path, or what `places_of` finds among those listed.

        Raises
        ------
        LogError
            When a word names none, or an ending several.
        """
        listed = {source.channel.name: source for source in self.channels}
        found = [source for word in dict.fromkeys(words) for source in self._named(word, listed)]
        return tuple({source.channel.name: source for source in found}.values())

    def _named(self, word: str, listed: Mapping[str, ChannelSource]) -> tuple[ChannelSource, ...]:
        known = listed.get(word)
        # Several publishers of a topic are told apart first.
        if known is not None and known.topic not in self.publishers:
            return (known,)
        if not is_pattern(word) and starts_with_topic(word, [*self.topics, *self.refused]):
            # Said in full: nothing else is meant by it, also where it can't be read; unless it's shown as a label.
            label = next((source for source in self.channels if source.channel.label == word), None)
            return (self._listed(self.resolve(word)) if label is None else label,)
        try:
            places = places_of(word, list(listed))
        except EstimateError as error:
            raise LogError(f"{self.file}: {error}") from None
        if not places and listed and "/" not in word:
            # No path that is written wrongly.
            raise LogError(f"{self.file}: {unknown(word, list(listed))}")
        return tuple(self.channels[place] for place in places) or (self.resolve(word),)

    def _listed(self, source: ChannelSource) -> ChannelSource:
        """Give a channel as lists have it, however its path was written; one that no list has stays as it is."""
        place = (source.topic, source.field, source.selector, source.column)
        same = (one for one in self.channels if (one.topic, one.field, one.selector, one.column) == place)
        return next(same, source)

    def resolve(self, path: str) -> ChannelSource:
        """Find the channel that a path names.

        Raises
        ------
        LogError
            When the log has no such channel; near ones are named.
        """
        try:
            source = self._resolved(path)
        except LogError as error:
            raise LogError(f"{self.file}: {error}") from None
        return with_setup(source, self.setups.get((source.topic, source.field)))

    def _resolved(self, path: str) -> ChannelSource:
        parsed = parse_message_path(path, [*self.topics, *self.refused])
        if parsed.topic not in self.topics:
            raise LogError(f"{path!r}: messages of {parsed.topic} can't be decoded: {self.refused[parsed.topic]}")
        if not parsed.steps:
            names = [one.channel.name for one in self.channels if one.topic == parsed.topic]
            if len(names) == 1:
                # As the topic knows it: what a setup file says of it must not be applied twice.
                return self._resolved(names[0])
            raise LogError(f"{path!r} is a topic; name a channel of it; {near_matches(path, names)}")
        source = self.topics[parsed.topic].resolve(parsed)
        self._require_one_publisher(parsed, source)
        return source

    def _require_one_publisher(self, path: MessagePath, source: ChannelSource) -> None:
        """Refuse a channel that several publish at once; one that only one of them knows is read."""
        if source.selector is not None and source.selector.message_filters:
            # A filter may tell the publishers apart; where it doesn't, their samples show it.
            return
        names = [f"{publisher}.{path.rest}" for publisher in self.publishers.get(path.topic, ())]
        known = [name for name in names if self._is_known(name)]
        if len(known) > 1:
            raise LogError(
                f"{path.text!r}: {len(known)} publish on {path.topic} at once; their samples are no single signal; "
                f"name one of them: {' or '.join(known)}"
            )

    def _is_known(self, path: str) -> bool:
        try:
            source = self._resolved(path)
        except LogError:
            return False
        return self.topics[source.topic].may_hold(source)

    @property
    def number_lists(self) -> tuple[NumberLists, ...]:
        """Lists of numbers in the messages of all topics that have channels."""
        listed = dict.fromkeys(source.topic for source in self.channels)
        return tuple(lists for name in listed for lists in self.topics[name].number_lists())

    def publishing_with(self, topic: str) -> int:
        """How many publish at once on a listed topic, or with it where it is one of several publishers itself."""
        return next((len(names) for whole, names in self.publishers.items() if topic in (whole, *names)), 1)

    def streams(self, sources: Sequence[ChannelSource]) -> list[Stream]:
        """Group channels whose samples come in the same messages.

        Elements that are chosen by name or filter may be missing from some messages, so each choice is a stream.
        """
        groups: dict[object, list[ChannelSource]] = {}
        for source in sources:
            selector = source.selector
            key: tuple[object, ...] = (source.topic,)
            if selector is not None:
                key += (selector.publisher, selector.message_filters, selector.element_filters)
            groups.setdefault(key, []).append(source)
        return [self._stream(tuple(group)) for group in groups.values()]

    def _stream(self, sources: tuple[ChannelSource, ...]) -> Stream:
        channels = self.topics[sources[0].topic]
        selector = sources[0].selector
        return Stream(
            topic=channels.topic,
            choice=self.choices[channels.topic.name],
            sources=sources,
            layout=channels.layout,
            names=channels.names,
            filters=selector.message_filters if selector else (),
        )


def read_catalog(container: Messages, *, setup: Setup, request: StampRequest) -> Catalog:
    """Look at the channels of a log and at the first messages of each topic.

    Raises
    ------
    SetupError
        When the setup file names a channel or topic that the log doesn't hold.
    LogError
        When the messages' own stamp is asked for and a topic with channels has none.
    """
    topics, refused = topics_of(container.channels)
    topics, undecodable = read_heads(container, topics)
    topics, changed = read_earlier_heads(container, topics)
    _require_known_batches(setup, topics)
    readable, unreadable = _channels_of(topics, setup.batches, setup)
    refused |= undecodable | changed | unreadable
    parts, unreadable = _parts(container, readable, setup)
    refused |= unreadable
    publishers, in_turn = _publishers(container, readable, parts)
    listed_topics = [name for topic in readable for name in publishers.get(topic, (topic,))]
    readable |= {name: part for found in parts.values() for name, part in found.items()}
    publishers |= {name: one.publishers for name, one in readable.items() if one.publishers}
    listed, unlisted = _listed(readable, listed_topics)
    heads = {name: _head(channels.topic) for name, channels in readable.items()}
    choices = _choices(heads, {source.topic for source in listed}, request)
    catalog = Catalog(
        file=container.path.name,
        topics=readable,
        choices=choices,
        refused=refused,
        unread=(*_unread(container, readable, refused), *unlisted),
        channels=(),
        setups={},
        lags_ns={topic: None if head is None else head.lag_range_ns(choices[topic]) for topic, head in heads.items()},
        start_ns=_start_ns(heads, choices, {source.topic for source in listed}, container.time_range_ns),
        publishers=publishers,
        in_turn=in_turn,
    )
    setups = _setups(catalog, setup, listed)
    channels = tuple(with_setup(source, setups.get((source.topic, source.field))) for source in listed)
    told = labelled(source.channel for source in channels)
    channels = tuple(replace(source, channel=one) for source, one in zip(channels, told, strict=True))
    return replace(catalog, channels=channels, setups=setups)


def _listed(readable: Mapping[str, TopicChannels], topics: Sequence[str]) -> tuple[list[ChannelSource], list[Unread]]:
    """List the channels of topics, those with the fewest fields first where they are too many, and tell of others."""
    room, found = MOST_LISTED, dict[str, list[ChannelSource]]()
    for name in sorted(topics, key=lambda name: len(readable[name].topic.fields)):
        sources = list(islice(readable[name].listed(), room + 1))
        if len(sources) > room:
            break
        found[name] = sources
        room -= len(sources)
    unlisted = [
        Unread(
            topic=name,
            reason=f"{len(readable[name].topic.fields)} fields are too many for a list of {MOST_LISTED} channels; "
            "single ones can be read by path",
        )
        for name in topics
        if name not in found
    ]
    return [source for name in topics for source in found.get(name, ())], unlisted


def _parts(
    container: Messages, readable: Mapping[str, TopicChannels], setup: Setup
) -> tuple[dict[str, dict[str, TopicChannels]], dict[str, str]]:
    """Look at each MCAP channel of topics that have several by itself; what can't be read is told as a topic is."""
    parts: dict[str, dict[str, TopicChannels]] = {}
    refused: dict[str, str] = {}
    for name, whole in readable.items():
        if len(whole.topic.decoders) > 1:
            topics = apart(whole.topic, container.channels)
            parts[name], unreadable = _channels_of(topics, dict.fromkeys(topics, setup.batches.get(name)), setup)
            refused |= unreadable
    return parts, refused


def _publishers(
    container: Messages, readable: Mapping[str, TopicChannels], parts: Mapping[str, Mapping[str, TopicChannels]]
) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, ...]]]:
    """Find the topics whose MCAP channels send the same at once, and those where they do so evenly in turn."""
    several = {name: readable[name].topic for name in parts if any(True for _ in readable[name].listed())}
    at_a_time: dict[str, tuple[str, ...]] = {}
    in_turn: dict[str, tuple[str, ...]] = {}
    for name, one in (read_arrivals(container, several) if several else {}).items():
        order = arrival_order(one.log_ns, one)
        came = one if order is None else one.kept(order)
        if came.channel is None or not at_once(came.log_ns, came.channel):
            continue
        sending = set(np.unique(came.channel).tolist())
        own = {part: channels for part, channels in parts[name].items() if sending & set(channels.topic.decoders)}
        if not _share_joints(own):
            found = in_turn if evenly_in_turn(came.log_ns, came.channel) else at_a_time
            found[name] = tuple(own)
    return at_a_time, in_turn


def _share_joints(parts: Mapping[str, TopicChannels]) -> bool:
    """Whether publishers name the elements of their arrays, and each has its own: then the names tell them apart."""
    names = [part.element_names for part in parts.values()]
    return all(names) and sum(map(len, names)) == len(frozenset().union(*names))


def _channels_of(
    topics: Mapping[str, Topic], layouts: Mapping[str, BatchLayout | None], setup: Setup
) -> tuple[dict[str, TopicChannels], dict[str, str]]:
    readable: dict[str, TopicChannels] = {}
    refused: dict[str, str] = {}
    for name, topic in topics.items():
        try:
            readable[name] = topic_channels(topic, layouts.get(name))
        except LogError as error:
            if layouts.get(name) is not None:
                raise SetupError(f"{setup.path}: [[batch]] {name}: {error}") from None
            refused[name] = str(error)
    return readable, refused


def _head(topic: Topic) -> TopicHead | None:
    if not topic.head:
        return None
    own = find_own_stamp(topic.fields, topic.schema_name)
    leaves = () if own is None else own.leaves
    return head_of(topic.head_with(leaves), own, topic.decode_head(leaves) if leaves else [])


def _choices(
    heads: Mapping[str, TopicHead | None], with_channels: Collection[str], request: StampRequest
) -> dict[str, StampChoice]:
    choices: dict[str, StampChoice] = {}
    for topic, head in heads.items():
        if head is None:
            choices[topic] = StampChoice(kind="log", reason="no message was found")
        elif topic in with_channels or request != "header":
            choices[topic] = choose_stamp(head, request, topic=topic)
        else:
            # Nobody asked for this topic's time; a text topic without stamps must not stop the log from being read.
            choices[topic] = choose_stamp(head, "auto", topic=topic)
    signals = {topic: head for topic, head in heads.items() if head is not None and topic in with_channels}
    shifts = clock_shifts_ns({topic: head for topic, head in signals.items() if head.messages > 1}, choices)
    return choices | {topic: choices[topic].shifted(shift_ns) for topic, shift_ns in shifts.items()}


def _start_ns(
    heads: Mapping[str, TopicHead | None],
    choices: Mapping[str, StampChoice],
    with_channels: Collection[str],
    logged_ns: tuple[int, int] | None,
) -> int:
    signals = {topic: head for topic, head in heads.items() if head is not None and topic in with_channels}
    # One message samples nothing, and latched ones carry the time of long ago.
    starts = [head.start_ns(choices[topic]) for topic, head in signals.items() if head.messages > 1]
    starts = starts or [head.start_ns(choices[topic]) for topic, head in signals.items()]
    return min(starts, default=0 if logged_ns is None else logged_ns[0])


def _unread(
    container: Messages, readable: Mapping[str, TopicChannels], refused: Mapping[str, str]
) -> Iterator[Unread]:
    known = container.message_counts()
    messages: dict[str, int] = {}
    for channel in container.channels.values():
        messages[channel.topic] = messages.get(channel.topic, 0) + (known or {}).get(channel.id, 0)
    for topic in dict.fromkeys((*messages, *refused)):
        counted = None if known is None else messages.get(topic)
        if topic in refused:
            yield Unread(topic=topic, reason=f"can't be decoded: {refused[topic]}", messages=counted)
        if topic in messages and topic in readable:
            yield from readable[topic].unread(counted)


# --- setup -------------------------------------------------------------------------------------------------------


def _require_known_batches(setup: Setup, topics: Mapping[str, Topic]) -> None:
    for name, layout in setup.batches.items():
        if name not in topics:
            near = near_matches(name, topics)
            raise SetupError(f"{setup.path}: [[batch]] topic: the log has no topic {name!r}; {near}")
        known = {info.path for info in topics[name].fields}
        for leaf in layout.leaves:
            if leaf not in known:
                near = near_matches(leaf, known)
                raise SetupError(f"{setup.path}: [[batch]] {name}: messages have no field {leaf!r}; {near}")


def _setups(catalog: Catalog, setup: Setup, listed: Sequence[ChannelSource]) -> dict[tuple[str, str], ChannelSetup]:
    """Find the channel of each table; all that the log doesn't hold are told at once."""
    found: dict[tuple[str, str], ChannelSetup] = {}
    mistakes: list[str] = []
    names = [source.channel.name for source in listed]
    for one in setup.channels:
        try:
            source = catalog.resolve(one.path)
            with_setup(source, one)
        except LogError:
            mistakes.append(
                f"{one.place}: [[channel]] path: {catalog.file} has no channel {one.path!r}; "
                f"{near_matches(one.path, names)}"
            )
        except SetupError as error:
            mistakes.append(str(error))
        else:
            found[source.topic, source.field] = one
    if mistakes:
        raise SetupError(*mistakes)
    return found


def with_setup(source: ChannelSource, setup: ChannelSetup | None) -> ChannelSource:
    """Refine a channel by what the setup file says of it.

    Raises
    ------
    SetupError
        When sensitivity or range don't fit the channel's unit.
    """
    if setup is None:
        return source
    channel, factor = refined(source.channel, source.factor, setup)
    return replace(source, channel=channel, factor=factor)
