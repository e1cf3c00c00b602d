"""Modes before and after: paired by frequency and shape, and changes told from scatter."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.shapes.mode_comparison import compare_modes
from chladni.signals.errors import EstimateError
from tests.modal.mode_makers import mode_set

BEFORE = mode_set(np.eye(3))


def fates(before, after):
    return [(one.fate, one.before, one.after) for one in compare_modes(before, after)]


def test_what_error_bars_explain_is_no_change():
    after = replace(BEFORE, frequency_hz=BEFORE.frequency_hz + 0.002, damping_ratio=BEFORE.damping_ratio + 2e-4)
    found = compare_modes(BEFORE, after)
    assert [one.fate for one in found] == ["unchanged"] * 3
    assert found[0].shift_hz == pytest.approx(0.002)
    assert found[0].shift_std_hz == pytest.approx(0.001 * np.sqrt(2))
    assert found[0].damping_change == pytest.approx(2e-4)
    assert found[0].mac == pytest.approx(1.0)


@pytest.mark.parametrize(
    "changed",
    [
        replace(BEFORE, frequency_hz=BEFORE.frequency_hz + np.array([0.0, -0.01, 0.0])),
        replace(BEFORE, damping_ratio=BEFORE.damping_ratio + np.array([0.0, 1e-3, 0.0])),
    ],
    ids=["frequency", "damping"],
)
def test_what_they_do_not_explain_is(changed):
    assert [one.fate for one in compare_modes(BEFORE, changed)] == ["unchanged", "changed", "unchanged"]


def test_modes_that_change_places_are_known_by_their_shapes():
    swapped = replace(mode_set(np.eye(3)[[1, 0, 2]]), frequency_hz=np.array([10.0, 10.2, 30.0]))
    before = replace(BEFORE, frequency_hz=np.array([10.0, 10.2, 30.0]))
    assert fates(before, swapped) == [("changed", 0, 1), ("changed", 1, 0), ("unchanged", 2, 2)]


def test_a_mode_elsewhere_or_of_another_shape_is_another_mode():
    other = replace(BEFORE, frequency_hz=np.array([10.0, 24.0, 30.0]))
    assert fates(BEFORE, other) == [
        ("unchanged", 0, 0), ("vanished", 1, None), ("appeared", None, 1), ("unchanged", 2, 2),
    ]  # fmt: skip
    turned = mode_set([[1, 0, 0], [0, 0.2, 1], [0, 0, 1]])
    assert ("vanished", 1, None) in fates(BEFORE, turned)


def test_a_set_without_modes_has_lost_them_all():
    empty = BEFORE.select(np.array([], dtype=int))
    assert fates(BEFORE, empty) == [("vanished", row, None) for row in range(3)]
    assert fates(empty, BEFORE) == [("appeared", None, row) for row in range(3)]


def test_an_unchanged_structure_seldom_shows_a_change():
    rng = np.random.default_rng(0)
    alarms = 0
    for _ in range(400):
        one, other = (
            replace(
                BEFORE,
                frequency_hz=BEFORE.frequency_hz + rng.normal(0, 0.001, 3),
                damping_ratio=BEFORE.damping_ratio + rng.normal(0, 1e-4, 3),
            )
            for _ in range(2)
        )
        alarms += any(change.fate != "unchanged" for change in compare_modes(one, other))
    # Binomial with 1 %: 4 on average, 12 or more once in three thousand.
    assert alarms < 12


def test_sets_without_a_common_channel_are_refused():
    with pytest.raises(EstimateError):
        compare_modes(BEFORE, mode_set(np.eye(2), names=("x", "y")))
