"""Random structures with instruments: chains and trees, on springs, on free guides, and in position loops."""

from dataclasses import replace
from math import pi
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.gap.blind.building import built
from chladni.gap.blind.plan import GROUND, Bench, Input, Joint, Loop, Output, Plan

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
