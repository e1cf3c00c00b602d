"""Synthesis of receptance, mobility and accelerance against the closed form of a structure."""

import numpy as np
import pytest

from chladni.modal.fit.modal_model import ModalModel
from chladni.signals.errors import EstimateError
from tests.modal.truth import chain

FREQUENCY_HZ = np.linspace(0.1, 9, 300)


def exact_model(truth, at=(0, 2)):
    """The closed form as a modal model: residue phi_i phi_j / (2 j omega_d)."""
    masses = truth.shapes.shape[1]
    nothing = np.zeros((masses, len(at)), dtype=complex)
    vectors = truth.shapes[:, list(at)] / (2j * truth.poles.imag[:, None])
    return ModalModel(
        poles=truth.poles, shapes=truth.shapes.astype(complex), participation=vectors, lower=nothing, upper=nothing
    )


def test_the_closed_form_in_all_forms():
    truth = chain()
    s = 2j * np.pi * FREQUENCY_HZ
    for form, order in (("receptance", 0), ("mobility", 1), ("accelerance", 2)):
        expected = truth.receptance(FREQUENCY_HZ, (0, 2)) * s**order
        found = exact_model(truth).synthesise(FREQUENCY_HZ, form)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-13 * np.abs(expected).max())


def test_residuals_are_inertia_and_flexibility():
    model = ModalModel(
        poles=np.empty(0, dtype=complex),
        shapes=np.empty((0, 1), dtype=complex),
        participation=np.empty((0, 1), dtype=complex),
        lower=np.array([[2.0 + 0j]]),
        upper=np.array([[3.0 + 0j]]),
    )
    s = 2j * np.pi * FREQUENCY_HZ
    np.testing.assert_allclose(model.synthesise(FREQUENCY_HZ, "receptance")[0, 0], 2 / s**2 + 3, rtol=1e-14)
    np.testing.assert_allclose(model.synthesise(FREQUENCY_HZ, "mobility")[0, 0], 2 / s + 3 * s, rtol=1e-14)
    at_rest = model.synthesise(np.array([0.0]), "accelerance")
    assert at_rest[0, 0, 0] == 2
    with pytest.raises(EstimateError, match="at 0 Hz the mobility"):
        model.synthesise(np.array([0.0]), "mobility")


def test_modes_are_named_by_their_poles_and_can_be_chosen():
    truth = chain()
    model = exact_model(truth)
    np.testing.assert_allclose(model.frequency_hz, truth.frequency_hz, rtol=1e-14)
    np.testing.assert_allclose(model.damping_ratio, truth.damping_ratio, rtol=1e-12)
    both = model.select([0, 3]).synthesise(FREQUENCY_HZ, "receptance")
    apart = sum(model.select([mode]).synthesise(FREQUENCY_HZ, "receptance") for mode in (0, 3))
    np.testing.assert_allclose(both, apart, rtol=1e-12)


def test_shapes_must_fit():
    with pytest.raises(EstimateError, match="participation has shape"):
        ModalModel(
            poles=np.array([-1 + 9j]),
            shapes=np.ones((1, 2), dtype=complex),
            participation=np.ones((2, 1), dtype=complex),
            lower=np.zeros((2, 1), dtype=complex),
            upper=np.zeros((2, 1), dtype=complex),
        )
