"""How far the gap closes on samples that no fit saw."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from chladni.gap.calibration import COVERAGE, DOUBT, DRAWS, LITTLE, ZERO
from chladni.gap.comparison.shares import pooled_gap
from chladni.gap.explanation.contest import held_gap
from chladni.gap.records.diagnosis import Closing, HeldOut
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Mask, Real
from chladni.spectral.filters import channel_runs


@dataclass(frozen=True, kw_only=True)
class Yardstick:
    """What simulations of a log are held against.

    Attributes
    ----------
    held
        ``[sample]`` that no fit saw.
    noise
        The floor, as far as what is believed leaves it.
    windows
        ``(start, stop)`` samples, None in free run.
    across_sensors
        Whether each sensor is predicted from the others.
    """

    measurement: Measurement
    held: Mask
    noise: NoiseFloor
    windows: Sequence[tuple[int, int]] | None
    across_sensors: bool = False

    @property
    def by(self) -> Literal["free_run", "windows", "cross_sensor"]:
        """See `Closing`."""
        if self.across_sensors:
            return "cross_sensor"
        return "free_run" if self.windows is None else "windows"

    @property
    def horizon_s(self) -> float | None:
        """Length of a window, None in free run."""
        if self.windows is None:
            return None
        return max(stop - start for start, stop in self.windows) / self.measurement.sample_rate_hz

    @cached_property
    def floor(self) -> float:
        """The noise over the RMS of what was measured, outputs pooled."""
        measured = self.measurement.outputs[:, self.held]
        return pooled_gap(np.broadcast_to(self.noise.rms[:, None], measured.shape), measured)

    @property
    def doubt(self) -> float:
        """What the noise itself is uncertain by, which is no gap."""
        return self.floor * (float(np.max(self.noise.std)) + DOUBT / 2)

    def closed(self, before: float, after: float) -> float | None:
        """Share of the gap that is closed, None when there is none beyond doubt."""
        if not np.isfinite(before) or before - self.floor <= self.doubt:
            return None
        return float(np.clip((before - after) / (before - self.floor), 0.0, 1.0))

    def explained(self, tuned: float, after: float) -> float | None:
        """Share of the power that tuning leaves beyond the noise, see `Closing`."""
        # With nothing added there is no share of it to tell; nor where tuning leaves hardly more than the noise.
        if after == tuned or self.closed(tuned, after) is None:
            return None
        return explained_power(tuned, tuned, after, noise=self.floor)


def explained_power(left: float, tuned: float, after: float, *, noise: float) -> float:
    """Give the share of the power that tuning leaves beyond the noise that a cause explains, 0 to 1.

    Gaps are `left` with all causes but this one, `tuned` with none of them, more than `noise`, and `after` with all.
    """
    # A cause is never worth more than all of them: without it the others may be left out, too.
    whole, back = tuned**2 - noise**2, min(left, tuned) ** 2 - after**2
    return float(np.clip(back / whole, 0.0, 1.0))


def closing_of(yardstick: Yardstick, before: Real, tuned: Real, after: Real, *, seed: int) -> Closing:
    """Compare three simulations ``[output, sample]`` with the measurement on held-out samples.

    They're those of the nominal model, with best parameters, and with parameters and effects; the seed is the
    bootstrap's.
    """
    measured, held = yardstick.measurement.outputs, yardstick.held
    log, rate = yardstick.measurement.log, yardstick.measurement.sample_rate_hz
    gaps = [held_gap(measured, one, held) for one in (before, tuned, after)]
    return Closing(
        before=gaps[0],
        tuned=gaps[1],
        after=gaps[2],
        noise=yardstick.floor,
        closed=yardstick.closed(gaps[0], gaps[2]),
        explained=yardstick.explained(gaps[1], gaps[2]),
        interval=_interval(yardstick, before, after, seed),
        held_out=tuple(
            HeldOut(log=log, start_s=start / rate, end_s=stop / rate) for start, stop in channel_runs(held)
        ),
        by=yardstick.by,
        horizon_s=yardstick.horizon_s,
        noise_at_most=bool(yardstick.noise.upper_bound.any()),
    )


def _interval(yardstick: Yardstick, before: Real, after: Real, seed: int) -> tuple[float, float] | None:
    """95 % interval by drawing held-out blocks with replacement (Kuensch 1989)."""
    measured = yardstick.measurement.outputs
    size = np.maximum(np.mean(measured[:, yardstick.held] ** 2, axis=1, keepdims=True), ZERO)
    blocks = [slice(start, stop) for start, stop in channel_runs(yardstick.held)]
    if len(blocks) < 3:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        powers = np.array(
            [[np.sum((measured - one)[:, block] ** 2 / size) for one in (before, after)] for block in blocks]
        )
    lengths = np.array([(block.stop - block.start) * len(measured) for block in blocks])
    if not np.all(np.isfinite(powers)):
        return None
    drawn = np.random.default_rng(seed).integers(0, len(blocks), (DRAWS, len(blocks)))
    root = np.sqrt(powers[drawn].sum(axis=1) / lengths[drawn].sum(axis=1)[:, None])
    found = [yardstick.closed(float(one), float(other)) for one, other in root]
    shares = [one for one in found if one is not None]
    if len(shares) < (1 - LITTLE) * DRAWS:
        return None
    low, high = np.quantile(shares, ((1 - COVERAGE) / 2, (1 + COVERAGE) / 2))
    return float(low), float(high)
