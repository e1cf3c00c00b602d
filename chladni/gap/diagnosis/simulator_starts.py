"""Values that a search starts from, for any effect at any site: from its parameters' units and the signals there."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import pi
from typing import Literal

from chladni.models.core.parameter import Parameter
from chladni.models.effects.attached_effect import AttachedEffect, attached_if_possible
from chladni.models.effects.effect_kind import EffectKind, Variant

SiteKind = Literal["input", "output", "joint"]
_UNIT = re.compile(r"(N|m|s|rad|kg)(?:\^(\d))?")


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteScales:
    """What is large and small at a site.

    Attributes
    ----------
    name, kind
        The site.
    amplitude
        Peak of the signal at an input or output; displacement (RMS) at a joint.
    rate
        Largest rate of the signal; velocity (RMS) at a joint.
    force
        At a joint: friction of this size changes the outputs by about as much as they are off.
    tone_hz
        Strongest line of what is missed at an output.
    interval_s, duration_s
        Between samples, and of the log.
    """

    name: str
    kind: SiteKind
    amplitude: float
    rate: float
    force: float
    tone_hz: float
    interval_s: float
    duration_s: float


def starts(kind: EffectKind, variant: Variant, site: SiteScales, others: Sequence[str]) -> Iterator[AttachedEffect]:
    """Give the effect with every combination of values worth trying.

    Parameters
    ----------
    others
        Names of the other outputs, for an effect that listens to one.
    """
    parameters = kind.parameters_of(variant.name)
    strengths = [name for name in kind.required if name in kind.neutral]
    grids: dict[str, tuple[float, ...]] = {}
    for name, parameter in parameters.items():
        if name in kind.optional and parameter.unit != "rad" and parameter.role == "construction":
            continue
        own = name not in kind.parameters
        rank = strengths.index(name) if name in strengths else None
        found = (
            _of_joint(parameter, site, rank, own=own)
            if site.kind == "joint"
            else _of_signal(parameter, site, kind.neutral.get(name), own=own)
        )
        allowed = tuple(value for value in found if parameter.minimum <= value <= parameter.maximum)
        grids[name] = allowed or (parameter.value,)
    sources: Sequence[str | None] = others if kind.needs_source else (None,)
    for source, numbers in product(sources, product(*grids.values())):
        values = dict(zip(grids, numbers, strict=True))
        # A combination that contradicts itself is none to try.
        effect = attached_if_possible(kind, site.name, values, variant=variant.name, source=source)
        if effect is not None:
            yield effect


def _of_joint(parameter: Parameter, site: SiteScales, rank: int | None, *, own: bool) -> tuple[float, ...]:
    """Values of a law of force; `rank` counts the strengths, `own` says that only this variant has the number."""
    unit = parameter.unit
    if parameter.role == "function":
        return (1.0, -1.0)
    if unit == "rad":
        return (0.0, pi / 2)
    if unit == "1":
        return (parameter.value, -parameter.value) if rank is not None else (parameter.value,)
    if unit == "s":
        return (0.3 * site.duration_s, 0.7 * site.duration_s) if not own else (0.02 * site.duration_s,)
    scale = _scale(unit, site)
    if own:
        return (0.02 * scale,)
    if rank is not None:
        # A law with two strengths wants the second above the first: sticking above sliding.
        sign = -1.0 if parameter.maximum <= 0 else 1.0
        return tuple(sign * share * scale * (1.0 + 0.6 * rank) for share in ((1.0,) if "N" in unit else (0.2, 1.0)))
    # A yield or a period beyond the motion is no shape of its own: the law is a spring or a constant there.
    return (0.05 * scale, 0.3 * scale) if parameter.minimum >= 0 else (0.05 * scale, 0.3 * scale, 1.0 * scale)


def _of_signal(parameter: Parameter, site: SiteScales, neutral: float | None, *, own: bool) -> tuple[float, ...]:
    """Values of what a signal passes."""
    unit = parameter.unit
    if unit == "rad":
        return (0.0, pi / 2)
    if unit == "1":
        return (parameter.value,) if neutral is None or own else (neutral + 0.1,)
    if unit == "s":
        return (0.5 * site.interval_s, 2.0 * site.interval_s, 8.0 * site.interval_s)
    if unit == "Hz" and neutral is None:
        return (site.tone_hz,)
    if unit == "Hz":
        # Corners of high-passes do nothing at 0, resonances nothing at infinity.
        return (0.2, 1.0, 5.0) if neutral == 0 else tuple(share / site.interval_s for share in (0.05, 0.15, 0.3))
    largest = site.rate if unit.endswith("/s") else site.amplitude
    return (0.1 * largest, 0.3 * largest, 0.7 * largest)


def _scale(unit: str, site: SiteScales) -> float:
    """Size of a quantity at a joint, from the joint's own force, displacement and velocity.

    Examples
    --------
    >>> site = SiteScales(name="j", kind="joint", amplitude=0.5, rate=2.0, force=3.0, tone_hz=1.0, interval_s=0.01,
    ...     duration_s=9.0)
    >>> _scale("N s^2/m^2", site), _scale("m", site)
    (0.75, 0.5)
    """
    sizes = {"N": site.force, "m": site.amplitude, "rad": site.amplitude, "s": site.amplitude / site.rate, "kg": 1.0}
    above, _, below = unit.partition("/")
    size = 1.0
    for text, sign in ((above, 1), (below, -1)):
        for name, power in _UNIT.findall(text):
            size *= sizes[name] ** (sign * int(power or 1))
    return float(size)
