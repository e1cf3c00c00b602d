"""Which messages of a log are asked for."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Mask, Whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """Messages of some channels with ``start_time_ns <= log_time < end_time_ns``; None is without bound."""

    channel_ids: frozenset[int]
    start_time_ns: int | None = None
    end_time_ns: int | None = None

    def touches(self, first_ns: int, last_ns: int) -> bool:
        """Tell whether some time from ``first_ns`` to ``last_ns``, both included, is asked for.

        >>> Selection(channel_ids=frozenset(), start_time_ns=5, end_time_ns=9).touches(9, 12)
        False
        """
        starts_late = self.end_time_ns is not None and first_ns >= self.end_time_ns
        ends_early = self.start_time_ns is not None and last_ns < self.start_time_ns
        return not (starts_late or ends_early)

    def covers(self, first_ns: int, last_ns: int) -> bool:
        """Tell whether all times from ``first_ns`` to ``last_ns``, both included, are asked for."""
        starts_before = self.start_time_ns is None or first_ns >= self.start_time_ns
        ends_behind = self.end_time_ns is None or last_ns < self.end_time_ns
        return starts_before and ends_behind

    def mask(self, log_time_ns: Whole) -> Mask:
        """Return which of these times are asked for."""
        chosen = np.ones(len(log_time_ns), np.bool_)
        if self.start_time_ns is not None:
            chosen &= log_time_ns >= self.start_time_ns
        if self.end_time_ns is not None:
            chosen &= log_time_ns < self.end_time_ns
        return chosen
