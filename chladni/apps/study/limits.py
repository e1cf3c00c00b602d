"""What left its band: followed quantities against the limits of a recipe and against an earlier study."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.special import ndtri

from chladni.apps.study.trends import Trends, title
from chladni.signals.trend import Trend

if TYPE_CHECKING:
    from chladni.io.study.recipe_file import LimitTable

#: Sigmas of a value's own error by which it must be beyond a limit: 95 % of one side.
SURE: Final = 1.645
#: Chance that a study like the earlier one shows any change, shared among all quantities.
FALSE_ALARM: Final = 0.01
#: How near a mode or a line must be to the frequency that a limit names.
NEAR: Final = 0.1
ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class OutOfBand:
    """A value that left its band.

    Attributes
    ----------
    what
        The quantity, in words.
    log
        Whose value it is; empty of a comparison of studies.
    value, std, unit
        And one sigma of it; infinite where it isn't known.
    low, high
        The band; infinite where it has no end.
    rule
        Whose band it is, in words.
    """

    what: str
    log: str
    value: float
    std: float
    unit: str
    low: float
    high: float
    rule: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What was held against limits.

    Attributes
    ----------
    outside
        What left its band.
    checked
        Quantities that were held against something.
    missing
        Limits, or quantities of the earlier study, that nothing here answers to, in sentences.
    """

    outside: tuple[OutOfBand, ...]
    checked: int
    missing: tuple[str, ...]


def judge(now: Trends, limits: "Sequence[LimitTable]", before: Trends | None = None) -> Verdict:
    """Hold what a study followed against limits, and against an earlier study.

    Parameters
    ----------
    now
        The study.
    limits
        Tables ``[[limit]]`` of its recipe: each value of each log must keep to ``low`` and ``high``, however few logs
        show it; the level since the last change must keep within ``change_percent`` of the earlier study's.
    before
        The earlier study, or None. What no limit with ``change_percent`` names must differ from it by no more than
        chance explains.

    Notes
    -----
    A value is outside when it's beyond a limit by more than 1.645 of its own sigmas, so that its error alone would
    put it there once in twenty times at most.
    """
    outside: list[OutOfBand] = []
    missing: list[str] = []
    checked = 0
    for limit in limits:
        meant = [one for one in (*now.trends, *now.seldom) if _is_meant(limit, one)]
        checked += len(meant)
        if not meant:
            missing.append(f"[[limit]] of {_words(limit)}: no log shows it, so it isn't checked")
        outside += [found for one in meant for found in _beyond(limit, one)]
    if before is not None:
        compared = [_counterpart(one, now.trends) for one in before.trends]
        checked += sum(one is not None for one in compared)
        for old, new in zip(before.trends, compared, strict=True):
            if new is None:
                missing.append(f"{title(old)} of the baseline isn't seen any more")
            else:
                outside += _changed(old, new, limits, count=len(before.trends))
    return Verdict(outside=tuple(outside), checked=checked, missing=tuple(missing))


def _words(limit: "LimitTable") -> str:
    parts = [limit.of, limit.channel or "", f"near {limit.near_hz:g} Hz" if limit.near_hz is not None else ""]
    return " ".join(filter(None, parts))


def _is_meant(limit: "LimitTable", trend: Trend) -> bool:
    if limit.of != trend.kind or (limit.channel is not None and limit.channel != trend.channel):
        return False
    return limit.near_hz is None or limit.of == "level" or abs(trend.near_hz / limit.near_hz - 1) <= NEAR


def _beyond(limit: "LimitTable", trend: Trend) -> Iterator[OutOfBand]:
    low = -np.inf if limit.low is None else limit.low
    high = np.inf if limit.high is None else limit.high
    error = np.where(np.isfinite(trend.std), trend.std, 0.0)
    far = (trend.values - SURE * error > high) | (trend.values + SURE * error < low)
    for place in np.flatnonzero(far):
        yield OutOfBand(
            what=title(trend),
            log=trend.logs[place],
            value=float(trend.values[place]),
            std=float(trend.std[place]),
            unit=trend.unit,
            low=low,
            high=high,
            rule=f"limit of {_words(limit)}",
        )


def _counterpart(old: Trend, trends: Sequence[Trend]) -> Trend | None:
    """Find the same quantity: by name and channel, and by frequency where it has one."""
    alike = [one for one in trends if (one.kind, one.channel, one.unit) == (old.kind, old.channel, old.unit)]
    if old.kind == "cause":
        return next((one for one in alike if one.name == old.name), None)
    near = [one for one in alike if abs(one.near_hz - old.near_hz) <= NEAR * max(old.near_hz, 1e-12)]
    return min(near, key=lambda one: abs(one.near_hz - old.near_hz), default=None)


def _changed(old: Trend, new: Trend, limits: "Sequence[LimitTable]", *, count: int) -> Iterator[OutOfBand]:
    (before, before_std), (after, after_std) = _latest(old), _latest(new)
    # At the baseline's temperature: two months of another season differ by it.
    known = {one.channel: one for one in old.covariates}
    for effect in new.covariates:
        if effect.channel in known:
            apart = effect.mean - known[effect.channel].mean
            after -= effect.slope * apart
            after_std = float(np.hypot(after_std, effect.slope_std * apart))
    std = float(np.hypot(before_std, after_std))
    asked = [one.change_percent for one in limits if one.change_percent is not None and _is_meant(one, new)]
    if asked:
        allowed, rule = min(asked) / 100 * abs(before), f"{min(asked):g} % about the baseline"
        beyond = abs(after - before) - SURE * std > allowed
    else:
        allowed, rule = float(-ndtri(FALSE_ALARM / (2 * count))) * std, "the baseline's scatter"
        # What never scatters differs in its last digits all the same.
        beyond = abs(after - before) > allowed + ROUNDING * abs(before)
    if beyond:
        yield OutOfBand(
            what=title(new), log="", value=after, std=after_std, unit=new.unit, low=before - allowed,
            high=before + allowed, rule=rule,
        )  # fmt: skip


def _latest(trend: Trend) -> tuple[float, float]:
    """Give the level since the last change, what covariates explain taken off, and one sigma of it."""
    first = trend.changes[-1].place if trend.changes else 0
    level = (trend.values - trend.explained)[first:]
    return float(level.mean()), trend.scatter / float(np.sqrt(level.size))
