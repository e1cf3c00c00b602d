"""States of a log on their grid, and commands held on it between their messages (zero-order hold)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chladni.signals.errors import LogError
from chladni.signals.join import join_resampled
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from chladni.io.log import Log
    from chladni.io.log_reader import StampedSamples
    from chladni.signals.arrays import Real, Whole

_Span = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StatesAndCommands:
    """States, and what was commanded at each of their samples.

    Attributes
    ----------
    states
        On one grid.
    commands
        ``[sample]`` on it by path; NaN where nothing was commanded yet, or any more.
    messages
        By path the times from which each holds, seconds from the grid's start, and the commands.
    command_rate_hz
        None where they come at no rate.
    remarks
        How they were brought together.
    """

    states: TimeSeries
    commands: Mapping[str, Real]
    messages: Mapping[str, tuple[Real, Real]]
    command_rate_hz: float | None
    remarks: tuple[str, ...]


def read_held(log: Log, states: Sequence[str], commands: Sequence[str], span_s: _Span) -> StatesAndCommands:
    """Read states and commands.

    Commands that share the grid of the states are taken sample by sample. Others are held from one to the next: at
    their own rate, or from their stamps where these scatter by more than a sample of the states.

    Parameters
    ----------
    log
        The log.
    states, commands
        Paths.
    span_s
        Start and end of what is read, seconds from the log's start.

    Raises
    ------
    LogError
        When states aren't uniform, or clocks were set at different times.
    """
    groups, rated = _groups(log, states, commands, span_s)
    main = max(groups, key=lambda one: len(_names(one) & set(states)))
    others = [one for one in groups if one is not main]
    remarks: list[str] = []
    missing = [name for name in states if name not in _names(main)]
    if missing:
        remarks.append(
            f"{counted(len(missing), 'signal')} of the state come in other messages: resampled to "
            f"{main.sample_rate_hz:.6g} Hz"
        )
    rows = {channel.name: main.values[row].astype(np.float64) for row, channel in enumerate(main.channels)}
    held = {name: rows[name] for name in commands if name in rows}
    messages = {name: _lasting(main.times_ns(), row, main) for name, row in held.items()}
    rate_hz = main.sample_rate_hz if held else None
    away = [name for name in commands if name not in held]
    if away:
        own = [one for one in others if _names(one) & set(away)]
        by_stamps = log.stamped(away, start_s=span_s[0], end_s=span_s[1])
        if rated and _scatter_s(own, by_stamps) < 1 / main.sample_rate_hz:
            held |= _held_at_rate(own, main)
            for one in own:
                parts = zip(one.channels, one.values, strict=True)
                messages |= {each.name: _lasting(one.times_ns(), row, main) for each, row in parts}
            rate_hz = min(one.sample_rate_hz for one in own)
            remarks.append(_grids_apart(main, own[0]))
        else:
            held |= _held_from_stamps(by_stamps, main)
            for part in by_stamps:
                rows_of = zip(part.channels, part.values, strict=True)
                messages |= {each.name: _lasting(part.times_ns, row, main) for each, row in rows_of}
            most = max((one.times_ns.size for one in by_stamps), default=0)
            remarks.append(
                f"{counted(most, 'command')} at no fixed rate: each is held from its own stamp until the next, the "
                "last until the end"
            )
    if missing:
        main = _with_others(main, [one for one in others if _names(one) & set(missing)], missing)
    return StatesAndCommands(
        states=main.select(list(states)), commands=held, messages=messages, command_rate_hz=rate_hz,
        remarks=tuple(remarks),
    )  # fmt: skip


def _lasting(times_ns: Whole, values: Real, states: TimeSeries) -> tuple[Real, Real]:
    """Seconds from the grid's start from which each command holds, and the commands that are numbers."""
    there = np.isfinite(values)
    return (times_ns[there] - states.start_time_ns) / NS_PER_S, values[there].astype(np.float64)


def _groups(
    log: Log, states: Sequence[str], commands: Sequence[str], span_s: _Span
) -> tuple[tuple[TimeSeries, ...], bool]:
    """Read what lies on grids: states always, commands where they have a rate, which is told."""
    start_s, end_s = span_s
    both = [*states, *commands]
    try:
        return log.read_groups(both, start_s=start_s, end_s=end_s, one_clock=bool(commands)), True
    except LogError:
        if not commands:
            raise
        # What is wrong with the states is told from here.
        groups = log.read_groups(states, start_s=start_s, end_s=end_s)
        if _readable(log, both, span_s):
            # Then it's the clocks that don't fit.
            raise
        return groups, False


def _readable(log: Log, paths: Sequence[str], span_s: _Span) -> bool:
    try:
        log.read_groups(paths, start_s=span_s[0], end_s=span_s[1])
    except LogError:
        return False
    return True


def _scatter_s(grids: Sequence[TimeSeries], stamped: Sequence[StampedSamples]) -> float:
    """Root mean square of stamps about the grid that they lie on; the most of several grids."""
    grid_of = {name: one for one in grids for name in _names(one)}
    scatter = [0.0]
    for part in stamped:
        grid = grid_of[part.channels[0].name]
        place = (part.times_ns - grid.start_time_ns) * (grid.sample_rate_hz / NS_PER_S)
        scatter.append(float(np.sqrt(np.mean((place - np.round(place)) ** 2))) / grid.sample_rate_hz)
    return max(scatter)


def _held_at_rate(grids: Sequence[TimeSeries], states: TimeSeries) -> dict[str, Real]:
    found = join_resampled(
        grids,
        sample_rate_hz=states.sample_rate_hz,
        start_time_ns=states.start_time_ns,
        samples=states.samples,
        method="hold",
    ).series
    return {channel.name: found.values[row].astype(np.float64) for row, channel in enumerate(found.channels)}


def _held_from_stamps(stamped: Sequence[StampedSamples], states: TimeSeries) -> dict[str, Real]:
    times_ns = states.times_ns()
    return {
        channel.name: hold(part.times_ns, part.values[row].astype(np.float64), times_ns)
        for part in stamped
        for row, channel in enumerate(part.channels)
    }


def hold(times_ns: Whole, values: Real, at_ns: Whole) -> Real:
    """Give the last value at or before each time; NaN before the first.

    Examples
    --------
    >>> hold(np.array([10, 20]), np.array([1.0, 2.0]), np.array([5, 10, 19, 20, 99]))
    array([nan,  1.,  1.,  2.,  2.])
    """
    finite = np.isfinite(values)
    times_ns, values = times_ns[finite], values[finite]
    if not values.size:
        return np.full(at_ns.size, np.nan)
    place = np.searchsorted(times_ns, at_ns, side="right") - 1
    return np.where(place >= 0, values[np.maximum(place, 0)], np.nan)


def _grids_apart(states: TimeSeries, commands: TimeSeries) -> str:
    """Say in what the commands' grid differs from that of the states."""
    later = (commands.start_time_ns - states.start_time_ns) * states.sample_rate_hz / NS_PER_S
    later_ms = 1e3 * (later - round(later)) / states.sample_rate_hz
    # Rates are shown with six digits.
    if f"{commands.sample_rate_hz:.6g}" == f"{states.sample_rate_hz:.6g}":
        apart = f"{abs(later_ms):.3g} ms {'after' if later_ms > 0 else 'before'}"
        return f"commands are stamped {apart} the states' samples: each is held from its stamp on"
    return (
        f"commands come at {commands.sample_rate_hz:.6g} Hz, states at {states.sample_rate_hz:.6g} Hz: each command "
        "is held until the next"
    )


def _with_others(states: TimeSeries, others: Sequence[TimeSeries], missing: Sequence[str]) -> TimeSeries:
    """Bring states that come in other messages to the grid of most."""
    found = join_resampled(
        others,
        sample_rate_hz=states.sample_rate_hz,
        start_time_ns=states.start_time_ns,
        samples=states.samples,
        method="band-limited",
    ).series.select(list(missing))
    return TimeSeries(
        values=np.concatenate([states.values, found.values]),
        sample_rate_hz=states.sample_rate_hz,
        start_time_ns=states.start_time_ns,
        channels=(*states.channels, *found.channels),
    )


def _names(series: TimeSeries) -> set[str]:
    return {channel.name for channel in series.channels}
