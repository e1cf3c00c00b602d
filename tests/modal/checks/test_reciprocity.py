"""Reciprocity of structures in closed form, and of such that were measured wrongly."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.checks.reciprocity import check_reciprocity
from chladni.signals.errors import EstimateError
from tests.modal.made_responses import chain, functions, reversed_channel

F_HZ = np.arange(2.0, 60.0, 0.1)


def measured(noise=0.01, seed=0, references=("m1", "m4"), averages=100.0):
    return functions(chain(), F_HZ, references=references, noise=noise, seed=seed, averages=averages)


def altered(response, row, column, factor):
    values = response.values.copy()
    values[row, column] *= factor
    return replace(response, values=values)


@pytest.mark.parametrize("averages", [0.0, 100.0])
def test_a_structure_is_reciprocal(averages):
    check = check_reciprocity(measured(averages=averages), bands=4)
    assert check.verdict == "reciprocal"
    assert check.pairs == (("/m4.x", "/force_m1", "/m1.x", "/force_m4"),)
    # The difference is what the random error explains: 145 lines know a ratio of RMS to 6 %.
    np.testing.assert_allclose(check.difference / check.expected, 1.0, atol=0.25)
    assert check.finding.startswith("reciprocal: 1 pair measured both ways")


def test_every_pair_is_looked_at_once():
    check = check_reciprocity(measured(references=("m1", "m3", "m4")))
    assert [pair[1::2] for pair in check.pairs] == [
        ("/force_m1", "/force_m3"),
        ("/force_m1", "/force_m4"),
        ("/force_m3", "/force_m4"),
    ]


def test_the_false_alarm_rate_is_the_stated_one():
    verdicts = [check_reciprocity(measured(seed=seed), false_discovery=0.01).verdict for seed in range(60)]
    # One in a hundred: more than 4 of 60 happen once in 3000 times.
    assert verdicts.count("reciprocal") >= 56


def test_a_badly_calibrated_sensor_is_found_with_its_size_and_band():
    check = check_reciprocity(altered(measured(), 3, 0, 1.3), bands=6)
    assert check.verdict == "not reciprocal"
    # 1.3 against 1: 0.3 over the RMS of both.
    expected = 0.3 / np.sqrt((1.3**2 + 1) / 2)
    resonant = check.expected[0] < 0.03
    assert resonant.any()
    np.testing.assert_allclose(check.difference[0][resonant], expected, rtol=0.1)
    assert "differ by 25" in check.finding or "differ by 26" in check.finding
    assert check.significant_share[0] > 0.05
    slight = check_reciprocity(altered(measured(noise=1e-3), 3, 0, 1.05))
    assert slight.verdict == "nearly reciprocal"
    assert "usual in a good test" in slight.finding


def test_a_sensor_upside_down_is_told_from_other_faults():
    turned = altered(measured(), 3, 0, -1.0)
    check = check_reciprocity(turned)
    assert check.verdict == "sign reversed"
    assert "opposite sign" in check.finding
    # The whole sensor upside down, and the setup that says so: reciprocal again.
    upside_down = altered(altered(measured(), 3, 0, -1.0), 3, 1, -1.0)
    responses = list(upside_down.responses)
    responses[3] = reversed_channel(responses[3])
    assert check_reciprocity(replace(upside_down, responses=tuple(responses))).verdict == "reciprocal"


def test_bands_without_lines_have_no_number():
    made = replace(measured(), excited=(F_HZ < 15) | (F_HZ > 50))
    check = check_reciprocity(made, bands=4)
    assert np.isnan(check.difference[0]).tolist() == [False, True, True, False]


def test_nothing_measured_both_ways_is_an_answer():
    check = check_reciprocity(measured(references=("m1",)))
    assert check.verdict == "not measured"
    assert check.pairs == ()
    assert "two references with points and directions" in check.finding
    with pytest.raises(EstimateError, match="bands is 0"):
        check_reciprocity(measured(), bands=0)
    with pytest.raises(EstimateError, match="false_discovery"):
        check_reciprocity(measured(), false_discovery=2.0)


def test_unexcited_lines_give_nothing_to_compare():
    made = replace(measured(), excited=np.zeros(F_HZ.size, bool))
    assert check_reciprocity(made, bands=2).verdict == "not measured"
