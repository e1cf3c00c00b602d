"""Modes whose shapes the sensors can't tell apart."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from chladni.apps.modes import identify_modes
from chladni.io.log import open_log
from chladni.modal.shapes.distinguishability import alike_modes, alike_sentence
from chladni.modal.shapes.mac import auto_mac
from chladni.modal.shapes.validation import validate
from tests import strategies as ours
from tests.modal.mode_makers import mode_set

SEEN_FROM_ONE_WING = np.array([[1.0, 0.9, 0.8], [1.0, 0.95, 0.7], [0.9, -1.0, 0.2]])


def test_three_sensors_side_by_side_see_two_modes_as_one() -> None:
    modes = mode_set(SEEN_FROM_ONE_WING)
    assert alike_modes(modes) == ((0, 1),)
    sentence = alike_sentence(modes, alike_modes(modes), auto_mac(modes))
    assert sentence.startswith(
        "3 channels don't tell the shapes of modes 1 and 2 (10 and 20 Hz, MAC 0.99) apart. Their frequencies"
    )
    assert "sensors at further points or directions" in sentence


def test_orthogonal_shapes_are_told_apart_until_their_error_bars_hide_it() -> None:
    shapes = np.array([[1.0, 0.3, 0.0], [1.0, -0.3, 0.3]])
    sharp = mode_set(shapes)
    likeness = auto_mac(sharp)
    assert 0.5 < likeness[0, 1] < 0.9
    assert alike_modes(sharp) == ()
    assert alike_modes(sharp, limit=0.5) == ((0, 1),)
    blurred = mode_set(shapes, shape_std=np.full(shapes.shape, 0.3 * (1 + 1j)))
    assert alike_modes(blurred) == ((0, 1),)
    assert "the error bars of the shapes hide the difference" in alike_sentence(blurred, ((0, 1),), likeness)


@pytest.mark.parametrize(
    ("others", "least"),
    [
        # Errors of small components turn the shape by all that they are: the law is exact to first order.
        ([0.1, -0.1, 0.05, 0.1], 0.03),
        # Errors along the shape don't turn it: fewer pairs are called different.
        ([-0.7, 0.4, 0.9, -0.2], 0.0),
    ],
)
def test_the_same_shape_with_errors_is_called_different_one_time_in_twenty(others: list[float], least: float) -> None:
    rng = np.random.default_rng(4)
    std, runs = 0.02, 2000
    noise = std * (rng.normal(size=(2, runs, 4)) + 1j * rng.normal(size=(2, runs, 4)))
    shapes = np.concatenate([np.ones((2, runs, 1)), np.array(others) + noise], axis=2)
    shape_std = np.full((2, 5), std * (1 + 1j)) * np.array([0, 1, 1, 1, 1])
    called = [alike_modes(mode_set(shapes[:, run], shape_std=shape_std), limit=1.0) for run in range(runs)]
    different = sum(not pairs for pairs in called) / runs
    # Binomial: 0.05 +- 3 sqrt(0.05 0.95/2000) = 0.035 to 0.065.
    assert least < different < 0.07


def test_one_channel_tells_nothing_apart() -> None:
    modes = mode_set([[1.0], [1.0], [1.0]])
    assert alike_modes(modes) == ((0, 1), (0, 2), (1, 2))
    assert alike_sentence(modes, alike_modes(modes), auto_mac(modes)).startswith("1 channel doesn't tell")


def test_many_pairs_are_counted() -> None:
    modes = mode_set([[1.0, 1.0, 0.0]] * 4 + [[0.0, 0.0, 1.0]])
    assert len(alike_modes(modes)) == 6
    assert "and 2 more apart" in alike_sentence(modes, alike_modes(modes), auto_mac(modes))


def test_when_no_two_modes_are_told_apart_they_arent_listed() -> None:
    modes = mode_set([[1.0, 0.9], [1.0, 0.8], [1.0, 1.0]])
    sentence = alike_sentence(modes, alike_modes(modes), auto_mac(modes))
    assert sentence.startswith("2 channels don't tell the shapes of any two of the 3 modes apart (MAC 0.99 to 1.00).")


def test_three_accelerometers_on_an_aircraft(shared_data: Path) -> None:
    with open_log(shared_data / "f16_level1.mcap") as log:
        modes = identify_modes(log, references="/shaker.wrench.force.z")
    checks = validate(modes)
    count = modes.frequency_hz.size
    off_diagonal = checks.auto_mac[np.triu_indices(count, k=1)]
    assert count >= 6
    # Known of this set-up: modes that are far apart in frequency have a MAC of 0.98 and more.
    assert np.sum(off_diagonal > 0.98) >= 5
    assert len(checks.alike) >= 5
    assert "3 channels don't tell the shapes of" in checks.findings[0]


@given(ours.mode_sets())
def test_pairs_are_ordered_and_the_most_alike_come_first(modes) -> None:  # type: ignore[no-untyped-def]
    likeness = auto_mac(modes)
    pairs = alike_modes(modes)
    assert all(first < second for first, second in pairs)
    assert len(set(pairs)) == len(pairs)
    values = [likeness[pair] for pair in pairs]
    assert values == sorted(values, reverse=True)
    high = np.argwhere(np.triu(likeness >= 0.9, k=1))
    assert {tuple(map(int, pair)) for pair in high} <= set(pairs)
