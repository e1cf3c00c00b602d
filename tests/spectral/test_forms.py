"""Accelerance, mobility, receptance against the closed form of one mass on a spring."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.testing import assert_close
from chladni.spectral.forms import convert_form, form

# Products of a few rounded factors.
RTOL = 16 * np.finfo(float).eps
FREQUENCY_HZ = np.arange(0.0, 50.0, 0.25)
OMEGA = 2 * np.pi * FREQUENCY_HZ
RECEPTANCE = 1 / (4e4 - 3.0 * OMEGA**2 + 1j * OMEGA * 20.0)
FORMS = {"receptance": ("m", 0), "mobility": ("m/s", 1), "accelerance": ("m/s^2", 2)}


def oscillator(name: str) -> FrequencyResponse:
    unit, order = FORMS[name]
    values = (1j * OMEGA) ** order * RECEPTANCE
    return FrequencyResponse(
        frequency_hz=FREQUENCY_HZ,
        values=values[np.newaxis, np.newaxis],
        std=0.01 * np.abs(values)[np.newaxis, np.newaxis],
        coherence=np.ones((1, OMEGA.size)),
        excited=np.ones(OMEGA.size, dtype=bool),
        responses=(Channel(name="mass", unit=unit, overload=100.0),),
        references=(Channel(name="force", unit="N", role="reference"),),
        provenance=Provenance(estimator="H1"),
    )


def without_zero(response: FrequencyResponse) -> FrequencyResponse:
    return replace(
        response,
        frequency_hz=response.frequency_hz[1:],
        values=response.values[..., 1:],
        std=response.std[..., 1:],
        coherence=response.coherence[:, 1:],
        excited=response.excited[1:],
        responses=tuple(replace(channel, overload=None) for channel in response.responses),
    )


@pytest.mark.parametrize("start", FORMS)
@pytest.mark.parametrize("goal", FORMS)
def test_each_form_becomes_each_other(start, goal):
    converted = convert_form(oscillator(start), goal)
    assert form(converted) == goal
    assert converted.unit(0, 0) == oscillator(goal).unit(0, 0)
    assert_close(without_zero(converted), without_zero(oscillator(goal)), rtol=RTOL)


@pytest.mark.parametrize(("start", "goal"), [("accelerance", "receptance"), ("mobility", "receptance")])
def test_division_by_j_omega_leaves_zero_hertz_undefined_and_says_so(start, goal):
    converted = convert_form(oscillator(start), goal)
    assert np.isnan(converted.values[0, 0, 0])
    assert np.isinf(converted.std[0, 0, 0])
    assert not converted.excited[0]
    assert converted.excited[1:].all()
    assert any("0 Hz" in note for note in converted.provenance.notes)


def test_multiplication_by_j_omega_is_defined_at_zero_hertz():
    converted = convert_form(oscillator("receptance"), "accelerance")
    assert converted.values[0, 0, 0] == 0
    assert converted.excited.all()
    assert not converted.provenance.notes


def test_an_overload_limit_does_not_survive_as_another_quantity():
    assert convert_form(oscillator("accelerance"), "mobility").responses[0].overload is None
    assert convert_form(oscillator("accelerance"), "accelerance").responses[0].overload == 100.0


def test_mixed_responses_come_to_one_form():
    parts = [oscillator("accelerance"), oscillator("receptance")]
    mixed = replace(
        parts[0],
        values=np.concatenate([part.values for part in parts]),
        std=np.concatenate([part.std for part in parts]),
        coherence=np.concatenate([part.coherence for part in parts]),
        responses=(parts[0].responses[0], parts[1].responses[0].with_name("laser")),
    )
    with pytest.raises(EstimateError, match="several forms"):
        form(mixed)
    converted = convert_form(mixed, "mobility")
    assert [channel.unit for channel in converted.responses] == ["m/s", "m/s"]
    np.testing.assert_allclose(converted.values[0, 0, 1:], converted.values[1, 0, 1:], rtol=RTOL)


def test_rotation_follows_its_own_units():
    gyro = replace(oscillator("mobility"), responses=(Channel(name="gyro", unit="rad/s"),))
    assert convert_form(gyro, "accelerance").responses[0].unit == "rad/s^2"
    assert convert_form(gyro, "receptance").responses[0].unit == "rad"


def test_what_is_no_motion_is_refused_by_name():
    strain = replace(oscillator("mobility"), responses=(Channel(name="/gauge.strain", unit="1"),))
    with pytest.raises(EstimateError, match=r"'/gauge.strain' without unit is no motion"):
        convert_form(strain, "receptance")


def test_an_unknown_form_is_refused():
    with pytest.raises(EstimateError, match="'inertance' is none of accelerance, mobility, receptance"):
        convert_form(oscillator("mobility"), "inertance")
