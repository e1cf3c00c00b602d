"""How many cases of which kind a campaign has, and which effects they hide."""

import re
from collections.abc import Mapping, Sequence
from itertools import cycle, islice
from typing import get_args

import numpy as np

from chladni.gap.blind.body_drafts import BODY_DRAFTS
from chladni.gap.blind.case_draw import Kind, Order
from chladni.gap.blind.joint_drafts import JOINT_DRAFTS
from chladni.gap.blind.signal_drafts import INPUT_DRAFTS, OUTPUT_DRAFTS
from chladni.gap.blind.vocabulary import OUTSIDE, WORDS
from chladni.signals.errors import SetupError

#: Cases of each kind in two hundred. A share of 5 % can't be told of fewer than twenty pairs, or faint effects.
DEFAULT: Mapping[Kind, int] = {
    "effect": 78, "none": 52, "parameters": 8, "two": 20, "faint": 20, "leave_out": 14, "outside": 8,
}  # fmt: skip
#: Share of cases whose noise is coloured; of those without an effect it's half, exactly.
_COLOURED = 0.4
#: Share of ordinary cases that leave words out too, so that the list tells nothing.
_DECOYS = 0.25


def composition_of(texts: Sequence[str]) -> dict[Kind, int]:
    """Read a composition from ``KIND=N`` each, such as ``two=20``, in any order; `DEFAULT` of none.

    Raises
    ------
    SetupError
        When one isn't of that form, names no kind, or asks for none of a kind.
    """
    asked: dict[Kind, int] = {}
    for text in texts:
        name, _, number = text.partition("=")
        kind = next((one for one in get_args(Kind) if one == name.strip()), None)
        if kind is None:
            raise SetupError(f"{text!r:.60} names no kind of case; there are {', '.join(get_args(Kind))}")
        if not re.fullmatch("[1-9][0-9]{0,5}", number.strip()):
            raise SetupError(f"{text!r:.60} must be of the form {kind}=N, with N from 1 to 999999")
        asked[kind] = int(number)
    # What is drawn follows the order of kinds: that of the words must not make another campaign.
    return {kind: asked[kind] for kind in get_args(Kind) if kind in asked} or dict(DEFAULT)


def counts(count: int, composition: Mapping[Kind, int] = DEFAULT) -> dict[Kind, int]:
    """Share `count` cases out in the proportions of `composition`, by largest remainders.

    Examples
    --------
    >>> counts(10, {"effect": 2, "none": 1})
    {'effect': 7, 'none': 3}
    """
    if count < 1:
        raise SetupError(f"count {count} must be at least 1")
    total = sum(composition.values())
    exact = {kind: count * share / total for kind, share in composition.items()}
    whole = {kind: int(share) for kind, share in exact.items()}
    for kind in sorted(exact, key=lambda one: whole[one] - exact[one])[: count - sum(whole.values())]:
        whole[kind] += 1
    return whole


def orders(count: int, rng: np.random.Generator, composition: Mapping[Kind, int] = DEFAULT) -> list[Order]:
    """Give the orders of a campaign, in random order; every word comes up about equally often."""
    made: list[Order] = []
    for kind, number in counts(count, composition).items():
        drawn = _words(kind, number, rng)
        for place, words in enumerate(drawn):
            # Every other case without an effect is coloured, the others by chance.
            coloured = place % 2 == 1 if kind in ("none", "parameters") else bool(rng.random() < _COLOURED)
            made.append(Order(kind=kind, words=words, coloured=coloured, leave_out=_left_out(kind, words, rng)))
    return [made[place] for place in rng.permutation(len(made))]


def _words(kind: Kind, number: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    if kind in ("none", "parameters"):
        return [()] * number
    if kind == "two":
        return [_pair(place, rng) for place in range(number)]
    if kind == "three":
        return [_triple(rng) for _ in range(number)]
    words = tuple(OUTSIDE) if kind == "outside" else WORDS
    # A new order for each round, so that a short campaign doesn't always hold the same words.
    rounds = (str(word) for _ in cycle([0]) for word in rng.permutation(words))
    return [(word,) for word in islice(rounds, number)]


def _pair(place: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Two joints, or a joint, body or input and a sensor."""
    if place % 3 == 0:
        joints = list(JOINT_DRAFTS)
        return str(rng.choice(joints)), str(rng.choice(joints))
    return _acting_and_sensor(rng)


def _acting_and_sensor(rng: np.random.Generator) -> tuple[str, str]:
    acting = [*JOINT_DRAFTS, *BODY_DRAFTS, *(word for word in INPUT_DRAFTS if word not in ("ripple", "gain_error"))]
    acting.remove("tonal_disturbance")
    return str(rng.choice(acting)), str(rng.choice([word for word in OUTPUT_DRAFTS if word != "tonal_disturbance"]))


def _triple(rng: np.random.Generator) -> tuple[str, ...]:
    """A joint, body or input, and a sensor, with another joint."""
    return (*_acting_and_sensor(rng), str(rng.choice(list(JOINT_DRAFTS))))


def _left_out(kind: Kind, words: tuple[str, ...], rng: np.random.Generator) -> tuple[str, ...]:
    others = [word for word in WORDS if word not in words]
    decoy = (str(rng.choice(others)),) if rng.random() < _DECOYS else ()
    return (*(words if kind == "leave_out" else ()), *decoy)
