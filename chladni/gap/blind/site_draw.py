"""Where an effect can be, and its draft there."""

import numpy as np

from chladni.gap.blind.body_drafts import BODY_DRAFTS, base_vibration
from chladni.gap.blind.draft import Draft, Scene
from chladni.gap.blind.joint_drafts import JOINT_DRAFTS, NEED_A_SPRING
from chladni.gap.blind.outside_drafts import OUTSIDE_DRAFTS
from chladni.gap.blind.plan import GROUND, Plan
from chladni.gap.blind.signal_drafts import INPUT_DRAFTS, OUTPUT_DRAFTS


def draw_draft(scene: Scene, word: str) -> Draft | None:
    """Draw a site of the word and a draft there; None when this bench has no such site."""
    if word == "base_vibration":
        return None if scene.bench.plan.drive else base_vibration(scene, GROUND)
    places = _places(scene, word)
    if not places:
        return None
    kind, sites = places[int(scene.rng.integers(len(places)))]
    site = str(scene.rng.choice(sites))
    tables = {"joint": JOINT_DRAFTS, "body": BODY_DRAFTS, "input": INPUT_DRAFTS, "output": OUTPUT_DRAFTS}
    return (tables[kind][word] if word in tables[kind] else OUTSIDE_DRAFTS[word])(scene, site)


def _places(scene: Scene, word: str) -> list[tuple[str, list[str]]]:
    """Kinds of site that the word has, each with the sites of this bench."""
    plan = scene.bench.plan
    found = {
        "joint": _joints(scene, word) if word in (*JOINT_DRAFTS, "viscoelastic", "periodic_stiffness") else [],
        "body": _bodies(plan, word) if word in (*BODY_DRAFTS, "gyroscopic_coupling") else [],
        "input": _inputs(plan, word) if word in (*INPUT_DRAFTS, "position_dependent_gain") else [],
        "output": _outputs(plan, word) if word in (*OUTPUT_DRAFTS, "square_sensor", "held_samples") else [],
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


def draw_numbers(rng: np.random.Generator, plan: Plan) -> dict[str, float]:
    """True numbers around the nominal ones, as the tolerances promise; nothing beyond two sigma."""
    true = {}
    for name, nominal in plan.numbers.items():
        z = rng.standard_normal()
        while abs(z) >= 2.0:
            z = rng.standard_normal()
        true[name] = nominal * (1.0 + plan.tolerance[name] * float(z))
    return true
