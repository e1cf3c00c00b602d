"""Words for messages: the nearest name, and kinds of site as people say them."""

import re
from collections.abc import Iterable, Sequence

from chladni.models.core.port import PortKind
from chladni.signals.wording import near_words

# A catalogue is shown whole, a model's sites need not be.
MOST_NAMES = 30
# Short words are alike by chance.
LIKE_A_WORD, MOST_LIKE = 0.8, 3

_SPOKEN: dict[PortKind, str] = {
    "joint": "a joint",
    "body": "a body",
    "ground": "the ground",
    "input": "an input",
    "actuation": "the place of an input",
    "output": "an output",
    "pair": "a pair of bodies such as ground~arm",
    "output_pair": "a pair of outputs such as left~right",
}


def nearest(name: str, known: Iterable[str], what: str) -> str:
    """Give ``did you mean ...?`` when a known name, or a word in it, is near, else (the first of) all of them.

    Examples
    --------
    >>> effects = ["coulomb_friction", "stribeck_friction", "delay"]
    >>> nearest("coulomb_fricton", effects, "effects"), nearest("frictoin", effects, "effects")
    ('did you mean coulomb_friction?', 'did you mean coulomb_friction or stribeck_friction?')
    >>> nearest("magnet", effects, "effects")
    'effects: coulomb_friction, stribeck_friction, delay'
    """
    names = list(dict.fromkeys(known))
    near = near_words(name, names) or _with_a_word_like(name, names)
    if near:
        return f"did you mean {' or '.join(near)}?"
    more = ", ..." if len(names) > MOST_NAMES else ""
    return f"{what}: {', '.join(names[:MOST_NAMES]) or 'none'}{more}"


def _with_a_word_like(name: str, names: Sequence[str]) -> list[str]:
    """Names that hold the word nearest to `name`: ``friction`` alone is far from ``coulomb_friction`` as a whole."""
    words = {one: re.split(r"[_.]", one) for one in names}
    every = list(dict.fromkeys(word for parts in words.values() for word in parts))
    near = near_words(name, every, cutoff=LIKE_A_WORD)
    holders = [one for one, parts in words.items() if near and near[0] in parts]
    # A word that many share, such as a body's in the names of its parameters, tells nothing.
    return holders if len(holders) <= MOST_LIKE else []


def spoken(kinds: Iterable[PortKind]) -> str:
    """Give kinds of site in words: ``a joint or an input``."""
    return " or ".join(_SPOKEN[kind] for kind in kinds)
