"""A simulated log against a measured one: where the gap lies, whatever simulator made it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import NOTICED, UNNOTICED
from chladni.gap.comparison.distortion import Distortion, distortion_where_told
from chladni.gap.comparison.log_regimes import measured_variables
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.comparison.shares import gap_map, pooled_gap, where_of
from chladni.gap.records.diagnosis import Where
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real
from chladni.signals.errors import LogError
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GapView(Value):
    """Everything about a gap that needs no model.

    Attributes
    ----------
    residual
        ``[output, sample]`` measured minus simulated.
    gap
        Pooled over outputs: RMS of the residual over RMS of measured, each output scaled by its own.
    where
        Channels, bands, regimes, times; no sites, since those are a model's.
    map_time_s, map_frequency_hz, map_density
        See `gap_map`.
    measured_split, simulated_split
        Linear, even, odd and noise of the outputs; None where no single input repeats, see `distortion_of`.
    remarks
        Outputs that only one side holds; inputs that differ.
    """

    residual: Real
    gap: float
    where: Where
    noise: NoiseFloor
    map_time_s: Real
    map_frequency_hz: Real
    map_density: Real
    measured_split: Distortion | None = None
    simulated_split: Distortion | None = None
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()


def compare_logs(measured: Measurement, simulated: Measurement) -> GapView:
    """Compare a measured log with one that any simulator wrote, of the same experiment.

    Parameters
    ----------
    measured, simulated
        Outputs are matched by name. Both begin with the same sample; the longer one is cut.

    Raises
    ------
    LogError
        When rates differ, no output is held by both, or an output's units differ.
    """
    _require_same_rate(measured, simulated)
    names = [name for name in measured.output_names if name in simulated.output_names]
    if not names:
        raise LogError(
            f"{measured.log} and {simulated.log} share no output: {', '.join(measured.output_names)} against "
            f"{', '.join(simulated.output_names)}; give them the same names"
        )
    samples = min(measured.samples, simulated.samples)
    # Cutting may leave fewer periods than were found before.
    ours, theirs = with_period(_cut(measured, names, samples)), _cut(simulated, names, samples)
    _require_same_units(ours, theirs)
    outputs, rate_hz, noise = ours.outputs, ours.sample_rate_hz, estimate_noise(ours)
    residual = outputs - theirs.outputs
    map_time_s, map_frequency_hz, map_density = gap_map(residual, outputs, rate_hz)
    return GapView(
        residual=residual,
        gap=pooled_gap(residual, outputs),
        where=where_of(residual, ours, noise, measured_variables(ours)),
        noise=noise,
        map_time_s=map_time_s,
        map_frequency_hz=map_frequency_hz,
        map_density=map_density,
        measured_split=distortion_where_told(ours),
        simulated_split=distortion_where_told(with_period(theirs)),
        remarks=_remarks(measured, simulated, samples),
    )


def _cut(measurement: Measurement, names: Sequence[str], samples: int) -> Measurement:
    rows = [measurement.output_names.index(name) for name in names]
    return replace(
        measurement,
        inputs=measurement.inputs[:, :samples],
        outputs=measurement.outputs[rows, :samples],
        output_names=tuple(names),
        output_units=tuple(measurement.output_units[row] for row in rows),
    )


def _require_same_rate(measured: Measurement, simulated: Measurement) -> None:
    ours_hz, theirs_hz = measured.sample_rate_hz, simulated.sample_rate_hz
    # Beyond, samples drift apart.
    if abs(ours_hz - theirs_hz) > UNNOTICED * ours_hz:
        raise LogError(
            f"{measured.log} has {ours_hz:g} Hz, {simulated.log} {theirs_hz:g} Hz; bring them to one rate, "
            f"chladni convert {simulated.log} OUT.mcap --resample {ours_hz:g}"
        )


def _require_same_units(measured: Measurement, simulated: Measurement) -> None:
    for name, ours, theirs in zip(measured.output_names, measured.output_units, simulated.output_units, strict=True):
        # A log without units is believed, as everywhere.
        if ours != theirs and "1" not in (ours, theirs):
            raise LogError(
                f"output {name!r} is in {ours} in {measured.log}, in {theirs} in {simulated.log}; state the true unit"
            )


def _remarks(measured: Measurement, simulated: Measurement, samples: int) -> tuple[str, ...]:
    remarks = []
    for one, other in ((measured, simulated), (simulated, measured)):
        lone = [name for name in one.output_names if name not in other.output_names]
        if lone:
            remarks.append(f"left out, since only {one.log} holds them: {', '.join(lone)}")
        if one.samples > samples:
            remarks.append(f"{one.log} is cut to the {samples / one.sample_rate_hz:g} s that {other.log} has too")
    return (*remarks, *_input_remarks(measured, simulated, samples))


def _input_remarks(measured: Measurement, simulated: Measurement, samples: int) -> list[str]:
    remarks = []
    for place, name in enumerate(measured.input_names):
        # An input that the simulator didn't write down can't be checked.
        if name in simulated.input_names:
            ours = measured.inputs[place, :samples]
            theirs = simulated.inputs[simulated.input_names.index(name), :samples]
            size = float(np.sqrt(np.mean(ours**2)))
            off = float(np.sqrt(np.mean((ours - theirs) ** 2)))
            if off > NOTICED * size:
                share = off / size if size > 0 else np.inf
                remarks.append(
                    f"input {name!r} differs by {share:.2g} of its RMS between the logs: part of the gap is the "
                    "excitation's"
                )
    return remarks
