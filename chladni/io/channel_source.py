"""Where a channel's samples come from, and what has to be done to them to be SI."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from math import isfinite
from typing import Final

from chladni.io.decoding.json_schema import number_in
from chladni.io.field_selector import FieldSelector
from chladni.io.known_schemas import is_command, known_unit, likely_role, possible_units
from chladni.io.topic import Topic
from chladni.signals.channel import Channel, Vector, unit_direction
from chladni.signals.errors import SetupError
from chladni.signals.unit_labels import quantity_of_name, read_label
from chladni.signals.units import si_factor

UNKNOWN_UNIT: Final = "1"

# Blanks of one line only: a comment on the next line belongs to the next field.
_COMMENT = re.compile(
    r"^[ \t]*[\w/<>=\[\]]+[ \t]+(?P<field>\w+)[ \t]*(?:=[^#\n]*)?#[ \t]*(?P<comment>.*?)[ \t\r]*$", re.MULTILINE
)
_IN_BRACKETS = re.compile(r"\[\s*([^\[\]]{1,30}?)\s*\]")
# A comment that is nothing but one of these is a unit; anything longer is prose and needs brackets.
_BARE_UNITS = frozenset(
    ["m/s^2", "m/s2", "m/s²", "m/s", "rad/s", "rad/s^2", "deg/s", "mm/s", "mm", "N", "V", "Pa", "Hz"]
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSource:
    """A channel and the way to its samples.

    Attributes
    ----------
    topic
        Topic of the log.
    field
        The channel's name after the topic, in the one spelling that lists use.
    channel
        What the samples are, in SI.
    factor
        Multiply what the message holds by it to get SI.
    selector
        Where the number stands in a message; None for a column of a batch message.
    column
        Index of the column of a batch message, or None.
    unread_unit
        What the log calls the unit, where that is none that can be read.
    """

    topic: str
    field: str
    channel: Channel
    factor: float
    selector: FieldSelector | None = None
    column: int | None = None
    unread_unit: str = ""


def channel_of(topic: Topic, *, name: str, field: str, leaf: str, unit: str | None) -> tuple[Channel, float, str]:
    """Describe a channel by what the log says of it.

    Parameters
    ----------
    topic
        Its topic, with metadata and schema.
    name
        The channel's name.
    field
        Its part after the topic, by which metadata knows it.
    leaf
        Leaf of the schema that holds its samples.
    unit
        Unit that the messages themselves give, or None.

    Returns
    -------
    channel
        In SI.
    factor
        From the unit of the log to SI.
    unread_unit
        As of `ChannelSource`.
    """
    factor, si_unit, unread = _si_unit(topic, field=field, leaf=leaf, unit=unit)
    said = topic.metadata
    overload = _number(said.get(f"chladni.overload.{field}"))
    role = said.get(f"chladni.role.{field}")
    channel = Channel(
        name=name,
        unit=si_unit,
        point=said.get(f"chladni.point.{field}"),
        direction=_direction(said.get(f"chladni.direction.{field}")),
        role="reference" if role == "reference" else "response" if role == "response" else likely_role(name, si_unit),
        overload=None if overload is None else overload * factor,
        units_possible=possible_units(topic.schema_name, leaf) if si_unit == UNKNOWN_UNIT else (),
        held=is_command(topic.schema_name),
    )
    return channel, factor, unread


def measured_fields(metadata: Mapping[str, str]) -> frozenset[str] | None:
    """Fields that the log's writer says were measured, all others being padding; None when it doesn't say."""
    listed = _json(metadata.get("chladni.fields"))
    if not isinstance(listed, list) or not all(isinstance(field, str) for field in listed):
        return None
    return frozenset(listed)


def _si_unit(topic: Topic, *, field: str, leaf: str, unit: str | None) -> tuple[float, str, str]:
    """First unit that is one, of the metadata, the message, the schema's comment, the type's documentation.

    With it the first label that is none.
    """
    ours, documented = topic.metadata.get(f"chladni.unit.{field}"), known_unit(topic.schema_name, leaf)
    in_comment, quantity = comment_units(topic.schema_text).get(leaf), documented or quantity_of_name(field)
    of_quantity, unread = partial(read_label, quantity=quantity), ""
    labels = ((topic.metadata.get("unit"), of_quantity), (unit, of_quantity), (in_comment, of_quantity))
    # A log may call its unit what it likes; what isn't understood is told, and never an error.
    for label, read in ((ours, si_factor), *labels):
        try:
            if label:
                return *read(label), unread
        except SetupError:
            # What stands in brackets in a comment may be anything.
            unread = unread or ("" if label is in_comment else str(label))
    return (1.0, UNKNOWN_UNIT, unread) if documented is None else (*si_factor(documented), unread)


# Asked for each field of a definition.
@lru_cache(maxsize=8)
def comment_units(schema_text: str) -> Mapping[str, str]:
    """Units in the comments of a ROS message definition's own fields: ``# [m/s^2]``, or a comment that is one.

    Examples
    --------
    >>> comment_units("float64 x # along the beam [mm]" + chr(10) + "float64 y # N" + chr(10) + "float64 z # left")
    {'x': 'mm', 'y': 'N'}
    """
    units = {}
    for found in _COMMENT.finditer(schema_text.split("\n====", maxsplit=1)[0]):
        in_brackets = _IN_BRACKETS.search(found["comment"])
        if in_brackets is not None:
            units[found["field"]] = in_brackets[1]
        elif found["comment"] in _BARE_UNITS:
            units[found["field"]] = found["comment"]
    return units


def _direction(text: str | None) -> Vector | None:
    listed = _json(text)
    if not isinstance(listed, list) or not all(isinstance(part, int | float) for part in listed):
        return None
    try:
        return unit_direction(listed)
    except SetupError:
        return None


def _number(text: str | None) -> float | None:
    number = None if text is None else number_in(text)
    return number if number is not None and isfinite(number) and number > 0 else None


def _json(text: str | None) -> object:
    if text is None or len(text) > 1 << 20:
        return None
    try:
        found: object = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return found
