"""Drafts of effects that no word of the vocabulary names."""

from collections.abc import Callable, Mapping
from math import pi

from chladni.gap.blind.draft import Draft, Scene
from chladni.gap.blind.plan import Hidden

Drafter = Callable[[Scene, str], Draft]


def viscoelastic(scene: Scene, site: str) -> Draft:
    """Rubber: a stiffness that rises, and a loss that stays, over two decades of frequency."""
    k = scene.stiffness(site)
    numbers = {"branches": 5.0, "lowest_hz": 0.1 * scene.bench.modes_hz[0]}

    def hidden(size: float) -> Hidden:
        return Hidden(effect="viscoelastic", site=site, law="viscoelastic",
                      numbers={**numbers, "stiffness": 0.1 * size * k})  # fmt: skip

    return Draft(hidden=hidden, most=10.0)


def gyroscopic_coupling(scene: Scene, site: str) -> Draft:
    """Two bodies' velocities push each other aside, as where a wheel spins."""
    plan = scene.bench.plan
    partner = scene.one_of(*(body for body in plan.bodies if body != site))
    mass = (scene.numbers[plan.inertia_of(site)] * scene.numbers[plan.inertia_of(partner)]) ** 0.5
    rate = 2 * pi * scene.bench.modes_hz[0] * mass * scene.sign()

    def hidden(size: float) -> Hidden:
        return Hidden(effect="gyroscopic_coupling", site=site, law="gyroscope",
                      numbers={"coefficient": 0.1 * size * rate}, source=partner)  # fmt: skip

    return Draft(hidden=hidden)


def periodic_stiffness(scene: Scene, site: str) -> Draft:
    """A spring that swings with a shaft which turns: parametric excitation."""
    k, turning = scene.stiffness(site), 2 * pi * scene.bench.modes_hz[0] * scene.between(0.15, 0.6)
    phase = scene.between(-3, 3)

    def hidden(size: float) -> Hidden:
        return Hidden(effect="periodic_stiffness", site=site, law="periodic_change",
                      numbers={"change": 0.1 * size * k, "angular_frequency": turning, "phase": phase})  # fmt: skip

    return Draft(hidden=hidden, most=5.0)


def position_dependent_gain(scene: Scene, site: str) -> Draft:
    """A motor whose force depends on where it is."""
    length, sign = scene.moving[f"{site}.x"] * scene.between(1.0, 2.0), scene.sign()

    def hidden(size: float) -> Hidden:
        return Hidden(effect="position_dependent_gain", site=site, law="position_gain",
                      numbers={"share": 0.2 * sign * size, "length": length})  # fmt: skip

    return Draft(hidden=hidden, most=4.5)


def square_sensor(scene: Scene, site: str) -> Draft:
    """A sensor with a quadratic error."""
    level, sign = scene.moving[site], scene.sign()

    def hidden(size: float) -> Hidden:
        return Hidden(effect="square_sensor", site=site, law="square",
                      numbers={"coefficient": 0.05 * sign * size / level})  # fmt: skip

    return Draft(hidden=hidden, most=10.0)


def held_samples(scene: Scene, site: str) -> Draft:
    """A bus that drops messages: the last sample is held."""
    length, seed = int(scene.rng.integers(4, 20)), float(scene.rng.integers(1 << 31))

    def hidden(size: float) -> Hidden:
        count = max(round(0.01 * size * scene.bench.samples / length), 1)
        return Hidden(effect="held_samples", site=site, law="held",
                      numbers={"samples": float(length), "count": float(count), "seed": seed})  # fmt: skip

    return Draft(hidden=hidden, least=0.1, most=20.0)


OUTSIDE_DRAFTS: Mapping[str, Drafter] = {
    "viscoelastic": viscoelastic,
    "gyroscopic_coupling": gyroscopic_coupling,
    "periodic_stiffness": periodic_stiffness,
    "position_dependent_gain": position_dependent_gain,
    "square_sensor": square_sensor,
    "held_samples": held_samples,
}
