"""Logs at several levels, no model: where the machine is nonlinear, by the modes of the lowest level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.apps.modes import identify_modes
from chladni.gap.comparison.linear_approximation import best_linear_approximation, moving_inputs
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.location.between_sensors import locate_between_sensors
from chladni.gap.location.sensor_location import SensorLocation
from chladni.gap.records.measurement import Measurement
from chladni.io.log import Log
from chladni.signals.errors import EstimateError, LogError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.mode_set import ModeSet
from chladni.signals.wording import counted

FEWEST_LEVELS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelLocation:
    """What logs at several levels tell.

    Attributes
    ----------
    location
        Where, and even or odd.
    modes
        Of the lowest level, which stand in for a model.
    measurements, responses
        By rising level, and the best linear approximation of each.
    """

    location: SensorLocation
    modes: ModeSet
    measurements: tuple[Measurement, ...]
    responses: tuple[FrequencyResponse, ...]


@in_one_thread()
def locate_from_levels(
    logs: Sequence[Log],
    *,
    force: str,
    sensors: Mapping[str, str],
    driving_point: str,
    band_hz: tuple[float, float] | None = None,
    seed: int = 0,
) -> LevelLocation:
    """Say at which sensor, or between which two, a machine is nonlinear, from logs at several levels.

    Parameters
    ----------
    logs
        Two or more from `chladni.open`, excited by one periodic force of one period length at different levels.
    force
        Its channel.
    sensors
        Short name of each sensor, and its channel; motions of one kind.
    driving_point
        Short name of the sensor at the force, along it.
    band_hz
        Where modes are looked for; all excited lines unless given.
    seed
        Of the bootstrap.

    Raises
    ------
    LogError
        When a log has no such channel, or samples are missing.
    EstimateError
        When there are fewer than two logs or sensors, or they don't go together.

    Examples
    --------
    >>> found = locate_from_levels(  # doctest: +SKIP
    ...     [quiet, loud], force="/shaker.wrench.force.z", driving_point="tip",
    ...     sensors={"tip": "/tip.accel.linear.z", "root": "/root.accel.linear.z"},
    ... )
    >>> for sentence in found.location.sentences():  # doctest: +SKIP
    ...     print(sentence)
    """
    if len(logs) < FEWEST_LEVELS or len(sensors) < FEWEST_LEVELS:
        raise EstimateError(
            f"{counted(len(logs), 'log')} and {counted(len(sensors), 'sensor')}: a place "
            "between sensors takes two levels and two sensors "
            "at least, and three sensors to tell more than one place"
        )
    if driving_point not in sensors:
        raise EstimateError(f"driving point {driving_point!r} is none of the sensors {', '.join(sensors)}")
    measurements = sorted((_measured(log, force, sensors) for log in logs), key=lambda one: float(one.inputs.std()))
    for one in measurements:
        if not moving_inputs(one):
            raise EstimateError(f"{one.log}: {force} stands still; name the channel of the force that drives")
    responses = [best_linear_approximation(one) for one in measurements]
    modes = identify_modes(responses[0], band_hz=band_hz)
    return LevelLocation(
        location=locate_between_sensors(measurements, modes, driving_point=driving_point, seed=seed),
        modes=modes,
        measurements=tuple(measurements),
        responses=tuple(responses),
    )


def _measured(log: Log, force: str, sensors: Mapping[str, str]) -> Measurement:
    series = log.read([force, *sensors.values()])
    if not (series.all_valid() and np.isfinite(series.values).all()):
        raise LogError(f"{log.path.name}: samples are missing; cut the log to a part without gaps")
    values = np.asarray(series.values, dtype=np.float64)
    return with_period(
        Measurement(
            log=log.path.name,
            sample_rate_hz=series.sample_rate_hz,
            inputs=values[:1],
            outputs=values[1:],
            input_names=(force,),
            output_names=tuple(sensors),
            output_units=tuple(channel.unit for channel in series.channels[1:]),
        )
    )
