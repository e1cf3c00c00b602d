"""The band that maps of a gap show: nearly all of the gap, before and after, and what is left out is said."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.records.diagnosis import GapSignals
from chladni.signals.arrays import Real
from chladni.viewers.gap_band import band_told, shown_hz
from tests import made_diagnosis as made

LINES_HZ = np.arange(101.0)


def maps(before: Real, after: Real) -> GapSignals:
    """Signals whose maps have these powers at 0 to 100 Hz, at three times."""
    density, density_after = (np.tile(power, (3, 1)) for power in (before, after))
    times = np.arange(3.0)
    return replace(
        made.signals(), map_time_s=times, map_frequency_hz=LINES_HZ, gap_map=density, gap_map_after=density_after
    )


def at(*lines: int, power: float = 1.0) -> Real:
    return np.where(np.isin(LINES_HZ, lines), power, 0.0)


def test_the_band_ends_a_little_above_the_gap() -> None:
    assert shown_hz(maps(at(2, 10), at(2, power=0.1))) == pytest.approx(1.2 * 10 + 1)


def test_what_only_the_last_simulation_errs_in_is_shown_too() -> None:
    assert shown_hz(maps(at(2, 10), at(50))) == pytest.approx(1.2 * 50 + 1)


def test_noise_far_below_the_gap_does_not_widen_the_band_and_its_share_is_said() -> None:
    noisy = maps(at(10, power=1e4) + 1.0, np.ones_like(LINES_HZ))
    assert shown_hz(noisy) < 20
    # Above 13 Hz 87 lines of 1, of 10101 in all.
    assert band_told(noisy) == "0 to 13 of 100 Hz, 0.86 % of the gap above"


@pytest.mark.parametrize(
    ("before", "after"),
    [(at(100), at(2)), (at(), at(2)), (np.full(101, np.nan), at(2))],
    ids=["up to the last line", "no gap", "nothing known"],
)
def test_of_a_whole_band_nothing_is_said(before: Real, after: Real) -> None:
    assert shown_hz(maps(before, after)) == 100
    assert band_told(maps(before, after)) == ""


def test_a_diverged_simulation_hides_no_gap() -> None:
    assert shown_hz(maps(at(30), np.full(101, np.inf))) >= 30
