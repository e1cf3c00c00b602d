"""The linear system that comes nearest to what was measured: frequency responses with their scatter."""

import numpy as np

from chladni.gap.comparison.periodicity import periods_of
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Mask
from chladni.signals.channel import Channel
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.excitation import DYNAMIC_RANGE, excited_lines
from chladni.spectral.frf import frequency_response
from chladni.spectral.periodic import Period, periodic_cross_spectra


def best_linear_approximation(measurement: Measurement) -> FrequencyResponse:
    """Estimate the best linear approximation of every output to every input that moves.

    With a periodic input and two steady periods or more: mean output over mean input, line by line, ``std`` by the
    scatter between periods and ``excited`` where the input has lines (Pintelon & Schoukens, *System Identification*,
    2nd ed., section 4.3); it holds the distortion of this one realisation of the input. Otherwise H1 after Welch.

    Raises
    ------
    EstimateError
        When no input moves.
    """
    names = moving_inputs(measurement)
    if not names:
        raise EstimateError(f"{measurement.log}: no input moves, so there is no response to one; excite the machine")
    spectra = period_spectra(measurement) or cross_spectra(_series(measurement))
    return frequency_response(spectra, references=names, responses=list(measurement.output_names))


def period_spectra(measurement: Measurement) -> CrossSpectra | None:
    """Give averages and scatter over the steady periods; None with fewer than two."""
    samples = measurement.period_samples
    names = moving_inputs(measurement)
    if samples is None or not names:
        return None
    count = measurement.samples // samples - measurement.transient_periods
    # One period has no scatter.
    if count < 2:
        return None
    # The measurement knows its period already; it needn't be searched for in one channel again.
    found = Period(
        channel=names[0],
        samples=samples,
        period_s=samples / measurement.sample_rate_hz,
        drift_samples=0.0,
        whole=True,
        first_sample=measurement.transient_periods * samples,
        count=count,
        dropped=measurement.transient_periods,
        noise_share=0.0,
    )
    return periodic_cross_spectra(_series(measurement), found)


def moving_inputs(measurement: Measurement) -> list[str]:
    """Names of the inputs that change, where there are steady periods within those."""
    signals = measurement.inputs
    # A step before the first steady period moves, but excites nothing in those.
    if measurement.period_samples is not None:
        signals = periods_of(signals, measurement.period_samples)[:, -1]
    moves = np.ptp(signals, axis=1) > 0
    return [name for name, one in zip(measurement.input_names, moves, strict=True) if one]


def excited_alone(measurement: Measurement) -> tuple[str, Mask] | None:
    """Give the only input that moves, and whether it excites each line; None without periods, or of several."""
    names, spectra = moving_inputs(measurement), period_spectra(measurement)
    if spectra is None or len(names) != 1:
        return None
    row = spectra.index(names[0])
    power = spectra.density[row, row].real
    # Of a sine all other lines are rounding errors, which repeat too.
    return names[0], np.asarray(excited_lines(spectra, names)[0] & (power > DYNAMIC_RANGE * power.max()))


def _series(measurement: Measurement) -> TimeSeries:
    """Inputs that move, then outputs, under their names in the model."""
    # One that stands still would make the references' matrix singular.
    inputs = [measurement.input_names.index(name) for name in moving_inputs(measurement)]
    return TimeSeries(
        values=np.concatenate([measurement.inputs[inputs], measurement.outputs]),
        sample_rate_hz=measurement.sample_rate_hz,
        channels=(
            *(Channel(name=measurement.input_names[row], role="reference") for row in inputs),
            *(
                Channel(name=name, unit=unit)
                for name, unit in zip(measurement.output_names, measurement.output_units, strict=True)
            ),
        ),
    )
