"""When the gap is larger: stretches that are put in are found, and none in a gap that is there all the time."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from chladni.gap.calibration import LISTED
from chladni.gap.comparison.shares import time_shares

RATE_HZ, SAMPLES = 200.0, 12800
PIECE_S = SAMPLES / 64 / RATE_HZ


def measured() -> np.ndarray:
    return np.ones((1, SAMPLES))


def test_a_stretch_is_found_to_a_piece_with_its_share_of_the_power() -> None:
    residual = np.random.default_rng(1).standard_normal((1, SAMPLES))
    first, stop = 3100, 5050
    residual[:, first:stop] *= 4.0
    (found,) = time_shares(residual, measured(), sample_rate_hz=RATE_HZ)
    assert found.start_s == pytest.approx(first / RATE_HZ, abs=PIECE_S)
    assert found.end_s == pytest.approx(stop / RATE_HZ, abs=PIECE_S)
    inside = slice(round(found.start_s * RATE_HZ), round(found.end_s * RATE_HZ))
    assert found.share == pytest.approx(np.sum(residual[:, inside] ** 2) / np.sum(residual**2))


def test_outputs_count_on_one_scale_and_the_largest_share_is_told_first() -> None:
    # 1 of the power of the first output early, 3 of the second's late, whatever their units.
    residual = np.zeros((2, SAMPLES))
    residual[0, 1000:2000], residual[1, 9000:10000] = 1e3, 1e-3 * np.sqrt(3)
    late, early = time_shares(residual, np.array([[1e3], [1e-3]]) * np.ones((2, SAMPLES)), sample_rate_hz=RATE_HZ)
    assert (late.start_s, late.end_s, late.share) == (45.0, 50.0, pytest.approx(0.75))
    assert (early.start_s, early.end_s, early.share) == (5.0, 10.0, pytest.approx(0.25))


def test_a_single_blow_is_found() -> None:
    residual = 0.1 * np.random.default_rng(2).standard_normal((1, SAMPLES))
    residual[0, 7777] = 50.0
    (found,) = time_shares(residual, measured(), sample_rate_hz=RATE_HZ)
    assert found.start_s <= 7777 / RATE_HZ <= found.end_s <= found.start_s + 2 * PIECE_S
    assert found.share > 0.9


@pytest.mark.parametrize("width_hz", [0.5, 5.0, 50.0])
def test_a_gap_that_is_there_all_the_time_has_no_time(width_hz: float) -> None:
    # Narrow noise comes and goes by itself; of forty records hardly one may tell of that.
    told = 0
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal(SAMPLES)
        pole = np.exp((-np.pi * width_hz + 2j * np.pi * 30.0) / RATE_HZ)
        residual = signal.lfilter([1.0], np.poly([pole, pole.conjugate()]).real, noise)[None]
        told += bool(time_shares(residual, measured(), sample_rate_hz=RATE_HZ))
    assert told <= 1


def test_no_gap_and_a_few_samples_have_no_times() -> None:
    assert time_shares(np.zeros((1, SAMPLES)), measured(), sample_rate_hz=RATE_HZ) == ()
    assert time_shares(np.arange(9.0)[None], np.ones((1, 9)), sample_rate_hz=RATE_HZ) == ()


def test_times_are_few() -> None:
    residual = np.zeros((1, SAMPLES))
    for place in range(12):
        residual[0, 1000 * place : 1000 * place + 200] = 1.0 + 0.01 * place
    found = time_shares(residual, measured(), sample_rate_hz=RATE_HZ)
    assert len(found) == LISTED
    assert found[0].start_s == pytest.approx(55.0, abs=PIECE_S)
    assert all(one.share >= other.share for one, other in pairwise(found))
