"""What a log lacks for any answer: length, level, or the sensor that would tell where a force acts."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.calibration import CYCLES_ASKED, LINES, LITTLE, LOCATED, LOUD, NEAR_DEG, ZERO
from chladni.gap.comparison.doubts import modes_of
from chladni.gap.design.experiments import excited_band_hz
from chladni.gap.design.more_sensors import (
    angles_deg,
    more_sensors,
    sensor_words,
    with_noise_of,
    with_rows,
    with_sensors,
)
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.linear_view import LinearView
from chladni.gap.plant.places import Site, placed, printed_patterns, sites_of
from chladni.gap.plant.record_lines import RecordLines
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.model import Model
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError
from chladni.signals.wording import listed

_Sensors = Sequence[StructureOutput]


def what_is_missing(
    model: Model, measurement: Measurement, noise: NoiseFloor, *, sites: Sequence[str] = ()
) -> str | None:
    """Say what to measure where a log is too short, too quiet, or has too few sensors to say where a force acts.

    Sites are names of the most likely ones, best first; every joint and body without any. There's None when nothing
    of this is missing.
    """
    found = [
        _length(model, measurement),
        level_missing(measurement, noise),
        sensor_missing(model, measurement, noise, sites=sites),
    ]
    return " ".join(one for one in found if one) or None


def _length(model: Model, measurement: Measurement) -> str | None:
    """Ask for a longer record when the lowest mode turns only a few times."""
    turning = modes_of(model.compile())
    if not turning.size or turning.min() * measurement.duration_s >= CYCLES_ASKED:
        return None
    lowest = float(turning.min())
    return (
        f"The log holds {lowest * measurement.duration_s:.2g} cycles of the lowest mode ({lowest:.3g} Hz): record at "
        f"least {CYCLES_ASKED / lowest:.2g} s ({CYCLES_ASKED:g} cycles)."
    )


def level_missing(measurement: Measurement, noise: NoiseFloor) -> str | None:
    """Ask for a higher level or averages when noise drowns the outputs, None when it doesn't."""
    share = noise.rms / np.maximum(np.std(measurement.outputs, axis=1), ZERO)
    middle = float(np.median(share))
    if middle <= LOUD:
        return None
    # What is measured holds the noise too.
    signal = max(1.0 - middle**2, LITTLE**2)
    factor = min(max(2.0, float(np.ceil(middle / (LOUD * signal**0.5)))), 4.0)
    then = middle / float(np.hypot(factor * signal**0.5, middle))
    return (
        f"Noise is {middle:.0%} of what the sensors show: raise the level {factor:.0f} times, or average "
        f"{factor**2:.0f} records or periods of the same input; it is then {then:.0%}."
    )


def sensor_missing(
    model: Model, measurement: Measurement, noise: NoiseFloor, *, sites: Sequence[str] = ()
) -> str | None:
    """Ask for the sensor that splits the likeliest sites best, None when those there are do, or none would.

    Sites are as `what_is_missing` takes them.
    """
    sensors = more_sensors(model, measurement, sites)
    if not sensors or not measurement.output_names:
        return None
    try:
        return _best_sensor(model, measurement, noise, sensors, sites)
    except ModelError:
        # What a sensor would show of a model that diverges is not known.
        return None


def _best_sensor(
    model: Model,
    measurement: Measurement,
    noise: NoiseFloor,
    sensors: Sequence[StructureOutput],
    names: Sequence[str],
) -> str | None:
    patterns, sites = _patterns(model, measurement, noise, sensors, names)
    if len(sites) < 2:
        return None
    own = list(range(len(measurement.output_names)))
    now, _ = _least(angles_deg(patterns, own))
    if now >= NEAR_DEG:
        return None
    gained = [_least(angles_deg(patterns, [*own, len(own) + place])) for place in range(len(sensors))]
    best = max(range(len(sensors)), key=lambda place: gained[place])
    then = gained[best][0]
    if then < 2.0 * now or then < 1.0:
        return None
    places = listed([site.name for site in sites])
    reason = (
        "One sensor can't tell where a force acts" if len(own) == 1 else f"The sensors hardly tell {places} apart"
    )
    by = "" if len(sites) == 2 else "at least "
    return (
        f"{reason}: add {sensor_words(sensors[best])}. What forces at {places} print over the sensors then differs "
        f"by {by}{then:.2g} degrees, now by {round(now, 1):g}; 90 can't be confused, less than {NEAR_DEG:g} drowns "
        "in noise."
    )


def _patterns(
    model: Model,
    measurement: Measurement,
    noise: NoiseFloor,
    sensors: Sequence[StructureOutput],
    names: Sequence[str],
) -> tuple[Complex, list[Site]]:
    """Patterns of the likeliest sites over the log's sensors and those that may be added."""
    more = with_sensors(model, sensors)
    compiled = more.compile()
    record = with_rows(measurement, more, sensors)
    outputs, run = record.output_names, FreeRun(more, record)
    rows = tuple(run.rows.tolist())
    view = LinearView(compiled, _lines(measurement), measurement.inputs, rows)
    count = len(measurement.output_names)
    # By what the nominal model would show.
    signals = np.concatenate([measurement.outputs, run.outputs()[count:]])
    floor = with_noise_of(noise, measurement.output_units, record.output_units[count:], signals)
    every = sites_of(compiled, measurement.output_names)
    wanted = [site for name in names for site in every if site.name == name]
    wanted = wanted or [site for site in every if site.kind in ("joint", "body")]
    # Sites that even all these sensors see as one are one place.
    sites = [place.sites[0] for place in placed(view, wanted, outputs, floor)][:LOCATED]
    if not sites:
        return np.zeros((0, len(rows), 1), dtype=np.complex128), []
    return printed_patterns(view, sites, outputs, floor), sites


def _lines(measurement: Measurement) -> RecordLines:
    low, high = excited_band_hz(measurement)
    step = measurement.sample_rate_hz / measurement.samples
    first, last = max(round(low / step), 1), min(round(high / step), (measurement.samples - 1) // 2)
    index = np.unique(np.linspace(first, max(first, last), LINES).round().astype(np.int64))
    return RecordLines(index=index, samples=measurement.samples, sample_rate_hz=measurement.sample_rate_hz)


def _least(angles: Real) -> tuple[float, float]:
    """Smallest and mean angle between different sites."""
    apart = angles[np.triu_indices(len(angles), 1)]
    return float(apart.min()), float(apart.mean())
