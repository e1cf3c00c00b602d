"""A link between two bodies, or to the ground, is the joint that the model hasn't."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.pair import pairs_of, unlinked_pairs, with_pair_port, with_pair_ports
from chladni.models.structures.structure import Body, Joint
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body
from tests.models.structures.made_models import tree

FREQUENCY_HZ = np.linspace(0.5, 60.0, 80)
LINK = {"stiffness": 2e4, "damping": 3.0}


def with_joint(between):
    """The tree without its tie, and with another joint."""
    structure = loose().structure
    joints = (*structure.joints, Joint(name="link", between=between, stiffness=2e4, damping=3.0))
    return replace(loose(), structure=replace(structure, joints=joints))


def loose():
    structure = tree().structure
    return replace(tree(), structure=replace(structure, joints=structure.joints[:-1]), outputs=tree().outputs[:3])


@pytest.mark.parametrize("pair", [("left", "right"), ("ground", "right"), ("base", "left")])
def test_it_is_a_joint_between_the_same_two_whichever_comes_first(pair) -> None:
    wanted = with_joint(pair).compile().frequency_response(FREQUENCY_HZ)
    for site in ("~".join(pair), "~".join(pair[::-1])):
        linked = loose().with_effects((attached("missing_link", site, LINK),)).compile()
        np.testing.assert_allclose(linked.frequency_response(FREQUENCY_HZ), wanted, rtol=1e-9)


def test_two_links_at_one_pair_add_up() -> None:
    half = attached("missing_link", "left~right", {"stiffness": 1e4, "damping": 1.5})
    twice = loose().with_effects((half, half)).compile().frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(
        twice, with_joint(("left", "right")).compile().frequency_response(FREQUENCY_HZ), rtol=1e-9
    )


def test_the_port_of_a_pair_moves_and_pushes_as_that_of_a_joint_between_them() -> None:
    compiled = tree().compile()
    found, place = with_pair_port(compiled, "left~right")
    tie = compiled.port_index("tie", "joint")
    np.testing.assert_allclose(found.displacement_state[place], compiled.displacement_state[tie])
    np.testing.assert_allclose(found.velocity_state[place], compiled.velocity_state[tie])
    np.testing.assert_allclose(found.g[:, place], compiled.g[:, tie])
    # But for the last output, the joint's force.
    np.testing.assert_allclose(found.h[:-1, place], compiled.h[:-1, tie])
    assert with_pair_port(found, "left~right") == (found, place)


def test_every_pair_is_a_site_once() -> None:
    assert pairs_of(one_body(), "pair") == ["ground~mass"]
    assert len(pairs_of(tree().compile(), "pair")) == 6
    assert pairs_of(one_body(), "output_pair") == ["acc~speed", "acc~place", "speed~place"]


@pytest.mark.parametrize(
    ("site", "words"),
    [
        ("left~rihgt", "there is no 'left~rihgt'; did you mean left~right?"),
        ("left", "acts at a pair of bodies such as ground~arm, but 'left' is a body; possible sites: ground~base"),
        ("left~left", "there is no 'left~left'"),
    ],
)
def test_another_site_is_refused_with_the_pairs_that_there_are(site, words) -> None:
    with pytest.raises(ModelError, match=words.replace("?", r"\?")):
        loose().with_effects((attached("missing_link", site, LINK),)).compile()


def test_what_turns_and_what_slides_are_no_pair() -> None:
    structure = tree().structure
    wheel = Body(name="wheel", mass=0.1, motion="rotation")
    joints = (*structure.joints, Joint(name="axle", between=("ground", "wheel"), stiffness=10.0, damping=0.1))
    mixed = replace(tree(), structure=replace(structure, bodies=(*structure.bodies, wheel), joints=joints))
    with pytest.raises(ModelError, match="left in m and wheel in rad move in unlike ways"):
        mixed.with_effects((attached("missing_link", "left~wheel", LINK),)).compile()


def test_what_a_joint_links_is_no_pair_to_look_at() -> None:
    assert unlinked_pairs(tree().compile()) == ("ground~left", "ground~right")
    assert unlinked_pairs(loose().compile()) == ("ground~left", "ground~right", "left~right")


def test_pairs_get_their_ports_at_once_as_one_after_another() -> None:
    compiled = loose().compile()
    names = unlinked_pairs(compiled)
    together, single = with_pair_ports(compiled, names), compiled
    for name in names:
        single, _ = with_pair_port(single, name)
    assert together.ports == single.ports
    for field in ("g", "h", "displacement_state", "displacement_port", "velocity_state", "velocity_port"):
        np.testing.assert_allclose(getattr(together, field), getattr(single, field), atol=1e-15)
