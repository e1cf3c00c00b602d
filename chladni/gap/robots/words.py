"""All words for robots at all sites."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from chladni.gap.records.diagnosis import PARAMETER
from chladni.gap.robots.coupling_words import couplings
from chladni.gap.robots.drive_words import delays, drives
from chladni.gap.robots.joint_words import bristles, friction, inertia, ripple, springs
from chladni.gap.robots.payload_words import bodies, payloads, readings
from chladni.gap.robots.term import Form, Term
from chladni.gap.robots.torques import FormKey, Torques
from chladni.gap.robots.transmission_words import transmissions

Maker = Callable[[Torques], Iterator[Term]]
#: What makes which words: columns that stay as they are, and those that are made anew for what was found.
_LASTING: Mapping[Maker, tuple[str, ...]] = {
    friction: ("coulomb_friction", "viscous_friction", "quadratic_damping", "load_friction", "stribeck_friction",
               "hysteresis"),
    couplings: ("coulomb_friction", "viscous_friction", "joint_spring"),
    springs: ("joint_spring", "one_sided_stop"),
    inertia: ("armature",),
    transmissions: ("joint_elasticity", "backlash"),
    drives: ("gain_error", "saturation", "dead_zone", "lag", "rate_limit", "controller_gain"),
    bodies: ("gravity_tilt", "misalignment", PARAMETER),
}  # fmt: skip
_MADE_ANEW: Mapping[Maker, tuple[str, ...]] = {
    bristles: ("stribeck_friction",),
    readings: ("encoder_offset",),
    payloads: ("payload",),
    delays: ("delay",),
    ripple: ("ripple",),
}
#: Words of robots beside those of effects.md.
ROBOT_WORDS = tuple(
    sorted({word for made in (_LASTING, _MADE_ANEW) for words in made.values() for word in words} - {PARAMETER})
)


def all_terms(torques: Torques, left_out: frozenset[str] = frozenset()) -> list[Term]:
    """Give the words that take part at every site of a robot, and laws with the forms that were found.

    Parameters
    ----------
    left_out
        Words, and words at a site as ``word@site``, that don't take part.
    """
    key = f"terms without {sorted(left_out)}"
    if key not in torques.memory:
        torques.memory[key] = _made(_LASTING, torques, left_out)
    terms = [*torques.memory[key], *_made(_MADE_ANEW, torques, left_out)]
    found = [_found(terms, form, value) for form, value in torques.guesses.forms.items()]
    return [*terms, *(one for one in found if one is not None)]


def _made(makers: Mapping[Maker, tuple[str, ...]], torques: Torques, left_out: frozenset[str]) -> list[Term]:
    takes_part = [make for make, words in makers.items() if not left_out.issuperset(words)]
    return [
        term
        for make in takes_part
        for term in make(torques)
        if left_out.isdisjoint((term.word, f"{term.word}@{term.site}"))
    ]


def _found(terms: list[Term], key: FormKey, value: float) -> Term | None:
    forms: list[Form] = [
        term.form for term in terms if term.form is not None and (term.word, term.site, term.variant) == key
    ]
    if not forms:
        return None
    near = min(forms, key=lambda one: abs(one.value - value))
    return replace(near, low=min(near.low, value), high=max(near.high, value)).at(value)
