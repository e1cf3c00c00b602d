"""The movement of a mode, written on every timeline: it must be seen whichever is active.

On `phase` it runs through one period. On `time` it runs from second 0 on, so that pressing play moves it without a
word about timelines, and then rests at phase 0, where it is also on `frequency`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Self

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from chladni.signals.arrays import Real, Whole
from chladni.signals.study import Study
from chladni.viewers.rerun.timelines import FREQUENCY, PERIOD_S, motion_index, phase_index, send_columns

STEP_DEG = 6
# Twelve bytes each: a few megabytes of movement in a file.
VERTICES_OF_A_STUDY = 400_000

Columns = Callable[[Real], rr.ComponentColumnList]


@dataclass(frozen=True, slots=True, kw_only=True)
class Movement:
    """Phases that are written, and how often the period is repeated on `time`.

    Attributes
    ----------
    phase_deg
        ``[frame]`` from 0 to 360, both included, so that the loop closes.
    periods
        How often the motion runs on `time`, at least once.
    """

    phase_deg: Whole
    periods: int

    @classmethod
    def of(cls, study: Study, *, vertices: int) -> Self:
        """Choose for a study of which `vertices` move in all its modes: as long as the log, if memory allows."""
        phase_deg = np.arange(0, 361, STEP_DEG)
        end_s = max((series.duration_s for series in study.series), default=0.0)
        affordable = VERTICES_OF_A_STUDY // max(phase_deg.size * vertices, 1)
        return cls(phase_deg=phase_deg, periods=max(1, min(ceil(end_s / PERIOD_S), affordable)))

    def frames(self, motion: NDArray[np.complexfloating]) -> Real:
        """Give Re(motion e^{j phase}), ``[frame, ...]``: a wave that travels in the shape travels on the screen."""
        turn = np.exp(1j * np.deg2rad(self.phase_deg))
        return np.asarray(np.multiply.outer(turn.real, motion.real) - np.multiply.outer(turn.imag, motion.imag))

    def send(self, recording: rr.RecordingStream, path: str, frames: Real, columns: Columns) -> None:
        """Write ``[frame, ...]`` on all timelines; `columns` makes rerun's columns of frames, one row a frame."""
        send_columns(recording, path, phase_index(self.phase_deg), columns(frames))
        # The last frame is the first of the next period; it is kept once, at the end.
        period, frame = np.divmod(np.arange(self.periods * (self.phase_deg.size - 1) + 1), self.phase_deg.size - 1)
        index = motion_index(period, self.phase_deg[frame])
        send_columns(recording, path, index, columns(frames[frame]))
        send_columns(recording, path, {FREQUENCY: np.zeros(1, dtype=np.int64)}, columns(frames[:1]))
