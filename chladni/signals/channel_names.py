"""Which channels a word names: a name, the ending or label of one, or a pattern; the one place that decides."""

import re
from collections.abc import Sequence

from chladni.signals.channel_labels import BOUNDARY, is_short_for, short_names, topic_of
from chladni.signals.errors import EstimateError
from chladni.signals.visible import place_of, visible
from chladni.signals.wording import near_matches, near_words

# As many as one reads to find the one that was meant.
MOST_CANDIDATES = 8


def is_pattern(word: str) -> bool:
    """Whether a word is a pattern: ``*`` stands for any characters, ``?`` for one.

    Examples
    --------
    >>> is_pattern("*/accel.x"), is_pattern("/imu.accel[0]")
    (True, False)
    """
    return "*" in word or "?" in word


def places_of(word: str, known: Sequence[str], *, role: str = "channel") -> tuple[int, ...]:
    """Give the places of the names that a word means.

    Parameters
    ----------
    word
        A name as it is or as it's shown; else an ending of one name alone, which begins where a word begins; else the
        label of one, see `short_names`; else an ending of the one topic that has one channel; else a pattern of whole
        names or such endings, which may mean several.
    known
        Names there are.
    role
        What they're called in messages, such as ``response``.

    Returns
    -------
    tuple of int
        In their order; empty when no name is meant.

    Raises
    ------
    EstimateError
        When several names end so, or have such a label; they're told.

    Examples
    --------
    >>> names = ["/a/imu.accel.x", "/a/imu.accel.y", "/b/wing_rail.x"]
    >>> places_of("rail.x", names), places_of("accel.y", names), places_of("*.x", names), places_of("ail.x", names)
    ((2,), (1,), (0, 2), ())
    >>> places_of("force", ["/motor/force.value", "/motor/current.value"])
    (0,)
    >>> places_of("base.x", ["/imu/base.accel.linear.x", "/imu/wrist.accel.linear.x"])
    (0,)
    """
    if (place := place_of(word, known)) is not None:
        return (place,)
    told = visible(word)
    ending = re.compile(BOUNDARY + (_expression(told) if is_pattern(told) else re.escape(told)) + r"\Z", re.DOTALL)
    found = tuple(place for place, name in enumerate(known) if word and ending.search(visible(name)))
    if len(found) == 1 or is_pattern(word) or not word:
        return found
    labels = short_names(known)
    if labelled := [place for place, name in enumerate(known) if labels[name] == told]:
        return tuple(labelled[:1])
    if found:
        raise EstimateError(
            f"{word!r} is the end of {len(found)} {role}s: {_some([known[place] for place in found])}; "
            f"give more of one name, or '*{word}' for all of them"
        )
    # Among fewer channels a shorter label was enough.
    found = tuple(place for place, name in enumerate(known) if is_short_for(told, name))
    if len(found) > 1:
        raise EstimateError(
            f"{word!r} is short for {len(found)} {role}s: {_some([known[place] for place in found])}; "
            f"give one as it is listed here"
        )
    return found or _only_of_topic(told, known)


def _only_of_topic(word: str, known: Sequence[str]) -> tuple[int, ...]:
    """Give the place of the one channel of the one topic that ends so, as ``/force`` has ``/force.value`` alone."""
    topics = [visible(topic_of(name)) for name in known]
    ending = re.compile(BOUNDARY + re.escape(word) + r"\Z")
    found = [place for place, topic in enumerate(topics) if ending.search(topic)]
    return tuple(found) if len(found) == 1 else ()


def unknown(word: str, known: Sequence[str], *, role: str = "channel") -> str:
    """Say that no channel is called so, and which there are.

    Examples
    --------
    >>> unknown("q", ["a", "b"])
    "no channel 'q'; there are: a, b"
    """
    inside = [name for name in known if word and visible(word) in visible(name)]
    if not inside or near_words(word, dict.fromkeys(known)):
        return f"no {role} {word!r}; {near_matches(word, known)}"
    all_of_them = f"; '*{word}*' means all of them" if len(inside) > 1 and not is_pattern(word) else ""
    held = "1 name holds" if len(inside) == 1 else f"{len(inside)} names hold"
    return f"no {role} {word!r}; {held} that: {_some(inside)}{all_of_them}"


def require_one(word: str, places: Sequence[int], known: Sequence[str], *, role: str = "channel") -> int:
    """Give the only place, where one channel is needed.

    Raises
    ------
    EstimateError
        When a pattern means several.
    """
    if len(places) > 1:
        raise EstimateError(
            f"{word!r} means {len(places)} {role}s: {_some([known[place] for place in places])}; name one"
        )
    return places[0]


def _expression(word: str) -> str:
    """Write a word as a regular expression; what a ``*`` before another one took isn't taken back (as `fnmatch`)."""
    first, *rest = (re.escape(part).replace(r"\?", ".") for part in re.split(r"\*+", word))
    if not rest:
        return first
    return first + "".join(f"(?>.*?{part})" for part in rest[:-1]) + f".*{rest[-1]}"


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_CANDIDATES} more" if len(names) > MOST_CANDIDATES else ""
    return f"{', '.join(map(visible, names[:MOST_CANDIDATES]))}{more}"
