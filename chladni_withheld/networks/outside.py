"""Physics that no word fits; the right answer is that something unknown is there."""

import numpy as np

from chladni_withheld.networks import laws
from chladni_withheld.networks.draft import Draft, Made, pick, pick_bodies_apart, pick_joint
from chladni_withheld.networks.machine import Addition, Link, Rows
from chladni_withheld.networks.network import Matrix
from chladni_withheld.networks.scene import Rng, Scene


def viscoelastic(rng: Rng, scene: Scene) -> Draft:
    """Maxwell's element beside a joint: a spring that relaxes in the middle of the band."""
    port = pick_joint(rng, scene)
    modes_hz = scene.network.modes_hz()
    time_s = 1 / (2 * np.pi * np.exp(rng.uniform(np.log(modes_hz[0]), np.log(modes_hz[-1]))))

    def build(size: float) -> Made:
        stiffness = size * port.stiffness
        addition = port.element(laws.RELAXATION, stiffness, time_s)
        return Made(addition, {"stiffness": stiffness, "relaxation_s": time_s})

    return Draft(
        "viscoelastic",
        "Maxwell's element",
        port.name,
        build,
        (0.5, 0.05, 4.0),
        direction=port.direction,
    )


def position_dependent_damping(rng: Rng, scene: Scene) -> Draft:
    """A squeezed film, whose damper grows with the square of the way."""
    port = pick_joint(rng, scene)

    def build(size: float) -> Made:
        damping = size * port.load / port.speed
        addition = port.element(laws.FILM, damping, port.way)
        return Made(addition, {"damping_at_rms_way": damping})

    return Draft(
        "position_dependent_damping",
        "squeezed film",
        port.name,
        build,
        (0.1, 0.005, 2.0),
        direction=port.direction,
    )


def periodic_stiffness(rng: Rng, scene: Scene) -> Draft:
    """A cracked shaft's stiffness, which comes and goes with the turn, faster than anything warms."""
    port = pick_joint(rng, scene, spring=True)
    period_s = scene.grid.duration_s / rng.uniform(15, 60)
    phase = rng.uniform(0, 2 * np.pi)

    def build(size: float) -> Made:
        stiffness = size * port.stiffness
        addition = port.element(laws.PERIODIC, stiffness, period_s, phase)
        return Made(addition, {"stiffness": stiffness, "period_s": period_s})

    return Draft(
        "periodic_stiffness",
        "stiffness as a sine of time",
        port.name,
        build,
        (0.1, 0.01, 0.5),
        direction=port.direction,
    )


def fluid_coupling(rng: Rng, scene: Scene) -> Draft | None:
    """Fluid between two bodies that share no joint: it couples their accelerations."""
    network = scene.network
    chosen = pick_bodies_apart(rng, scene)
    if chosen is None:
        return None
    first, second = chosen

    def build(size: float) -> Made:
        inertia = size * min(network.masses[first], network.masses[second])
        link = Link(first=first, second=second, inertia=inertia)
        return Made(Addition(links=(link,)), {"inertia": inertia})

    site = network.pair_name(first, second)
    return Draft(
        "fluid_coupling",
        "inertia of a relative motion",
        site,
        build,
        (0.3, 0.05, 3.0),
        direction=network.direction(first, second),
    )


def square_sensor(rng: Rng, scene: Scene) -> Draft:
    """A sensor that isn't straight: its square shows."""
    row = int(rng.integers(len(scene.network.sensors)))
    name, rms = scene.network.sensors[row].name, float(scene.outputs_rms[row])
    sign = float(rng.choice([-1, 1]))

    def build(size: float) -> Made:
        square = sign * size / rms
        addition = Addition(converters={name: lambda x: x + square * x**2})
        return Made(addition, {"square": square})

    return Draft("square_sensor", "square of the signal", name, build, (0.1, 0.005, 0.5))


def held_samples(rng: Rng, scene: Scene) -> Draft:
    """A transmission that stalls: now and then the last sample is told again, for some samples."""
    row = int(rng.integers(len(scene.network.sensors)))
    name = scene.network.sensors[row].name
    stalls = rng.random(scene.grid.samples)

    def build(size: float) -> Made:
        def stall(x: Matrix) -> Matrix:
            told = np.arange(len(x))
            told[1:][stalls[1:] < size] = 0
            held: Matrix = x[np.maximum.accumulate(told)]
            return held

        return Made(Addition(converters={name: stall}), {"share": size})

    return Draft("held_samples", "last sample told again", name, build, (0.1, 0.005, 0.6))


def drifting_gain(rng: Rng, scene: Scene) -> Draft:
    """A charge amplifier that warms up: one sensor's gain fades in the log."""
    row = int(rng.integers(len(scene.network.sensors)))
    name = scene.network.sensors[row].name
    share = 1 - np.exp(-np.arange(scene.grid.samples) / (rng.uniform(0.2, 0.6) * scene.grid.samples))
    sign = float(rng.choice([-1, 1]))

    def build(size: float) -> Made:
        gain = 1 + sign * size * share
        return Made(Addition(converters={name: lambda x: gain * x}), {"change": sign * size})

    return Draft("drifting_gain", "gain that warms up", name, build, (0.2, 0.01, 0.7))


def rectified_crosstalk(rng: Rng, scene: Scene) -> Draft | None:
    """A cable that a neighbour's diode disturbs: a sensor shows a part of another's magnitude."""
    sensors = scene.network.sensors
    alike = [
        (one.name, other.name)
        for one in sensors
        for other in sensors
        if one is not other and one.where == other.where
    ]
    chosen = pick(rng, range(len(alike)))
    if chosen is None:
        return None
    name, source = alike[chosen]
    rms = dict(zip((sensor.name for sensor in sensors), scene.outputs_rms, strict=True))

    def build(size: float) -> Made:
        part = size * float(rms[name] / rms[source])

        def wiring(rows: Rows, _: float) -> Rows:
            return rows | {name: rows[name] + part * np.abs(rows[source])}

        return Made(Addition(wiring=wiring), {"part": part})

    return Draft("rectified_crosstalk", "another sensor's magnitude", name, build, (0.1, 0.005, 0.5), source=source)
