"""Sensors that a structure could have besides those in a log."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from chladni.gap.calibration import ZERO
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.model import Model
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import Measure, StructureOutput
from chladni.signals.arrays import Complex, Real

_WORDS: dict[Measure, str] = {
    "acceleration": "an accelerometer at",
    "displacement": "an encoder across",
    "force": "a force sensor in",
    "velocity": "a velocity sensor at",
}


def sensor_words(sensor: StructureOutput) -> str:
    """Say which sensor it is, as in "add an accelerometer at wrist"."""
    return f"{_WORDS[sensor.measures]} {sensor.at}"


def more_sensors(
    model: Model, measurement: Measurement, suspects: Collection[str] = ()
) -> tuple[StructureOutput, ...]:
    """Give accelerometers at bodies without one, encoders and force sensors at suspected joints.

    Outputs that the measurement doesn't hold are sensors that aren't there. Suspects are names of sites: a sensor
    that is suspected itself doesn't count, since a second one beside it may tell.
    """
    if not isinstance(model, StructureModel):
        return ()
    have = {
        (one.at, one.measures)
        for one in model.outputs
        if one.name in measurement.output_names and one.name not in suspects
    }
    joints = [joint.name for joint in model.structure.joints if joint.name in suspects]
    wanted: list[tuple[str, Measure]] = [(body.name, "acceleration") for body in model.structure.bodies]
    wanted += [(joint, "displacement") for joint in joints] + [(joint, "force") for joint in joints]
    taken = _names(model)
    found = []
    for at, measures in wanted:
        if (at, measures) not in have:
            found.append(StructureOutput(name=_free(f"{measures}_of_{at}"[:90], taken), measures=measures, at=at))
    return tuple(found)


def with_sensors(model: Model, sensors: Sequence[StructureOutput]) -> Model:
    """Give the model with the sensors behind its own."""
    if not sensors or not isinstance(model, StructureModel):
        return model
    return replace(model, outputs=(*model.outputs, *sensors))


def with_rows(measurement: Measurement, model: Model, sensors: Sequence[StructureOutput]) -> Measurement:
    """Give the record that would be made with the sensors of a model too; what they would show is not known."""
    units = {one.name: one.unit for one in model.compile().outputs}
    return replace(
        measurement,
        outputs=np.concatenate([measurement.outputs, np.zeros((len(sensors), measurement.samples))]),
        output_names=(*measurement.output_names, *(one.name for one in sensors)),
        output_units=(*measurement.output_units, *(units[one.name] for one in sensors)),
    )


def with_noise_of(noise: NoiseFloor, units: Sequence[str], more_units: Sequence[str], signals: Real) -> NoiseFloor:
    """Give the noise of the log's outputs and of sensors that would be as good.

    A sensor of a unit that the log holds is as noisy as those in the middle; another one as noisy for its signal, of
    all ``signals [output, sample]`` with the new ones last.
    """
    size = np.maximum(np.std(signals, axis=1), ZERO)
    count = len(units)
    relative = float(np.median(noise.rms / size[:count]))
    new = np.empty(len(more_units))
    for place, unit in enumerate(more_units):
        same = noise.rms[[one == unit for one in units]]
        new[place] = np.median(same) if same.size else relative * size[count + place]
    white = np.zeros((new.size, noise.whitening.shape[1]))
    white[:, 0] = 1.0
    return NoiseFloor(
        rms=np.concatenate([noise.rms, new]),
        whitening=np.concatenate([noise.whitening, white]),
        innovation_rms=np.concatenate([noise.innovation_rms, new]),
        method=(*noise.method, *("as the others",) * new.size),
        std=np.concatenate([noise.std, np.ones(new.size)]),
        upper_bound=np.concatenate([noise.upper_bound, np.ones(new.size, dtype=np.bool_)]),
    )


def _names(model: StructureModel) -> set[str]:
    bodies = {body.name for body in model.structure.bodies} | {joint.name for joint in model.structure.joints}
    signals = {one.name for one in model.inputs} | {one.name for one in model.outputs}
    return bodies | signals | {one.name for one in model.controllers}


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def angles_deg(patterns: Complex, chosen: Sequence[int]) -> Real:
    """Angle between the patterns of each two sites on some outputs, ``[site, site]``, 0 to 90 degrees.

    A force of any shape is free on every line, so only the direction over the outputs tells: with one output all
    angles are 0. The mean over the lines of the squared sine is taken.

    Examples
    --------
    Two sites that two sensors see apart, and one sensor alone doesn't:

    >>> patterns = np.array([[[1.0], [0.0]], [[1.0], [1.0]]], dtype=np.complex128)
    >>> angles_deg(patterns, [0, 1]).round(3).tolist(), angles_deg(patterns, [0]).tolist()
    ([[0.0, 45.0], [45.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]])
    """
    seen = patterns[:, list(chosen)]
    size = np.sqrt(np.sum(np.abs(seen) ** 2, axis=1, keepdims=True))
    unit = seen / np.where(size > 0, size, 1.0)
    along = np.abs(np.einsum("iol,kol->ikl", unit.conj(), unit)) ** 2
    # A line on which a site prints nothing tells nothing.
    sine = np.where(size[:, 0][:, None] * size[:, 0][None] > 0, np.maximum(1.0 - along, 0.0), 0.0)
    return np.asarray(np.degrees(np.arcsin(np.sqrt(np.clip(sine.mean(axis=-1), 0.0, 1.0)))), dtype=np.float64)
