"""Modes that drift, cross and vanish, followed by frequency and shape."""

import numpy as np

from chladni.modal.shapes.mode_tracks import SeenModes, follow_modes

SHAPES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, -1.0]], dtype=complex)
NAMES = ("a", "b", "c")


def seen(frequency_hz: list[float], rows: list[int]) -> SeenModes:
    return SeenModes(frequency_hz=np.array(frequency_hz), shapes=SHAPES[rows].reshape(-1, 3), channels=NAMES)


def test_modes_that_cross_are_told_by_their_shapes() -> None:
    logs = []
    for day in range(40):
        bending, torsion = 10 + 0.05 * day, 11 - 0.05 * day
        order = [0, 1] if bending < torsion else [1, 0]
        logs.append(seen(sorted([bending, torsion]), order))
    tracks = follow_modes(logs)
    assert len(tracks) == 2
    rising = max(tracks, key=lambda one: one.frequency_hz)
    assert [logs[day].frequency_hz[row] for day, row in rising.sightings.items()] == [
        10 + 0.05 * d for d in range(40)
    ]


def test_a_mode_that_is_missed_for_a_while_is_the_same_one() -> None:
    logs = [seen([10.0], [0]), seen([], []), seen([], []), seen([10.2, 30.0], [0, 1])]
    tracks = follow_modes(logs)
    assert [sorted(track.sightings) for track in tracks] == [[0, 3], [3]]


def test_another_shape_is_another_mode_however_near() -> None:
    assert len(follow_modes([seen([10.0], [0]), seen([10.0], [1])])) == 2


def test_shapes_are_compared_over_what_both_logs_measured() -> None:
    fewer = SeenModes(frequency_hz=np.array([10.1]), shapes=2j * SHAPES[:1, :2], channels=NAMES[:2])
    [track] = follow_modes([seen([10.0], [0]), fewer])
    assert track.sightings == {0: 0, 1: 0}
