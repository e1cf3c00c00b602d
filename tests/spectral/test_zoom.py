"""Zoom against closed forms of tones, and against the plain transform where their lines meet."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral import zoom
from chladni.spectral.zoom import zoom_of_blocks, zoom_spectrum
from tests.spectral.made_signals import blocks, noise, series

RATE_HZ = 1000.0


def test_on_the_lines_of_the_transform_it_is_the_transform():
    x = noise(2, 1000)
    found = zoom_spectrum(series(x, rate_hz=RATE_HZ), band_hz=(100.0, 200.0), lines=101, window="boxcar")
    plain = 2 / 1000 * np.abs(np.fft.rfft(x, axis=1))[:, 100:201]
    np.testing.assert_allclose(found.values, plain, atol=1e-12)
    np.testing.assert_allclose(found.frequency_hz, np.arange(100, 201))
    rms = zoom_spectrum(
        series(x, rate_hz=RATE_HZ), band_hz=(100.0, 200.0), lines=101, window="boxcar", quantity="rms"
    )
    np.testing.assert_allclose(rms.values, plain / np.sqrt(2), atol=1e-12)


def test_named_channels_are_selected_with_their_rows():
    found = zoom_spectrum(series(noise(3, 1000), rate_hz=RATE_HZ), band_hz=(100.0, 200.0), lines=11)
    chosen = found.select(["c", "a"])
    assert [channel.name for channel in chosen.channels] == ["c", "a"]
    np.testing.assert_array_equal(chosen.values, found.values[[2, 0]])
    with pytest.raises(EstimateError, match="no channel 'd'"):
        found.select(["d"])


def test_two_close_tones_are_parted_and_read():
    t = np.arange(20_000) / RATE_HZ
    pair = 1.5 * np.cos(2 * np.pi * 100.03 * t) + 0.4 * np.cos(2 * np.pi * 100.55 * t + 1) + 9.81
    found = zoom_spectrum(series(pair, rate_hz=RATE_HZ), band_hz=(99.5, 101.0), lines=3001)
    for frequency_hz, size in ((100.03, 1.5), (100.55, 0.4)):
        near = np.abs(found.frequency_hz - frequency_hz) < 0.05
        highest = np.flatnonzero(near)[found.values[0, near].argmax()]
        assert found.frequency_hz[highest] == pytest.approx(frequency_hz, abs=0.002)
        assert found.values[0, highest] == pytest.approx(size, rel=0.005)
    assert "closer than 0.075 Hz" in found.provenance.notes[0]


def test_the_longest_run_without_a_gap_is_taken():
    x = noise(2, 3000)
    x[1, 900] = np.nan
    found = zoom_spectrum(series(x, rate_hz=RATE_HZ), band_hz=(10.0, 20.0), lines=50)
    alone = zoom_spectrum(series(x[:, 901:], rate_hz=RATE_HZ), band_hz=(10.0, 20.0), lines=50)
    np.testing.assert_array_equal(found.values, alone.values)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"band_hz": (20.0, 10.0)}, "isn't one within 0 to 500 Hz"),
        ({"band_hz": (10.0, 501.0)}, "isn't one within"),
        ({"band_hz": (10.0, 20.0), "lines": 1}, "1 line; give 2 to"),
    ],
)
def test_what_is_no_band_is_refused(options, words):
    with pytest.raises(EstimateError, match=words):
        zoom_spectrum(series(noise(1, 100), rate_hz=RATE_HZ), **options)


def test_blocks_give_what_the_whole_gives():
    x = noise(2, 9000)
    x[1, 900] = np.nan
    whole = series(x, rate_hz=RATE_HZ)
    found = zoom_of_blocks(lambda: blocks(whole, [500, 401, 3000]), band_hz=(10.0, 20.0), lines=50)
    expected = zoom_spectrum(whole, band_hz=(10.0, 20.0), lines=50)
    np.testing.assert_allclose(found.values, expected.values, rtol=1e-9)
    assert found.provenance == expected.provenance


def test_a_window_of_a_long_record_is_laid_between_samples_of_a_shorter_one(monkeypatch):
    x = series(noise(1, 30_000), rate_hz=RATE_HZ)
    expected = zoom_spectrum(x, band_hz=(10.0, 20.0), lines=50)
    monkeypatch.setattr(zoom, "LONGEST_WINDOW", 1 << 12)
    monkeypatch.setattr(zoom, "SAMPLES_AT_ONCE", 1 << 10)
    found = zoom_spectrum(x, band_hz=(10.0, 20.0), lines=50)
    # A cosine by straight lines between 4096 points is (2 pi / 4096)^2 / 8 = 3e-7 off at most.
    np.testing.assert_allclose(found.values, expected.values, atol=1e-6 * expected.values.max())


@pytest.mark.parametrize(("sizes", "readings"), [([4000], 1), ([2000, 2000], 2)])
def test_a_lone_block_is_read_once(sizes, readings):
    whole, reads = series(np.random.default_rng(4).standard_normal(4000)), []

    def read():
        reads.append(None)
        return blocks(whole, sizes)

    found = zoom_of_blocks(read, band_hz=(10.0, 20.0), lines=50)
    assert len(reads) == readings
    np.testing.assert_allclose(found.values, zoom_of_blocks(lambda: whole, band_hz=(10.0, 20.0), lines=50).values)
