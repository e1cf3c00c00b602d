"""Modes keep their number from look to look, and what moves beyond its error bar is told."""

import numpy as np

from chladni.modal.operational.mode_tracking import ModeTracker
from chladni.signals.channel import Channel
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance

CHANNELS = tuple(Channel(name=name, unit="m/s^2") for name in "abc")
SHAPES = np.array([[1, 1, 1], [1, 0, -1], [1, -2, 1]], dtype=complex)
STD = 1e-3


def found(frequency_hz, shapes=SHAPES, *, seed=0):
    """Modes at these frequencies, with scatter as large as their error bars say."""
    rng = np.random.default_rng(seed)
    frequency_hz = np.asarray(frequency_hz, float) * (1 + STD * rng.standard_normal(len(frequency_hz)))
    order = np.argsort(frequency_hz)
    return ModeSet(
        frequency_hz=frequency_hz[order],
        frequency_std_hz=STD * frequency_hz[order],
        damping_ratio=np.full(order.size, 0.02),
        damping_std=np.full(order.size, 2e-3),
        shapes=shapes[order],
        shape_std=np.full((order.size, 3), 0.01 + 0.01j),
        channels=CHANNELS,
        provenance=Provenance(estimator="made"),
    )


def test_scatter_moves_no_mode() -> None:
    tracker = ModeTracker()
    told = [text for look in range(200) for text in tracker.look(found([5.0, 9.0, 20.0], seed=look), float(look))]
    assert told == []
    assert [mode.number for mode in tracker.modes] == [1, 2, 3]
    assert all(mode.looks == 200 for mode in tracker.modes)


def test_a_mode_that_moves_is_told_once_and_keeps_its_number() -> None:
    tracker = ModeTracker()
    told = []
    for look in range(30):
        moved_hz = 9.0 if look < 15 else 8.6
        told += [(look, text) for text in tracker.look(found([5.0, moved_hz, 20.0], seed=look), float(look))]
    ((when, text),) = told
    assert when == 17
    assert "moved to 8.6" in text
    assert [mode.number for mode in tracker.modes] == [1, 2, 3]


def test_modes_that_cross_are_told_apart_by_their_shapes() -> None:
    tracker = ModeTracker()
    for look in range(21):
        first, second = 9.0 + 0.05 * look, 9.5
        tracker.look(found([first, second], SHAPES[:2], seed=look), float(look))
    by_number = {mode.number: mode.frequency_hz for mode in tracker.modes}
    assert abs(by_number[1] - 10.0) < 0.05
    assert abs(by_number[2] - 9.5) < 0.05


def test_a_mode_that_isnt_seen_any_more_is_told_and_so_is_its_return() -> None:
    tracker = ModeTracker()
    told = []
    for look in range(30):
        frequencies = [5.0, 9.0] if not 10 <= look < 20 else [5.0]
        told += tracker.look(found(frequencies, SHAPES[: len(frequencies)], seed=look), float(look))
    assert [text.split("Hz")[1] for text in told] == [" isn't seen any more", " is back"]
