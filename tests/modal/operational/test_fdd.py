from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.operational.fdd import FrequencyDomainDecomposition
from chladni.signals.errors import EstimateError
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.made_spectra import expected_spectra
from tests.modal.truth import ambient_record, chain, noise_record

METHOD = FrequencyDomainDecomposition()


def mac(one, other):
    return abs(np.vdot(one, other)) ** 2 / (np.vdot(one, one) * np.vdot(other, other)).real


@pytest.fixture(scope="module")
def chain_spectra():
    record = ambient_record(chain(), cycles=2000, rng=np.random.default_rng(0), noise=0.01)
    return cross_spectra(record, resolution_hz=0.01)


def test_the_modes_of_a_chain_are_found_each_once(chain_spectra):
    modes, truth = METHOD.identify(chain_spectra), chain()
    assert modes.frequency_hz.size == 5
    assert np.all(np.abs(modes.frequency_hz - truth.frequency_hz) < 4 * modes.frequency_std_hz)
    assert np.all(np.abs(modes.damping_ratio - 0.01) < 4 * modes.damping_std)
    assert all(mac(modes.shapes[row], truth.shapes[row]) > 0.999 for row in range(5))
    assert np.all(np.max(np.abs(modes.shapes), axis=1) == 1)
    assert modes.references == ()
    assert modes.participation is None
    assert modes.provenance.estimator == "FDD"
    assert any("half-power" in note for note in modes.provenance.notes)
    assert any("unscaled" in note for note in modes.provenance.notes)


def test_coarse_lines_admit_how_little_they_tell_of_the_damping():
    # A mode a fifth of a line wide.
    spectra = expected_spectra([(10.0, 0.002, np.array([1.0, -0.5]))], spacing_hz=0.2, lines=256)
    modes = METHOD.identify(spectra)
    assert modes.damping_std[0] > 0.99 * 0.2 / np.sqrt(12) / 10.0
    assert abs(modes.damping_ratio[0] - 0.002) < 2 * modes.damping_std[0]


def test_the_peak_at_the_end_of_the_spectra_shows_one_flank():
    spectra = expected_spectra([(12.6, 0.01, np.array([1.0, -0.5]))], spacing_hz=0.05, lines=254)
    modes = METHOD.identify(spectra, frequencies_hz=[12.6])
    assert modes.damping_ratio[0] == pytest.approx(0.01, rel=0.2)


def test_a_band_a_count_and_frequencies_by_hand_limit_the_modes(chain_spectra):
    truth = chain().frequency_hz
    banded = METHOD.identify(chain_spectra, band_hz=(2.0, 5.0))
    np.testing.assert_allclose(banded.frequency_hz, truth[1:3], rtol=0.01)
    strongest = METHOD.identify(chain_spectra, count=2)
    assert strongest.frequency_hz.size == 2
    many = METHOD.identify(chain_spectra, count=8)
    assert many.frequency_hz.size == 5
    assert any("8 modes asked for, 5 found" in note for note in many.provenance.notes)
    # The same mode twice is one mode.
    by_hand = METHOD.identify(chain_spectra, frequencies_hz=[truth[3] - 0.01, truth[3] + 0.01, truth[0]])
    np.testing.assert_allclose(by_hand.frequency_hz, truth[[0, 3]], atol=0.031)
    # Known to the line, and no better.
    assert np.all(by_hand.frequency_std_hz >= 0.01 / np.sqrt(12))


def test_noise_has_no_modes():
    rng = np.random.default_rng(1)
    for _ in range(10):
        series = noise_record(20_000, rng=rng).select([f"/mass{row}.z" for row in range(4)])
        modes = METHOD.identify(cross_spectra(series))
        assert modes.frequency_hz.size == 0
        assert modes.shapes.shape == (0, 4)
        assert any("no mode" in note for note in modes.provenance.notes)


def test_a_peak_without_one_shape_is_left_out_with_a_word():
    # On every line another shape: as close modes, or a machine beside a mode, make it.
    spectra = expected_spectra([(10.0, 0.01, np.array([1.0, 0.0]))], spacing_hz=0.05, lines=400)
    density = np.array(spectra.density)
    density[:, :, 201:] = density[::-1, ::-1, 201:]
    modes = METHOD.identify(replace(spectra, density=density))
    assert modes.frequency_hz.size == 0
    assert any("agree with its own by a MAC of 0.50" in note for note in modes.provenance.notes)


def test_one_channel_is_enough_with_a_word():
    spectra = expected_spectra([(10.0, 0.01, np.ones(1))], spacing_hz=0.05, lines=400)
    modes = METHOD.identify(spectra)
    assert modes.frequency_hz == pytest.approx([10.0], abs=0.01)
    np.testing.assert_array_equal(modes.shapes, [[1.0]])
    np.testing.assert_array_equal(modes.shape_std, [[0.0]])
    assert any("one channel" in note for note in modes.provenance.notes)


def test_more_channels_than_averages_are_told():
    spectra = expected_spectra([(10.0, 0.01, np.ones(6))], spacing_hz=0.05, lines=400, averages=5.0)
    modes = METHOD.identify(spectra, frequencies_hz=[10.0])
    assert any("5 effective averages of 6 channels" in note for note in modes.provenance.notes)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count": 0}, "count is 0"),
        ({"band_hz": (3.0, 2.0)}, "band_hz is"),
        ({"band_hz": (900.0, 1000.0)}, "band_hz is"),
        ({"frequencies_hz": [3.0, 99.0]}, "99 Hz lies outside the spectra's 0 to"),
    ],
)
def test_requests_outside_the_spectra_are_refused(chain_spectra, options, message):
    with pytest.raises(EstimateError, match=message):
        METHOD.identify(chain_spectra, **options)


def test_settings_and_provenance_that_make_no_sense_are_refused(chain_spectra):
    with pytest.raises(EstimateError, match=r"min_mac is 1\.5"):
        FrequencyDomainDecomposition(min_mac=1.5)
    other = replace(chain_spectra, provenance=replace(chain_spectra.provenance, segment_s=3.0))
    with pytest.raises(EstimateError, match=r"segments of 3 s don't belong to lines 0\.00999"):
        METHOD.identify(other)
