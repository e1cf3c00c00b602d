"""What a log holds of a model: its channels matched to the model's inputs and outputs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import CYCLES, LISTED, MOST, SAMPLES_A_CYCLE
from chladni.gap.comparison.doubts import instability, modes_of, shortness
from chladni.gap.comparison.whole_stretch import Read, good_samples, whole_stretch
from chladni.gap.records.measurement import Measurement
from chladni.io.log_info import some_of
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, ModelError, SetupError
from chladni.signals.number_range import out_of_range
from chladni.signals.time_series import TimeSeries
from chladni.signals.units import si_factor
from chladni.signals.visible import place_of
from chladni.signals.wording import counted


@dataclass(frozen=True, slots=True, kw_only=True)
class _Match:
    """A terminal of the model, and the row of the recording that holds it (None: no row)."""

    terminal: Terminal
    row: int | None

    @property
    def wanted(self) -> str:
        """Name of the channel that is looked for."""
        return self.terminal.channel or self.terminal.name


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchedLog:
    """A log as a model sees it.

    Attributes
    ----------
    measurement
        SI, without a missing sample: the longest stretch in which all channels are there, if it is at least half of
        the log.
    warnings
        Sentences that come before any answer, which means little with them: nothing drives the model, it's unstable,
        the log is very short.
    losses
        Sentences on what an answer can't be read without: gaps that cost a part of the log.
    remarks
        Sentences on what else limits an answer: outputs that the log doesn't hold, few cycles, a low rate.
    """

    measurement: Measurement
    warnings: tuple[str, ...]
    losses: tuple[str, ...]
    remarks: tuple[str, ...]


def measurement_of(
    model: Model, recording: TimeSeries, *, log: str, held: Sequence[str] | None = None
) -> tuple[Measurement, tuple[str, ...]]:
    """Give the measurement of `matched_log`, and all that is said of it: warnings first, then losses."""
    found = matched_log(model, recording, log=log, held=held)
    return found.measurement, (*found.warnings, *found.losses, *found.remarks)


def matched_log(
    model: Model,
    recording: TimeSeries,
    *,
    log: str,
    held: Sequence[str] | None = None,
    begins_s: float = 0.0,
    damage: Sequence[str] = (),
) -> MatchedLog:
    """Match the channels of a log to the inputs and outputs of a model.

    A terminal of the model listens to the channel that it names, else to the channel that has its own name. The
    reference of a controller is an input of the closed model; its command, where the driven input names a channel,
    is an output like any other.

    Parameters
    ----------
    model
        Whose inputs and outputs are looked for.
    recording
        What `Log.read` gave: one rate for all channels.
    log
        Name of the log, for messages.
    held
        Names of all channels that the log holds, for messages; those of the recording if not given.
    begins_s, damage
        Where in the log the recording begins, and what of the file couldn't be read, for messages.

    Raises
    ------
    LogError
        When the log hasn't got the channel of an input, or holds numbers there that can't be squared; when it holds
        none of the outputs, or has no stretch without gaps that is long enough.
    ModelError
        When no input of the model could ever be found in a log, or units don't fit.
    """
    compiled = model.compile()
    # What was read of a log may be a small part of it: the channel that was meant may be among the others.
    told = some_of([one.name for one in recording.channels] if held is None else held, count=LISTED)
    inputs = [_matched(terminal, recording) for terminal in compiled.inputs]
    _require_inputs(inputs, model.name, log, held=told)
    driving = [match.row for match in inputs if match.row is not None]
    _require_inputs_in_range(recording, driving, log)
    outputs, remarks = _usable_outputs(compiled, recording, log, driving)
    _require_outputs(outputs, remarks, model.name, log, held=told)
    rows = [*driving, *(match.row for match in outputs if match.row is not None)]
    read = Read(log=log, begins_s=begins_s, damage=damage)
    stretch, gaps = whole_stretch(recording, rows, driving, read)
    measurement = Measurement(
        log=log,
        sample_rate_hz=recording.sample_rate_hz,
        inputs=_signals(inputs, recording, stretch, "input", log),
        outputs=_signals(outputs, recording, stretch, "output", log),
        input_names=tuple(match.terminal.name for match in inputs),
        output_names=tuple(match.terminal.name for match in outputs),
        output_units=tuple(match.terminal.unit for match in outputs),
    )
    short, unstable = shortness(compiled, measurement), instability(model.name, compiled)
    return MatchedLog(
        measurement=measurement,
        warnings=(*_at_rest(inputs, model.name, measurement, recording), *filter(None, [unstable, short])),
        losses=gaps,
        remarks=(*remarks, *_undriven(inputs), *_limits(compiled, measurement, short=short is not None)),
    )


def _matched(terminal: Terminal, recording: TimeSeries) -> _Match:
    names = [channel.name for channel in recording.channels]
    # The channel that the model names goes first: a log may hold another one by the terminal's name.
    found = [place_of(name, names) for name in (terminal.channel, terminal.name) if name is not None]
    return _Match(terminal=terminal, row=next((row for row in found if row is not None), None))


def _require_inputs(inputs: Sequence[_Match], model: str, log: str, *, held: str) -> None:
    for match in inputs:
        # An input that names no channel isn't expected in a log; one that does is needed.
        if match.row is None and match.terminal.channel is not None:
            raise LogError(
                f"{log}: input {match.terminal.name!r} of the model listens to channel {match.wanted!r}, which the "
                f"log doesn't hold; it holds {held}; correct the model's channel or log the input"
            )
    if inputs and all(match.row is None for match in inputs):
        raise ModelError(
            f"model {model!r}: no input names a channel, and {log} has none of their names; it holds {held}; "
            "give an [[input]] its channel"
        )


def _usable_outputs(
    compiled: CompiledModel, recording: TimeSeries, log: str, driving: Sequence[int]
) -> tuple[list[_Match], tuple[str, ...]]:
    """Give outputs that were measured, and sentences on the others."""
    used: list[_Match] = []
    remarks: list[str] = []
    for terminal in compiled.outputs:
        match = _matched(terminal, recording)
        reason = _why_unusable(match, recording, log, driving)
        if reason is None:
            used.append(match)
        else:
            remarks.append(f"output {terminal.name!r} is left out: {reason}")
    return used, tuple(remarks)


def _require_outputs(used: Sequence[_Match], left_out: Sequence[str], model: str, log: str, *, held: str) -> None:
    if not used:
        told = "; ".join(left_out[:3]) or "the model has no output"
        raise LogError(
            f"{log}: nothing to compare model {model!r} with: {told}; the log holds {held}; give an [[output]] the "
            "channel that measured it"
        )


def _why_unusable(match: _Match, recording: TimeSeries, log: str, driving: Sequence[int]) -> str | None:
    if match.row is None:
        return f"{log} holds no channel {match.wanted!r}"
    # Judged alone: one dead sensor shouldn't cost the samples of all others.
    good = good_samples(recording, [match.row])
    apart = [row for row in driving if not np.any(good & good_samples(recording, [row]))]
    if good.any() and apart:
        return (
            f"channel {match.wanted!r} has samples {_span(recording, match.row)} only, input channel "
            f"{recording.channels[apart[0]].name!r} {_span(recording, apart[0])}: at no time both; take stamps of "
            "one clock (--stamp log), or record both together"
        )
    if np.mean(good) < MOST:
        return f"channel {match.wanted!r} misses {np.mean(~good):.0%} of its samples"
    values = recording.values[match.row][good]
    if values.min() == values.max():
        return f"channel {match.wanted!r} never changes from {values[0]:g}"
    fault = out_of_range(float(np.abs(values).max()))
    return None if fault is None else f"channel {match.wanted!r} {fault}"


def _require_inputs_in_range(recording: TimeSeries, driving: Sequence[int], log: str) -> None:
    for row in driving:
        good = good_samples(recording, [row])
        fault = out_of_range(float(np.abs(recording.values[row][good]).max(initial=0.0)))
        if fault is not None:
            raise LogError(f"{log}: input channel {recording.channels[row].name!r} {fault}")


def _span(recording: TimeSeries, row: int) -> str:
    """Say from when to when a channel has samples."""
    places = np.flatnonzero(good_samples(recording, [row]))
    if not places.size:
        return "at no time"
    rate_hz = recording.sample_rate_hz
    return f"from {places[0] / rate_hz:g} to {(places[-1] + 1) / rate_hz:g} s"


def _signals(matches: Sequence[_Match], recording: TimeSeries, stretch: slice, kind: str, log: str) -> Real:
    signals = np.zeros((len(matches), stretch.stop - stretch.start))
    for place, match in enumerate(matches):
        if match.row is not None:
            factor = _factor(match.terminal, recording.channels[match.row], f"{log}: ", kind)
            signals[place] = factor * recording.values[match.row, stretch]
    return signals


def _factor(terminal: Terminal, channel: Channel, where: str, kind: str) -> float:
    """Give what turns a channel into the terminal's unit; `ModelError` when they don't fit."""
    # A channel without unit is a log that doesn't say; the model does.
    if channel.unit == "1":
        _require_possible(terminal, channel, where, kind)
        return 1.0
    try:
        factor, si_unit = si_factor(channel.unit)
    except SetupError:
        factor, si_unit = 1.0, channel.unit
    if si_unit == si_factor(terminal.unit)[1]:
        return factor
    raise ModelError(
        f"{where}channel {channel.name!r} is in {channel.unit}, {kind} {terminal.name!r} of the model in "
        f"{terminal.unit}; connect another channel, or state the channel's true unit in the setup"
    )


def _require_possible(terminal: Terminal, channel: Channel, where: str, kind: str) -> None:
    """Refuse a channel that by its message's type holds another quantity than the terminal's."""
    wanted = si_factor(terminal.unit)[1]
    # A signal without unit, as of a block scheme, may be anything.
    if channel.units_possible and wanted not in (*channel.units_possible, "1"):
        raise ModelError(
            f"{where}channel {channel.name!r} is in {' or '.join(channel.units_possible)} by its message's type, "
            f"{kind} {terminal.name!r} of the model in {terminal.unit}; correct what the {kind} is in the model, "
            "connect another channel, or state the channel's true unit in the setup"
        )


def _undriven(inputs: Sequence[_Match]) -> tuple[str, ...]:
    idle = [match.terminal.name for match in inputs if match.row is None]
    return (f"not logged, taken as zero: input {', '.join(idle)}",) if idle else ()


def _at_rest(
    inputs: Sequence[_Match], model: str, measurement: Measurement, recording: TimeSeries
) -> tuple[str, ...]:
    """Name the inputs when none of them ever moves, as after a wrong channel or a drive that was off."""
    if not inputs:
        undriven = (
            f"model {model!r} has no [[input]]: in it only what starts in motion moves, and all that drove the "
            f"machine in {measurement.log} counts as a gap; give it an [[input]] with the channel that holds that"
        )
        return (undriven,)
    if np.any(np.ptp(measurement.inputs, axis=1) > 0):
        return ()
    told = ", ".join(
        f"{match.terminal.name!r} ({recording.channels[match.row].name!r}) is {row[0]:g} throughout"
        for match, row in zip(inputs, measurement.inputs, strict=True)
        if match.row is not None
    )
    still = (
        f"no input moves in {measurement.log}: input {told}; only what starts in motion or isn't logged shows; check "
        "the channel, or whether the drive was on"
    )
    return (still,)


def _limits(compiled: CompiledModel, measurement: Measurement, *, short: bool) -> tuple[str, ...]:
    """Sentences on a log that holds too few cycles or is too coarse for a good answer."""
    remarks = []
    duration_s, rate_hz = measurement.duration_s, measurement.sample_rate_hz
    modes_hz = modes_of(compiled)
    # Once: a log that is shorter still was told as such.
    if modes_hz.size and duration_s * modes_hz.min() < CYCLES and not short:
        remarks.append(
            f"the log is short: {duration_s:.3g} s hold {duration_s * modes_hz.min():.2g} cycles of the lowest mode "
            f"({modes_hz.min():.3g} Hz), {CYCLES:g} or more tell more"
        )
    if modes_hz.size and rate_hz < SAMPLES_A_CYCLE * modes_hz.max():
        beyond = int(np.sum(rate_hz < SAMPLES_A_CYCLE * modes_hz))
        remarks.append(
            f"a log at {rate_hz:g} Hz can't follow {counted(beyond, 'mode')} of the model above "
            f"{rate_hz / SAMPLES_A_CYCLE:.3g} Hz"
        )
    return tuple(remarks)
