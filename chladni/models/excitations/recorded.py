"""A signal from a log."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """One channel of a series, sample for sample."""

    series: TimeSeries
    channel: str

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:  # noqa: ARG002  # nothing here is random
        """Give ``[sample]``.

        Raises
        ------
        ModelError
            When the rate differs, the series is too short or a sample is missing: nothing is resampled, padded or
            bridged here.
        """
        row = self.series.index(self.channel)
        if abs(self.series.sample_rate_hz - sample_rate_hz) > 1e-9 * sample_rate_hz:
            raise ModelError(
                f"{self.channel}: recorded at {self.series.sample_rate_hz:g} Hz, simulated at {sample_rate_hz:g} Hz; "
                "simulate at the log's rate or resample the log"
            )
        values = np.asarray(self.series.values[row, :count], dtype=np.float64)
        if values.size < count:
            raise ModelError(
                f"{self.channel}: {values.size} samples recorded, {count} needed; simulate fewer seconds"
            )
        missing = ~np.isfinite(values)
        if self.series.valid is not None:
            missing |= ~self.series.valid[row, :count]
        if missing.any():
            at_s = float(np.argmax(missing)) / sample_rate_hz
            raise ModelError(f"{self.channel}: no sample at {at_s:g} s; choose a stretch of the log without gaps")
        return values
