"""A log that any simulator wrote, held against a measured one: where they disagree, without a model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from chladni.apps.findings import reading_sentences, require_channels
from chladni.apps.gap_document import Document, distortion_document, where_document
from chladni.apps.sources import Span, joined
from chladni.gap.comparison.distortion import Distortion
from chladni.gap.comparison.linear_approximation import moving_inputs
from chladni.gap.comparison.log_against_log import GapView, compare_logs
from chladni.gap.records.diagnosis import DistortionShare, Where
from chladni.gap.records.measurement import Measurement
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.engineering import bounded_percent, percent
from chladni.signals.errors import LogError
from chladni.signals.join import JoinMethod
from chladni.signals.number_range import rms
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted

COMPARISON_FORMAT: Final = "chladni.gap-comparison/1"
# What differs by less than this share of its RMS was played back, not simulated: digits of a CSV, single precision.
PLAYED_BACK = 1e-4
NAMES_TOLD = 8
NO_INPUT = (
    "no channel that moves is the same in both logs, so none is taken for an input: linear, even and odd shares and "
    "what changes with level aren't told"
)
NO_SPLIT = (
    "linear, even and odd shares aren't told: they take one input that repeats, two periods of it or more behind the "
    "transient, at best with odd lines only"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GapComparison:
    """Where a simulated and a measured log disagree.

    Attributes
    ----------
    simulated, measured
        Names of the logs.
    gap, noise
        RMS of (measured - simulated), and of the noise, over RMS of measured, outputs pooled.
    where
        Channels, bands, regimes, times from the log's start; no sites, which only a model has.
    inputs
        Channels that are the same in both logs: what drove them.
    pair, view
        Both logs as they were compared, and what came of it: evidence for levels and pictures.
    distortion, simulated_distortion
        Output by output of either log; empty where the input doesn't tell.
    remarks
        What limits the comparison.
    """

    simulated: str
    measured: str
    gap: float
    noise: float
    where: Where
    inputs: tuple[str, ...]
    pair: tuple[Measurement, Measurement]
    view: GapView
    distortion: tuple[DistortionShare, ...] = ()
    simulated_distortion: tuple[DistortionShare, ...] = ()
    remarks: tuple[str, ...] = ()


def compare_with_simulated(
    measured: Log,
    simulated: Log,
    *,
    start_s: float | None = None,
    end_s: float | None = None,
    join: JoinMethod = "auto",
) -> GapComparison:
    """Say where two logs of one experiment disagree: one measured, one written by any simulator.

    Channels are matched by their names, and both logs begin with the same sample. Channels that are the same in both
    are taken for inputs.

    Raises
    ------
    LogError
        When a log can't be read, the logs share no channel that differs, rates or units differ, or samples are
        missing.
    """
    span, logs = Span(start_s=start_s, end_s=end_s, join=join), (measured, simulated)
    for log in logs:
        require_channels(log, log.path.name)
    # One list for both, so that rows are the same channels.
    names = _shared(measured, simulated)
    (first, our_notes), (second, their_notes) = (_read(log, names, span) for log in logs)
    inputs = _played_back(first, second)
    outputs = [name for name in names if name not in inputs]
    # Somebody compared a log with itself, or with a copy that holds inputs alone.
    if not outputs:
        raise LogError(f"{simulated.path.name}: every channel that it shares with {measured.path.name} is the same")
    ours, theirs = (
        _measurement(series, inputs, outputs, log.path.name)
        for series, log in zip((first, second), logs, strict=True)
    )
    view = compare_logs(ours, theirs)
    return GapComparison(
        simulated=theirs.log,
        measured=ours.log,
        gap=view.gap,
        noise=_pooled_noise(view),
        where=_later(view.where, (first.start_time_ns - measured.start_time_ns) / NS_PER_S),
        inputs=inputs,
        pair=(ours, theirs),
        view=view,
        distortion=_shares(view.measured_split),
        simulated_distortion=_shares(view.simulated_split),
        remarks=(
            *(told for log in logs for told in reading_sentences(log, everything=False)),
            *dict.fromkeys((*our_notes, *their_notes)),
            *view.remarks,
            *_split_remarks(view, moving_inputs(ours)),
        ),
    )


def answer(found: GapComparison) -> tuple[str, ...]:
    """Give what is said first: how far the simulation is from the log, and what was taken for inputs."""
    first = f"{found.simulated} is {percent(found.gap)} from {found.measured}, noise {noise_told(found)}."
    moving = moving_inputs(found.pair[0])
    still = len(found.inputs) - len(moving)
    if not moving:
        return (first,)
    # Messages hold axes that nothing drives; their names would hide the one that counts.
    beside = f" ({counted(still, 'other channel')} that stand{'s' if still == 1 else ''} still)" if still else ""
    return (first, f"The same in both, taken for inputs: {', '.join(moving)}{beside}.")


def noise_told(found: GapComparison) -> str:
    """Give the noise as a share, at most so much where that of an output is a bound."""
    return bounded_percent(found.noise, at_most=any(one.noise_at_most for one in found.where.channels))


def comparison_document(found: GapComparison) -> Document:
    """Document of ``chladni gap --simulated``: `where` as in a diagnosis, and the gap with its noise.

    `distortion` and `simulated_distortion` are there when the input tells them.
    """
    splits = {"distortion": found.distortion, "simulated_distortion": found.simulated_distortion}
    return {
        "format": COMPARISON_FORMAT,
        "simulated": found.simulated,
        "logs": [found.measured],
        "inputs": list(found.inputs),
        "where": where_document(found.where),
        "gap": {"before": float(found.gap), "noise": float(found.noise)},
        **{key: [distortion_document(one) for one in shares] for key, shares in splits.items() if shares},
        "remarks": list(found.remarks),
    }


def _shared(ours: Log, theirs: Log) -> list[str]:
    held = {channel.name for channel in theirs.channels}
    names = [channel.name for channel in ours.channels if channel.name in held]
    if not names:
        told = (some_of([channel.name for channel in log.channels], count=NAMES_TOLD) for log in (ours, theirs))
        raise LogError(
            f"{ours.path.name} and {theirs.path.name} share no channel: {' against '.join(told)}; give the simulated "
            "log the names of the measured one"
        )
    return names


def _read(log: Log, names: Sequence[str], span: Span) -> tuple[TimeSeries, tuple[str, ...]]:
    series, notes = joined(log, names, span, exact=True)
    if not (series.all_valid() and np.isfinite(series.values).all()):
        raise LogError(f"{log.path.name}: samples are missing; choose a part without gaps with --start and --end")
    return series, notes


def _played_back(first: TimeSeries, second: TimeSeries) -> tuple[str, ...]:
    """Channels that are the same in both logs, sample by sample."""
    samples = min(first.samples, second.samples)
    same = []
    for row, channel in enumerate(first.channels):
        ours, theirs = first.values[row, :samples], second.values[row, :samples]
        if rms(ours - theirs) <= PLAYED_BACK * rms(ours):
            same.append(channel.name)
    return tuple(same)


def _measurement(series: TimeSeries, inputs: Sequence[str], outputs: Sequence[str], log: str) -> Measurement:
    return Measurement(
        log=log,
        sample_rate_hz=series.sample_rate_hz,
        inputs=np.asarray(
            series.select(inputs).values if inputs else np.empty((0, series.samples)), dtype=np.float64
        ),
        outputs=np.asarray(series.select(outputs).values, dtype=np.float64),
        input_names=tuple(inputs),
        output_names=tuple(outputs),
        output_units=tuple(channel.unit for channel in series.select(outputs).channels),
    )


def _later(where: Where, offset_s: float) -> Where:
    """Times from the log's start, as --start counts them."""
    return replace(
        where,
        times=tuple(replace(one, start_s=one.start_s + offset_s, end_s=one.end_s + offset_s) for one in where.times),
    )


def _shares(split: Distortion | None) -> tuple[DistortionShare, ...]:
    return () if split is None else split.shares


def _split_remarks(view: GapView, moving: Sequence[str]) -> tuple[str, ...]:
    """What the input doesn't allow to be told of distortion."""
    ours, theirs = view.measured_split, view.simulated_split
    if not moving:
        return (NO_INPUT,)
    if ours is None or theirs is None:
        return (NO_SPLIT,)
    return ours.remarks


def _pooled_noise(view: GapView) -> float:
    return float(np.sqrt(np.mean([channel.noise**2 for channel in view.where.channels])))
