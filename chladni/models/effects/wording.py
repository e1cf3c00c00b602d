"""Words for messages: the nearest name, and kinds of site as people say them."""

from collections.abc import Iterable
from difflib import get_close_matches

from chladni.models.core.port import PortKind

_SPOKEN: dict[PortKind, str] = {
    "joint": "a joint",
    "body": "a body",
    "ground": "the ground",
    "input": "an input",
    "actuation": "the place of an input",
    "output": "an output",
}


def nearest(name: str, known: Iterable[str], what: str) -> str:
    """Give ``did you mean ...?`` when one of the known names is near, else all of them."""
    names = list(dict.fromkeys(known))
    near = get_close_matches(name, names, n=1)
    return f"did you mean {near[0]}?" if near else f"{what}: {', '.join(names) or 'none'}"


def spoken(kinds: Iterable[PortKind]) -> str:
    """Give kinds of site in words: ``a joint or an input``."""
    return " or ".join(_SPOKEN[kind] for kind in kinds)
