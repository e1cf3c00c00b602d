"""Trials at outputs: what a sensor does to the signal."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.explanation.body_trials import tone_trials
from chladni.gap.explanation.resonances import resonances
from chladni.gap.explanation.rounded_limit import rounded_limit
from chladni.gap.explanation.trial import Force, Matrix, Numbers, Shape, Spectrum, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered
from chladni.gap.records.measurement import Measurement

#: Damping ratio of two coupling stages that are as good as one.
_UNLIKE = 3.0


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
    yield from (_shift(motion, sign) for sign in (1.0, -1.0))

    def coupled(shape: Shape) -> Force:
        omega = 2 * np.pi * numbers(shape)[0]
        # A slow corner still remembers the start at the end.
        return Force(fixed=-y * omega / (s + omega), basis=np.stack([omega / (s + omega)]))

    def coupled_twice(shape: Shape) -> Force:
        corner, damping = numbers(shape)
        omega = 2 * np.pi * corner
        turning = s**2 + 2 * damping * omega * s + omega**2
        return Force(fixed=y * (s**2 / turning - 1), basis=np.stack([omega / turning, s / turning]))

    def ride(shape: Shape) -> Force:
        frequency, damping = numbers(shape)
        omega = 2 * np.pi * frequency
        turning = s**2 + 2 * damping * omega * s + omega**2
        return Force(fixed=y * (omega**2 / turning - 1), basis=np.stack([omega / turning, s / turning]))

    corners = np.geomspace(5e-4 * rate, 0.15 * rate, 20).tolist()
    yield Trial(
        effect="ac_coupling", site=site, build=coupled, grid=logarithms(corners),
        values=lambda shape, _: {"corner": numbers(shape)[0]}, parameters=1,
    )  # fmt: skip
    yield Trial(
        effect="ac_coupling", site=site, variant="second_order", build=coupled_twice,
        grid=logarithms(corners, (0.7, 1.2)),
        values=_two_stages, parameters=2,
    )  # fmt: skip
    measured = y + motion.spectrum(motion.force)
    yield Trial(
        effect="mounting_resonance", site=site, build=ride,
        grid=[
            *logarithms(np.geomspace(0.02 * rate, 2.0 * rate, 30).tolist(), (0.02, 0.1, 0.4)),
            *resonances(measured, y, motion.believed, motion.lines.frequency_hz, (0.0, 0.5 * rate)),
        ],
        values=lambda shape, _: {"frequency": numbers(shape)[0], "damping_ratio": numbers(shape)[1]}, parameters=2,
    )  # fmt: skip


def _two_stages(shape: Shape, _: Matrix) -> Numbers | None:
    corner, damping = numbers(shape)
    # Far apart, the upper corner is one stage's and the lower one shows nowhere.
    return {"corner": corner, "damping_ratio": damping} if damping < _UNLIKE else None


def _shift(motion: Recovered, sign: float) -> Trial:
    """Signal that comes late or, with a negative sign, early: shapes hold logarithms, which have none."""
    y, s = motion.spectrum(motion.displacement), motion.s

    def shifted(shape: Shape) -> Force:
        return Force.known(y * np.expm1(-s * sign * numbers(shape)[0]))

    def values(shape: Shape, _: Matrix) -> Numbers:
        return {"offset": sign * numbers(shape)[0]}

    offsets = (np.geomspace(0.03, 60.0, 24) / motion.lines.sample_rate_hz).tolist()
    return Trial(
        effect="time_offset", site=motion.site, build=shifted, values=values, grid=logarithms(offsets), parameters=1
    )


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
        yield rounded_limit(motion, "clipping", inside)


def _cross_axes(motion: Recovered, measurement: Measurement) -> Iterator[Trial]:
    own = measurement.output_names.index(motion.site.name)
    for place, name in enumerate(measurement.output_names):
        if name == motion.site.name or measurement.output_units[place] != measurement.output_units[own]:
            continue
        yield _cross_axis(motion, name, motion.spectrum(measurement.outputs[place]))


def _cross_axis(motion: Recovered, source: str, spectrum: Spectrum) -> Trial:
    def build(_: Shape) -> Force:
        return Force.of(spectrum)

    def values(_: Shape, amplitudes: Matrix) -> Numbers:
        return {"coefficient": float(amplitudes[0])}

    return Trial(effect="cross_axis", site=motion.site, source=source, build=build, values=values, parameters=1)
