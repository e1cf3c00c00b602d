from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure import Body, Joint
from tests.models.effects.small_models import MASS, STIFFNESS, one_body
from tests.models.structures.made_models import tree

FREQUENCY_HZ = np.linspace(0.5, 80.0, 160)
OSCILLATOR = {"mass": 0.4, "frequency": 12.0, "damping_ratio": 0.03}


@pytest.mark.parametrize("body", ["base", "left", "right"])
def test_it_is_the_model_with_one_more_body_hung_on(body: str) -> None:
    model = tree()
    omega = 2 * pi * OSCILLATOR["frequency"]
    panel = Body(name="panel", mass=OSCILLATOR["mass"])
    hinge = Joint(
        name="hinge",
        between=(body, "panel"),
        stiffness=OSCILLATOR["mass"] * omega**2,
        damping=2 * OSCILLATOR["damping_ratio"] * omega * OSCILLATOR["mass"],
    )
    structure = replace(
        model.structure, bodies=(*model.structure.bodies, panel), joints=(*model.structure.joints, hinge)
    )
    wanted = replace(model, structure=structure).compile().frequency_response(FREQUENCY_HZ)
    given = attached("extra_mode", body, OSCILLATOR).attach(model.compile()).frequency_response(FREQUENCY_HZ)
    # All inputs: a hammer, an actuator at a joint, and the ground, which shakes the oscillator too.
    np.testing.assert_allclose(given, wanted, rtol=1e-9, atol=1e-13 * np.abs(wanted).max())


def test_an_undamped_absorber_stops_its_body_at_its_own_frequency() -> None:
    own = sqrt(STIFFNESS / MASS) / (2 * pi)
    plant = attached("extra_mode", "mass", {"mass": 0.2, "frequency": own, "damping_ratio": 0.0}).attach(one_body())
    place = plant.frequency_response(np.array([own]))[2, 0, 0]
    assert abs(place) < 1e-12 / STIFFNESS
    # Den Hartog: the two resonances of a tuned absorber are at (Omega/omega)^2 = 1 + mu/2 +- sqrt(mu + mu^2/4).
    mu = 0.2 / MASS
    undamped = attached("extra_mode", "mass", {"mass": 0.2, "frequency": own, "damping_ratio": 0.0}).attach(
        one_body(damping=0.0)
    )
    found = np.unique(np.round(np.abs(undamped.state_space().poles()) / (2 * pi * own), 12))
    ratio = 1 + mu / 2 + np.array([-1, 1]) * sqrt(mu + mu**2 / 4)
    np.testing.assert_allclose(found, np.sqrt(ratio), rtol=1e-11)


def test_far_above_the_body_it_is_an_added_mass() -> None:
    stiff = attached("extra_mode", "mass", {"mass": 0.5, "frequency": 1e5, "damping_ratio": 0.01}).attach(one_body())
    rigid = attached("added_mass", "mass", {"mass": 0.5}).attach(one_body())
    # What the oscillator's own compliance leaves: (20/1e5)^2 and 2 zeta 20/1e5 are below 1e-5.
    np.testing.assert_allclose(
        stiff.frequency_response(FREQUENCY_HZ[:40]), rigid.frequency_response(FREQUENCY_HZ[:40]), rtol=1e-4
    )


def test_two_at_one_body_keep_their_states_apart() -> None:
    once = attached("extra_mode", "mass", OSCILLATOR).attach(one_body())
    twice = attached("extra_mode", "mass", {**OSCILLATOR, "frequency": 30.0}).attach(once)
    assert twice.states == (
        "x",
        "v",
        "mass.extra_mode.displacement",
        "mass.extra_mode.velocity",
        "mass.extra_mode.displacement.2",
        "mass.extra_mode.velocity.2",
    )
    third = attached("extra_mode", "mass", OSCILLATOR).attach(twice)
    assert third.states[-1] == "mass.extra_mode.velocity.3"
