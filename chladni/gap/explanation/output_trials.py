"""Trials at outputs: what a sensor does to the signal."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.explanation.body_trials import tone_trials
from chladni.gap.explanation.trial import Force, Shape, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered
from chladni.gap.records.measurement import Measurement


def output_trials(motion: Recovered, measurement: Measurement) -> Iterator[Trial]:
    """Give the effects that act at an output, along the signal that the other sensors say it should have seen."""
    spectrum = motion.spectrum(motion.displacement)
    yield Trial(
        effect="gain_error", site=motion.site, build=lambda _: Force.of(spectrum),
        values=lambda _, a: {"gain": 1.0 + float(a[0])}, parameters=1,
    )  # fmt: skip
    yield from _filters(motion)
    yield from _clipping(motion, measurement)
    yield from _cross_axes(motion, measurement)
    yield from tone_trials(motion)


def _filters(motion: Recovered) -> Iterator[Trial]:
    y, s, site, rate = motion.spectrum(motion.displacement), motion.s, motion.site, motion.lines.sample_rate_hz
    offsets = (np.geomspace(0.03, 60.0, 24) / rate).tolist()
    for sign in (1.0, -1.0):
        yield Trial(
            effect="time_offset", site=site,
            build=lambda shape, sign=sign: Force.known(y * np.expm1(-s * sign * numbers(shape)[0])),  # type: ignore[misc]
            values=lambda shape, _, sign=sign: {"offset": sign * numbers(shape)[0]},  # type: ignore[misc]
            grid=logarithms(offsets), parameters=1,
        )  # fmt: skip

    def coupled(shape: Shape) -> Force:
        omega = 2 * np.pi * numbers(shape)[0]
        return Force.known(-y * omega / (s + omega))

    def ride(shape: Shape) -> Force:
        frequency, damping = numbers(shape)
        omega = 2 * np.pi * frequency
        return Force.known(y * (omega**2 / (s**2 + 2 * damping * omega * s + omega**2) - 1))

    yield Trial(
        effect="ac_coupling", site=site, build=coupled,
        grid=logarithms(np.geomspace(5e-4 * rate, 0.15 * rate, 20).tolist()),
        values=lambda shape, _: {"corner": numbers(shape)[0]}, parameters=1,
    )  # fmt: skip
    yield Trial(
        effect="mounting_resonance", site=site, build=ride,
        grid=logarithms(np.geomspace(0.02 * rate, 2.0 * rate, 30).tolist(), (0.02, 0.1, 0.4)),
        values=lambda shape, _: {"frequency": numbers(shape)[0], "damping_ratio": numbers(shape)[1]}, parameters=2,
    )  # fmt: skip


def _clipping(motion: Recovered, measurement: Measurement) -> Iterator[Trial]:
    y = motion.displacement
    measured = measurement.outputs[measurement.output_names.index(motion.site.name)]
    # A sensor that clips shows its limit itself: nothing is far beyond where its samples pile up.
    limits = np.quantile(np.abs(measured), (0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999)).tolist()
    inside = [limit for limit in limits if 0 < limit < float(np.max(np.abs(y)))]
    if inside:
        yield Trial(
            effect="clipping", site=motion.site, grid=logarithms(inside), parameters=1,
            build=lambda shape: Force.known(motion.spectrum(np.clip(y, -numbers(shape)[0], numbers(shape)[0]) - y)),
            values=lambda shape, _: {"limit": numbers(shape)[0]},
        )  # fmt: skip


def _cross_axes(motion: Recovered, measurement: Measurement) -> Iterator[Trial]:
    own = measurement.output_names.index(motion.site.name)
    for place, name in enumerate(measurement.output_names):
        if name == motion.site.name or measurement.output_units[place] != measurement.output_units[own]:
            continue
        spectrum = motion.spectrum(measurement.outputs[place])
        yield Trial(
            effect="cross_axis", site=motion.site, source=name, parameters=1,
            build=lambda _, spectrum=spectrum: Force.of(spectrum),  # type: ignore[misc]
            values=lambda _, a: {"coefficient": float(a[0])},
        )  # fmt: skip
