"""Trials at a site: every effect that may act there, with the force that it would give along the recovered motion."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import TAIL, ZERO
from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.law_trials import trials_of
from chladni.models.effects.trial import Trial, TrialMotion


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteTrial:
    """One form of an effect at one site; `kind` is None of a law that has no name."""

    kind: EffectKind | None = None
    site: Site
    form: Trial

    @property
    def effect(self) -> str:
        """The word."""
        return self.kind.name if self.kind is not None else ""


def trials_at(
    problem: LinearProblem,
    measurement: Measurement,
    motion: Recovered,
    band_hz: tuple[float, float],
    kinds: Iterable[EffectKind],
) -> Iterator[SiteTrial]:
    """Give the trials of a motion's site.

    Parameters
    ----------
    measurement
        What sensors showed in all, even where the problem is of a part of it.
    band_hz
        Where the excitation has power.
    """
    site = motion.site
    known = TrialMotion(
        name=site.name,
        kind=site.kind,
        compiled=problem.view(np.zeros(len(problem.tunables.names))).compiled,
        force=motion.force,
        displacement=motion.displacement,
        velocity=motion.velocity,
        sample_rate_hz=motion.lines.sample_rate_hz,
        frequency_hz=motion.lines.frequency_hz,
        believed=motion.believed,
        spectrum=motion.spectrum,
        band_hz=band_hz,
        outputs=dict(zip(measurement.output_names, measurement.outputs, strict=True)),
        position_at=lambda port: motion.position_at(problem, port),
    )
    for kind in kinds:
        if site.kind in kind.sites:
            yield from (SiteTrial(kind=kind, site=site, form=form) for form in trials_of(kind, known))


def excited_band_hz(measurement: Measurement) -> tuple[float, float]:
    """Give the lowest and highest frequency of the band that holds 99 % of the outputs' power."""
    signals = measurement.outputs / np.maximum(np.std(measurement.outputs, axis=1, keepdims=True), ZERO)
    power = np.sum(np.abs(np.fft.rfft(signals - signals.mean(axis=1, keepdims=True), axis=1)) ** 2, axis=0)
    total = np.cumsum(power) / max(float(power.sum()), ZERO)
    low, high = np.searchsorted(total, (TAIL, 1 - TAIL))
    step = measurement.sample_rate_hz / measurement.samples
    return float(max(low, 1) * step), float(max(high, 2) * step)
