"""Random drives with their instruments."""

from collections.abc import Mapping
from math import pi

import numpy as np

from chladni.gap.blind.building import built
from chladni.gap.blind.drive_equations import PARTS
from chladni.gap.blind.plan import GROUND, Bench, Input, Joint, Output, Plan

#: Numbers of each drive: nominal value in SI, and how well it is known.
_NUMBERS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "pneumatic-motor": {
        "active_area": (70e-4, 0.01), "air_volume": (750e-6, 0.05), "reduced_mass": (300.0, 0.03),
        "leakage": (0.45e-11, 0.2), "viscous_loss": (1300.0, 0.2), "adiabatic_exponent": (1.4, 0.01),
        "pressure": (5e5, 0.02),
    },
    "hydraulic-motor": {
        "active_area": (10e-4, 0.01), "oil_volume": (100e-6, 0.05), "bulk_modulus": (1.4e9, 0.1),
        "reduced_mass": (300.0, 0.03), "leakage": (3e-12, 0.2), "viscous_loss": (2000.0, 0.2),
        "valve_time": (2e-3, 0.1),
    },
    "dc-servo": {
        "resistance": (1.0, 0.05), "inductance": (2e-3, 0.1), "torque_constant": (0.1, 0.03),
        "back_emf": (0.1, 0.03), "inertia": (1e-4, 0.05), "viscous_loss": (1e-4, 0.2),
    },
}  # fmt: skip
#: Signals of each: which drive it, and which may be measured with how they move.
_INPUTS: Mapping[str, tuple[str, ...]] = {
    "pneumatic-motor": ("flow", "load"), "hydraulic-motor": ("flow", "load"), "dc-servo": ("voltage", "load_torque"),
}  # fmt: skip
_OF_PISTON = (("acceleration", "m/s^2"), ("velocity", "m/s"), ("displacement", "m"), ("pressure_drop", "Pa"))
_OUTPUTS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "pneumatic-motor": _OF_PISTON, "hydraulic-motor": _OF_PISTON,
    "dc-servo": (("velocity", "rad/s"), ("current", "A"), ("acceleration", "rad/s^2"), ("torque", "N m")),
}  # fmt: skip
_UNITS = {"flow": "m^3/s", "load": "N", "voltage": "V", "load_torque": "N m", "position_reference": "rad"}
#: Sample rate over the drive's highest natural frequency.
_LEAST_OVER, _MOST_OVER = 12.0, 40.0
_RATES_HZ = (100.0, 200.0, 250.0, 500.0, 512.0, 1000.0, 1024.0, 2000.0, 2048.0, 5000.0, 10000.0, 20000.0)


def draw_drive_bench(rng: np.random.Generator) -> Bench:
    """Draw until a usual sample rate suits the drive's poles."""
    while True:
        plan = _plan(rng)
        poles = np.linalg.eigvals(built(plan, plan.numbers).assembly.arrays(1.0, 1).system[0])
        size = np.abs(poles)
        modes_hz = np.sort(size[size > 1e-6 * size.max()]) / (2 * pi)
        wanted = modes_hz[-1] * rng.uniform(_LEAST_OVER, _MOST_OVER)
        usable = [rate for rate in _RATES_HZ if _LEAST_OVER * modes_hz[-1] <= rate <= 2 * wanted]
        if np.all(poles.real < 1e-6 * size.max()) and usable:
            rate_hz = usable[0]
            samples = int(np.clip(round(rng.uniform(8.0, 20.0) * rate_hz), 8000, 25000))
            return Bench(plan=plan, rate_hz=rate_hz, samples=samples, modes_hz=tuple(float(f) for f in modes_hz))


def _plan(rng: np.random.Generator) -> Plan:
    drive = str(rng.choice(list(_NUMBERS)))
    # Data sheets of other sizes than the usual one.
    numbers = {name: float(f"{value * np.exp(rng.uniform(-0.25, 0.25)):.4g}") for name, (value, _) in
               _NUMBERS[drive].items()}  # fmt: skip
    tolerance = {name: spread for name, (_, spread) in _NUMBERS[drive].items()}
    if drive == "pneumatic-motor":
        numbers["adiabatic_exponent"] = 1.4
    options: dict[str, str] = {}
    if drive == "hydraulic-motor":
        options = {"valve_lag": str(rng.choice(["on", "off"]))}
        if options["valve_lag"] == "off":
            del numbers["valve_time"], tolerance["valve_time"]
    if drive == "dc-servo" and rng.random() < 0.4:
        options, gains = {"loop": "position"}, _gains(numbers)
        numbers, tolerance = numbers | gains, tolerance | dict.fromkeys(gains, 0.0)
    joint, body, _ = PARTS[drive]
    inputs = _inputs(rng, drive, body, options)
    return Plan(
        name="bench", drive=drive, options=options, bodies=(body,),
        joints=(Joint(name=joint, first=GROUND, second=body),), inputs=inputs,
        outputs=_outputs(rng, drive, body, options), numbers=numbers, tolerance=tolerance, rotary=drive == "dc-servo",
    )  # fmt: skip


def _gains(n: Mapping[str, float]) -> dict[str, float]:
    """Loops of a slow servo: the current in a millisecond, the speed in some, the position behind."""
    current_s = 6e-4
    velocity_s = 6 * current_s
    gains = {
        "current_gain": n["inductance"] / current_s,
        "current_time": n["inductance"] / n["resistance"],
        "velocity_gain": n["inertia"] / (2 * n["torque_constant"] * current_s),
        "velocity_time": velocity_s,
        "velocity_weight": 0.0,
        "position_gain": 1 / (5 * velocity_s),
    }
    return {name: float(f"{value:.4g}") for name, value in gains.items()}


def _inputs(rng: np.random.Generator, drive: str, body: str, options: Mapping[str, str]) -> tuple[Input, ...]:
    main, load = _INPUTS[drive]
    names = ["position_reference" if options.get("loop") == "position" else main]
    names += [load] if rng.random() < 0.5 else []
    return tuple(
        Input(name=name, channel=f"/daq.u{place}", at=body if name == load else "", unit=_UNITS[name])
        for place, name in enumerate(names, start=1)
    )


def _outputs(rng: np.random.Generator, drive: str, body: str, options: Mapping[str, str]) -> tuple[Output, ...]:
    known = _OUTPUTS[drive]
    count = int(rng.integers(2, len(known) + 1))
    chosen = sorted(int(place) for place in rng.permutation(len(known))[:count])
    # What the loops measure isn't tampered with: it's the drive that would change.
    fed_back = ("velocity", "current") if options.get("loop") == "position" else ()
    return tuple(
        Output(name=known[place][0], channel=f"/daq.y{row}", measures=known[place][0], at=body,
               unit=known[place][1], fed_back=known[place][0] in fed_back)
        for row, place in enumerate(chosen, start=1)
    )  # fmt: skip
