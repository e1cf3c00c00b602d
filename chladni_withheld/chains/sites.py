"""Where an effect can be, and its draft there; drafts of what no word of the vocabulary names are here, too."""

from collections.abc import Mapping
from math import pi

from chladni_withheld.chains.effects import (
    BODY_DRAFTS,
    INPUT_DRAFTS,
    JOINT_DRAFTS,
    NEED_A_SPRING,
    OUTPUT_DRAFTS,
    base_vibration,
)
from chladni_withheld.chains.plan import GROUND, Plan
from chladni_withheld.chains.scene import Draft, Drafter, Scene, draft
from chladni_withheld.vocabulary import WORDS


def viscoelastic(scene: Scene, site: str) -> Draft:
    """Rubber: a stiffness that rises, and a loss that stays, over two decades of frequency."""
    k = scene.stiffness(site)
    numbers = {"branches": 5.0, "lowest_hz": 0.1 * scene.bench.modes_hz[0]}
    return draft("viscoelastic", site, "viscoelastic", lambda size: {
        **numbers, "stiffness": 0.1 * size * k}, most=10.0)  # fmt: skip


def gyroscopic_coupling(scene: Scene, site: str) -> Draft:
    """Two bodies' velocities push each other aside, as where a wheel spins."""
    plan = scene.bench.plan
    partner = scene.one_of(*(body for body in plan.bodies if body != site))
    mass = (scene.mass(site) * scene.mass(partner)) ** 0.5
    rate = 2 * pi * scene.bench.modes_hz[0] * mass * scene.sign()
    return draft("gyroscopic_coupling", site, "gyroscope", lambda size: {
        "coefficient": 0.1 * size * rate}, source=partner)  # fmt: skip


def periodic_stiffness(scene: Scene, site: str) -> Draft:
    """A spring that swings with a shaft which turns: parametric excitation."""
    k, turning = scene.stiffness(site), 2 * pi * scene.bench.modes_hz[0] * scene.between(0.15, 0.6)
    phase = scene.between(-3, 3)
    return draft("periodic_stiffness", site, "periodic_change", lambda size: {
        "change": 0.1 * size * k, "angular_frequency": turning, "phase": phase}, most=5.0)  # fmt: skip


def position_dependent_gain(scene: Scene, site: str) -> Draft:
    """A motor whose force depends on where it is."""
    length, sign = scene.moving[f"{site}.x"] * scene.between(1.0, 2.0), scene.sign()
    return draft("position_dependent_gain", site, "position_gain", lambda size: {
        "share": 0.2 * sign * size, "length": length}, most=4.5)  # fmt: skip


def square_sensor(scene: Scene, site: str) -> Draft:
    """A sensor with a quadratic error."""
    level, sign = scene.moving[site], scene.sign()
    return draft("square_sensor", site, "square", lambda size: {
        "coefficient": 0.05 * sign * size / level}, most=10.0)  # fmt: skip


def held_samples(scene: Scene, site: str) -> Draft:
    """A bus that drops messages: the last sample is held."""
    length, seed = int(scene.rng.integers(4, 20)), float(scene.rng.integers(1 << 31))

    def numbers(size: float) -> dict[str, float]:
        count = max(round(0.01 * size * scene.bench.samples / length), 1)
        return {"samples": float(length), "count": float(count), "seed": seed}

    return draft("held_samples", site, "held", numbers, least=0.1, most=20.0)


OUTSIDE_DRAFTS: Mapping[str, Drafter] = {
    "viscoelastic": viscoelastic,
    "gyroscopic_coupling": gyroscopic_coupling,
    "periodic_stiffness": periodic_stiffness,
    "position_dependent_gain": position_dependent_gain,
    "square_sensor": square_sensor,
    "held_samples": held_samples,
}

#: Words by what they are at; the ground has one.
DRAFTS: Mapping[str, Mapping[str, Drafter]] = {
    "joint": JOINT_DRAFTS, "body": BODY_DRAFTS, "input": INPUT_DRAFTS, "output": OUTPUT_DRAFTS,
    "ground": {"base_vibration": base_vibration},
}  # fmt: skip
#: Words of the vocabulary that are drawn, in its order.
DRAWN = tuple(word for word in WORDS if any(word in drafts for drafts in DRAFTS.values()))
#: What lies outside of it and is drawn.
OUTSIDE_DRAWN = tuple(OUTSIDE_DRAFTS)


def draw_draft(scene: Scene, word: str) -> Draft | None:
    """Draw a site of the word and a draft there; None when this bench has no such site."""
    places = _places(scene, word)
    if not places:
        return None
    kind, sites = places[int(scene.rng.integers(len(places)))]
    site = str(scene.rng.choice(sites))
    return (DRAFTS[kind][word] if word in DRAFTS[kind] else OUTSIDE_DRAFTS[word])(scene, site)


def _places(scene: Scene, word: str) -> list[tuple[str, list[str]]]:
    """Kinds of site that the word has, each with the sites of this bench."""
    plan = scene.bench.plan
    found = {
        "joint": _joints(scene, word) if word in (*JOINT_DRAFTS, "viscoelastic", "periodic_stiffness") else [],
        "body": _bodies(plan, word) if word in (*BODY_DRAFTS, "gyroscopic_coupling") else [],
        "input": _inputs(plan, word) if word in (*INPUT_DRAFTS, "position_dependent_gain") else [],
        "output": _outputs(plan, word) if word in (*OUTPUT_DRAFTS, "square_sensor", "held_samples") else [],
        "ground": [GROUND] if word in DRAFTS["ground"] and not plan.drive else [],
    }
    return [(kind, sites) for kind, sites in found.items() if sites]


def _joints(scene: Scene, word: str) -> list[str]:
    springs = word in NEED_A_SPRING or word in OUTSIDE_DRAFTS
    names = [joint.name for joint in scene.bench.plan.joints]
    return [name for name in names if not springs or scene.stiffness(name) > 0]


def _bodies(plan: Plan, word: str) -> list[str]:
    return list(plan.bodies) if word != "gyroscopic_coupling" or len(plan.bodies) > 1 else []


def _inputs(plan: Plan, word: str) -> list[str]:
    moving = word in ("ripple", "position_dependent_gain")
    return [one.name for one in plan.inputs if not moving or one.at not in ("", GROUND) or one.joint]


def _outputs(plan: Plan, word: str) -> list[str]:
    # What a controller sees is kept sound but for its gain: anything else there is another plant, not a sensor.
    usable = [one for one in plan.outputs if not one.fed_back or (word == "gain_error" and not plan.drive)]
    if word != "cross_axis":
        return [one.name for one in usable]
    kinds: list[str] = [one.measures for one in plan.outputs]
    return [one.name for one in usable if kinds.count(one.measures) > 1]
