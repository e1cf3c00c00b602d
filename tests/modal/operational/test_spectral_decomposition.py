from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.operational.spectral_decomposition import decompose, relative_std
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.made_spectra import expected_spectra

TRAVELLING = np.array([1.0, 0.8 * np.exp(-0.9j), 0.5 * np.exp(-1.8j)])
ONE = [(10.0, 0.01, TRAVELLING)]


def mac(one, other):
    return abs(np.vdot(one, other)) ** 2 / (np.vdot(one, one) * np.vdot(other, other)).real


def test_the_first_vector_is_the_shape_and_not_its_conjugate():
    found = decompose(expected_spectra(ONE, spacing_hz=0.1, lines=256))
    vector = found.vectors[100, :, 0]
    assert mac(vector, TRAVELLING) == pytest.approx(1.0, abs=1e-9)
    assert mac(vector, TRAVELLING.conj()) < 0.5


def test_a_wave_that_arrives_late_has_a_lagging_phase():
    # From samples, so that the convention of the whole chain is tested: channel 1 is channel 0 a quarter of a second
    # later, a phase of -90 degrees at 1 Hz.
    rng = np.random.default_rng(0)
    values = rng.standard_normal(80_025)
    series = TimeSeries(
        values=np.stack([values[25:], values[:-25]]),
        sample_rate_hz=100.0,
        channels=(Channel(name="a", unit="m/s^2"), Channel(name="b", unit="m/s^2")),
    )
    found = decompose(cross_spectra(series, resolution_hz=0.1))
    vector = found.vectors[10, :, 0]
    # A delay of a 40th of the segment costs coherence of that order.
    assert np.angle(vector[1] / vector[0]) == pytest.approx(-np.pi / 2, abs=0.05)


def test_singular_values_are_those_of_the_matrix_and_fall():
    spectra = expected_spectra([*ONE, (12.0, 0.02, np.array([1.0, -1.0, 1.0]))], spacing_hz=0.1, lines=256)
    found = decompose(spectra)
    of_numpy = np.linalg.svd(spectra.density.transpose(2, 0, 1), compute_uv=False)
    assert relative_std(found) == pytest.approx(1 / np.sqrt(1000))
    np.testing.assert_allclose(found.values, of_numpy, rtol=1e-9, atol=1e-12 * of_numpy.max())


def test_channels_of_other_units_are_brought_to_one_scale_and_back():
    spectra = expected_spectra(ONE, spacing_hz=0.1, lines=256)
    small = np.diag([1.0, 1e-4, 1.0])
    mixed = replace(
        spectra,
        density=np.einsum("ij,jkf,kl->ilf", small, spectra.density, small),
        channels=(*spectra.channels[:1], Channel(name="a1", unit="rad/s"), *spectra.channels[2:]),
    )
    found = decompose(mixed)
    # Each channel has the same power in its own scale.
    np.testing.assert_allclose(np.einsum("kii->i", found.matrix).real, 1.0, rtol=1e-12)
    assert mac(found.vectors[100, :, 0] * found.scale, small @ TRAVELLING) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("overlap", [0.5, 0.75])
def test_overlapping_segments_are_worth_the_record(overlap):
    series = TimeSeries(
        values=np.random.default_rng(1).standard_normal((1, 100_000)),
        sample_rate_hz=100.0,
        channels=(Channel(name="a", unit="m/s^2"),),
    )
    found = decompose(cross_spectra(series, resolution_hz=0.2, overlap=overlap))
    # Half-overlapping Hann segments give away a tenth.
    assert 0.9 * 1000 < found.record_s < 1.01 * 1000


def test_what_is_no_average_of_noise_is_refused():
    spectra = expected_spectra(ONE, spacing_hz=0.1, lines=256)
    for averaging in ("peak-hold", "periodic", "impact"):
        other = replace(spectra, provenance=replace(spectra.provenance, averaging=averaging))
        with pytest.raises(EstimateError, match=f"these spectra are a {averaging} one"):
            decompose(other)
    few = replace(spectra, provenance=replace(spectra.provenance, effective_averages=3.5))
    with pytest.raises(EstimateError, match=r"3\.5 effective averages are too few"):
        decompose(few)
    with pytest.raises(EstimateError, match="15 lines are too few for peaks"):
        decompose(expected_spectra(ONE, spacing_hz=1.0, lines=15))


def test_nan_and_silence_are_refused():
    spectra = expected_spectra(ONE, spacing_hz=0.1, lines=256)
    density = np.array(spectra.density)
    density[1, 1, 40:44] = np.nan
    with pytest.raises(EstimateError, match=r"channel 'a1' aren't finite on 4 lines, from 4 Hz on"):
        decompose(replace(spectra, density=density))
    with pytest.raises(EstimateError, match="no channel has any power"):
        decompose(replace(spectra, density=np.zeros_like(density)))
