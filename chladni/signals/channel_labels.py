"""Short labels of channels: what tables and pictures show, and what `places_of` takes in place of the name."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence

from chladni.signals.visible import visible

LONGEST_NAME = 48
_PIECE = re.compile(r"""(?:\[[^\]]*\]|\{[^}]*\}|"[^"]*"|'[^']*'|[^/.])+|[/.]""")
# Between words stands what is neither a letter nor a digit; an ending may begin with it, too.
BOUNDARY = r"(?:^|(?<=[\W_])|(?=[\W_]))"
_BOUNDARY = re.compile(BOUNDARY)


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Give every channel name a label as short as it can be without two channels sharing one.

    A label is the last part of the topic and the last field; where that is ambiguous, or how another name ends, all
    fields, then the whole name, then the whole name and a number. Characters that can't be seen are shown as escapes.

    Parameters
    ----------
    names
        Channel names; repeated ones count once.

    Returns
    -------
    dict
        Label of each name, all different, at most 48 characters and a number.

    Examples
    --------
    >>> list(short_names(["/imu/wrist.accel.linear.x", "/imu/base.accel.linear.x", "/f.force.z"]).values())
    ['wrist.x', 'base.x', 'f.z']
    """
    # In the order given, so that the same log always gets the same labels.
    pending = known = list(dict.fromkeys(names))
    labels: dict[str, str] = {}
    for shorten in (_leaf, _fields, _whole):
        candidates = {name: shorten(name) for name in pending}
        # Labels already given count too: a whole name may be the short form of another.
        uses = Counter([*candidates.values(), *labels.values()])
        if shorten is not _whole:
            uses += _endings_of_others(candidates, known)
        labels |= {name: label for name, label in candidates.items() if uses[label] == 1}
        pending = [name for name in pending if name not in labels]
    for number, name in enumerate(pending, start=2):
        labels[name] = f"{_whole(name)} #{number}"
    return labels


def is_short_for(label: str, name: str) -> bool:
    """Whether a label is a short form of a name, among whatever names it was made.

    Examples
    --------
    >>> is_short_for("base.x", "/imu/base.accel.x"), is_short_for("base.y", "/imu/base.accel.x")
    (True, False)
    """
    return any(shorten(name) == label for shorten in (_leaf, _fields, _whole))


def _endings_of_others(labels: dict[str, str], known: Sequence[str]) -> Counter[str]:
    """How many names end as a label of another does: such a label would be taken for that name's ending."""
    wanted, found = set(labels.values()), Counter[str]()
    for name in known:
        shown = visible(name)
        ends = {shown[place.start() :] for place in _BOUNDARY.finditer(shown)}
        found.update(wanted.intersection(ends) - {labels.get(name, "")})
    return found


def topic_of(name: str) -> str:
    """Topic that a name begins with: what stands before its fields; all of a name without fields.

    Examples
    --------
    >>> topic_of("/motor/force.value"), topic_of("tip")
    ('/motor/force', 'tip')
    """
    pieces, last_slash = _pieces(name)
    first_dot = next((place for place in range(last_slash + 1, len(pieces)) if pieces[place] == "."), len(pieces))
    return "".join(pieces[:first_dot])


def _pieces(name: str) -> tuple[list[str], int]:
    """Words and separators of a name, and the place of the last slash; -1 where there is none."""
    pieces = _PIECE.findall(name)
    return pieces, max((place for place, piece in enumerate(pieces) if piece == "/"), default=-1)


def _split(name: str) -> tuple[Sequence[str], Sequence[str]]:
    """Parts of the topic and fields after it; separators inside brackets, braces and quotes don't count."""
    pieces, last_slash = _pieces(name)
    after = [piece for piece in pieces[last_slash + 1 :] if piece != "."]
    before = [piece for piece in pieces[: max(last_slash, 0)] if piece not in "/."]
    return [*before, *after[:1]], after[1:]


def _leaf(name: str) -> str:
    topic, fields = _split(name)
    return _printable(".".join([*topic[-1:], *fields[-1:]]))


def _fields(name: str) -> str:
    topic, fields = _split(name)
    return _printable(".".join([*topic[-1:], *fields]))


def _whole(name: str) -> str:
    return _printable(name)


def _printable(text: str) -> str:
    shown = visible(text) or "(no name)"
    if len(shown) <= LONGEST_NAME:
        return shown
    # The end tells channels apart more often than the middle does.
    half = LONGEST_NAME // 2
    return f"{shown[: half - 1]}…{shown[-half:]}"
