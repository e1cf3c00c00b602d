"""Samples of the inputs, made into the rows that each step takes."""

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.band_limited import polynomials, rates
from chladni.models.integrator.hold import Hold, chained, split_delay
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def input_rows(compiled: CompiledModel, hold: Hold, signals: Real, sample_rate_hz: float, extra: int) -> Real:
    """Lay out what acts in each step, see `Hold`.

    Parameters
    ----------
    signals
        ``[input, sample]``, as commanded.
    extra
        Steps after the last sample, in which every input keeps its last value.

    Returns
    -------
    ``[sample + extra, width]``; the last row is the value at the end, with nothing after it.
    """
    count = signals.shape[1] + extra
    rows = np.zeros((count, hold.width))
    mapped = _mapped(compiled, signals, sample_rate_hz)
    column = kink = 0
    for place, (terminal, kind) in enumerate(zip(compiled.inputs, compiled.holds, strict=True)):
        delay_s = compiled.input_delays_s[place]
        if delay_s < 0:
            raise ModelError(f"input {terminal.name!r}: delay {delay_s:g} s is negative; an input can only be late")
        whole, fraction = split_delay(delay_s, sample_rate_hz)
        if (length := chained(terminal, kind)) > 1:
            smooth = _band_limited if kind == "band_limited" else _spline
            rows[:, hold.places(column)] = smooth(mapped[place], whole + fraction, count, length, sample_rate_hz).T
        elif fraction:
            _fill_kinked(rows, hold, kink, mapped[place], whole, fraction)
            kink += 1
        else:
            _fill_straight(rows, hold, column, mapped[place], whole)
        column += length
    times_s = np.arange(count) / sample_rate_hz
    for generated in compiled.generated:
        samples = np.asarray(generated.samples(times_s), dtype=np.float64)
        _require(samples, (count,), f"generated input {generated.terminal.name!r}")
        _fill_straight(rows, hold, column, samples, 0)
        column += 1
    return rows


def _mapped(compiled: CompiledModel, signals: Real, sample_rate_hz: float) -> Real:
    mapped = signals.copy() if compiled.input_maps else signals
    for place, sample_map in compiled.input_maps:
        mapped[place] = sample_map(mapped[place], sample_rate_hz)
        _require(mapped[place], (signals.shape[1],), f"input {compiled.inputs[place].name!r} after its effects")
    return mapped


def _require(samples: Real, shape: tuple[int, ...], what: str) -> None:
    if samples.shape != shape:
        raise ModelError(f"{what}: shape {samples.shape}, {shape} was expected")
    if not np.all(np.isfinite(samples)):
        sample = int(np.flatnonzero(~np.isfinite(samples))[0])
        raise ModelError(f"{what}: sample {sample} is {samples[sample]}; every sample must be a finite number")


def _late(samples: Real, whole: int, count: int) -> Real:
    """``[count + 1]`` samples that come `whole` steps late: 0 before the first, the last value after the last."""
    places = np.arange(count + 1) - whole
    return np.where(places < 0, 0.0, samples[np.clip(places, 0, samples.size - 1)])


def _fill_straight(rows: Real, hold: Hold, column: int, samples: Real, whole: int) -> None:
    late = _late(samples, whole, len(rows))
    rows[:, column] = late[:-1]
    if column in hold.held:
        return
    rise = np.diff(late)
    # Before the dead time has passed nothing comes: the first sample is a jump, no ramp from zero.
    rise[: min(whole, rise.size)] = 0.0
    rows[:, hold.rise_of(column)] = rise


def _fill_kinked(rows: Real, hold: Hold, kink: int, samples: Real, whole: int, fraction: float) -> None:
    """In each step the sample from ``whole`` steps ago falls at `fraction`: two straight pieces, or two values."""
    column = int(hold.kinked[kink])
    count = len(rows)
    places = hold.columns + hold.straight.size + kink
    before, at, after = (_late(samples, whole + shift, count)[:count] for shift in (1, 0, -1))
    first, second = at - before, after - at
    if column in hold.held:
        rows[:, column], rows[:, places + hold.kinked.size] = before, first
        return
    jump = np.zeros(count)
    if whole < count:
        # The signal starts inside this step.
        jump[whole], first[whole] = at[whole], 0.0
    second[:whole] = 0.0
    start = before + (1 - fraction) * first
    start[: min(whole + 1, count)] = 0.0
    rows[:, column] = start
    rows[:, hold.rise_of(column)] = first
    rows[:, places] = second - first
    rows[:, places + hold.kinked.size] = jump


def _band_limited(samples: Real, late: float, count: int, length: int, sample_rate_hz: float) -> Real:
    """``[length + 1, count]``: a band-limited signal, its rates, and the rise of the last, `late` samples late."""
    return np.asarray(rates(polynomials(samples, length, late, count), sample_rate_hz), dtype=np.float64)


def _spline(samples: Real, late: float, count: int, length: int, sample_rate_hz: float) -> Real:
    """The same of a prescribed motion that is a spline."""
    from scipy.interpolate import make_interp_spline

    # Counted in samples the spline's equations are well scaled; rates are scaled after.
    spline = make_interp_spline(np.arange(samples.size), samples, k=min(length, samples.size - 1))
    places = np.arange(count) - late
    inside = np.clip(places, 0.0, samples.size - 1.0)
    degree = int(spline.k)
    motion = np.zeros((length, count))
    for order in range(min(length, degree + 1)):
        motion[order] = spline(inside, nu=order)
    motion[1:, places != inside] = 0.0
    motion[0, places < 0] = 0.0
    motion *= sample_rate_hz ** np.arange(length)[:, None]
    return np.vstack([motion, np.diff(motion[-1], append=motion[-1, -1])])
