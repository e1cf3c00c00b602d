"""Drives beside python-control, and the paper's claims on PD2 and the position loop of the hydraulic motor."""

import argparse
import time
from collections.abc import Mapping, Sequence

import control
import numpy as np
from scipy.optimize import brentq

from chladni.models.analysis.behaviour import behaviour
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import DriveModel, drive_model
from chladni.models.drives.pd2_design import best_pd2, cancelling_pd2
from chladni.models.excitations.step import Step
from chladni.models.integrator.simulate import simulate

HYDRAULIC = DRIVES["hydraulic-motor"]
STEP = 100e-6
FREQUENCY_HZ = np.geomspace(1e-2, 1e4, 400)


def table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    print(f"\n## {title}\n")
    print("| " + " | ".join(head) + " |")
    print("| " + " | ".join("---" for _ in head) + " |")
    for row in rows:
        print("| " + " | ".join(row) + " |")


def piston_oracle(p: Mapping[str, float], capacity: float) -> dict[tuple[str, str], np.ndarray]:
    """Equation 2 and its relatives, in transfer functions of python-control."""
    s = control.tf("s")
    scale = capacity * p["reduced_mass"]
    below = (
        s**2
        + (capacity * p["viscous_loss"] + p["reduced_mass"] * p["leakage"]) / scale * s
        + (p["active_area"] ** 2 + p["leakage"] * p["viscous_loss"]) / scale
    )
    speed = {
        "flow": p["active_area"] / scale / below,
        "load": -(capacity * s + p["leakage"]) / scale / below,
    }
    points = 2j * np.pi * FREQUENCY_HZ
    return {
        (output, entry): (speed[entry] * factor)(points)
        for entry in speed
        for output, factor in (("displacement", 1 / s), ("velocity", 1), ("acceleration", s))
    }


def servo_oracle(p: Mapping[str, float]) -> dict[tuple[str, str], np.ndarray]:
    s = control.tf("s")
    electric, mechanic = p["inductance"] * s + p["resistance"], p["inertia"] * s + p["viscous_loss"]
    below = electric * mechanic + p["torque_constant"] * p["back_emf"]
    points = 2j * np.pi * FREQUENCY_HZ
    return {
        ("velocity", "voltage"): (p["torque_constant"] / below)(points),
        ("current", "voltage"): (mechanic / below)(points),
        ("velocity", "load_torque"): (-electric / below)(points),
    }


def worst(model: DriveModel, expected: Mapping[tuple[str, str], np.ndarray]) -> float:
    compiled = model.compile()
    found = compiled.frequency_response(FREQUENCY_HZ)
    rows = [terminal.name for terminal in compiled.outputs]
    columns = [terminal.name for terminal in compiled.inputs]
    return max(
        float(np.max(np.abs(found[rows.index(output), columns.index(entry)] / wanted - 1)))
        for (output, entry), wanted in expected.items()
    )


def agreement() -> None:
    rows = []
    for name in ("pneumatic-motor", "hydraulic-motor", "dc-servo"):
        kind, model = DRIVES[name], drive_model(DRIVES[name])
        p = kind.parameters.numbers()
        if name == "pneumatic-motor":
            expected = piston_oracle(p, p["air_volume"] / (p["adiabatic_exponent"] * p["pressure"]))
        elif name == "hydraulic-motor":
            expected = piston_oracle(p, p["oil_volume"] / p["bulk_modulus"])
        else:
            expected = servo_oracle(p)
        times = []
        for _ in range(50):
            start = time.perf_counter()
            model.compile()
            times.append(time.perf_counter() - start)
        rows.append([name, str(len(expected)), f"{worst(model, expected):.1e}", f"{1e3 * np.median(times):.2f}"])
    table(
        "Responses beside python-control, relative, 0.01 Hz to 10 kHz",
        ["drive", "transfer functions", "largest difference", "compile [ms]"],
        rows,
    )


def numbers(model: DriveModel, entry: str, output: str, size: float) -> dict[str, float]:
    found = behaviour(model, from_input=entry, to_output=output, size=size, band=0.05)
    return {q.name: np.nan if q.value is None else q.value for q in found.quantities}


def velocity(
    model: DriveModel, length_s: float = 0.3, points: int = 60_001
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, velocity over its end value, and flow over the step, after a step of flow; by python-control."""
    space = model.compile().state_space()
    system = control.ss(space.a, space.b[:, :1], space.c, space.d[:, :1])
    names = [terminal.name for terminal in space.outputs]
    instants = np.linspace(0.0, length_s, points)
    _, found = control.forced_response(system, instants, np.ones(points))
    speed = found[names.index("velocity")]
    return instants, speed / speed[-1], found[names.index("motor_flow")]


def reaches(instants: np.ndarray, speed: np.ndarray, level: float) -> float:
    return float(instants[int(np.argmax(speed >= level))])


def oscillating_pair(model: DriveModel) -> tuple[float, float]:
    poles = model.compile().state_space().poles()
    pair = next(pole for pole in poles if pole.imag > 0)
    return abs(pair), -pair.real / abs(pair)


def corrected(parameters: Mapping[str, float]) -> DriveModel:
    return drive_model(HYDRAULIC, parameters, {"correction": "pd2"})


def pd2_claim() -> None:
    plain = drive_model(HYDRAULIC)
    omega, zeta = oscillating_pair(plain)
    designs = {
        "none": plain,
        "PD2, zeros on the poles": corrected(cancelling_pd2(omega=omega, damping_ratio=zeta).parameters()),
        "PD2, settles soonest": corrected(best_pd2(omega=omega, damping_ratio=zeta).parameters()),
    }
    rows, first = [], {}
    for name, model in designs.items():
        instants, speed, flow = velocity(model)
        found = numbers(model, "flow", "velocity", STEP)
        row = {
            "largest flow / step": float(np.abs(flow).max()),
            "largest acceleration after [ms]": 1e3 * found["acceleration_time"],
            "95 % first reached after [ms]": 1e3 * reaches(instants, speed, 0.95),
            "stays within 5 % after [ms]": 1e3 * found["settling_time"],
            "overshoot [%]": max(100 * (float(speed.max()) - 1), 0.0),
            "largest acceleration [m/s^2]": found["peak_acceleration"],
        }
        first = first or row
        rows.append([name, *(f"{value:.3g}{change(value, first[key], name)}" for key, value in row.items())])
    table("PD2 on the hydraulic motor: velocity after a step of flow, flow at most twice the step",
          ["correction", *first], rows)  # fmt: skip
    instants, speed, _ = velocity(plain)
    bound = reaches(instants, speed, 0.95 / 2) / reaches(instants, speed, 0.95)
    print(
        f"\nomega = {omega:.1f} rad/s, zeta = {zeta:.3f}. No correction of any kind reaches 95 % sooner than the full"
    )
    print(f"twofold flow does: {100 * (bound - 1):+.0f} %. Half the time would take a flow of", end=" ")
    print(f"{0.95 / speed[int(np.searchsorted(instants, reaches(instants, speed, 0.95) / 2))]:.1f} steps.")


def change(value: float, first: float, name: str) -> str:
    return "" if name == "none" or first == 0 else f" ({100 * (value / first - 1):+.0f} %)"


def pd2_off_tune() -> None:
    omega, zeta = oscillating_pair(drive_model(HYDRAULIC))
    rows = []
    for name, design in (("zeros on the poles", cancelling_pd2), ("settles soonest", best_pd2)):
        parameters = design(omega=omega, damping_ratio=zeta).parameters()
        row = [name]
        for share in (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3):
            mass = HYDRAULIC.parameters["reduced_mass"].value * share
            found = numbers(corrected({**parameters, "reduced_mass": mass}), "flow", "velocity", STEP)
            row.append(f"{1e3 * found['settling_time']:.0f} ms, {max(found['overshoot'], 0.0):.0f} %")
        rows.append(row)
    table("The same corrections when the mass is another: settling time, overshoot",
          ["PD2", *(f"mass x {share:g}" for share in (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3))], rows)  # fmt: skip


def stability_limit(options: Mapping[str, str], parameters: Mapping[str, float]) -> float:
    """Gain of the position loop at which the first pair of poles reaches the imaginary axis."""

    def growth(logarithm: float) -> float:
        model = drive_model(HYDRAULIC, {**parameters, "position_gain": np.exp(logarithm)}, options)
        return float(model.compile().state_space().poles().real.max())

    return float(np.exp(brentq(growth, np.log(1e-3), np.log(10.0))))


def position_loop() -> None:
    options = {"loop": "position"}
    limit, rows = stability_limit(options, {}), []
    for share in (0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8):
        model = drive_model(HYDRAULIC, {"position_gain": share * limit}, options) if share else drive_model(HYDRAULIC)
        moved = numbers(model, "flow", "velocity", STEP)
        _, zeta = oscillating_pair(model)
        placed = numbers(model, "reference", "displacement", 1e-3) if share else {}
        instants = np.linspace(0.0, 1.0, 100_001)
        space = model.compile().state_space()
        names = [terminal.name for terminal in space.outputs]
        column = [terminal.name for terminal in space.inputs].index("flow")
        system = control.ss(space.a, space.b[:, column : column + 1], space.c, space.d[:, column : column + 1])
        _, found = control.forced_response(system, instants, np.full(instants.size, STEP))
        peak = np.abs(
            space.frequency_response(np.geomspace(5.0, 100.0, 20_001))[names.index("velocity"), column]
        ).max()
        rows.append(
            [
                f"{share:g}" if share else "open",
                f"{zeta:.3f}",
                f"{peak:.3g}",
                f"{found[names.index('velocity')].max():.4f}",
                f"{moved['peak_acceleration']:.2f}",
                told(placed, "rise_time", 1e3),
                told(placed, "settling_time", 1e3),
                told(placed, "overshoot", 1.0),
            ]
        )
    table(
        f"Proportional loop on position, gain over the limit of stability {limit:.4f} m^2/s",
        ["gain / limit", "damping ratio", "resonance of v/Q [1/m^2]", "largest v [m/s]", "largest a [m/s^2]",
         "rise of z to its reference [ms]", "settled [ms]", "overshoot [%]"],
        rows,
    )  # fmt: skip


def told(found: Mapping[str, float], name: str, factor: float) -> str:
    value = found.get(name, np.nan)
    return "-" if not np.isfinite(value) else f"{factor * max(value, 0.0):.3g}"


def pd2_in_the_loop() -> None:
    omega, zeta = oscillating_pair(drive_model(HYDRAULIC))
    rows = []
    for name, options, parameters in (
        ("none", {"loop": "position"}, {}),
        (
            "zeros on the poles",
            {"loop": "position", "correction": "pd2"},
            cancelling_pd2(omega=omega, damping_ratio=zeta).parameters(),
        ),
        (
            "settles soonest",
            {"loop": "position", "correction": "pd2"},
            best_pd2(omega=omega, damping_ratio=zeta).parameters(),
        ),
    ):
        limit = stability_limit(options, parameters)
        best = min(
            (
                numbers(
                    drive_model(HYDRAULIC, {**parameters, "position_gain": share * limit}, options),
                    "reference", "displacement", 1e-3,
                ) | {"share": share}
                for share in np.arange(0.05, 0.6, 0.01)
            ),
            key=lambda found: found["settling_time"] if np.isfinite(found["settling_time"]) else np.inf,
        )  # fmt: skip
        open_loop = numbers(
            drive_model(HYDRAULIC, parameters, {key: word for key, word in options.items() if key == "correction"}),
            "flow", "displacement", STEP,
        )  # fmt: skip
        rows.append(
            [
                name,
                f"{open_loop['critical_frequency']:.1f}",
                f"{limit:.3f}",
                f"{best['share'] * limit:.3f}",
                f"{1e3 * best['settling_time']:.0f}",
                f"{max(best['overshoot'], 0.0):.1f}",
                f"{best['peak_acceleration']:.3g}",
            ]
        )
    table(
        "PD2 inside the position loop, each at the gain with which it settles soonest",
        ["correction", "critical frequency of z/Q [Hz]", "stable up to [m^2/s]", "gain [m^2/s]", "settled [ms]",
         "overshoot [%]", "largest acceleration for 1 mm [m/s^2]"],
        rows,
    )  # fmt: skip


def valve_in_the_loop(step_m: float = 0.05, seconds: float = 3.0, rate_hz: float = 2e4) -> None:
    rows = []
    for name, words in (
        ("ideal", ()),
        ("lag", ("valve_lag",)),
        ("saturation", ("saturation",)),
        ("dead zone", ("dead_zone",)),
        ("all three", ("valve_lag", "saturation", "dead_zone")),
    ):
        model = drive_model(HYDRAULIC, {}, {"loop": "position", **dict.fromkeys(words, "on")})
        found = simulate(model, {"reference": Step(size=step_m)}, duration_s=seconds, sample_rate_hz=rate_hz)
        names = [terminal.name for terminal in model.compile().outputs]
        place, flow = (found.outputs.values[names.index(signal)] for signal in ("displacement", "motor_flow"))
        outside = np.flatnonzero(np.abs(place - place[-1]) > 0.05 * step_m)
        rows.append(
            [
                name,
                f"{1e6 * np.abs(flow).max():.0f}",
                f"{1e3 * (outside[-1] + 1) / rate_hz:.0f}",
                f"{100 * (place.max() / step_m - 1):.2f}",
                f"{1e3 * (step_m - place[-1]):.3f}",
            ]
        )
    width = HYDRAULIC.parameters["valve_overlap"].value * HYDRAULIC.parameters["rated_flow"].value
    table(
        f"Servo valve in the position loop, a step of {1e3 * step_m:g} mm; dead zone ±{1e6 * width:g} cm^3/s",
        ["valve", "largest flow [cm^3/s]", "settled [ms]", "overshoot [%]", "left at the end [mm]"],
        rows,
    )


def servo_rules() -> None:
    rows = []
    for loop, output in (("current", "current"), ("velocity", "velocity"), ("position", "position")):
        model = drive_model(DRIVES["dc-servo"], {}, {"loop": loop, "converter_lag": "on"})
        found = numbers(model, f"{loop}_reference", output, 1.0)
        rows.append(
            [loop, told(found, "rise_time", 1e3), told(found, "settling_time", 1e3), told(found, "overshoot", 1.0),
             f"{found['bandwidth']:.0f}"]
        )  # fmt: skip
    table(
        "DC servo, gains by the textbook's rules",
        ["loop", "rise [ms]", "settled [ms]", "overshoot [%]", "bandwidth [Hz]"],
        rows,
    )


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    agreement()
    pd2_claim()
    pd2_off_tune()
    position_loop()
    pd2_in_the_loop()
    valve_in_the_loop()
    servo_rules()
