"""Message paths: how a number inside the messages of a topic is named, in Foxglove's syntax."""

import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from math import isnan
from typing import Literal

from chladni.signals.errors import LogError
from chladni.signals.text_reading import real_number
from chladni.signals.visible import as_meant
from chladni.signals.wording import near_matches

Operator = Literal["==", "!=", "<", "<=", ">", ">="]
FilterValue = str | float | bool

_NAME = re.compile(r'\.(?:"((?:[^"\\]|\\.)*)"|([^.\[\]{}"\s]+))')
_BRACKET = re.compile(r'\[\s*(?:([0-9]+)|(:)|"((?:[^"\\]|\\.)*)"|([^\[\]:"\s-][^\[\]:"]*?))\s*\]')
_FILTER = re.compile(
    r"""\{\s*(?P<field>[^\s=!<>{}"']+)\s*(?P<operator>==|!=|<=|>=|<|>)\s*"""
    r"""(?:"(?P<double>(?:[^"\\]|\\.)*)"|'(?P<single>(?:[^'\\]|\\.)*)'|(?P<bare>[^\s{}"']+))\s*\}"""
)
_INDEX_DIGITS = 18
"""Digits of an index that 64 bits hold."""

# Not with a backslash, which only begins an escape outside quotes: a name that holds one stands in quotes.
_PLAIN_NAME = re.compile(r'(?!@)[^.\[\]{}"\s\\]+')


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldStep:
    """Go into the field called `name`."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class IndexStep:
    """Take element `index` of an array, from 0; None stands for ``[:]``, all that the filter behind it lets pass."""

    index: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyStep:
    """Take the element of an array that the names beside it call `name` (our extension, for JointState)."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterStep:
    """Keep messages (or, after an array, elements) whose field compares true.

    Attributes
    ----------
    field
        Field names joined by dots, relative to what the filter follows.
    operator
        How the field is compared with `value`.
    value
        Text, number or truth value.
    """

    field: str
    operator: Operator
    value: FilterValue


Step = FieldStep | IndexStep | KeyStep | FilterStep


@dataclass(frozen=True, slots=True, kw_only=True)
class MessagePath:
    r"""A topic and the steps from its message down to one number.

    Attributes
    ----------
    text
        The path as it was written, escapes such as ``\x1b`` taken for the characters that they show.
    topic
        Topic of the log.
    steps
        From the message down.
    """

    text: str
    topic: str
    steps: tuple[Step, ...]

    @property
    def rest(self) -> str:
        """What follows the topic, without the dot."""
        return self.text[_length_of(self.topic, self.text) :].removeprefix(".")


def parse_message_path(text: str, topics: Collection[str]) -> MessagePath:
    """Split a path into topic and steps.

    Parameters
    ----------
    text
        Such as ``/imu/wrist.linear_acceleration.x``, ``/axis.position[0]``, ``/joints.position[elbow]``,
        ``/log{name=="a"}.value`` or ``/tf.transforms[:]{child_frame_id=="tip"}.transform.translation.x``.
        What `chladni.signals.visible.visible` shows of a path is read as the path.
    topics
        Topics of the log; the longest one that the path starts with is meant, since topics may hold dots.

    Raises
    ------
    LogError
        When no topic matches (near ones are named), or the rest isn't a path (the place is named).

    Examples
    --------
    >>> parse_message_path("/a.b.c", ["/a", "/a.b"]).topic
    '/a.b'
    >>> parse_message_path("/a.x[2]", ["/a"]).steps
    (FieldStep(name='x'), IndexStep(index=2))
    """
    text = as_meant(text)
    topic, position = _topic_of(text, topics)
    steps: list[Step] = []
    while position < len(text):
        step, position = _next_step(text, position)
        steps.append(step)
    return MessagePath(text=text, topic=topic, steps=tuple(steps))


def starts_with_topic(text: str, topics: Collection[str]) -> bool:
    """Whether a path begins with one of the log's topics.

    Examples
    --------
    >>> starts_with_topic("/imu.x", ["/imu"]), starts_with_topic("imu.x", ["/imu"])
    (True, False)
    """
    return any(_length_of(topic, as_meant(text)) is not None for topic in topics)


def quoted(name: str) -> str:
    r"""Write a field or column name so that it parses back to itself.

    Examples
    --------
    >>> quoted("ch1"), quoted("top floor")
    ('ch1', '"top floor"')
    """
    return name if _PLAIN_NAME.fullmatch(name) else in_quotes(name)


def topic_text(topic: str) -> str:
    r"""Write a topic as paths begin with it: as it is, unless a backslash in it could be taken for an escape.

    Examples
    --------
    >>> topic_text("/imu"), topic_text(r"/imu\x1b")
    ('/imu', '"/imu\\\\x1b"')
    """
    return in_quotes(topic) if "\\" in topic else topic


def element_text(name: str) -> str:
    r"""Write the brackets that choose an element by its name; in quotes where they would mean something else.

    Examples
    --------
    >>> element_text("elbow"), element_text("3"), element_text("a]")
    ('[elbow]', '["3"]', '["a]"]')
    """
    bare = _BRACKET.fullmatch(f"[{name}]")
    return f"[{name}]" if bare and bare[4] == name and "\\" not in name else f"[{in_quotes(name)}]"


def in_quotes(name: str) -> str:
    """Write a name or a text in quotes, as paths read it."""
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _topic_of(text: str, topics: Collection[str]) -> tuple[str, int]:
    for topic in sorted(topics, key=len, reverse=True):
        if (length := _length_of(topic, text)) is not None:
            return topic, length
    wanted = re.split(r"[.\[{]", text, maxsplit=1)[0]
    raise LogError(
        f"{text!r}: no topic of the log starts this path; {near_matches(wanted, [*map(topic_text, topics)])}"
    )


def starts(topic: str, text: str) -> bool:
    """Whether a topic starts a path.

    Examples
    --------
    >>> starts("/arm", "/arm.velocity[0]"), starts("/arm", "/arm2.velocity[0]")
    (True, False)
    """
    return _length_of(topic, text) is not None


def _length_of(topic: str, text: str) -> int | None:
    """How much of a path is its topic, as it is or in quotes; None where it's another one."""
    for written in (topic, quoted(topic), in_quotes(topic)):
        if text.startswith(written) and text[len(written) : len(written) + 1] in ("", ".", "[", "{"):
            return len(written)
    return None


def _next_step(text: str, position: int) -> tuple[Step, int]:
    if found := _NAME.match(text, position):
        name = found[2] if found[1] is None else _unescaped(found[1])
        if found[1] is None and name.startswith("@"):
            raise LogError(f"{text!r}: functions such as .{name} aren't supported in a path; name the field itself")
        return FieldStep(name=name), found.end()
    if found := _BRACKET.match(text, position):
        return _bracket_step(text, found), found.end()
    if found := _FILTER.match(text, position):
        return _filter_step(text, found), found.end()
    raise LogError(
        f"{text!r}: {text[position:]!r} isn't understood; after the topic a path has .field, [index], [name] "
        'or {field=="value"} (one comparison a filter; no slices, no variables)'
    )


def _bracket_step(text: str, found: re.Match[str]) -> Step:
    index, everything, named, bare = found.groups()
    if index is not None:
        if len(index) > _INDEX_DIGITS:
            raise LogError(f"{text!r}: no array has an element {index[:20]}...")
        return IndexStep(index=int(index))
    if everything is not None:
        return IndexStep(index=None)
    return KeyStep(name=bare if named is None else _unescaped(named))


def _filter_step(text: str, found: re.Match[str]) -> FilterStep:
    operator: Operator = found["operator"]  # type: ignore[assignment]  # the pattern admits only these
    return FilterStep(field=found["field"], operator=operator, value=_filter_value(text, found))


def _filter_value(text: str, found: re.Match[str]) -> FilterValue:
    for group in ("double", "single"):
        if found[group] is not None:
            return _unescaped(found[group])
    bare = found["bare"]
    if bare in ("true", "false"):
        return bare == "true"
    with suppress(ValueError):
        number = real_number(bare)
        # Nothing compares with what is no number, and no message would be left.
        if not isnan(number):
            return number
    raise LogError(f"{text!r}: {bare!r} in the filter is neither a number nor true or false; put text into quotes")


def _unescaped(text: str) -> str:
    return re.sub(r"\\(.)", r"\1", text)
