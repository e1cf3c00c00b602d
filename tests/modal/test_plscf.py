"""Poles of closed-form structures by the poly-reference least-squares complex frequency estimator."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.plscf import polyreference_poles
from chladni.signals.errors import EstimateError
from tests.modal.made_responses import chain, functions

FREQUENCY_HZ = np.arange(0, 60, 0.1)
# Rounding of the sums (1e-16 of their size) is squared into the normal equations: half of the digits remain, less
# some for poles that lie close to each other.
EXACT = 1e-6


def true_poles(structure):
    modes = structure.natural_modes()
    omega = 2 * np.pi * modes.frequency_hz
    return omega * (-modes.damping_ratio + 1j * np.sqrt(1 - modes.damping_ratio**2))


def poles_of(table, order):
    return table.pole[table.order == order]


def worst(found, truth):
    """Largest relative distance from a true pole to the nearest found."""
    return np.max(np.min(np.abs(found[None, :] - truth[:, None]), axis=1) / np.abs(truth))


@pytest.mark.parametrize("form", [0, 1, 2])
@pytest.mark.parametrize("references", [("m1",), ("m1", "m3")])
@pytest.mark.parametrize("frequency_hz", [FREQUENCY_HZ, FREQUENCY_HZ[1:], FREQUENCY_HZ[21:]])
def test_poles_of_a_chain_are_exact_without_noise_and_alone(form, references, frequency_hz):
    structure = chain()
    table = polyreference_poles(functions(structure, frequency_hz, references=references, order=form), max_order=40)
    truth = true_poles(structure)
    for order in (20, 30, 40):
        assert poles_of(table, order).size == truth.size
        assert worst(poles_of(table, order), truth) < EXACT


def test_orders_beyond_what_the_lines_determine_are_left_out_with_a_note():
    response = functions(chain(), np.arange(1, 61, 1.0), noise=1e-3)
    table = polyreference_poles(response, max_order=60)
    assert table.orders[-1] == 29
    assert "orders above 29 left out: 60 lines" in table.notes[0]


def test_impossible_requests_are_named():
    response = functions(chain(), FREQUENCY_HZ)
    with pytest.raises(EstimateError, match="orders from 5 to 3"):
        polyreference_poles(response, min_order=5, max_order=3)
    with pytest.raises(EstimateError, match="band 30 to 10 Hz"):
        polyreference_poles(response, band_hz=(30, 10))
    with pytest.raises(EstimateError, match="2 excited lines"):
        polyreference_poles(response, band_hz=(10, 10.15))
    with pytest.raises(EstimateError, match="zero or not finite"):
        polyreference_poles(replace(response, values=np.zeros_like(response.values)))
