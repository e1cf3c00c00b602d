"""All words for robots at all sites."""

from collections.abc import Callable, Iterator

from chladni.gap.robots.body_words import bodies, readings
from chladni.gap.robots.drive_words import drives
from chladni.gap.robots.joint_words import coupled, friction, inertia, ripple, springs
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import Torques
from chladni.gap.robots.transmission_words import transmissions

_MAKERS: tuple[Callable[[Torques], Iterator[Term]], ...] = (
    friction, coupled, springs, inertia, transmissions, drives, readings, bodies, ripple,
)  # fmt: skip


def all_terms(torques: Torques) -> list[Term]:
    """Give every word at every site of a robot."""
    return [term for make in _MAKERS for term in make(torques)]
