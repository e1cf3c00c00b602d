"""Effects at bodies, between bodies that share no joint, and at the ground."""

import numpy as np

from chladni_withheld.networks.draft import Draft, Made, pick, pick_bodies_apart
from chladni_withheld.networks.excitation import Band, random_signal
from chladni_withheld.networks.machine import Addition, Link, Satellite
from chladni_withheld.networks.network import GROUND, Matrix
from chladni_withheld.networks.scene import Rng, Scene, ground_moves


def extra_mode(rng: Rng, scene: Scene) -> Draft:
    """A cable or panel: a first mode in the band, and often a second, a third as heavy, above it."""
    network = scene.network
    body = int(rng.integers(len(network.bodies)))
    modes_hz = network.modes_hz()
    frequency_hz = float(np.exp(rng.uniform(np.log(1.1 * modes_hz[0]), np.log(modes_hz[-1]))))
    damping = rng.uniform(0.01, 0.05)
    seconds = [(1.0, 1.0)]
    if 2.8 * frequency_hz < 0.35 * scene.grid.rate_hz and rng.random() < 0.6:
        seconds.append((0.3, rng.uniform(2.2, 2.8)))

    def build(size: float) -> Made:
        mass = size * network.masses[body]
        hung = tuple(_hung(body, part * mass, factor * frequency_hz, damping) for part, factor in seconds)
        told = {"mass": mass, "frequency_hz": frequency_hz, "damping_ratio": damping}
        return Made(Addition(satellites=hung), told)

    law = f"a thing that hangs on with {len(seconds)} modes"
    return Draft(
        "extra_mode",
        law,
        network.bodies[body],
        build,
        (0.05, 0.003, 0.4),
        direction=network.direction(GROUND, body),
    )


def _hung(host: int, mass: float, frequency_hz: float, damping: float) -> Satellite:
    omega = 2 * np.pi * frequency_hz
    return Satellite(host=host, mass=mass, stiffness=mass * omega**2, damping=2 * damping * mass * omega)


def added_mass(rng: Rng, scene: Scene) -> Draft:
    """A block bolted on, or glued on so stiffly that its own mode lies far above the band."""
    network = scene.network
    body = int(rng.integers(len(network.bodies)))
    glue_hz = 8 * float(network.modes_hz()[-1])
    glued = glue_hz < 2 * scene.grid.rate_hz

    def build(size: float) -> Made:
        mass = size * network.masses[body]
        bolted = Addition(links=(Link(first=GROUND, second=body, inertia=mass),))
        addition = Addition(satellites=(_hung(body, mass, glue_hz, 0.05),)) if glued else bolted
        return Made(addition, {"mass": mass})

    law = "glued block" if glued else "bolted block"
    site, direction = network.bodies[body], network.direction(GROUND, body)
    return Draft("added_mass", law, site, build, (0.2, 0.08, 1.0), direction=direction, is_number=True)


def missing_link(rng: Rng, scene: Scene) -> Draft | None:
    """A spring, a damper, or both, that the model has no joint for."""
    network = scene.network
    pairs = network.apart()
    chosen = pick(rng, range(len(pairs)))
    if chosen is None:
        return None
    first, second = pairs[chosen]
    springs = [joint.stiffness for joint in network.joints if joint.stiffness]
    dampers = [joint.damping for joint in network.joints if joint.damping]
    kind = str(rng.choice(["spring", "damper", "link"], p=[0.4, 0.25, 0.35]))

    def build(size: float) -> Made:
        stiffness = size * float(np.median(springs)) * (kind != "damper")
        damping = size * float(np.median(dampers)) * {"spring": 0.0, "damper": 4.0, "link": 1.0}[kind]
        link = Link(first=first, second=second, stiffness=stiffness, damping=damping)
        return Made(Addition(links=(link,)), {"stiffness": stiffness, "damping": damping})

    site = network.pair_name(first, second)
    return Draft("missing_link", kind, site, build, (0.3, 0.005, 3.0), direction=network.direction(first, second))


def gyroscopic(rng: Rng, scene: Scene) -> Draft | None:
    """Two bodies of one rotor's axis, without a joint: each one's speed pushes the other."""
    network = scene.network
    chosen = pick_bodies_apart(rng, scene)
    if chosen is None:
        return None
    first, second = chosen
    pushed = scene.inertia(first) + scene.inertia(second)
    speeds = scene.travel(GROUND, first)[1] + scene.travel(GROUND, second)[1]

    def build(size: float) -> Made:
        coefficient = size * pushed / speeds
        return Made(Addition(skew=((first, second, coefficient),)), {"coefficient": coefficient})

    return Draft("gyroscopic", "skew coupling", network.pair_name(first, second), build, (0.05, 0.002, 0.5))


def tonal_disturbance(rng: Rng, scene: Scene) -> Draft:
    """A motor's steady hum with a weak second harmonic; its phase wanders a little."""
    network = scene.network
    body = int(rng.integers(len(network.bodies)))
    modes_hz = network.modes_hz()
    frequency_hz = rng.uniform(modes_hz[0], modes_hz[-1])
    tone = tone_signal(rng, scene, scene.grid.half_times_s(), frequency_hz)
    scale = scene.inertia(body)

    def build(size: float) -> Made:
        amplitude = size * scale
        told = {"frequency_hz": frequency_hz, "amplitude": amplitude}
        return Made(Addition(pushes=((body, amplitude * tone),)), told)

    return Draft(
        "tonal_disturbance",
        "hum with a second harmonic",
        network.bodies[body],
        build,
        (0.2, 1e-4, 10.0),
        direction=network.direction(GROUND, body),
    )


def tone_signal(rng: Rng, scene: Scene, times_s: Matrix, frequency_hz: float) -> Matrix:
    """A tone of unit amplitude with 5 % of second harmonic, whose phase wanders slowly by a few degrees."""
    slow = rng.uniform(1.0, 3.0) / scene.grid.duration_s
    wander = 0.03 * np.sin(2 * np.pi * slow * times_s + rng.uniform(0, 2 * np.pi))
    angle = 2 * np.pi * frequency_hz * times_s + rng.uniform(0, 2 * np.pi) + wander
    tone: Matrix = np.sin(angle) + 0.05 * np.sin(2 * angle)
    return tone


def unbalance(rng: Rng, scene: Scene) -> Draft:
    """A rotor that runs up or down through the modes: its force grows with the square of its speed."""
    network = scene.network
    body = int(rng.integers(len(network.bodies)))
    modes_hz = network.modes_hz()
    low_hz, high_hz = rng.uniform(0.2, 0.5) * modes_hz[0], rng.uniform(0.6, 1.0) * modes_hz[-1]
    share = (scene.grid.half_times_s() / scene.grid.duration_s).clip(0, 1)
    if rng.random() < 0.4:
        share = 1 - share
    # Drives are ramped along a rounded line, seldom a straight one.
    speed = 2 * np.pi * (low_hz + (high_hz - low_hz) * share ** rng.uniform(0.8, 1.3))
    turned = np.cumsum(speed) * (0.5 * scene.grid.step_s)
    force = speed**2 * np.sin(turned)
    scale = scene.inertia(body) / (2 * np.pi * high_hz) ** 2

    def build(size: float) -> Made:
        moment = size * scale
        told = {"moment": moment, "slowest_hz": low_hz, "fastest_hz": high_hz}
        return Made(Addition(pushes=((body, moment * force),)), told)

    return Draft(
        "unbalance",
        "rotor running up or down",
        network.bodies[body],
        build,
        (0.3, 1e-4, 10.0),
        direction=network.direction(GROUND, body),
    )


def base_vibration(rng: Rng, scene: Scene) -> Draft | None:
    """A floor that shakes by itself: noise around one or two of its own broad resonances."""
    network, grid = scene.network, scene.grid
    if ground_moves(network):
        return None
    modes_hz = network.modes_hz()
    floor = np.zeros(2 * grid.steps + 1)
    low_hz = high_hz = float(modes_hz[0])
    for _ in range(int(rng.integers(1, 3))):
        middle_hz = float(np.exp(rng.uniform(np.log(modes_hz[0]), np.log(0.8 * modes_hz[-1]))))
        band = Band(low_hz=0.6 * middle_hz, high_hz=1.6 * middle_hz)
        noise = random_signal(rng, grid, band)
        floor += noise / np.sqrt(np.mean(noise**2))
        low_hz, high_hz = min(low_hz, band.low_hz), max(high_hz, band.high_hz)
    scale = scene.inertia(0) / network.masses[0]

    def build(size: float) -> Made:
        level = size * scale
        told = {"level": level, "low_hz": low_hz, "high_hz": high_hz}
        return Made(Addition(floor=level * floor), told)

    return Draft("base_vibration", "floor with its own resonances", "ground", build, (0.1, 1e-4, 5.0))
