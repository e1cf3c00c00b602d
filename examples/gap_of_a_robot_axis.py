"""One axis of a robot beside its model: the friction that the model leaves out, checked on another log of the axis.

Needs ``emps.mcap``, ``emps_pulses.mcap`` and ``models/`` in the folder that CHLADNI_DATA names, or in ../shared/data.
A path as argument takes the picture, such as ``axis.png``.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

import chladni
from chladni import StructureInput, StructureModel, explained_model, force_along_motion

POSITION, FORCE = "/axis.position[0]", "/axis.effort[0]"
COMMAND, PULSES = "/command.position[0]", "/pulses.effort[0]"
#: Of the measured force; its noise lies above.
BAND_HZ = 50.0


def velocity_and_acceleration(series: chladni.TimeSeries) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the measured position, by a spline of degree 5."""
    spline = make_interp_spline(series.times_s(), series.values[series.index(POSITION)], k=5)
    return spline.derivative(1)(series.times_s()), spline.derivative(2)(series.times_s())


def low_passed(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """Without phase, but for the first and last half second."""
    passed = sosfiltfilt(butter(4, BAND_HZ, fs=rate_hz, output="sos"), signal)
    return np.asarray(passed[int(rate_hz / 2) : -int(rate_hz / 2)])


def force_error(model: StructureModel, series: chladni.TimeSeries) -> float:
    """Force that the measured motion takes, by the model, less the measured one; over the measured one."""
    rate_hz, position = series.sample_rate_hz, series.values[series.index(POSITION)]
    velocity, acceleration = velocity_and_acceleration(series)
    # What switches with the sign of the velocity must not switch with its noise.
    smooth = sosfiltfilt(butter(4, BAND_HZ, fs=rate_hz, output="sos"), velocity)
    needed = (
        model.parameters["carriage.mass"].value * acceleration + model.parameters["guide.damping"].value * velocity
    )
    for law in model.compile().laws:
        needed = needed + force_along_motion(law, position, smooth, series.times_s())
    measured = low_passed(series.values[series.index(FORCE)], rate_hz)
    return float(np.linalg.norm(low_passed(needed, rate_hz) - measured) / np.linalg.norm(measured))


def loop_errors(model: StructureModel, series: chladni.TimeSeries) -> tuple[float, float]:
    """Force error over the force, and RMS position error [m], of the loop simulated from its command."""
    if PULSES in [channel.name for channel in series.channels]:
        disturbance = StructureInput(name="pulses", at="axis", kind="disturbance", channel=PULSES)
        model = replace(model, inputs=(*model.inputs, disturbance))
    # The controller holds its command for a millisecond: half of it is a delay.
    model = model.with_effects([*model.effects, chladni.attached("delay", "motor", {"delay": 0.5e-3})])
    velocity, _ = velocity_and_acceleration(series.window(end_s=0.02))
    start = {
        "carriage.displacement": float(series.values[series.index(POSITION), 0]),
        "carriage.velocity": float(velocity[0]),
    }
    outputs = chladni.simulate(model, series, initial=start).outputs
    missed = {
        name: series.values[series.index(name)] - outputs.values[outputs.index(name)] for name in (FORCE, POSITION)
    }
    force = np.linalg.norm(missed[FORCE]) / np.linalg.norm(series.values[series.index(FORCE)])
    return float(force), float(np.sqrt(np.mean(missed[POSITION] ** 2)))


def main() -> None:
    """Print the answer, and how well the model that it gives predicts both logs."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not (data / "emps.mcap").exists():
        print(f"{data / 'emps.mcap'} is not there; set CHLADNI_DATA to the folder of measured logs")
        return
    # Half of the log: the other half is for the check, as emps_pulses is.
    found = chladni.diagnose_gap(data / "models" / "emps.toml", data / "emps.mcap", end_s=12.4)
    print(*found.summary(), sep="\n")
    nominal = chladni.load_model(data / "models" / "emps_closed_loop.toml")
    explained = explained_model(nominal, found)
    for name, channels in (("emps", ()), ("emps_pulses", (PULSES,))):
        with chladni.open_log(data / f"{name}.mcap") as log:
            series = log.read([POSITION, FORCE, COMMAND, *channels])
        for title, model in (("nominal", nominal), ("explained", explained)):
            force, position_m = loop_errors(model, series)
            print(
                f"{name}, {title}: force along the measured motion {force_error(model, series):.1%} off; "
                f"in its loop {force:.1%}, position {1e6 * position_m:.1f} um"
            )
    if len(sys.argv) > 1:
        found.plot().figure.savefig(sys.argv[1], dpi=200)
        print("picture:", sys.argv[1])


if __name__ == "__main__":
    main()
