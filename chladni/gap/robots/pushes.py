"""Stretches of a log in which something pushes: a torque of any shape for a while, which no law explains."""

from dataclasses import dataclass
from math import log

import numpy as np
from scipy.ndimage import label, uniform_filter1d

from chladni.gap.calibration import ANOTHER, DETAILS, FAR, LITTLE, MOST, QUARTER
from chladni.gap.robots.contest import Contest, Fit
from chladni.gap.robots.torques import Torques
from chladni.signals.arrays import Mask, Real

#: Periods of the cutoff over which energy is looked at: what a filter of its length can tell apart.
_WINDOW = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """A torque that acts for a while.

    Attributes
    ----------
    start_s, end_s
        From the log's start.
    joints
        At which it's felt, most first.
    torque
        Largest at the first of them, N m (N).
    """

    start_s: float
    end_s: float
    joints: tuple[str, ...]
    torque: float


def pushed(contest: Contest, fit: Fit) -> tuple[tuple[float, float], ...]:
    """Give the stretches that hold most of what a fit leaves beyond the noise; none where it's spread."""
    torques = contest.torques
    energy, count = contest.course(fit)
    if not count.any():
        return ()
    size = max(round(_WINDOW / torques.cutoff_hz * torques.rate_hz), 1)
    ratio = _mean(energy, size) / np.maximum(_mean(count, size), np.mean(count) * LITTLE)
    inside = ratio > max(FAR, LITTLE * float(np.max(ratio)))
    excess = np.maximum(energy - count, 0.0)
    if not inside.any() or inside.mean() > QUARTER or np.sum(excess[inside]) < MOST * np.sum(excess):
        return ()
    times = torques.log.time_s[torques.kept]
    marks, found = label(inside)
    bounds = [np.flatnonzero(marks == each + 1)[[0, -1]] for each in range(found)]
    return tuple((float(times[a]), float(times[b])) for a, b in bounds)


def price(contest: Contest, stretches: tuple[tuple[float, float], ...]) -> float:
    """Give the nats that a torque of any shape in some stretches pays."""
    times = contest.torques.log.time_s
    whole = float(times[-1] - times[0])
    # One of the places that it could be at in a log, at about its own length.
    return sum(DETAILS - log(ANOTHER) + log(max(whole / max(b - a, 1e-3), 1.0)) for a, b in stretches)


def pushes_of(contest: Contest, fit: Fit) -> tuple[Push, ...]:
    """Tell of the stretches that were left out of a contest."""
    torques = contest.torques
    rest = (torques.missing - contest.explained(fit))[: len(torques.joints)]
    times = torques.log.time_s[torques.kept]
    return tuple(_told(torques, rest, times, a, b) for a, b in torques.away)


def _told(torques: Torques, rest: Real, times: Real, start_s: float, end_s: float) -> Push:
    inside: Mask = (times >= start_s) & (times <= end_s)
    over = np.sqrt(np.mean(rest[:, inside] ** 2, axis=1)) / torques.noise[: len(rest)] * torques.driven
    order = np.argsort(-over)
    felt = [int(row) for row in order if over[row] > max(FAR, LITTLE * over[order[0]])] or [int(order[0])]
    return Push(
        start_s=start_s, end_s=end_s, joints=tuple(torques.joints[row].name for row in felt),
        torque=float(np.max(np.abs(rest[felt[0], inside]))),
    )  # fmt: skip


def _mean(values: Real, size: int) -> Real:
    return np.asarray(uniform_filter1d(values, size, mode="constant"))
