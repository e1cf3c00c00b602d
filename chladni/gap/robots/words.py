"""All words for robots at all sites."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from chladni.gap.robots.body_words import bodies, payloads, readings
from chladni.gap.robots.drive_words import delays, drives
from chladni.gap.robots.joint_words import coupled, friction, inertia, ripple, springs
from chladni.gap.robots.term import Form, Term
from chladni.gap.robots.torques import FormKey, Torques
from chladni.gap.robots.transmission_words import transmissions

Maker = Callable[[Torques], Iterator[Term]]
#: Words whose columns stay as they are, and those that are made anew for what was found.
_LASTING: tuple[Maker, ...] = (friction, coupled, springs, inertia, transmissions, drives, bodies)
_MADE_ANEW: tuple[Maker, ...] = (readings, payloads, delays, ripple)


def all_terms(torques: Torques) -> list[Term]:
    """Give every word at every site of a robot, and laws with the forms that were found."""
    if "terms" not in torques.memory:
        torques.memory["terms"] = [term for make in _LASTING for term in make(torques)]
    terms = [*torques.memory["terms"], *(term for make in _MADE_ANEW for term in make(torques))]
    found = [_found(terms, key, value) for key, value in torques.guesses.forms.items()]
    return [*terms, *(one for one in found if one is not None)]


def _found(terms: list[Term], key: FormKey, value: float) -> Term | None:
    forms: list[Form] = [
        term.form for term in terms if term.form is not None and (term.word, term.site, term.variant) == key
    ]
    if not forms:
        return None
    near = min(forms, key=lambda one: abs(one.value - value))
    return replace(near, low=min(near.low, value), high=max(near.high, value)).at(value)
