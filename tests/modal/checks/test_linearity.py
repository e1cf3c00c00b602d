"""Linearity between levels: silent for linear structures, right about the measured aircraft."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.checks.linearity import check_linearity
from chladni.signals.errors import EstimateError
from chladni.spectral.frf import frequency_response
from chladni.spectral.periodic import find_period, periodic_cross_spectra
from tests.modal.made_responses import chain, functions, one_mass
from tests.spectral.aircraft import ACCELEROMETERS, PAYLOAD, SHAKER, aircraft

F_HZ = np.arange(2.0, 60.0, 0.1)


def levels(count=3, *, seed=0, noise=0.02, responses=None):
    return [
        functions(chain(), F_HZ, noise=noise / (k + 1), seed=10 * seed + k, responses=responses) for k in range(count)
    ]


def test_a_linear_chain_is_linear_at_the_stated_false_alarm_rate():
    checks = [check_linearity(levels(seed=seed, responses=("m2", "m5")), false_alarm=0.05) for seed in range(30)]
    # One in twenty: more than 6 of 30 happen once in 1000 times.
    assert sum(check.verdict != "linear" for check in checks) <= 6
    check = next(check for check in checks if check.verdict == "linear")
    assert check.difference.shape == (2, 2, 1)
    # 580 lines know the RMS of a difference to 3 %.
    np.testing.assert_allclose(check.difference / check.expected, 1.0, atol=0.15)
    assert check.finding.startswith("linear: between 3 levels no line changes")


def test_a_softening_structure_is_nonlinear_with_its_peak():
    frequency_hz = np.arange(15.0, 25.0, 0.02)
    made = [
        functions(one_mass(natural_hz, ratio), frequency_hz, noise=0.01, seed=k)
        for k, (natural_hz, ratio) in enumerate([(20.0, 0.01), (19.9, 0.012), (19.7, 0.02)])
    ]
    check = check_linearity(made)
    assert check.verdict == "nonlinear"
    assert np.all(np.diff(check.difference[:, 0, 0]) > 0)
    (peak,) = check.peaks
    assert peak.shift_hz == pytest.approx(-0.3, abs=0.02)
    assert peak.fate == "moved"
    assert "the peak of /m1.x goes from 20 to 19.7" in check.finding
    assert "modes hold for their level only" in check.finding


def test_a_small_change_is_nearly_linear():
    made = levels(2, noise=1e-3)
    values = made[1].values.copy()
    values[2] *= 1.05
    check = check_linearity([made[0], replace(made[1], values=values)])
    assert check.verdict == "nearly linear"
    assert "/m3.x / /force_m1 changes by 5%" in check.finding


def test_the_aircraft_is_nonlinear(shared_data):
    measured = []
    for level in (1, 3, 5, 7):
        series = aircraft(shared_data, level)
        spectra = periodic_cross_spectra(series, find_period(series, channel=SHAKER))
        measured.append(frequency_response(spectra, references=SHAKER, responses=ACCELEROMETERS))
    check = check_linearity(measured)
    assert check.verdict == "nonlinear"
    # The published torsion peak: 7.324 to 7.227 Hz, 0.258 to 0.075 (m/s^2)/N.
    torsion = next(
        change
        for change in check.peaks
        if change.before
        and change.after
        and change.channels[0] == PAYLOAD
        and abs(change.before.frequency_hz - 7.324) < 0.01
    )
    assert torsion.after.frequency_hz == pytest.approx(7.227, abs=0.001)
    assert torsion.before.height == pytest.approx(0.258, abs=0.001)
    assert torsion.after.height == pytest.approx(0.075, abs=0.001)
    assert torsion.fate == "moved"
    assert "7.324 to 7.227 Hz" in check.finding
    assert np.all(check.difference[-1] > 10 * check.expected[-1])


def test_peaks_that_are_nowhere_paired_are_not_told():
    flat = [replace(r, values=np.full(r.values.shape, 1.0 + k, complex)) for k, r in enumerate(levels(2))]
    check = check_linearity(flat)
    assert check.verdict == "nonlinear"
    assert "the peak" not in check.finding


def test_lines_excited_at_one_level_only_are_no_ground():
    one, other = levels(2)
    check = check_linearity([replace(one, excited=F_HZ < 30), replace(other, excited=F_HZ > 30.05)])
    assert check.verdict == "undecided"
    assert "no line is excited at all of 2 levels" in check.finding


def test_what_can_not_be_compared_is_refused():
    made = levels(2)
    with pytest.raises(EstimateError, match="1 level given"):
        check_linearity(made[:1])
    with pytest.raises(EstimateError, match="false_alarm"):
        check_linearity(made, false_alarm=1.0)
    other = functions(chain(), F_HZ, responses=("m1", "m2"))
    with pytest.raises(EstimateError, match=r"level 1 has channels /m1.x, .*, level 2 /m1.x, /m2.x"):
        check_linearity([made[0], other])
