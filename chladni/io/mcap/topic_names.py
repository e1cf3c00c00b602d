"""Which topic and which field of its message a channel of some name is written to."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from chladni.io.message_path import quoted, topic_text
from chladni.signals.errors import SetupError

_TOPIC_AND_REST = re.compile(r"^(?P<topic>/[^.\[{]*[^.\[{/])(?:\.(?P<rest>.+))?$", re.DOTALL)
# ROS 2 allows lower-case field names only; indices of any word serve JointState, whose elements have names.
_FIELD_PATH = re.compile(r"[a-z][a-z0-9_]*(\[\w+\])?(\.[a-z][a-z0-9_]*(\[\d+\])?)*")
_QUOTED = re.compile(r'^"(?P<inside>(?:[^"\\]|\\.)*)"$', re.DOTALL)
_OUTSIDE_NAMES = re.compile(r"[^A-Za-z0-9_/]+")
SCALAR_FIELD = "value"


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldOfTopic:
    """A place for a channel's samples.

    Attributes
    ----------
    topic
        Name of the topic.
    field
        Path of a field in its messages, or the name of a column of its batch messages.
    name
        The channel name under which a reader finds the samples.
    """

    topic: str
    field: str
    name: str


def message_places(names: Sequence[str]) -> tuple[FieldOfTopic, ...]:
    """Give each channel a field of a message that holds one sample.

    A name that is a message path keeps its topic and field. Any other name becomes a topic of its own, made of the
    letters, digits, ``_`` and ``/`` in it, with the one field ``value``.

    Raises
    ------
    SetupError
        When two channels would land in the same place.

    Examples
    --------
    >>> [place.name for place in message_places(["/imu.linear_acceleration.x", "Force 1 (hammer)"])]
    ['/imu.linear_acceleration.x', '/Force_1_hammer.value']
    """
    return _without_clash(names, tuple(_message_place(name) for name in names))


def block_places(names: Sequence[str], *, topic: str) -> tuple[FieldOfTopic, ...]:
    """Give each channel a column of a batch message; names without a topic of their own go to `topic`.

    Examples
    --------
    >>> [place.name for place in block_places(["/daq.ch1", "Force 1 (hammer)"], topic="/rig")]
    ['/daq.ch1', '/rig."Force 1 (hammer)"']
    """
    return _without_clash(names, tuple(_block_place(name, topic) for name in names))


def _message_place(name: str) -> FieldOfTopic:
    match = _TOPIC_AND_REST.match(name)
    if match is not None and match["rest"] is not None and _FIELD_PATH.fullmatch(match["rest"]):
        topic, field = match["topic"], match["rest"]
        return FieldOfTopic(topic=topic, field=field, name=f"{topic_text(topic)}.{field}")
    # ROS names hold letters, digits, _ and /; anything else would be refused by the tools that read the log.
    topic = "/" + (_OUTSIDE_NAMES.sub("_", name).strip("_/") or "channel")
    return FieldOfTopic(topic=topic, field=SCALAR_FIELD, name=f"{topic}.{SCALAR_FIELD}")


def _block_place(name: str, default_topic: str) -> FieldOfTopic:
    match = _TOPIC_AND_REST.match(name)
    topic = default_topic if match is None else match["topic"]
    column = name if match is None else match["rest"] or SCALAR_FIELD
    in_quotes = _QUOTED.match(column)
    if match is not None and in_quotes is not None:
        column = re.sub(r"\\(.)", r"\1", in_quotes["inside"])
    return FieldOfTopic(topic=topic, field=column, name=f"{topic_text(topic)}.{quoted(column)}")


def _without_clash(names: Sequence[str], places: tuple[FieldOfTopic, ...]) -> tuple[FieldOfTopic, ...]:
    owners: dict[str, str] = {}
    for name, place in zip(names, places, strict=True):
        if place.name in owners:
            raise SetupError(
                f"channels {owners[place.name]!r} and {name!r} would both be written to {place.name}; "
                "rename one of them"
            )
        owners[place.name] = name
    return places
