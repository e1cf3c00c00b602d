"""A topic of a log: its channels in the file, their decoders, and first messages, which tell what no schema does."""

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice
from typing import Final

import numpy as np

from chladni.io.arrival import Arrivals, arrival_order, numbered
from chladni.io.clock.stray_stamps import untimed
from chladni.io.decoding import Decoded, Decoder, FieldInfo, definition_text, make_decoder
from chladni.io.mcap.channel_registry import McapChannel
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.messages import Messages
from chladni.signals.errors import LogError

HEAD_MESSAGES: Final = 64
"""Messages of a topic that are looked at before any is read: for stamps that move, lengths of arrays, names."""

_JOINT_BATCHES: Final = 8
"""Batches a topic that are read to find the heads of all topics together, before rare ones are looked for alone."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Topic:
    """A topic whose messages can be decoded.

    Attributes
    ----------
    name
        As in the log.
    schema_name, encoding
        Message type, and how messages are encoded (``cdr``, ``ros1``, ``protobuf``, ``json``).
    metadata
        MCAP channel metadata, of all its channels together.
    decoders
        Decoder of each MCAP channel; several channels may share the topic.
    schema_text
        Schema as text where it is text, for the units in its comments.
    head
        First messages, a few batches of at most `HEAD_MESSAGES` messages together; empty for a silent topic.
    """

    name: str
    schema_name: str
    encoding: str
    metadata: Mapping[str, str]
    decoders: Mapping[int, Decoder]
    schema_text: str
    head: tuple[MessageBatch, ...] = ()

    @property
    def fields(self) -> tuple[FieldInfo, ...]:
        """Leaves of the messages."""
        return next(iter(self.decoders.values())).fields

    @property
    def by_path(self) -> Mapping[str, FieldInfo]:
        """The same by their paths."""
        return _by_path(next(iter(self.decoders.values())))

    @property
    def lists_with_text(self) -> frozenset[str]:
        """Lists of messages that hold a text somewhere."""
        return _lists_with_text(next(iter(self.decoders.values())))

    def known_to(self, channel_id: int) -> AbstractSet[str]:
        """Paths of the leaves of one MCAP channel: channels of a topic may differ in their schema."""
        return _by_path(self.decoders[channel_id]).keys()

    def decode(self, batch: MessageBatch, leaves: Sequence[str]) -> Decoded:
        """Decode some leaves of one batch."""
        return self.decoders[batch.channel_id].columns(batch, leaves)

    def head_with(self, leaves: Sequence[str]) -> list[MessageBatch]:
        """Give the first messages whose schema has these leaves."""
        return [batch for batch in self.head if self.known_to(batch.channel_id) >= set(leaves)]

    def decode_head(self, leaves: Sequence[str]) -> list[Decoded]:
        """Decode some leaves of the first messages that have them."""
        return [self.decode(batch, leaves) for batch in self.head_with(leaves)]

    @property
    def unread(self) -> Mapping[str, str]:
        """Numeric leaves that can't be read, and why."""
        return next(iter(self.decoders.values())).unread

    def with_head(self, head: Sequence[MessageBatch]) -> "tuple[Topic, str | None]":
        """Give the topic with the first messages of its channels, from which decoders learn what no schema tells.

        Returns
        -------
        topic : Topic
            Without the channels whose messages can't be decoded.
        reason : str or None
            Why one of them can't.
        """
        decoders: dict[int, Decoder] = {}
        reason = None
        for channel, decoder in self.decoders.items():
            try:
                decoders[channel] = decoder.informed_by([batch for batch in head if batch.channel_id == channel])
            except LogError as error:
                reason = str(error)
        readable = tuple(batch for batch in head if batch.channel_id in decoders)
        return replace(self, head=readable, decoders=decoders), reason


# Asked for each field; the channels of a topic have few decoders.
@lru_cache(maxsize=8)
def _by_path(decoder: Decoder) -> Mapping[str, FieldInfo]:
    return {info.path: info for info in decoder.fields}


@lru_cache(maxsize=8)
def _lists_with_text(decoder: Decoder) -> frozenset[str]:
    return frozenset(
        info.path.partition("[].")[0] for info in decoder.fields if info.kind == "string" and "[]." in info.path
    )


def topics_of(channels: Mapping[int, McapChannel]) -> tuple[dict[str, Topic], dict[str, str]]:
    """Group the channels of a log by topic and make their decoders.

    Returns
    -------
    topics : dict
        Topics that can be decoded, in the order of the file.
    refused : dict
        Why the others can't, by topic.
    """
    topics: dict[str, Topic] = {}
    refused: dict[str, str] = {}
    # Many channels may share a long schema, which is read once.
    made: dict[_Format, Decoder | str] = {}
    for channel in sorted(channels.values(), key=lambda one: one.id):
        key = _format_of(channel)
        decoder = made[key] if key in made else made.setdefault(key, _decoder(*key))
        if isinstance(decoder, str):
            refused[channel.topic] = decoder
            continue
        known = topics.get(channel.topic)
        topics[channel.topic] = _new_topic(channel, decoder) if known is None else _joined(known, channel, decoder)
    return topics, refused


_Format = tuple[str, str, str, bytes]
"""Message encoding, and name, encoding and text of the schema."""


def _format_of(channel: McapChannel) -> _Format:
    schema = channel.schema
    if schema is None:
        return channel.message_encoding, "", "", b""
    return channel.message_encoding, schema.name, schema.encoding, schema.data


def _decoder(message_encoding: str, schema_name: str, schema_encoding: str, schema_data: bytes) -> Decoder | str:
    """Make a decoder, or say why there's none."""
    try:
        return make_decoder(
            message_encoding=message_encoding,
            schema_name=schema_name,
            schema_encoding=schema_encoding,
            schema_data=schema_data,
        )
    except LogError as error:
        return str(error)


def _new_topic(channel: McapChannel, decoder: Decoder) -> Topic:
    schema = channel.schema
    is_text = schema is not None and schema.encoding in ("ros1msg", "ros2msg")
    return Topic(
        name=channel.topic,
        schema_name="" if schema is None else schema.name,
        encoding=channel.message_encoding,
        metadata=dict(channel.metadata),
        decoders={channel.id: decoder},
        schema_text=definition_text(schema.data) if schema is not None and is_text else "",
    )


def _joined(topic: Topic, channel: McapChannel, decoder: Decoder) -> Topic:
    return replace(
        topic,
        metadata={**channel.metadata, **topic.metadata},
        decoders={**topic.decoders, channel.id: decoder},
    )


def apart(topic: Topic, channels: Mapping[int, McapChannel]) -> dict[str, Topic]:
    """Give each MCAP channel of a topic as a topic of its own, whose name says which channel it is.

    Parameters
    ----------
    topic
        With its head.
    channels
        Of the log, by id.
    """
    return {
        f"{topic.name}{{@channel=={channel}}}": replace(
            _new_topic(channels[channel], decoder),
            name=f"{topic.name}{{@channel=={channel}}}",
            head=tuple(batch for batch in topic.head if batch.channel_id == channel),
        )
        for channel, decoder in topic.decoders.items()
    }


# --- first messages ----------------------------------------------------------------------------------------------


def read_heads(container: Messages, topics: Mapping[str, Topic]) -> tuple[dict[str, Topic], dict[str, str]]:
    """Give the topics with their first messages.

    All topics are looked for together, since most begin in the same few chunks; those that don't are then looked
    for alone, where an index leads straight to them.

    Returns
    -------
    topics : dict
        Topics whose messages can be decoded.
    refused : dict
        Why messages of the others can't.
    """
    counts = container.message_counts()
    heads: dict[int, list[MessageBatch]] = {channel: [] for topic in topics.values() for channel in topic.decoders}
    missing = {channel for channel in heads if counts is None or counts.get(channel, 0) > 0}
    _fill(heads, missing, container.batches(missing), budget=_JOINT_BATCHES * len(missing), counts=counts)
    for channel in sorted(missing):
        if not heads[channel]:
            _fill(heads, {channel}, container.batches({channel}), budget=_JOINT_BATCHES, counts=counts)
    found: dict[str, Topic] = {}
    refused: dict[str, str] = {}
    for name, topic in topics.items():
        informed, reason = topic.with_head([batch for channel in topic.decoders for batch in heads[channel]])
        if informed.decoders:
            found[name] = informed
        if reason is not None:
            refused[name] = reason
    return found, refused


def _fill(
    heads: dict[int, list[MessageBatch]],
    missing: set[int],
    batches: Iterator[MessageBatch],
    *,
    budget: int,
    counts: Mapping[int, int] | None,
) -> None:
    """Take first messages until every channel has enough (it leaves `missing`) or the budget of batches is spent."""
    if not missing:
        return
    for batch in islice(batches, budget):
        head = heads[batch.channel_id]
        wanted = HEAD_MESSAGES - sum(map(len, head))
        if wanted > 0 and len(batch):
            head.append(_first(batch, wanted))
        enough = HEAD_MESSAGES if counts is None else min(HEAD_MESSAGES, counts.get(batch.channel_id, 0))
        if sum(map(len, head)) >= enough:
            missing.discard(batch.channel_id)
        if not missing:
            return


def read_earlier_heads(container: Messages, topics: Mapping[str, Topic]) -> tuple[dict[str, Topic], dict[str, str]]:
    """Give the topics with the messages that are first by time as their heads, where a log stores others before them.

    Nothing is read where the log holds no message that was logged before all the heads. Those that can't be decoded
    by these are told with the reason, as `read_heads` does.
    """
    known = [int(batch.log_time_ns.min()) for topic in topics.values() for batch in topic.head]
    span_ns = container.time_range_ns
    if span_ns is None or not known or span_ns[0] >= min(known):
        return dict(topics), {}
    found, refused = dict(topics), dict[str, str]()
    for name, arrivals in read_arrivals(container, topics).items():
        order = arrival_order(arrivals.log_ns, arrivals)
        first_ns = arrivals.log_ns[:HEAD_MESSAGES] if order is None else arrivals.log_ns[order[:HEAD_MESSAGES]]
        if first_ns.size and first_ns[0] < min(int(batch.log_time_ns.min()) for batch in topics[name].head):
            window = container.batches(
                topics[name].decoders, start_time_ns=int(first_ns[0]), end_time_ns=int(first_ns[-1]) + 1
            )
            found[name], reason = topics[name].with_head([_first(batch, HEAD_MESSAGES) for batch in window])
            if reason is not None:
                refused[name] = reason
    return {name: topic for name, topic in found.items() if topic.decoders}, refused


def read_arrivals(container: Messages, topics: Mapping[str, Topic]) -> dict[str, Arrivals]:
    """Give the arrivals of all messages of some topics, those left out whose log time is no time."""
    owner = {channel: topic for topic in topics.values() for channel in topic.decoders}
    parts: dict[str, list[Arrivals]] = {name: [] for name in topics}
    for stretch, batch in numbered(container.batches(owner)):
        topic = owner[batch.channel_id]
        parts[topic.name].append(Arrivals.of(batch, stretch if len(topic.decoders) > 1 else None))
    found = {name: Arrivals.joined(some) for name, some in parts.items()}
    return {name: _with_log_time(one) for name, one in found.items()}


def _with_log_time(arrivals: Arrivals) -> Arrivals:
    away = untimed(arrivals.log_ns, None)
    return arrivals if away is None else arrivals.kept(~away)


def _first(batch: MessageBatch, count: int) -> MessageBatch:
    if len(batch) <= count:
        return batch
    part = slice(0, count)
    # Copies, so that a head of 64 messages doesn't keep a chunk of megabytes alive.
    end = int(np.max(batch.offsets[part] + batch.lengths[part]))
    start = int(np.min(batch.offsets[part]))
    return replace(
        batch,
        buffer=batch.buffer[start:end].copy(),
        offsets=batch.offsets[part] - start,
        lengths=batch.lengths[part],
        log_time_ns=batch.log_time_ns[part],
        publish_time_ns=batch.publish_time_ns[part],
        sequence=batch.sequence[part],
    )
