"""Measurements of discrete linear systems, whose noise and distortion are known exactly."""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

import chladni
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Index, Real

RATE_HZ = 500.0
# Modes in cycles a sample, with their damping ratios.
MODES = ((0.021, 0.01), (0.054, 0.008), (0.093, 0.015))


def measurement(inputs: Real, outputs: Real, *, rate_hz: float = RATE_HZ, log: str = "made.mcap") -> Measurement:
    return Measurement(
        log=log,
        sample_rate_hz=rate_hz,
        inputs=np.atleast_2d(inputs),
        outputs=np.atleast_2d(outputs),
        input_names=tuple(f"force{place + 1}" for place in range(len(np.atleast_2d(inputs)))),
        output_names=tuple(f"acc{place + 1}" for place in range(len(np.atleast_2d(outputs)))),
        output_units=("m/s^2",) * len(np.atleast_2d(outputs)),
    )


def machine(force: Real, weights: Real) -> Real:
    """Outputs ``[output, sample]`` of three modes that a force excites, from rest; `weights` is [output, mode]."""
    modal = []
    for cycles, zeta in MODES:
        pole = np.exp(2 * np.pi * cycles * (-zeta + 1j * np.sqrt(1 - zeta**2)))
        # Twice differenced, as an acceleration is.
        modal.append(lfilter([1.0, -2.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force))
    return np.asarray(weights @ np.array(modal))


def weights(outputs: int, seed: int) -> Real:
    return np.asarray(np.random.default_rng([seed, 7]).uniform(0.3, 1.0, (outputs, len(MODES)))) * np.sign(
        np.random.default_rng([seed, 8]).standard_normal((outputs, len(MODES)))
    )


def coloured(rng: np.random.Generator, shape: tuple[int, int], colour: str) -> Real:
    """Noise of unit RMS: white, pink down to a thousandth of a cycle, or resonant."""
    white = rng.standard_normal(shape)
    if colour == "white":
        return white / white.std(axis=1, keepdims=True)
    if colour == "pink":
        cycles = np.fft.rfftfreq(shape[1])
        noise = np.fft.irfft(np.fft.rfft(white) / np.sqrt(np.maximum(cycles, 1e-3)), shape[1])
    else:
        pole = 0.97 * np.exp(2j * np.pi * 0.2)
        noise = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], white)
    return np.asarray(noise / noise.std(axis=1, keepdims=True))


def multisine(rng: np.random.Generator, period: int, lines: Index) -> Real:
    """One period of random phases and unit RMS."""
    spectrum = np.zeros(period // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    one = np.fft.irfft(spectrum, period)
    return np.asarray(one / one.std())


@cache
def aircraft(shared_data: Path, level: int) -> Measurement:
    """A measured ground vibration test: shaker force, three accelerations, nine periods, first one transient."""
    names = ("excitation", "wing_rail", "payload_rail")
    with chladni.open_log(shared_data / f"f16_level{level}.mcap") as log:
        series = log.read(["/shaker.wrench.force.z", *(f"/{name}.accel.linear.z" for name in names)])
    values = series.values.astype(float)
    return with_period(
        Measurement(
            log=f"level {level}",
            sample_rate_hz=series.sample_rate_hz,
            inputs=values[:1],
            outputs=values[1:],
            input_names=("shaker",),
            output_names=names,
            output_units=("m/s^2",) * 3,
        )
    )
