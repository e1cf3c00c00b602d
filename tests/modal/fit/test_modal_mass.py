"""Modal masses against closed forms, and a sentence where there are none."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.fit.maximum_likelihood import refine
from chladni.modal.fit.modal_mass import modal_scale, unit_modal_mass_shapes
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from tests.modal.modal_coverage import started
from tests.modal.truth import ModalTruth, chain, noisy_response

FREQUENCY_HZ = np.linspace(0.2, 8, 400)


def fitted(at=(0, 2), noise=1e-3, truth=None):
    truth = truth or chain()
    rng = np.random.default_rng(8)
    response = noisy_response(truth, FREQUENCY_HZ, at, noise=noise, rng=rng)
    return truth, response, refine(response, started(truth, at, rng))


def true_mass(truth):
    return 1 / np.max(np.abs(truth.shapes), axis=1) ** 2


def test_modal_mass_of_a_chain():
    truth, response, modes = fitted()
    scaling = modal_scale(modes, response.responses, response.references)
    scale = scaling.scale
    assert scaling.notes == ()
    off = np.abs(scale.modal_mass - true_mass(truth)) / scale.modal_mass_std
    assert off.max() < 4
    np.testing.assert_allclose(scale.modal_mass, true_mass(truth), rtol=1e-3)
    shapes = unit_modal_mass_shapes(modes.model.shapes, scale)
    signs = np.sign(np.sum(shapes.real * truth.shapes, axis=1, keepdims=True))
    np.testing.assert_allclose(shapes * signs, truth.shapes, atol=2e-3)
    modal_a = modes.model.shapes[:, 0] / modes.model.participation[:, 0]
    if scale.response == response.responses[0].name:
        np.testing.assert_allclose(scale.modal_a, modal_a)


def test_modal_mass_of_a_structure_in_kilograms():
    bodies = tuple(Body(name=f"m{i}", mass=mass) for i, mass in enumerate((2.0, 3.0, 1.5)))
    joints = tuple(
        Joint(name=f"k{i}", between=("ground" if i == 0 else f"m{i - 1}", f"m{i}"), stiffness=4e4, damping=2.0)
        for i in range(3)
    )
    structure = Structure(bodies=bodies, joints=joints)
    modes = structure.natural_modes()
    frequency_hz = np.linspace(2, 45, 900)
    values = structure.accelerance(frequency_hz)[:, 1:2]
    axis = (1.0, 0.0, 0.0)
    response = FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=np.zeros(values.shape),
        coherence=np.ones((3, frequency_hz.size)),
        excited=np.ones(frequency_hz.size, dtype=bool),
        responses=tuple(Channel(name=f"a{i}", unit="m/s^2", point=f"m{i}", direction=axis) for i in range(3)),
        references=(Channel(name="f", unit="N", point="m1", direction=axis, role="reference"),),
        provenance=noisy_response(chain(), FREQUENCY_HZ, (0,), noise=0.1, rng=np.random.default_rng(0)).provenance,
    )
    truth = ModalTruth(
        frequency_hz=modes.frequency_hz, damping_ratio=modes.damping_ratio, shapes=np.real(modes.shapes)
    )
    found = refine(response, started(truth, (1,), np.random.default_rng(1)))
    np.testing.assert_allclose(found.model.frequency_hz, modes.frequency_hz, rtol=1e-10)
    np.testing.assert_allclose(found.model.damping_ratio, modes.damping_ratio, rtol=1e-7)
    np.testing.assert_allclose(found.model.shapes, modes.shapes, atol=1e-8)
    scale = modal_scale(found, response.responses, response.references).scale
    masses = np.einsum("ri,ij,rj->r", modes.shapes.real, structure.mass_matrix(), modes.shapes.real)
    # Joints damp this structure nearly, not exactly, in proportion: m = phi^T M phi to second order in damping.
    np.testing.assert_allclose(scale.modal_mass, masses, rtol=1e-4)


def test_opposite_directions_turn_the_sign():
    _, response, modes = fitted(at=(0,))
    turned = tuple(replace(channel, direction=(0.0, 0.0, -1.0)) for channel in response.references)
    straight = modal_scale(modes, response.responses, response.references).scale
    scaling = modal_scale(modes, response.responses, turned)
    np.testing.assert_allclose(scaling.scale.modal_mass, -straight.modal_mass)
    assert "is negative: check directions and signs" in scaling.notes[0]
    assert np.all(np.isnan(unit_modal_mass_shapes(modes.model.shapes, scaling.scale)))


def test_directions_that_differ_a_little_are_one_axis_as_in_the_check_of_driving_points():
    _, response, modes = fitted(at=(0,))
    tilted = tuple(replace(channel, direction=(0.02, 0.0, np.sqrt(1 - 0.02**2))) for channel in response.references)
    assert modal_scale(modes, response.responses, tilted).scale is not None


def test_a_named_driving_point_counts_with_its_sign():
    _, response, modes = fitted(at=(0,))
    turned = tuple(replace(channel, point="other", direction=(0.0, 0.0, -1.0)) for channel in response.references)
    names = (response.responses[0].name, response.references[0].name)
    scale = modal_scale(modes, response.responses, turned, driving_point=names).scale
    assert np.all(scale.modal_mass < 0)


def test_a_driving_point_can_be_named():
    truth, response, modes = fitted()
    bare = tuple(replace(channel, point=None, direction=None) for channel in response.responses)
    names = (response.responses[2].name, response.references[1].name)
    scale = modal_scale(modes, bare, response.references, driving_point=names).scale
    assert (scale.response, scale.reference) == names
    # The third mass moves little in some modes; its intervals say so.
    assert np.all(np.abs(scale.modal_mass - true_mass(truth)) < 4 * scale.modal_mass_std + 1e-9)
    with pytest.raises(EstimateError, match="no response 'nowhere'"):
        modal_scale(modes, bare, response.references, driving_point=("nowhere", names[1]))


@pytest.mark.parametrize(
    ("references", "reason"),
    [
        ({"point": None}, "doesn't say at which point"),
        ({"point": "elsewhere"}, "none of the 5 responses is at the point"),
        ({"direction": (1.0, 0.0, 0.0)}, "none of the 5 responses is at the point"),
        ({"unit": "V"}, "in V is no force"),
        ({"unit": "m/s^2"}, "in m/s^2 is a motion"),
        ({"unit": "N m"}, "is no motion that"),
    ],
)
def test_unscaled_says_why(references, reason):
    _, response, modes = fitted(at=(0,))
    changed = tuple(replace(channel, **references) for channel in response.references)
    scaling = modal_scale(modes, response.responses, changed)
    assert scaling.scale is None
    assert scaling.notes[0].startswith("unscaled: ")
    assert reason in scaling.notes[0]


def test_torque_and_rotation_scale():
    _, response, modes = fitted(at=(0,))
    turned = tuple(replace(channel, unit="rad/s^2") for channel in response.responses)
    torque = tuple(replace(channel, unit="N m") for channel in response.references)
    assert modal_scale(modes, turned, torque).scale is not None


def test_a_driving_point_at_a_node_is_told():
    truth = chain()
    shapes = truth.shapes.copy()
    shapes[2, 0] = 1e-3
    node = ModalTruth(frequency_hz=truth.frequency_hz, damping_ratio=truth.damping_ratio, shapes=shapes)
    _, response, modes = fitted(at=(0,), noise=0.1, truth=node)
    scaling = modal_scale(modes, response.responses, response.references)
    assert any(f"{modes.model.frequency_hz[2]:.6g} Hz is very uncertain" in note for note in scaling.notes)
