"""Deflection shapes of structures whose motion is known."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.checks.deflection_shape import deflection_shape, phase_referenced_shape
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.made_responses import chain, functions

F_HZ = np.arange(2.0, 60.0, 0.1)
RATE_HZ = 200.0


def test_from_functions_it_is_their_line():
    made = functions(chain(), F_HZ, references=("m1", "m4"), noise=0.01)
    shape = deflection_shape(made, F_HZ[100], reference="/force_m4")
    np.testing.assert_array_equal(shape.amplitude, made.values[:, 1, 100])
    np.testing.assert_array_equal(shape.std, made.std[:, 1, 100])
    assert shape.units == ("(m/s^2)/N",) * 5
    assert shape.reference.name == "/force_m4"
    assert shape.channels == made.responses
    assert shape.provenance.notes == made.provenance.notes


def test_at_a_resonance_it_is_the_mode():
    truth = chain().natural_modes()
    shape = deflection_shape(functions(chain(), F_HZ), truth.frequency_hz[0])
    largest = np.argmax(np.abs(shape.amplitude))
    # Other modes add about damping ratio times their distance: a few tenths of a percent here.
    np.testing.assert_allclose(shape.amplitude / shape.amplitude[largest], truth.shapes[0], atol=0.01)
    assert "the deflection shape is that of the nearest line, 5.7 Hz, for 5.73317 Hz" in shape.provenance.notes


def test_masked_lines_are_not_taken():
    made = functions(chain(), F_HZ)
    excited = made.excited.copy()
    excited[100] = False
    shape = deflection_shape(replace(made, excited=excited), F_HZ[100] + 0.01)
    assert shape.frequency_hz == F_HZ[101]
    values = made.values.copy()
    values[2, 0, 101] = np.nan
    holed = deflection_shape(replace(made, values=values), F_HZ[101])
    assert "/m3.x: no value at this line" in holed.provenance.notes


def test_frequencies_that_were_not_excited_are_refused():
    made = functions(chain(), F_HZ, references=("m1", "m4"))
    with pytest.raises(EstimateError, match=r"2 references \(/force_m1, /force_m4\); name one of them"):
        deflection_shape(made, 20.0)
    with pytest.raises(EstimateError, match=r"no excited line at 80 Hz, the nearest is at 59.9 Hz"):
        deflection_shape(made, 80.0, reference="/force_m1")
    with pytest.raises(EstimateError, match="no excited line at nan Hz"):
        deflection_shape(made, np.nan, reference="/force_m1")
    with pytest.raises(EstimateError, match="no reference '/f'"):
        deflection_shape(made, 20.0, reference="/f")
    with pytest.raises(EstimateError, match="no line is excited"):
        deflection_shape(replace(made, excited=np.zeros(F_HZ.size, bool)), 20.0, reference="/force_m1")


def operation(noise=0.0, seed=0, samples=40_000):
    """Three channels of one tone at 12.5 Hz, peak 2, 1 and 3, the second 90 degrees ahead, the third opposite."""
    t = np.arange(samples) / RATE_HZ
    phases = 2 * np.pi * 12.5 * t
    tones = np.stack([2 * np.cos(phases), np.cos(phases + np.pi / 2), -3 * np.cos(phases)])
    values = tones + noise * np.random.default_rng(seed).standard_normal(tones.shape)
    channels = tuple(Channel(name=name, unit="m/s^2") for name in "abc")
    return cross_spectra(
        TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels), resolution_hz=0.5, window="hann"
    )


def test_in_operation_a_tone_has_its_rms_and_phase():
    shape = phase_referenced_shape(operation(), 12.5, reference="a")
    # 12.5 Hz lies on a line; what is left is rounding and the constant taken off each segment.
    np.testing.assert_allclose(shape.amplitude, np.array([2, 1j, -3]) / np.sqrt(2), atol=1e-9)
    assert shape.units == ("m/s^2",) * 3
    assert shape.reference.name == "a"
    turned = phase_referenced_shape(operation(), 12.5, reference="b")
    np.testing.assert_allclose(turned.amplitude, np.array([-2j, 1, 3j]) / np.sqrt(2), atol=1e-9)


def test_in_operation_the_error_bars_cover_the_truth():
    truth, inside, total = np.array([1j, -3]) / np.sqrt(2), 0, 0
    for seed in range(60):
        shape = phase_referenced_shape(operation(noise=1.0, seed=seed, samples=8000), 12.5, reference="a")
        error = shape.amplitude[1:] - truth
        inside += np.count_nonzero(np.abs(error.imag) < 1.96 * shape.std[1:])
        inside += np.count_nonzero(np.abs(error.real) < 1.96 * shape.std[1:])
        total += 4
    # 240 numbers, nominally 95 %; the reference's own noise, not counted, is a small share here.
    assert 0.85 <= inside / total <= 0.995


def test_motion_of_its_own_is_told_and_left_out():
    random = np.random.default_rng(3)
    common = random.standard_normal(40_000)
    values = np.stack([common, common + 3 * random.standard_normal(40_000)])
    channels = (Channel(name="a", unit="m/s^2"), Channel(name="b", unit="m/s^2"))
    spectra = cross_spectra(TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels), resolution_hz=1.0)
    shape = phase_referenced_shape(spectra, 30.2, reference="a")
    assert shape.provenance.notes[-1].startswith("b: less than half of the motion")
    assert any("nearest line, 30 Hz, for 30.2 Hz" in note for note in shape.provenance.notes)
    own = np.sqrt(spectra.density[1, 1, 30].real * spectra.bandwidth_hz)
    assert abs(shape.amplitude[1]) < 0.6 * own
    # The common part has RMS^2 of a density of 2/200 Hz over the line's bandwidth.
    assert abs(shape.amplitude[1]) == pytest.approx(np.sqrt(0.01 * spectra.bandwidth_hz), abs=4 * shape.std[1])


def test_a_reference_at_rest_and_a_single_average_are_told():
    spectra = operation()
    still = replace(spectra, density=spectra.density * 0)
    with pytest.raises(EstimateError, match=r"'a' doesn't move at 12.5 Hz"):
        phase_referenced_shape(still, 12.5, reference="a")
    once = replace(spectra, provenance=replace(spectra.provenance, effective_averages=1.0))
    assert np.isinf(phase_referenced_shape(once, 12.5, reference="a").std).all()
