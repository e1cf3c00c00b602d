"""Modes followed over many logs, by frequency and shape."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from chladni.modal.shapes.mode_comparison import FARTHEST, LEAST_MAC, cheapest_pairs
from chladni.signals.arrays import Complex, Real

#: Sightings that tell where a mode is now: it may drift over the year, and one sighting may be off.
REMEMBERED: Final = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenModes:
    """The modes of one log.

    Attributes
    ----------
    frequency_hz
        ``[mode]``.
    shapes
        ``[mode, channel]``.
    channels
        Names.
    """

    frequency_hz: Real
    shapes: Complex
    channels: tuple[str, ...]


@dataclass(slots=True, kw_only=True, eq=False)
class ModeTrack:
    """One mode over logs.

    Attributes
    ----------
    sightings
        Row of the mode in each log that has it, by the log's number.
    """

    sightings: dict[int, int] = field(default_factory=dict)
    _frequencies_hz: list[float] = field(default_factory=list)
    _shape: Mapping[str, complex] = field(default_factory=dict)

    @property
    def frequency_hz(self) -> float:
        """Where it was lately."""
        return float(np.median(self._frequencies_hz[-REMEMBERED:]))

    def see(self, log: int, row: int, seen: SeenModes) -> None:
        """Note a sighting."""
        self.sightings[log] = row
        self._frequencies_hz.append(float(seen.frequency_hz[row]))
        self._shape = dict(zip(seen.channels, seen.shapes[row].tolist(), strict=True))

    def likeness(self, seen: SeenModes) -> Real:
        """``[mode]`` MAC with the shape as it was last seen, over the channels that both have; 1 without any."""
        shared = [column for column, name in enumerate(seen.channels) if name in self._shape]
        if len(shared) < 2:
            return np.ones(seen.frequency_hz.size)
        mine = np.array([self._shape[seen.channels[column]] for column in shared])
        theirs = seen.shapes[:, shared]
        sizes = (np.abs(theirs) ** 2).sum(axis=1) * (np.abs(mine) ** 2).sum()
        return np.asarray(np.abs(theirs @ mine.conj()) ** 2 / np.maximum(sizes, np.finfo(float).tiny))


def follow_modes(
    logs: Sequence[SeenModes], *, farthest: float = FARTHEST, least_mac: float = LEAST_MAC
) -> tuple[ModeTrack, ...]:
    """Follow modes from log to log.

    Parameters
    ----------
    logs
        In the order of time; a log without modes is an empty one.
    farthest
        By what share of its frequency a mode may move since it was seen.
    least_mac
        How alike shapes of one mode are, at least.

    Returns
    -------
    tuple of ModeTrack
        By frequency; one that was seen in a single log is a track, too.

    Notes
    -----
    Pairs are chosen for all modes of a log at once, as `compare_modes` chooses them, against the frequency where each
    mode was lately (the median of five sightings) and the shape that it had last.
    """
    tracks: list[ModeTrack] = []
    for number, seen in enumerate(logs):
        taken: set[int] = set()
        if tracks and seen.frequency_hz.size:
            before_hz = np.array([track.frequency_hz for track in tracks])
            likeness = np.vstack([track.likeness(seen) for track in tracks])
            for one, row in cheapest_pairs(
                before_hz, seen.frequency_hz, likeness, farthest=farthest, least_mac=least_mac
            ):
                tracks[one].see(number, row, seen)
                taken.add(row)
        for row in range(seen.frequency_hz.size):
            if row not in taken:
                tracks.append(ModeTrack())
                tracks[-1].see(number, row, seen)
    return tuple(sorted(tracks, key=lambda track: track.frequency_hz))
