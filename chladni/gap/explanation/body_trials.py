"""Trials at bodies: more mass, an attached oscillator, a tone."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.explanation.resonances import resonances
from chladni.gap.explanation.tones import strongest_tones
from chladni.gap.explanation.trial import Force, Matrix, Numbers, Shape, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered

#: A mount that resonates this far above all that moved amplifies its load's pull there by less than a quarter: that
#: is a mass. Below it's an oscillator, whose resonance shows.
STIFF_MOUNT = 2.2


def body_trials(motion: Recovered, band_hz: tuple[float, float]) -> Iterator[Trial]:
    """Give the effects that act at a body.

    Parameters
    ----------
    band_hz
        Where the excitation has power: an attached mode is looked for there.
    """
    acceleration = motion.s * motion.spectrum(motion.velocity)
    stiff_hz = STIFF_MOUNT * band_hz[1]
    yield Trial(
        effect="added_mass", site=motion.site, build=lambda _: Force.of(-acceleration),
        values=lambda _, a: {"mass": float(a[0])} if a[0] > 0 else None, parameters=1,
    )  # fmt: skip

    def pull(shape: Shape) -> Force:
        frequency, damping = numbers(shape)
        omega, s = 2 * np.pi * frequency, motion.s
        turning = s**2 + 2 * damping * omega * s + omega**2
        # It swings at the start already, and still at the end.
        share = (omega**2 + 2 * damping * omega * s) / turning
        return Force.of(-acceleration * share, omega / turning, s / turning)

    # A mount bends a little below its resonance; above the excitation it's a mass, whatever holds it.
    yield Trial(
        effect="added_mass", site=motion.site, variant="mounted", build=pull,
        grid=logarithms((stiff_hz * np.array([1.1, 2.0, 4.0])).tolist(), (0.05,)),
        values=lambda shape, a: _oscillator(shape, a) if numbers(shape)[0] > stiff_hz else None, parameters=3,
    )  # fmt: skip
    # A lightly damped oscillator pulls the other way a little beside its resonance: a grid alone may step over it.
    estimated = resonances(
        motion.spectrum(motion.force),
        -acceleration,
        motion.believed,
        motion.lines.frequency_hz,
        (band_hz[0], stiff_hz),
    )
    spread = np.geomspace(max(band_hz[0], 0.5), stiff_hz, 45).tolist()
    yield Trial(
        effect="extra_mode", site=motion.site, build=pull,
        grid=[*logarithms(spread, (0.003, 0.01, 0.03)), *estimated],
        values=lambda shape, a: _oscillator(shape, a) if numbers(shape)[0] <= stiff_hz else None, parameters=3,
    )  # fmt: skip
    yield from tone_trials(motion)


def _oscillator(shape: Shape, amplitudes: Matrix) -> Numbers | None:
    if amplitudes[0] <= 0:
        return None
    frequency, damping = numbers(shape)
    return {"mass": float(amplitudes[0]), "frequency": frequency, "damping_ratio": damping}


def tone_trials(motion: Recovered) -> Iterator[Trial]:
    """Give sines at the strongest lines of the recovered force, for a body or an output."""
    tones = strongest_tones(motion.force, motion.lines.sample_rate_hz)
    if not tones:
        return

    def build(shape: Shape) -> Force:
        angle = 2 * np.pi * numbers(shape)[0] * motion.time_s
        return Force.of(motion.spectrum(np.sin(angle)), motion.spectrum(np.cos(angle)))

    yield Trial(
        effect="tonal_disturbance", site=motion.site, build=build, grid=logarithms(tones),
        values=lambda shape, a: {
            "frequency": numbers(shape)[0], "amplitude": float(np.hypot(a[0], a[1])),
            "phase": float(np.arctan2(a[1], a[0])),
        },
        parameters=3,
    )  # fmt: skip
