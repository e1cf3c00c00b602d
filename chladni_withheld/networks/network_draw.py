"""Networks drawn at random: their graph, numbers, inputs and outputs."""

from dataclasses import replace

import numpy as np

from chladni_withheld.networks.network import GROUND, Drive, Joint, Measures, Network, Sensor, Where

Rng = np.random.Generator
_BODIES = (
    "frame", "plate", "head", "beam", "hub", "rotor", "shell", "pallet", "gimbal", "mast",
    "yoke", "tray", "spindle", "cradle", "boom", "deck", "ram", "lens", "anvil", "bracket",
)  # fmt: skip
_JOINTS = (
    "mount", "bolt", "flexure", "bush", "rail", "hinge", "isolator", "weld", "clamp", "shaft",
    "slide", "pin", "bearing", "strut", "coupling", "seal", "latch", "guide", "membrane", "belt",
)  # fmt: skip
_MEASURES: tuple[Measures, ...] = ("acceleration", "velocity", "displacement", "force")
_WHERE: tuple[Where, ...] = ("body", "joint", "ground")


_DECAYS = 8.0
"""Time constants of the slowest mode that a log lasts at least."""


def draw_network(rng: Rng, rate_hz: float, duration_s: float) -> Network:
    """Draw a machine of two to six bodies whose modes a log shows.

    The highest lies at 0.1 to 0.22 of the rate, all are damped by 0.3 to 6 %, and die several times in the log.
    """
    for _ in range(1000):
        network = _scaled(rng, _bare(rng), rng.uniform(0.1, 0.22) * rate_hz)
        poles = network.poles()
        ratios = -poles.real / np.abs(poles)
        slow = bool(-poles.real.max() * duration_s < _DECAYS)
        if len(poles) == len(network.bodies) and not slow and ratios.min() > 0.003 and ratios.max() < 0.06:
            return replace(network, drives=_drives(rng, network), sensors=_sensors(rng, network))
    raise AssertionError("no network fits: the ranges of its numbers contradict each other")


def _bare(rng: Rng) -> Network:
    bodies = int(rng.integers(2, 7))
    names = rng.permutation(_BODIES)[:bodies]
    edges = _tree(rng, bodies)
    further = _further_edges(rng, bodies, edges)
    labels = rng.permutation(_JOINTS)
    joints = [
        Joint(name=str(label), first=a, second=b, stiffness=float(np.exp(rng.normal(0, 0.5))), damping=1.0)
        for label, (a, b) in zip(labels, edges + further, strict=False)
    ]
    # The machine stands without its further edges, so these may be a bare spring or a bare damper.
    for number in range(len(edges), len(joints)):
        if rng.random() < 0.25:
            without_spring = bool(rng.random() < 0.5)
            joint = joints[number]
            joints[number] = replace(joint, stiffness=0.0) if without_spring else replace(joint, damping=0.0)
    masses = tuple(float(np.exp(rng.normal(0, 0.4))) for _ in range(bodies))
    return Network(
        rotary=bool(rng.random() < 0.2), bodies=tuple(map(str, names)), masses=masses, joints=tuple(joints),
        drives=(), sensors=(),
    )  # fmt: skip


def _tree(rng: Rng, bodies: int) -> list[tuple[int, int]]:
    """Give each body a parent among those before it, or, for a star, the first; the first stands on the ground."""
    star = rng.random() < 0.25
    return [(GROUND, 0)] + [(0 if star else int(rng.integers(0, body)), body) for body in range(1, bodies)]


def _further_edges(rng: Rng, bodies: int, edges: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Edges that close loops between bodies, or through the ground."""
    to_ground = [(GROUND, body) for body in range(1, bodies)]
    between = [(a, b) for a in range(bodies) for b in range(a + 1, bodies) if (a, b) not in edges]
    kind = rng.choice(["tree", "loop", "grounded", "both"], p=[0.25, 0.3, 0.25, 0.2])
    chosen = []
    if kind in ("grounded", "both") or (bodies == 2 and kind == "loop"):
        chosen += _some(rng, to_ground, 2)
    if kind in ("loop", "both"):
        chosen += _some(rng, between, 2)
    return chosen


def _some(rng: Rng, edges: list[tuple[int, int]], most: int) -> list[tuple[int, int]]:
    count = min(int(rng.integers(1, most + 1)), len(edges))
    return [edges[number] for number in rng.permutation(len(edges))[:count]]


def _scaled(rng: Rng, network: Network, highest_hz: float) -> Network:
    """Give the network sizes in SI: a mass of its own scale, springs for the highest mode, dampers for the ratios."""
    scale = float(np.exp(rng.uniform(np.log(0.3), np.log(40.0)))) * (0.02 if network.rotary else 1.0)
    heavy = replace(network, masses=tuple(scale * mass for mass in network.masses))
    factor = (highest_hz / heavy.modes_hz()[-1]) ** 2
    middle = 2 * np.pi * highest_hz / 2.5
    ratio = np.exp(rng.uniform(np.log(0.006), np.log(0.025)))
    # A bare damper is as strong as one beside a spring of the network's usual size would be.
    strengths = [(joint.stiffness or 1.0) * factor * np.exp(rng.normal(0, 0.5)) for joint in network.joints]
    joints = tuple(
        replace(
            joint,
            stiffness=float(joint.stiffness * factor),
            damping=float(joint.damping * 2 * ratio * strength / middle),
        )
        for joint, strength in zip(network.joints, strengths, strict=True)
    )
    return replace(heavy, joints=joints)


def _drives(rng: Rng, network: Network) -> tuple[Drive, ...]:
    chosen: list[Drive] = []
    count = 1 if rng.random() < 0.6 else 2
    while len(chosen) < count:
        drive = _drive(rng, network, len(chosen))
        if all((drive.where, drive.at) != (other.where, other.at) for other in chosen):
            chosen.append(drive)
    return tuple(chosen)


def _drive(rng: Rng, network: Network, number: int) -> Drive:
    where = _WHERE[rng.choice(3, p=[0.6, 0.25, 0.15])]
    if where == "body":
        return Drive(name=f"shaker{number + 1}", where=where, at=int(rng.integers(len(network.bodies))))
    if where == "joint":
        return Drive(name=f"actuator{number + 1}", where=where, at=int(rng.integers(len(network.joints))))
    return Drive(name="floor", where="ground", at=GROUND)


def _sensors(rng: Rng, network: Network) -> tuple[Sensor, ...]:
    """Sensors at most of the bodies, of one kind or mixed, and often one across a joint."""
    bodies = len(network.bodies)
    count = int(rng.integers(max(2, int(np.ceil(0.6 * bodies))), bodies + 1))
    plan = rng.choice(4, p=[0.55, 0.15, 0.15, 0.15])
    sensors = []
    for body in sorted(rng.permutation(bodies)[:count]):
        measures = _MEASURES[plan if plan < 3 else rng.integers(3)]
        sensors.append(_sensor(measures, "body", int(body), network.bodies[body]))
    across = [number for number, joint in enumerate(network.joints) if GROUND not in (joint.first, joint.second)]
    # Across a foot it would be the body's own sensor once more.
    if across and rng.random() < 0.5:
        joint = int(rng.choice(across))
        sensors.append(_sensor(_MEASURES[rng.integers(4)], "joint", joint, network.joints[joint].name))
    return tuple(sensors)


def _sensor(measures: Measures, where: Where, at: int, owner: str) -> Sensor:
    short = {"acceleration": "acc", "velocity": "vel", "displacement": "pos", "force": "load"}[measures]
    return Sensor(name=f"{short}_{owner}", measures=measures, where=where, at=at)
