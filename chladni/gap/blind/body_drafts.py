"""Drafts of effects at bodies and at the ground."""

from collections.abc import Callable, Mapping

from chladni.gap.blind.draft import Draft, Scene
from chladni.gap.blind.plan import GROUND, Hidden

Drafter = Callable[[Scene, str], Draft]


def _mass_of(scene: Scene, body: str) -> float:
    return scene.numbers[scene.bench.plan.inertia_of(body)]


def extra_mode(scene: Scene, site: str) -> Draft:
    """A clamped beam's first modes, or two masses one behind the other, somewhere in the excited band."""
    modes_hz = scene.bench.modes_hz
    highest_hz = min(1.2 * modes_hz[-1], 0.2 * scene.bench.rate_hz)
    frequency, ratio = scene.about(0.6 * modes_hz[0], highest_hz), scene.about(0.004, 0.04)
    law, mass = scene.one_of("beam", "appendage"), _mass_of(scene, site)
    above, share = scene.between(1.8, 3.0), scene.between(0.03, 0.2)

    def hidden(size: float) -> Hidden:
        numbers = {"mass": 0.1 * size * mass, "frequency": frequency, "damping_ratio": ratio}
        if law == "appendage":
            numbers |= {"second_mass": share * numbers["mass"], "second_frequency": above * frequency}
        return Hidden(effect="extra_mode", site=site, law=law, numbers=numbers)

    return Draft(hidden=hidden, most=10.0)


def added_mass(scene: Scene, site: str) -> Draft:
    """A payload, rigid or on a mount well above what is measured; more than the tolerance explains."""
    mass, plan = _mass_of(scene, site), scene.bench.plan
    least = 4.5 * plan.tolerance[plan.inertia_of(site)]
    stiff, ratio = scene.rng.random() < 0.6, scene.between(0.02, 0.1)
    frequency = min(6.0 * scene.bench.modes_hz[-1], 1.5 * scene.bench.rate_hz)

    def hidden(size: float) -> Hidden:
        numbers = {"mass": size * mass}
        if stiff:
            numbers |= {"frequency": frequency, "damping_ratio": ratio}
        return Hidden(effect="added_mass", site=site, law="stiff_mount" if stiff else "rigid", numbers=numbers)

    return Draft(hidden=hidden, least=least, most=3.0)


def tone_at_body(scene: Scene, site: str) -> Draft:
    """A force of a motor that runs nearby, whose speed wanders slightly."""
    force = max(scene.force_at(joint.name) for joint in scene.bench.plan.joints)
    numbers = _tone(scene)

    def hidden(size: float) -> Hidden:
        return Hidden(effect="tonal_disturbance", site=site, law="tone",
                      numbers={**numbers, "amplitude": 0.1 * size * force})  # fmt: skip

    return Draft(hidden=hidden)


def tone_at_output(scene: Scene, site: str) -> Draft:
    """Hum on a cable."""
    numbers = _tone(scene)

    def hidden(size: float) -> Hidden:
        return Hidden(effect="tonal_disturbance", site=site, law="tone",
                      numbers={**numbers, "amplitude": 0.1 * size * scene.moving[site]})  # fmt: skip

    return Draft(hidden=hidden)


def _tone(scene: Scene) -> dict[str, float]:
    modes_hz = scene.bench.modes_hz
    return {
        "frequency": scene.about(0.5 * modes_hz[0], min(1.5 * modes_hz[-1], 0.2 * scene.bench.rate_hz)),
        "phase": scene.between(-3.0, 3.0),
        # A random walk of the phase, in rad per square root of a second.
        "wander": scene.about(0.003, 0.05),
        "seed": float(scene.rng.integers(1 << 31)),
    }


def base_vibration(scene: Scene, _site: str) -> Draft:
    """A floor that shakes in a band which isn't flat."""
    modes_hz = scene.bench.modes_hz
    low = scene.about(0.2, 0.9) * modes_hz[0]
    high = min(scene.between(1.0, 1.5) * modes_hz[-1], 0.25 * scene.bench.rate_hz)
    felt = max(scene.moving[f"{joint.name}.s"] for joint in scene.bench.plan.joints) * 6.3 * modes_hz[0]
    numbers = {"low": low, "high": max(high, 2 * low), "tilt": scene.between(-1.0, 1.0),
               "seed": float(scene.rng.integers(1 << 31))}  # fmt: skip

    def hidden(size: float) -> Hidden:
        return Hidden(effect="base_vibration", site=GROUND, law="shaped_noise",
                      numbers={**numbers, "level": 0.1 * size * felt})  # fmt: skip

    return Draft(hidden=hidden)


BODY_DRAFTS: Mapping[str, Drafter] = {
    "extra_mode": extra_mode,
    "added_mass": added_mass,
    "tonal_disturbance": tone_at_body,
}
