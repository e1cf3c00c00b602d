"""A chain with one nonlinear joint, shaken by a multisine at several levels; some of its bodies have a sensor."""

from collections.abc import Mapping
from functools import cache

import numpy as np

import chladni
from chladni.gap.comparison.linear_approximation import best_linear_approximation
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.signals.mode_set import ModeSet
from tests.gap.made_log import RATE_HZ, chain

PERIOD, PERIODS = 2048, 5
# Body 0 is shaken; bodies 1 and 4 have no sensor.
BODIES = (0, 2, 3)
OUTPUTS = tuple(f"a{body}" for body in BODIES)
RMS = (3.0, 30.0, 60.0)
NOISE = 1e-3


def machine():
    """Joint jN is between body N - 1 (or the ground) and body N; modes at 17, 49, 83, 131 and 138 Hz.

    Damping is proportional to stiffness, so that shapes are real.
    """
    stiffnesses = np.array([2e5, 6e5, 4e5, 3e5, 5e5])
    return chain([2.0, 2.5, 3.0, 1.5, 2.0], stiffnesses, 2e-4 * stiffnesses)


def multisine(rms: float):
    """``[sample]`` to run with, and as a force sensor sees what runs: straight lines between the samples."""
    rng = np.random.default_rng(3)
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    lines = np.arange(8, 300)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    heard = spectrum * np.sinc(np.fft.rfftfreq(PERIOD)) ** 2
    one, seen = np.fft.irfft(spectrum, PERIOD), np.fft.irfft(heard, PERIOD)
    return tuple(np.tile(rms * each / one.std(), PERIODS)[None] for each in (one, seen))


def measurement(
    joint: str, kind: str, values: Mapping[str, float], rms: float, *, noise: float = NOISE
) -> Measurement:
    """Five periods of white noise on top, the first one transient."""
    model = machine()
    effects = [attached(kind, joint, dict(values))] if kind else []
    force, seen = multisine(rms)
    outputs = Integrator(model.with_effects(effects).compile(), RATE_HZ).run(force).outputs[list(BODIES)]
    scatter = np.random.default_rng(round(rms)).standard_normal(outputs.shape)
    return with_period(
        Measurement(
            log=f"{rms:g} N", sample_rate_hz=RATE_HZ, inputs=seen,
            outputs=outputs + noise * outputs.std(axis=1, keepdims=True) * scatter, input_names=("shaker",),
            output_names=OUTPUTS, output_units=("m/s^2",) * len(OUTPUTS),
        )
    )  # fmt: skip


@cache
def levels(joint: str, kind: str, values: tuple[tuple[str, float], ...]) -> tuple[tuple[Measurement, ...], ModeSet]:
    """Measurements by rising level, and the modes of the lowest."""
    found = tuple(measurement(joint, kind, dict(values), rms) for rms in RMS)
    return found, chladni.identify_modes(best_linear_approximation(found[0]))
