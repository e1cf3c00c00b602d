"""Log evidence that records are expected to bring between candidates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import EFFECTIVE_SAMPLES
from chladni.gap.design.course import Course
from chladni.gap.design.rival import Rival, imitated
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: An experiment with the rows of the outputs that are measured in it.
Record = tuple[Course, tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class Separation:
    """How far apart candidates are.

    Attributes
    ----------
    rivals
        The first is compared with each other one.
    noise
        Of all outputs.
    detail
        ``[output]`` share of an output's power that even the right law would leave.
    """

    rivals: Sequence[Rival]
    noise: NoiseFloor
    detail: Real

    def nats(self, records: Sequence[Record], *, passes: int = 1) -> Real:
        """Give ``[rival]`` against the first candidate, of records that are explained together.

        The mean of the log evidence that is expected when the one is true and when the other is (Box & Hill 1967),
        with the likelihood of the contest.

        Parameters
        ----------
        passes
            Linear steps of each refit.

        Raises
        ------
        EstimateError
            When slopes are not finite.
        """
        return np.array(
            [
                0.5 * (self._lost(records, (0, other), passes) + self._lost(records, (other, 0), passes))
                for other in range(1, len(self.rivals))
            ]
        )

    def _lost(self, records: Sequence[Record], pair: tuple[int, int], passes: int) -> float:
        """Nats that the second of a pair is behind when the first is true, however it's refitted."""
        rival = self.rivals[pair[1]]
        at, best = np.zeros(rival.unknowns), np.inf
        for step in range(passes):
            try:
                parts = [
                    course.part(self.noise, self.detail, chosen, pair, at if step else None)
                    for course, chosen in records
                ]
            except ModelError:
                # Where it diverges it imitates nothing: what was found before stands.
                break
            at, left = imitated(rival, at, parts)
            shares = [np.log1p(one / part.scale) for one, part in zip(left, parts, strict=True)]
            lost = 0.5 * EFFECTIVE_SAMPLES * float(np.sum(np.concatenate(shares))) + rival.paid(at)
            # A step may promise too much; that it promises too little is not possible for long.
            best = min(best, max(lost, 0.0))
        return best
