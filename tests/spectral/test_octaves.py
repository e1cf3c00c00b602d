"""Octave bands and weightings against the numbers of the standards."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.levels import decibels
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.leakage import named_window
from chladni.spectral.octaves import (
    attenuation_limits,
    filter_sections,
    octave_band,
    octave_bands,
    octave_density,
    octave_filter,
    octaves,
    synthesised_class,
)
from chladni.spectral.psd import power_spectral_density

RATE_HZ = 8000.0


def sine(frequency_hz, seconds=8.0, amplitude=2.0):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    values = amplitude * np.sin(2 * np.pi * frequency_hz * t)[np.newaxis]
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=(Channel(name="a", unit="m/s^2"),))


def test_bands_are_those_of_the_base_ten_system():
    bands = octave_bands(20, 6000)
    nominal = [25, 31.5, 40, 50, 63, 80, 100, 125, 160, 200, 250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000]
    assert [band.nominal_hz for band in bands] == [*nominal, 2500, 3150, 4000, 5000]
    # Exact mid-band frequencies as tabulated in annex A of the standard.
    exact = {25: 25.119, 100: 100.0, 315: 316.23, 1250: 1258.9, 5000: 5011.9}
    for band in bands:
        if band.nominal_hz in exact:
            assert band.mid_hz == pytest.approx(exact[band.nominal_hz], rel=5e-5)
    for lower, upper in pairwise(bands):
        assert lower.high_hz == pytest.approx(upper.low_hz, rel=1e-14)
    assert octave_band(-30).nominal_hz == 1.0
    assert octave_band(-31).nominal_hz == 0.8


def test_octaves_and_twelfths_are_called_as_annex_e_has_it():
    whole = octave_bands(11, 23_000, fraction=1)
    assert [band.nominal_hz for band in whole] == [16, 31.5, 63, 125, 250, 500, 1000, 2000, 4000, 8000, 16_000]
    assert [round(band.mid_hz, 3) for band in whole[3:6]] == [125.893, 251.189, 501.187]
    # Of an even number none lies at 1 kHz: it's the edge between two.
    twelfths = octave_bands(890, 1190, fraction=12)
    assert [band.nominal_hz for band in twelfths] == [920, 970, 1030, 1090, 1150]
    assert twelfths[2].low_hz == pytest.approx(1000.0, rel=1e-12)
    for bands in (whole, twelfths):
        for lower, upper in pairwise(bands):
            assert lower.high_hz == pytest.approx(upper.low_hz, rel=1e-12)
        ratio = bands[0].high_hz / bands[0].low_hz
        assert ratio ** bands[0].fraction == pytest.approx(10**0.3, rel=1e-12)


@pytest.mark.parametrize("fraction", [0, -3, 25])
def test_a_fraction_that_is_none_is_refused(fraction):
    with pytest.raises(EstimateError, match="divided in 1 to 24 bands"):
        octave_bands(20, 100, fraction=fraction)


def test_tones_of_a_microphone_have_the_levels_that_a_sound_level_meter_shows():
    # 1 Pa RMS is 93.98 dB; at 100 Hz A takes 19.15 dB off, C 0.30.
    log = sine(100.0, amplitude=np.sqrt(2))
    microphone = TimeSeries(values=log.values, sample_rate_hz=RATE_HZ, channels=(Channel(name="a", unit="Pa"),))
    for weighting, level_db in ((None, 93.98), ("A", 93.98 - 19.15), ("C", 93.98 - 0.30)):
        found = octaves(microphone, fraction=1, weighting=weighting)
        at = found.nominal_hz.tolist().index(125)
        assert found.decibels()[0, at] == pytest.approx(level_db, abs=0.02)
        assert decibels(found.total, found.channels)[0] == pytest.approx(level_db, abs=0.02)
        assert found.weighting == weighting


def test_finer_bands_add_up_to_coarser_ones():
    noise = TimeSeries(
        values=np.random.default_rng(2).standard_normal((1, 64_000)),
        sample_rate_hz=RATE_HZ,
        channels=(Channel(name="a", unit="m/s^2"),),
    )
    density = octave_density(noise, resolution_hz=0.5)
    whole, thirds = (octaves(density, fraction=fraction, low_hz=44.0, high_hz=3000.0) for fraction in (1, 3))
    power = (thirds.bands.rms[0] ** 2).reshape(-1, 3).sum(axis=1)
    np.testing.assert_allclose(power, whole.bands.rms[0] ** 2, rtol=1e-9)


def test_a_series_has_lines_fine_enough_for_the_lowest_band_asked_for():
    found = octaves(sine(100.0), low_hz=22.0)
    assert found.nominal_hz[0] == 25
    assert 1 / found.bands.provenance.segment_s <= (found.bands.high_hz - found.bands.low_hz)[0] / 5
    # Without a wish: bands as low as 31 half-overlapping segments allow.
    assert octaves(sine(100.0)).bands.provenance.averages == 31


def test_a_record_too_short_for_any_band_is_told():
    with pytest.raises(EstimateError, match=r"a record of 0\.02 s shows 1/3 octave bands from 1\.54e\+04 Hz on"):
        octaves(sine(500.0, seconds=0.02))


def test_a_range_that_touches_the_edges_holds_the_band():
    band = octave_band(3)
    assert octave_bands(band.low_hz, band.high_hz) == (band,)
    assert octave_bands(band.low_hz * 1.001, band.high_hz) == ()


@pytest.mark.parametrize(("low_hz", "high_hz"), [(0, 10), (10, 10), (20, 10), (1, np.inf)])
def test_a_range_must_be_positive_and_rise(low_hz, high_hz):
    with pytest.raises(EstimateError, match="0 < low < high"):
        octave_bands(low_hz, high_hz)


def test_the_mask_has_the_breakpoints_of_the_standard():
    # IEC 61260-1:2014, annex with the breakpoints of third octaves: 0.77257, 0.91958, 1.02667, 1.08746, 1.29437, ...
    ratio = np.array([1.0, 1.02667, 1.08746, 1.29437, 1.88173, 3.05365, 5.39195])
    least, most = attenuation_limits(ratio, performance_class=1)
    np.testing.assert_allclose(least, [-0.4, -0.4, -0.4, 16.6, 40.5, 60.0, 70.0], atol=0.02)
    np.testing.assert_allclose(most[:3], [0.4, 0.5, 1.4], atol=0.02)
    assert np.isinf(most[3:]).all()
    np.testing.assert_allclose(attenuation_limits(1 / ratio, performance_class=1), [least, most], atol=1e-9)
    assert np.all(attenuation_limits(ratio, performance_class=2)[0] <= least)
    edge = 10**0.05
    least, most = attenuation_limits(np.array([edge * 0.99999, edge * 1.00001]), performance_class=1)
    np.testing.assert_allclose(least, [-0.4, 1.2], atol=0.01)
    assert most[0] == pytest.approx(5.3, abs=0.01)


@pytest.mark.parametrize(
    ("fraction", "number"),
    [*((3, number) for number in (-30, -20, -10, 0, 3, 5)), (1, -6), (1, 0), (12, -80), (12, 0)],
)
def test_the_filters_meet_the_mask_of_class_1(fraction, number):
    band = octave_band(number, fraction=fraction)
    ratio = np.unique(np.concatenate([np.geomspace(1 / 8, 8, 4001), np.geomspace(0.85, 1.18, 4001)]))
    ratio = ratio[ratio * band.mid_hz < RATE_HZ / 2]
    _, response = signal.sosfreqz(filter_sections(band, RATE_HZ), worN=ratio * band.mid_hz, fs=RATE_HZ)
    attenuation_db = -20 * np.log10(np.maximum(np.abs(response), 1e-12))
    least, most = attenuation_limits(ratio, performance_class=1, fraction=fraction)
    assert np.all(attenuation_db >= least)
    assert np.all(attenuation_db <= most)


def test_a_filter_passes_its_tone_and_stops_the_others():
    log = sine(1000.0)
    settled = slice(8000, None)
    own = octave_filter(log, octave_band(0))
    np.testing.assert_allclose(np.sqrt(np.mean(own.values[0, settled] ** 2)), np.sqrt(2), rtol=0.01)
    other = octave_filter(log, octave_band(-3))
    assert np.sqrt(np.mean(other.values[0, settled] ** 2)) < np.sqrt(2) * 10 ** (-16.6 / 20)
    assert own.channels == log.channels


def test_a_filter_refuses_gaps_and_bands_too_high():
    log = sine(1000.0, seconds=1.0)
    holes = np.ones(log.values.shape, dtype=bool)
    holes[0, 10] = False
    gapped = TimeSeries(values=log.values, sample_rate_hz=RATE_HZ, channels=log.channels, valid=holes)
    with pytest.raises(EstimateError, match="missing samples"):
        octave_filter(gapped, octave_band(0))
    with pytest.raises(EstimateError, match=r"0\.45 of the sample rate"):
        octave_filter(log, octave_band(6))


def test_levels_of_a_tone_and_of_noise():
    log = sine(500.0)
    white = np.random.default_rng(1).standard_normal(log.values.shape)
    both = TimeSeries(
        values=np.vstack([log.values, white]),
        sample_rate_hz=RATE_HZ,
        channels=(Channel(name="tone", unit="N"), Channel(name="noise", unit="N")),
    )
    psd = power_spectral_density(cross_spectra(both, resolution_hz=2.0))
    levels = octaves(psd).bands
    bands = octave_bands(levels.low_hz[0], levels.high_hz[-1])
    assert len(bands) == levels.low_hz.size
    at_500 = [band.nominal_hz for band in bands].index(500)
    assert levels.rms[0, at_500] == pytest.approx(np.sqrt(2), rel=1e-3)
    widths = levels.high_hz - levels.low_hz
    # Variance 1 over 4000 Hz; each band within 5 of its own stated sigmas.
    deviation = (levels.rms[1] - np.sqrt(widths / 4000)) / levels.std[1]
    assert np.abs(deviation).max() < 5
    assert "no class of IEC 61260-1 applies" in levels.provenance.notes[-1]
    assert "Hz band on" in levels.provenance.notes[-1]
    # Each band is at least one line wide.
    assert widths[0] >= 2.0


def test_bands_summed_from_lines_meet_the_mask_once_they_hold_enough_lines():
    hann = named_window("hann")
    numbers = range(-20, 8)
    classes = [synthesised_class(octave_band(n), spacing_hz=1.0, window=hann) for n in numbers]
    # 10 Hz: a band of 2.3 lines; 20 Hz: 4.6 lines.
    assert classes[0] is None
    assert classes[3:] == [1] * len(classes[3:])
    # The side lobes of a rectangular window fall too slowly for 70 dB.
    bare = named_window("boxcar")
    assert synthesised_class(octave_band(0), spacing_hz=1.0, window=bare) is None


def test_a_spectrum_without_a_whole_band_is_refused():
    psd = power_spectral_density(cross_spectra(sine(500.0), resolution_hz=2.0))
    with pytest.raises(EstimateError, match="no 1/3 octave band"):
        octaves(psd, low_hz=100.0, high_hz=110.0)
