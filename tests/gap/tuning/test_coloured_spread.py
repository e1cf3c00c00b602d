"""The spread that a fit states is that of many logs, whatever the colour of what it leaves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.gap.plant.free_run import FreeRun
from chladni.gap.tuning.output_error import fit_output_error, with_coloured_spread
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

SAMPLES = 3000
WHITE = (1.0,)
SLOW = (1.0, -0.98)
#: Around the first mode, at 29 Hz, where what a law leaves is loudest.
RINGING = (1.0, -1.9 * np.cos(2 * np.pi * 29.0 / RATE_HZ), 0.95**2)


def fits(colour: tuple[float, ...], coloured: bool, count: int = 14):
    """Yield z over its stated spread, of logs with another noise each; the machine is the nominal one."""
    signals, model = band_noise(SAMPLES), three_bodies()
    log, floor = measured(model, signals, noise=0.0)
    # Loud enough that the prior says next to nothing.
    rms = 0.02 * np.std(log.outputs, axis=1)
    told = replace(floor, rms=rms, innovation_rms=rms)
    training = np.arange(SAMPLES) // 300 % 3 != 1
    for seed in range(count):
        white = np.random.default_rng(seed).standard_normal((len(rms), SAMPLES + 500))
        noise = lfilter([1.0], colour, white)[:, 500:]
        heard = replace(log, outputs=log.outputs + rms[:, None] * noise / np.std(noise, axis=1, keepdims=True))
        run = FreeRun(model, heard)
        fit = fit_output_error(run, told, training=training)
        fit = with_coloured_spread(run, told, fit, training=training) if coloured else fit
        yield fit.z / np.sqrt(np.diag(fit.covariance))


def scatter(colour: tuple[float, ...], coloured: bool) -> float:
    """RMS of errors over stated spreads: 1 when these are right."""
    return float(np.sqrt(np.mean(np.square(list(fits(colour, coloured))))))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("colour", [pytest.param(WHITE, marks=pytest.mark.nightly), SLOW, RINGING])
def test_spreads_are_those_of_many_logs(colour: tuple[float, ...]) -> None:
    assert scatter(colour, True) == pytest.approx(1.0, abs=0.35)


def test_white_noise_is_no_stand_in_for_coloured() -> None:
    assert scatter(SLOW, False) < 0.7
    assert scatter(RINGING, False) > 2.0
