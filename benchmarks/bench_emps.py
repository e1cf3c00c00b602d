"""One axis of a robot against its measured logs: parameters from the equation of motion, and the simulated loop.

The published values are those of Janot, Gautier and Brunot (2019): mass, viscous and Coulomb friction, offset, and
the controller. Two things are measured against them.

Equation error: force = M a + F_v v + F_c sign(v) + offset, by least squares. Position is differentiated by a spline
of degree 5, sign(v) is taken of the band-limited velocity, then force, acceleration, velocity and sign all pass the
same zero-phase low-pass (Butterworth of order 4, forwards and backwards) of 50 Hz, half a second at either end is
left out and one sample in eight is kept.

Closed loop: the command of the log drives the model file's loop from the log's first position and speed. The real
controller computes once a millisecond and holds its command; the rows with a hold say so by a dead time of half a
sample at the motor. What the model records as force is the command, as in the log.
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

import chladni
from chladni.models.effects.attached_effect import attached
from chladni.models.files.model_file import load_model
from chladni.models.integrator.simulate import simulate
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.arrays import Real
from chladni.signals.time_series import TimeSeries

POSITION, FORCE, COMMAND, PULSES = (
    "/axis.position[0]",
    "/axis.effort[0]",
    "/command.position[0]",
    "/pulses.effort[0]",
)
#: Mass [kg], viscous [N s/m], Coulomb [N], offset [N].
PUBLISHED = (95.1, 203.5, 20.4, -3.2)
BAND_HZ = 50.0
HOLD_S = 0.5e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationError:
    """Least squares of the equation of motion: parameters as in `PUBLISHED`, and the residual over the force."""

    parameters: tuple[float, ...]
    residual: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopError:
    """Measured minus simulated: force over the measured force, position in m RMS."""

    force: float
    position_m: float


def data_folder() -> Path:
    return Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))


def read_log(folder: Path, name: str) -> TimeSeries:
    channels = [POSITION, FORCE, COMMAND, *([PULSES] if "pulses" in name else [])]
    with chladni.open_log(folder / f"{name}.mcap") as log:
        return log.read(channels)


def equation_error(series: TimeSeries, *, coulomb: bool = True) -> EquationError:
    rate = series.sample_rate_hz
    low_pass = butter(4, BAND_HZ, fs=rate, output="sos")

    def limited(samples: Real) -> Real:
        return np.asarray(sosfiltfilt(low_pass, samples, padlen=int(rate / 2)))

    time_s, position, force = series.times_s(), series.values[series.index(POSITION)], series.index(FORCE)
    spline = make_interp_spline(time_s, position, k=5)
    velocity = limited(spline.derivative(1)(time_s))
    columns = [limited(spline.derivative(2)(time_s)), velocity, limited(np.sign(velocity)), np.ones(series.samples)]
    if not coulomb:
        del columns[2]
    kept = slice(int(rate / 2), -int(rate / 2), 8)
    equations, target = np.stack(columns, axis=1)[kept], limited(series.values[force])[kept]
    found = np.linalg.lstsq(equations, target, rcond=None)[0]
    residual = target - equations @ found
    return EquationError(
        parameters=tuple(found if coulomb else np.insert(found, 2, 0.0)),
        residual=float(np.linalg.norm(residual) / np.linalg.norm(target)),
    )


def axis_model(
    folder: Path, parameters: tuple[float, ...], *, pulses: bool = False, hold_s: float = 0.0
) -> StructureModel:
    model = load_model(folder / "models" / "emps_closed_loop.toml")
    assert isinstance(model, StructureModel)
    mass, viscous, coulomb, offset = parameters
    model = model.with_values({"carriage.mass": mass, "guide.damping": viscous})
    if pulses:
        disturbance = StructureInput(name="pulses", at="axis", kind="disturbance", channel=PULSES)
        model = replace(model, inputs=(*model.inputs, disturbance))
    friction = attached("coulomb_friction", "guide", {"force": coulomb, "offset": offset})
    return model.with_effects([friction, *([attached("delay", "motor", {"delay": hold_s})] if hold_s else [])])


def loop_error(model: StructureModel, series: TimeSeries) -> LoopError:
    position, force = series.values[series.index(POSITION)], series.values[series.index(FORCE)]
    start = make_interp_spline(series.times_s()[:20], position[:20], k=5)
    initial = {"carriage.displacement": float(position[0]), "carriage.velocity": float(start.derivative(1)(0.0))}
    outputs = simulate(model, series, initial=initial).outputs
    missed_force = force - outputs.values[outputs.index(FORCE)]
    missed_position = position - outputs.values[outputs.index(POSITION)]
    return LoopError(
        force=float(np.linalg.norm(missed_force) / np.linalg.norm(force)),
        position_m=float(np.sqrt(np.mean(missed_position**2))),
    )


def print_equation_error(folder: Path) -> EquationError:
    """Print the table of parameters; give those of the linear equation."""
    print("| equation error, to 50 Hz | mass [kg] | viscous [N s/m] | Coulomb [N] | offset [N] | residual/force |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    print("| published | " + " | ".join(f"{one:.1f}" for one in PUBLISHED) + " | |")
    linear = equation_error(read_log(folder, "emps"), coulomb=False)
    rows = {
        "emps": equation_error(read_log(folder, "emps")),
        "emps, linear equation": linear,
        "emps_pulses": equation_error(read_log(folder, "emps_pulses")),
    }
    for name, row in rows.items():
        pairs = zip(row.parameters, PUBLISHED, strict=True)
        cells = [f"{one:.2f} ({100 * (one / true - 1):+.2f} %)" for one, true in pairs]
        print(f"| {name} | {' | '.join(cells)} | {row.residual:.3f} |")
    return linear


def print_closed_loop(folder: Path, linear: EquationError) -> None:
    print("\n| closed loop from the command | force error/force | at most | position error [um RMS] | at most |")
    print("| --- | ---: | ---: | ---: | ---: |")
    series = read_log(folder, "emps")
    for name, parameters, hold_s, force, position in (
        ("emps, published values with Coulomb friction", PUBLISHED, 0.0, "6 %", "5"),
        ("the same, command held for its millisecond", PUBLISHED, HOLD_S, "6 %", "5"),
        ("emps, best linear equation", linear.parameters, 0.0, "", ""),
        ("the same, command held", linear.parameters, HOLD_S, "", ""),
    ):
        error = loop_error(axis_model(folder, parameters, hold_s=hold_s), series)
        print(f"| {name} | {error.force:.1%} | {force} | {1e6 * error.position_m:.2f} | {position} |")
    series = read_log(folder, "emps_pulses")
    for name, hold_s, force in (
        ("emps_pulses, disturbance in, continuous controller", 0.0, ""),
        ("the same, command held for its millisecond", HOLD_S, "9 %"),
    ):
        error = loop_error(axis_model(folder, PUBLISHED, pulses=True, hold_s=hold_s), series)
        print(f"| {name} | {error.force:.1%} | {force} | {1e6 * error.position_m:.2f} | |")


def main() -> None:
    """Print both tables."""
    folder = data_folder()
    print_closed_loop(folder, print_equation_error(folder))


if __name__ == "__main__":
    main()
