"""Trials at inputs: what an actuator does to its command."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.rounded_limit import rounded_limit
from chladni.gap.explanation.trial import Force, Shape, Spectrum, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered
from chladni.models.effects.rate_limit import limited_samples

Matrix = NDArray[np.float64]


def input_trials(motion: Recovered) -> Iterator[Trial]:
    """Give the effects that act at an input, along its command."""
    if not np.any(motion.displacement):
        return
    spectrum = motion.spectrum(motion.displacement)
    yield Trial(
        effect="gain_error", site=motion.site, build=lambda _: Force.of(spectrum),
        values=lambda _, a: {"gain": 1.0 + float(a[0])}, parameters=1,
    )  # fmt: skip
    yield from _late(motion, spectrum)
    yield from _limits(motion)


def _late(motion: Recovered, u: Spectrum) -> Iterator[Trial]:
    s = motion.s
    times = (np.geomspace(0.05, 100.0, 24) / motion.lines.sample_rate_hz).tolist()

    def second(shape: Shape) -> Force:
        time_s, damping = numbers(shape)
        return Force.known(u * (1 / (time_s**2 * s**2 + 2 * damping * time_s * s + 1) - 1))

    yield _known(motion, "delay", lambda value: u * np.expm1(-s * value), times, "delay")
    yield _known(motion, "lag", lambda value: u * (1 / (value * s + 1) - 1), times, "time_constant", "first_order")
    yield Trial(
        effect="lag", site=motion.site, variant="second_order", build=second, grid=logarithms(times, (0.5, 0.9)),
        values=lambda shape, _: {"time_constant": numbers(shape)[0], "damping_ratio": numbers(shape)[1]},
        parameters=2,
    )  # fmt: skip


def _limits(motion: Recovered) -> Iterator[Trial]:
    u, rate = motion.displacement, motion.lines.sample_rate_hz
    size, rms = float(np.max(np.abs(u))), float(np.sqrt(np.mean(u**2)))
    shares = (0.3, 0.5, 0.65, 0.75, 0.83, 0.89, 0.93, 0.96, 0.98, 0.99, 0.997)
    # By how often it's reached, and by size: steps stand at few levels.
    limits = [*np.quantile(np.abs(u), shares).tolist(), *(size * np.array([0.1, 0.3, 0.6, 0.9])).tolist()]
    limits = sorted({limit for limit in limits if 0 < limit < size})
    if limits:
        yield _known(
            motion,
            "saturation",
            lambda value: motion.spectrum(np.clip(u, -value, value) - u),
            limits,
            "limit",
            "clipped",
        )
        yield _known(
            motion,
            "saturation",
            lambda value: motion.spectrum(value * np.tanh(u / value) - u),
            limits,
            "limit",
            "smooth",
        )
        yield rounded_limit(motion, "saturation", limits)
    widths = (rms * np.geomspace(0.01, 1.5, 18)).tolist()
    yield _known(motion, "dead_zone", lambda value: motion.spectrum(-np.clip(u, -value, value)), widths, "width")
    fastest = float(np.max(np.abs(np.diff(u)))) * rate
    rates = (fastest * np.geomspace(0.002, 0.95, 24)).tolist()
    yield _known(
        motion, "rate_limit", lambda value: motion.spectrum(limited_samples(u, rate, value, 0.0) - u), rates, "rate"
    )


def _known(
    motion: Recovered,
    effect: str,
    force: Callable[[float], Spectrum],
    grid: Sequence[float],
    name: str,
    variant: str | None = None,
) -> Trial:
    """A trial with one number and no free amplitude: what acts is the shaped command itself."""
    return Trial(
        effect=effect, site=motion.site, variant=variant, build=lambda shape: Force.known(force(numbers(shape)[0])),
        grid=logarithms(grid), values=lambda shape, _: {name: numbers(shape)[0]}, parameters=1,
    )  # fmt: skip
