"""Random benches with instruments, and their true numbers.

Structures are chains and trees, on springs, on free guides, and in position loops; drives are the model file's.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import pi
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni_withheld.chains.equations import PARTS
from chladni_withheld.chains.plan import GROUND, Bench, Input, Joint, Loop, Output, Plan
from chladni_withheld.chains.simulation import built

Matrix = NDArray[np.float64]
Footing = Literal["grounded", "free", "loop"]

RATES_HZ = (500.0, 512.0, 800.0, 1000.0, 1024.0, 1600.0, 2000.0, 2048.0)
#: Frequencies that count for a draw, as shares of the sample rate.
LOWEST_SHARE, HIGHEST_SHARE = 1 / 100, 1 / 5.5
_LEAST_DAMPING, _MOST_DAMPING = 0.002, 0.06
#: Units of force and length, where bodies move along and where they turn.
_FORCE, _LENGTH = ("N", "N m"), ("m", "rad")


def draw_structure(rng: np.random.Generator, footing: Footing) -> Bench:
    """Draw until the modes lie where the log can show them and a loop is stable with some margin."""
    while True:
        rate_hz = float(rng.choice(RATES_HZ))
        # 8000 to 25000 samples, 6 to 20 s.
        samples = int(np.clip(round(rng.uniform(6.0, 20.0) * rate_hz), 8000, 25000))
        plan = _structure(rng, rate_hz, footing)
        poles = np.linalg.eigvals(built(plan, plan.numbers).assembly.arrays(1.0, 1).system[0])
        modes_hz = _usable_modes(poles, rate_hz)
        if modes_hz:
            return Bench(plan=_with_instruments(rng, plan, footing), rate_hz=rate_hz, samples=samples,
                         modes_hz=modes_hz)  # fmt: skip


def _usable_modes(poles: NDArray[Any], rate_hz: float) -> tuple[float, ...]:
    """Natural frequencies, or nothing when the poles aren't those of a bench that can be measured."""
    size = np.abs(poles)
    moving = poles[size > 1e-6 * size.max()]
    if np.any(moving.real > -1e-9 * size.max()):
        return ()
    swinging = moving[moving.imag > 0]
    if not swinging.size:
        return ()
    modes_hz = np.sort(np.abs(swinging)) / (2 * pi)
    ratios = -swinging.real / np.abs(swinging)
    inside = modes_hz[0] >= 0.8 * LOWEST_SHARE * rate_hz and modes_hz[-1] <= HIGHEST_SHARE * rate_hz
    damped = ratios.min() >= _LEAST_DAMPING and np.sort(ratios)[0] <= _MOST_DAMPING
    return tuple(float(one) for one in modes_hz) if inside and damped else ()


def _structure(rng: np.random.Generator, rate_hz: float, footing: Footing) -> Plan:
    count = int(rng.integers(2, 7))
    bodies = tuple(f"body{place + 1}" for place in range(count))
    chain = rng.random() < 0.5
    joints = [(GROUND, bodies[0])]
    joints += [(bodies[place - 1 if chain else int(rng.integers(place))], bodies[place]) for place in range(1, count)]
    if footing == "grounded" and count > 2 and rng.random() < 0.3:
        joints.append((GROUND, bodies[int(rng.integers(1, count))]))
    named = tuple(Joint(name=f"joint{p + 1}", first=one[0], second=one[1]) for p, one in enumerate(joints))
    rotary = rng.random() < 0.15
    plan = Plan(name="bench", bodies=bodies, joints=named, inputs=(), outputs=(), rotary=rotary)
    numbers = _numbers(rng, plan, rate_hz, footing)
    plan = replace(plan, numbers=numbers, tolerance=_tolerances(rng, numbers))
    return _in_loop(rng, plan, rate_hz) if footing == "loop" else plan


def _numbers(rng: np.random.Generator, plan: Plan, rate_hz: float, footing: Footing) -> dict[str, float]:
    """Masses and springs at random, then all springs times one number, so that the lowest mode falls where drawn."""
    heavy = 1e-2 if plan.rotary else 3.0
    masses = heavy * np.exp(rng.uniform(-1.2, 1.2, len(plan.bodies)))
    springs = np.exp(rng.uniform(-0.9, 0.9, len(plan.joints)))
    if footing != "grounded":
        springs[0] = 0.0
    stiffness = np.zeros((masses.size, masses.size))
    for joint, k in zip(plan.joints, springs, strict=True):
        ends = np.array([float(body == joint.second) - float(body == joint.first) for body in plan.bodies])
        stiffness += k * np.outer(ends, ends)
    squares = np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(masses, masses)))
    lowest = np.sqrt(squares[1 if springs[0] == 0 else 0])
    # In a loop the flexible modes stand above the loop's own.
    share = rng.uniform(LOWEST_SHARE, 1 / 25) if footing == "grounded" else rng.uniform(1 / 40, 1 / 15)
    springs *= (2 * pi * share * rate_hz / lowest) ** 2
    omega = 2 * pi * share * rate_hz
    ratio = np.exp(rng.uniform(np.log(0.003), np.log(0.03)))
    dampers = 2 * ratio / omega * springs * np.exp(rng.uniform(-0.5, 0.5, springs.size))
    if springs[0] == 0:
        dampers[0] = masses.sum() * omega * np.exp(rng.uniform(np.log(0.01), np.log(0.05)))
    numbers = {plan.inertia_of(body): float(m) for body, m in zip(plan.bodies, masses, strict=True)}
    for joint, k, c in zip(plan.joints, springs, dampers, strict=True):
        numbers |= {f"{joint.name}.stiffness": float(k), f"{joint.name}.damping": float(c)}
    # Data sheets don't give more digits.
    return {name: float(f"{value:.4g}") for name, value in numbers.items()}


def _tolerances(rng: np.random.Generator, numbers: dict[str, float]) -> dict[str, float]:
    """Masses are known best, dampers worst."""
    spread = {"mass": (0.01, 0.05), "inertia": (0.01, 0.05), "stiffness": (0.02, 0.1), "damping": (0.1, 0.25)}
    return {name: round(float(rng.uniform(*spread[name.split(".")[1]])), 3) for name in numbers}


def _in_loop(rng: np.random.Generator, plan: Plan, rate_hz: float) -> Plan:
    """Close a position loop around a motor at the first body."""
    mass = sum(plan.numbers[plan.inertia_of(body)] for body in plan.bodies)
    omega = 2 * pi * rate_hz * rng.uniform(1 / 90, 1 / 50)
    gain = float(f"{mass * np.exp(rng.uniform(0.0, 2.0)):.3g}")
    law: Literal["p-p", "pd", "pid"] = ("p-p", "pd", "pid")[int(rng.integers(3))]
    if law == "p-p":
        gains = {"kv": mass * omega / gain, "kp": omega / 4}
    else:
        gains = {"kp": mass * omega**2 / gain, "kd": 1.4 * mass * omega / gain}
        gains |= {"ki": gains["kp"] * omega / 12} if law == "pid" else {}
    loop = Loop(name="axis", reference="/daq.ref1", feedback="pos1", drives="motor", law=law)
    numbers = {**plan.numbers, "axis.gain": gain, **{f"axis.{key}": float(f"{value:.4g}") for key, value in
                                                      gains.items()}}  # fmt: skip
    tolerance = {**plan.tolerance, **dict.fromkeys((name for name in numbers if name.startswith("axis.")), 0.0)}
    motor = Input(name="motor", channel="/daq.u1", unit=_FORCE[plan.rotary], at=plan.bodies[0])
    position = Output(name="pos1", channel="/daq.y0", measures="displacement", unit=_LENGTH[plan.rotary],
                      at=plan.bodies[0], fed_back=True)  # fmt: skip
    return replace(plan, loop=loop, numbers=numbers, tolerance=tolerance, inputs=(motor,), outputs=(position,))


def _with_instruments(rng: np.random.Generator, plan: Plan, footing: Footing) -> Plan:
    inputs = [*plan.inputs, *_inputs(rng, plan, footing)]
    outputs = [*plan.outputs, *_sensors(rng, plan, footing)]
    return replace(plan, inputs=tuple(inputs), outputs=tuple(outputs))


def _inputs(rng: np.random.Generator, plan: Plan, footing: Footing) -> list[Input]:
    first = len(plan.inputs) + 1
    count = int(rng.integers(0, 2)) if footing == "loop" else 1 + int(rng.random() < 0.3)
    bodies = rng.permutation(plan.bodies)[:count]
    made = [
        Input(name=f"input{p}", channel=f"/daq.u{p}", unit=_FORCE[plan.rotary], at=str(body))
        for p, body in enumerate(bodies, start=first)
    ]
    chance = rng.random()
    if footing != "loop" and chance < 0.1:
        joint = plan.joints[int(rng.integers(1, len(plan.joints)))]
        made[0] = replace(made[0], at="", joint=joint.name)
    elif footing == "grounded" and chance < 0.2 and not plan.rotary:
        made[0] = replace(made[0], at=GROUND, unit="m/s^2")
    return made


def _sensors(rng: np.random.Generator, plan: Plan, footing: Footing) -> list[Output]:
    least = 1 if footing == "loop" else 2
    count = int(rng.integers(least, len(plan.bodies) + 1))
    bodies = sorted(str(body) for body in rng.permutation(plan.bodies)[:count])
    measured = []
    for place, body in enumerate(bodies):
        # A free axis drifts away: its displacement would be all that counts.
        chances = (0.88, 0.12, 0.0) if footing == "free" else (0.75, 0.1, 0.15)
        word = ("acceleration", "velocity", "displacement")[int(rng.choice(3, p=chances))]
        unit = _LENGTH[plan.rotary] + {"acceleration": "/s^2", "velocity": "/s", "displacement": ""}[word]
        measured.append(
            Output(name=f"sensor{place + 1}", channel=f"/daq.y{place + 1}", measures=word, unit=unit, at=body)
        )
    return measured


#: Numbers of each drive: nominal value in SI, and how well it is known.
_DRIVE_NUMBERS: Mapping[str, Mapping[str, tuple[float, float]]] = {
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
_DRIVE_INPUTS: Mapping[str, tuple[str, ...]] = {
    "pneumatic-motor": ("flow", "load"), "hydraulic-motor": ("flow", "load"), "dc-servo": ("voltage", "load_torque"),
}  # fmt: skip
_OF_PISTON = (("acceleration", "m/s^2"), ("velocity", "m/s"), ("displacement", "m"), ("pressure_drop", "Pa"))
_DRIVE_OUTPUTS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "pneumatic-motor": _OF_PISTON, "hydraulic-motor": _OF_PISTON,
    "dc-servo": (("velocity", "rad/s"), ("current", "A"), ("acceleration", "rad/s^2"), ("torque", "N m")),
}  # fmt: skip
_UNITS = {"flow": "m^3/s", "load": "N", "voltage": "V", "load_torque": "N m", "position_reference": "rad"}
#: Sample rate over the drive's highest natural frequency.
_LEAST_OVER, _MOST_OVER = 12.0, 40.0
_DRIVE_RATES_HZ = (100.0, 200.0, 250.0, 500.0, 512.0, 1000.0, 1024.0, 2000.0, 2048.0, 5000.0, 10000.0, 20000.0)


def draw_drive_bench(rng: np.random.Generator) -> Bench:
    """Draw until a usual sample rate suits the drive's poles."""
    while True:
        plan = _drive_plan(rng)
        poles = np.linalg.eigvals(built(plan, plan.numbers).assembly.arrays(1.0, 1).system[0])
        size = np.abs(poles)
        modes_hz = np.sort(size[size > 1e-6 * size.max()]) / (2 * pi)
        wanted = modes_hz[-1] * rng.uniform(_LEAST_OVER, _MOST_OVER)
        usable = [rate for rate in _DRIVE_RATES_HZ if _LEAST_OVER * modes_hz[-1] <= rate <= 2 * wanted]
        if np.all(poles.real < 1e-6 * size.max()) and usable:
            rate_hz = usable[0]
            samples = int(np.clip(round(rng.uniform(8.0, 20.0) * rate_hz), 8000, 25000))
            return Bench(plan=plan, rate_hz=rate_hz, samples=samples, modes_hz=tuple(float(f) for f in modes_hz))


def _drive_plan(rng: np.random.Generator) -> Plan:
    drive = str(rng.choice(list(_DRIVE_NUMBERS)))
    # Data sheets of other sizes than the usual one.
    numbers = {name: float(f"{value * np.exp(rng.uniform(-0.25, 0.25)):.4g}") for name, (value, _) in
               _DRIVE_NUMBERS[drive].items()}  # fmt: skip
    tolerance = {name: spread for name, (_, spread) in _DRIVE_NUMBERS[drive].items()}
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
    inputs = _drive_inputs(rng, drive, body, options)
    return Plan(
        name="bench", drive=drive, options=options, bodies=(body,),
        joints=(Joint(name=joint, first=GROUND, second=body),), inputs=inputs,
        outputs=_drive_outputs(rng, drive, body, options), numbers=numbers, tolerance=tolerance,
        rotary=drive == "dc-servo",
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


def _drive_inputs(rng: np.random.Generator, drive: str, body: str, options: Mapping[str, str]) -> tuple[Input, ...]:
    main, load = _DRIVE_INPUTS[drive]
    names = ["position_reference" if options.get("loop") == "position" else main]
    names += [load] if rng.random() < 0.5 else []
    return tuple(
        Input(name=name, channel=f"/daq.u{place}", at=body if name == load else "", unit=_UNITS[name])
        for place, name in enumerate(names, start=1)
    )


def _drive_outputs(rng: np.random.Generator, drive: str, body: str, options: Mapping[str, str]) -> tuple[Output, ...]:
    known = _DRIVE_OUTPUTS[drive]
    count = int(rng.integers(2, len(known) + 1))
    chosen = sorted(int(place) for place in rng.permutation(len(known))[:count])
    # What the loops measure isn't tampered with: it's the drive that would change.
    fed_back = ("velocity", "current") if options.get("loop") == "position" else ()
    return tuple(
        Output(name=known[place][0], channel=f"/daq.y{row}", measures=known[place][0], at=body,
               unit=known[place][1], fed_back=known[place][0] in fed_back)
        for row, place in enumerate(chosen, start=1)
    )  # fmt: skip


def draw_numbers(rng: np.random.Generator, plan: Plan) -> dict[str, float]:
    """True numbers around the nominal ones, as the tolerances promise; nothing beyond two sigma."""
    true = {}
    for name, nominal in plan.numbers.items():
        z = rng.standard_normal()
        while abs(z) >= 2.0:
            z = rng.standard_normal()
        true[name] = nominal * (1.0 + plan.tolerance[name] * float(z))
    return true
