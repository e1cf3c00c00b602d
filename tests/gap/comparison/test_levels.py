from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.comparison.levels import compare_levels, followed_peak, level_responses
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.records.measurement import Measurement
from tests.gap.comparison import made_measurements as made


def linear_runs(levels: tuple[float, ...]) -> list[Measurement]:
    rng = np.random.default_rng(1)
    force = np.tile(made.multisine(rng, 4000, np.arange(20, 800)), 9)
    y = made.machine(force, made.weights(2, 1))
    noise = 0.01 * y.std(axis=1, keepdims=True)
    return [
        with_period(made.measurement(level * force, level * y + noise * rng.standard_normal(y.shape), log=f"{level}"))
        for level in levels
    ]


def test_a_linear_machine_stays_as_it_is() -> None:
    told = compare_levels(linear_runs((1.0, 4.0)))
    assert len(told) == 2
    assert all("stays as it is" in sentence for sentence in told)
    assert all("from 1 to 4 RMS" in sentence for sentence in told)


def test_levels_are_sorted_and_named() -> None:
    levels = level_responses(linear_runs((4.0, 1.0, 2.0)))
    assert [one.log for one in levels] == ["1.0", "2.0", "4.0"]
    np.testing.assert_allclose([one.level for one in levels], [1, 2, 4], rtol=1e-6)


def test_one_level_or_equal_levels_tell_nothing() -> None:
    assert compare_levels([]) == ()
    assert compare_levels(linear_runs((1.0,))) == ()
    (told,) = compare_levels(linear_runs((1.0, 1.05)))
    assert "less than 10%" in told


def test_random_excitation_works_too() -> None:
    rng = np.random.default_rng(2)
    runs = []
    for level in (1.0, 5.0):
        force = rng.standard_normal(60000)
        y = made.machine(force, made.weights(1, 1))
        runs.append(made.measurement(level * force, level * y + 0.01 * y.std() * rng.standard_normal(y.shape)))
    told = compare_levels(runs)
    assert any("stays as it is" in sentence for sentence in told)
    assert not any("no linear system" in sentence for sentence in told)


def test_outputs_that_are_silent_or_missing_in_a_log_are_passed_over() -> None:
    rng = np.random.default_rng(4)
    force = rng.standard_normal(5000)
    silent = [made.measurement(level * force, np.zeros((2, 5000))) for level in (1.0, 2.0)]
    assert compare_levels(silent) == ()
    first, second = linear_runs((1.0, 4.0))
    lacking = replace(second, outputs=second.outputs[:1], output_names=("acc1",), output_units=("m/s^2",))
    assert [sentence.split(":")[0] for sentence in compare_levels([first, lacking])] == ["acc1"]


def test_measured_aircraft_softens_and_damps_with_level(shared_data: Path) -> None:
    runs = [made.aircraft(shared_data, level) for level in (7, 1, 3, 5)]
    peaks = followed_peak("payload_rail", level_responses(runs))
    assert peaks is not None
    # Published for the payload, read at lines of 400/8192 Hz.
    np.testing.assert_allclose([peak.frequency_hz for peak in peaks], [7.324, 7.275, 7.227, 7.227], atol=5e-4)
    np.testing.assert_allclose([peak.height for peak in peaks], [0.258, 0.233, 0.097, 0.075], atol=5e-4)
    told = compare_levels(runs)
    (payload, grows) = (sentence for sentence in told if sentence.startswith("payload_rail"))
    for part in ("7.324 to 7.227 Hz", "gives way", "0.258 to 0.0749", "damping grows", "12.4 to 97.8"):
        assert part in payload
    assert "no linear system" in grows
    # The connection rattles at high level: odd, with an even part, between wing and payload.
    assert told[-1].startswith("at 97.8 RMS")
    assert "between wing_rail and payload_rail" in told[-1]
    assert "(odd and even told" in told[-1]


@pytest.mark.parametrize("share", [0.0, 1e-3])
def test_a_cubic_term_makes_the_share_grow_with_level(share: float) -> None:
    rng = np.random.default_rng(3)
    force = np.tile(made.multisine(rng, 4000, np.arange(21, 800, 2)), 6)
    runs = []
    for level in (1.0, 10.0):
        x = made.machine(level * force, made.weights(1, 1))[0]
        x /= made.machine(force, made.weights(1, 1)).std()
        y = x + share * x**3 + 1e-3 * rng.standard_normal(x.size)
        runs.append(with_period(made.measurement(level * force, y)))
    told = [sentence for sentence in compare_levels(runs) if "no linear system" in sentence]
    assert bool(told) == (share > 0)
