"""Shares with their uncertainty, and how well probabilities are calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

_Z = 1.959963984540054


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """`right` of `count`, with Wilson's 95 % interval.

    E. B. Wilson, Journal of the American Statistical Association 22 (1927).

    Examples
    --------
    >>> one = Share(right=9, count=10)
    >>> one.value, round(one.low, 3), round(one.high, 3)
    (0.9, 0.596, 0.982)
    >>> Share(right=0, count=0).value is None
    True
    """

    right: int
    count: int

    @property
    def value(self) -> float | None:
        """The share; None of nothing."""
        return self.right / self.count if self.count else None

    @property
    def low(self) -> float:
        """Lower end of the interval; 0 of nothing."""
        return self._end(-1.0)

    @property
    def high(self) -> float:
        """Upper end of the interval; 1 of nothing."""
        return self._end(1.0)

    def _end(self, side: float) -> float:
        if not self.count:
            return 0.0 if side < 0 else 1.0
        n, p, z2 = self.count, self.right / self.count, _Z**2
        middle, half = p + z2 / (2 * n), _Z * sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        # Rounding would leave an end a hair outside.
        return min(max((middle + side * half) / (1 + z2 / n), 0.0), 1.0)

    def told(self) -> dict[str, Any]:
        """Give it for JSON."""
        return {"right": self.right, "count": self.count, "share": self.value, "interval": [self.low, self.high]}


def share_of(marks: Sequence[bool]) -> Share:
    """Share of those that are true."""
    return Share(right=sum(marks), count=len(marks))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reliability:
    """One bin of a reliability diagram."""

    low: float
    high: float
    count: int
    probability: float
    right: float


def reliability(probabilities: Sequence[float], right: Sequence[bool], *, bins: int = 10) -> list[Reliability]:
    """Bins of equal width that hold any, each with its mean probability and its share of right answers.

    Examples
    --------
    >>> [(one.count, one.right) for one in reliability([0.95, 0.97, 0.3], [True, False, False])]
    [(1, 0.0), (2, 0.5)]
    """
    p, hit = np.asarray(probabilities, dtype=float), np.asarray(right, dtype=float)
    place = np.minimum((p * bins).astype(int), bins - 1)
    return [
        Reliability(low=k / bins, high=(k + 1) / bins, count=int(np.sum(place == k)),
                    probability=float(p[place == k].mean()), right=float(hit[place == k].mean()))
        for k in range(bins) if np.any(place == k)
    ]  # fmt: skip


def calibration_error(table: Sequence[Reliability]) -> float | None:
    """Expected calibration error: mean distance of probability and share, weighted by the bins' counts.

    M. P. Naeini, G. F. Cooper, M. Hauskrecht, AAAI (2015), equation 6.
    """
    total = sum(one.count for one in table)
    return sum(one.count * abs(one.probability - one.right) for one in table) / total if total else None
