"""Modes followed from one look to the next, by frequency and shape."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from chladni.modal.shapes.mode_comparison import compare_modes
from chladni.signals.live_state import TrackedMode
from chladni.signals.mode_change import ModeChange
from chladni.signals.mode_set import ModeSet
from chladni.signals.wording import with_sigma

#: Chance that any mode of an unchanged structure is said to have moved, at one look.
FALSE_ALARM: Final = 1e-4
#: Looks in a row that must agree before a change is told, or a mode counts as gone.
LOOKS: Final = 3
#: Positions that a track remembers; more than a picture has room for.
MOST_REMEMBERED: Final = 4096


@dataclass(slots=True, kw_only=True, eq=False)
class _Track:
    """A mode, and the set and row that later looks are compared with."""

    mode: TrackedMode
    reference: ModeSet
    moved: int = 0
    told_gone: bool = False


class ModeTracker:
    """Follows modes; mutable.

    A track keeps the mode as it was when it was last judged steady. A later look belongs to it if its frequency is
    within a tenth and the shape agrees (see `compare_modes`). A shift beyond the error bars at three looks in a row
    is told, and the track goes on from there.
    """

    def __init__(self, *, false_alarm: float = FALSE_ALARM) -> None:
        self._false_alarm = false_alarm
        self._tracks: list[_Track] = []
        self._count = 0

    @property
    def modes(self) -> tuple[TrackedMode, ...]:
        """The modes at present, by frequency; those that were missed for long are left out."""
        seen = [track.mode for track in self._tracks if track.mode.missed < LOOKS]
        return tuple(sorted(seen, key=lambda mode: mode.frequency_hz))

    def look(self, found: ModeSet, time_s: float) -> tuple[str, ...]:
        """Take the modes of one look; give sentences on what changed beyond error bars."""
        told: list[str] = []
        matched: set[int] = set()
        # Shapes over other channels can't be compared: all is begun anew.
        self._tracks = [track for track in self._tracks if track.reference.channels == found.channels]
        self._tracks.sort(key=lambda track: float(track.reference.frequency_hz[0]))
        seen: set[int] = set()
        for change in self._changes(found):
            if change.before is not None and change.after is not None:
                matched.add(change.after)
                seen.add(change.before)
                told += self._seen(self._tracks[change.before], found, change, time_s)
        for place, track in enumerate(self._tracks):
            if place not in seen:
                told += self._missed(track)
        for row in range(found.frequency_hz.size):
            if row not in matched:
                self._begin(found, row, time_s)
        # A mode that was seen once, and never again, was scatter.
        self._tracks = [
            one
            for one in self._tracks
            if one.mode.missed < LOOKS or (one.mode.looks >= LOOKS and one.mode.missed < 99)
        ]
        return tuple(told)

    def _changes(self, found: ModeSet) -> tuple[ModeChange, ...]:
        if not self._tracks or not found.frequency_hz.size:
            return ()
        return compare_modes(
            _together([track.reference for track in self._tracks]), found, false_alarm=self._false_alarm
        )

    def _begin(self, found: ModeSet, row: int, time_s: float) -> None:
        self._count += 1
        mode = TrackedMode(
            number=self._count,
            mac=1.0,
            first_s=time_s,
            last_s=time_s,
            looks=1,
            **_numbers(found, row),
        )
        self._tracks.append(_Track(mode=mode, reference=_one(found, row)))

    def _seen(self, track: _Track, found: ModeSet, change: ModeChange, time_s: float) -> tuple[str, ...]:
        before, row = track.mode, change.after or 0
        track.mode = replace(
            before,
            mac=1.0 if change.mac is None else change.mac,
            last_s=time_s,
            looks=before.looks + 1,
            missed=0,
            **_numbers(found, row),
        )
        back = (f"the mode at {before.frequency_hz:.5g} Hz is back",) if track.told_gone else ()
        track.told_gone = False
        track.moved = track.moved + 1 if change.fate == "changed" else 0
        if track.moved < LOOKS:
            return back
        track.moved, track.reference = 0, _one(found, row)
        return (*back, _moved_sentence(change))

    def _missed(self, track: _Track) -> tuple[str, ...]:
        track.mode = replace(track.mode, missed=track.mode.missed + 1)
        if track.mode.missed == LOOKS and track.mode.looks >= LOOKS:
            track.told_gone = True
            return (f"the mode at {track.mode.frequency_hz:.5g} Hz isn't seen any more",)
        return ()


def _moved_sentence(change: ModeChange) -> str:
    shift = with_sigma(change.shift_hz or 0.0, change.shift_std_hz or 0.0)
    damping = with_sigma(100 * (change.damping_change or 0.0), 100 * (change.damping_change_std or 0.0))
    return (
        f"the mode at {change.before_hz:.5g} Hz moved to {change.after_hz:.5g} Hz: {shift} Hz, damping {damping} % "
        f"of critical, MAC {change.mac:.2f}"
    )


def _numbers(found: ModeSet, row: int) -> dict[str, Any]:
    return {
        "frequency_hz": float(found.frequency_hz[row]),
        "frequency_std_hz": float(found.frequency_std_hz[row]),
        "damping_ratio": float(found.damping_ratio[row]),
        "damping_std": float(found.damping_std[row]),
    }


def _one(found: ModeSet, row: int) -> ModeSet:
    """A mode alone, without all that belongs to its set."""
    return ModeSet(
        frequency_hz=found.frequency_hz[row : row + 1],
        frequency_std_hz=found.frequency_std_hz[row : row + 1],
        damping_ratio=found.damping_ratio[row : row + 1],
        damping_std=found.damping_std[row : row + 1],
        shapes=found.shapes[row : row + 1],
        shape_std=found.shape_std[row : row + 1],
        channels=found.channels,
        provenance=found.provenance,
    )


def _together(modes: Sequence[ModeSet]) -> ModeSet:
    """Single modes of the same channels as one set; they come by rising frequency."""
    parts: dict[str, Any] = {
        name: np.concatenate([getattr(one, name) for one in modes])
        for name in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std", "shapes", "shape_std")
    }
    return ModeSet(**parts, channels=modes[0].channels, provenance=modes[0].provenance)
