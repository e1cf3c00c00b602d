"""Averaged cross-spectra against SciPy and against what is known in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import csd

from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.testing import assert_close
from chladni.spectral.cross_spectra import cross_spectra
from tests.spectral.made_signals import blocks, noise, series

RATE_HZ = 1000.0


def coloured(seed=5):
    """Three channels with common parts, offsets and a trend, so that every element of the matrix matters."""
    x = noise(3, 4000, seed=seed)
    x[1] += 0.5 * np.roll(x[0], 3)
    x[2] += x[0] - 0.2 * x[1]
    return x + np.array([[9.81], [0.0], [-2.0]]) + np.linspace(0, 1, 4000)


@pytest.mark.parametrize(
    ("resolution_hz", "window", "overlap", "detrend"),
    [
        *((4.0, window, 0.5, "constant") for window in ("hann", "boxcar", "flattop", ("kaiser", 6.0))),
        *((1000 / 251, "hann", overlap, "constant") for overlap in (0.0, 0.5, 0.7)),
        *((4.0, "hann", 0.7, detrend) for detrend in ("none", "constant", "linear")),
    ],
)
def test_numbers_are_scipys(resolution_hz, window, overlap, detrend):
    values = coloured()
    spectra = cross_spectra(
        series(values), resolution_hz=resolution_hz, window=window, overlap=overlap, detrend=detrend
    )
    samples = round(RATE_HZ / resolution_hz)
    kept = {"none": False}.get(detrend, detrend)
    for i in range(3):
        for j in range(3):
            frequency_hz, expected = csd(
                values[i],
                values[j],
                fs=RATE_HZ,
                window=window,
                nperseg=samples,
                noverlap=int(samples * overlap + 1e-9),
                detrend=kept,
            )
            # 1e-12 of each number, but for what cancels: rounding scales with the largest products, offsets included.
            np.testing.assert_allclose(spectra.density[i, j], expected, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(spectra.frequency_hz, frequency_hz, rtol=1e-15)
    assert spectra.noise_density is None


@pytest.mark.parametrize("samples", [250, 251])
def test_parseval_without_window(samples):
    # Segments side by side without window: the density sums to the mean square, for even and odd lengths.
    values = coloured()[:, : samples * 15]
    spectra = cross_spectra(
        series(values), resolution_hz=RATE_HZ / samples, window="boxcar", overlap=0.0, detrend="none"
    )
    power = spectra.density.sum(axis=-1) * RATE_HZ / samples
    np.testing.assert_allclose(power.real, values @ values.T / values.shape[1], rtol=1e-12)
    # The imaginary part belongs to the quadrature and needn't vanish line by line, but is odd about pairs.
    np.testing.assert_allclose(power, power.conj().T, rtol=1e-12)


@pytest.mark.parametrize("samples", [250, 251])
def test_parseval_in_welchs_sense(samples):
    # One segment: the density sums to mean(w^2 x^2) / mean(w^2).
    x = noise(1, samples)
    spectra = cross_spectra(series(x), resolution_hz=RATE_HZ / samples, detrend="none")
    w = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(samples) / samples)
    expected = np.mean(w**2 * x**2) / np.mean(w**2)
    assert spectra.density.real.sum() * RATE_HZ / samples == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("window", ["boxcar", "hann", "flattop", ("tukey", 0.4)])
def test_a_sine_on_a_line_has_its_power(window):
    time_s = np.arange(3000) / RATE_HZ
    sine = 3.0 * np.sin(2 * np.pi * 60 * time_s + 0.3)
    spectra = cross_spectra(series(sine), resolution_hz=2.0, window=window, detrend="none")
    assert spectra.density[0, 0, 30].real * spectra.bandwidth_hz == pytest.approx(4.5, rel=1e-12)


def test_white_noise_has_its_density():
    x = noise(1, 200_000)
    spectra = cross_spectra(series(x), resolution_hz=1.0)
    density, averages = spectra.density[0, 0].real, spectra.provenance.effective_averages
    # Variance 1 over 500 Hz; the mean over 400 lines scatters by 1/sqrt(400 n) but for neighbours' correlation (1.94
    # for Hann: 1 + 2 (2/3)^2 + 2 (1/6)^2), five sigma.
    sigma = np.sqrt(1.94 / (400 * averages)) / 500
    assert density[50:450].mean() == pytest.approx(1 / 500, abs=5 * sigma)


def test_a_delay_turns_the_phase_backwards():
    x = noise(1, 50_000)[0]
    spectra = cross_spectra(series(np.stack([x[10:], x[:-10]])), resolution_hz=1.0)  # b(t) = a(t - 10 ms)
    lines = slice(1, 40)
    expected = -2 * np.pi * spectra.frequency_hz[lines] * 0.010
    measured = np.unwrap(np.angle(spectra.density[0, 1, lines]))
    # A delay of 1 % of the segment leaves a little coherence out; phase error about sqrt((1 - c)/(2 n c)).
    np.testing.assert_allclose(measured, expected, atol=0.02)


@settings(max_examples=10, deadline=None)
@given(order=st.permutations(range(3)), gains=st.tuples(*[st.floats(0.1, 100)] * 3))
def test_permuted_and_scaled_channels_give_permuted_and_scaled_spectra(order, gains):
    values = coloured()
    plain = cross_spectra(series(values), resolution_hz=10.0)
    scaled = cross_spectra(series(values[order] * np.array(gains)[:, np.newaxis]), resolution_hz=10.0)
    expected = plain.density[np.ix_(order, order)] * np.multiply.outer(gains, gains)[:, :, np.newaxis]
    # The first line holds what the mean leaves of an offset: nothing but rounding.
    np.testing.assert_allclose(scaled.density[..., 1:], expected[..., 1:], rtol=1e-9, atol=1e-12)


def test_later_in_time_is_the_same():
    early, late = series(coloured()), series(coloured(), start_time_ns=10**18)
    assert_close(cross_spectra(late), cross_spectra(early), rtol=0)


def test_a_stream_is_its_series_by_default_too():
    whole = series(noise(2, 20_000).astype(np.float32))
    spectra = cross_spectra(whole)
    assert_close(cross_spectra(blocks(whole, [777] * 20)), spectra, rtol=0)
    assert spectra.provenance.segment_s == 1.024


def test_a_stream_beyond_the_lead_takes_the_longest_default():
    whole = series(noise(1, 150_000))
    assert_close(cross_spectra(blocks(whole, [50_000] * 2)), cross_spectra(whole), rtol=0)


def test_the_account_tells_how_it_was_made():
    account = cross_spectra(
        series(noise(1, 1000)), resolution_hz=10.0, window=("kaiser", 6.0), overlap=0.75, detrend="linear"
    ).provenance
    assert (account.window, account.segment_s, account.overlap, account.detrend) == (
        "kaiser 6.0",
        0.1,
        0.75,
        "linear",
    )
    assert (account.averages, account.averaging, account.skipped) == (37, "linear", 0)
    assert 15 < account.effective_averages < 20


def test_peak_hold_is_at_least_the_average_and_counts_as_one():
    source = series(noise(2, 5000))
    held = cross_spectra(source, resolution_hz=10.0, averaging="peak-hold")
    mean = cross_spectra(source, resolution_hz=10.0)
    assert np.all(np.abs(held.density) >= np.abs(mean.density))
    assert held.provenance.effective_averages == 1.0


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"resolution_hz": 0.1}, SetupError),
        ({"window": "none such"}, SetupError),
        ({"overlap": 1.5}, SetupError),
        ({"averaging": "median"}, SetupError),
    ],
)
def test_impossible_options_are_refused(options, error):
    with pytest.raises(error):
        cross_spectra(series(noise(1, 1000)), **options)


def test_no_samples_are_refused():
    with pytest.raises(EstimateError, match="no sample"):
        cross_spectra([])
