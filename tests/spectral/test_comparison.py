"""Comparisons: silent when nothing changed, and right about what did."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.comparison import compare_densities, compare_responses
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from chladni.spectral.psd import power_spectral_density

RATE_HZ = 500.0


def measured(values, units="m/s^2", names=None):
    units = [units] * len(values) if isinstance(units, str) else units
    names = names or [f"c{row}" for row in range(len(values))]
    channels = tuple(Channel(name=name, unit=unit) for name, unit in zip(names, units, strict=True))
    return TimeSeries(values=np.asarray(values), sample_rate_hz=RATE_HZ, channels=channels)


def density(values, *, resolution_hz=1.0, **options):
    return power_spectral_density(cross_spectra(measured(values, **options), resolution_hz=resolution_hz))


def resonant(random, samples, frequency_hz=40.0, damping=0.02, shape=()):
    """White noise through one resonance."""
    omega = 2 * np.pi * frequency_hz
    system = signal.cont2discrete(([omega**2], [1, 2 * damping * omega, omega**2]), 1 / RATE_HZ, "zoh")
    return signal.lfilter(system[0].ravel(), system[1], random.standard_normal((*shape, samples)))


@pytest.mark.parametrize("kind", ["white", "resonant"])
def test_the_same_process_twice_shows_no_change(kind):
    random = np.random.default_rng(1)
    trials, lines, bands, moved = 25, 0, 0, 0
    for _ in range(trials):
        values = [
            random.standard_normal((2, 10_000)) if kind == "white" else resonant(random, 10_000, shape=(2,))
            for _ in range(2)
        ]
        result = compare_densities(density(values[0]), density(values[1]))
        lines += bool(result.significant.any())
        bands += any(level.significant for level in result.bands)
        moved += sum(peak.fate != "unchanged" for peak in result.peaks)
        assert abs(result.overall[0].change_db) < 5 * result.overall[0].change_std_db
    # At most 5 % of the trials, 1.25 in the mean; a binomial count exceeds 5 with a chance of 0.1 %.
    assert lines <= 5
    assert bands <= 5
    assert moved <= 2


def test_one_decibel_in_a_band_is_found_there_and_only_there():
    random = np.random.default_rng(2)
    before, after = random.standard_normal((2, 1, 60_000))
    sections = signal.butter(6, (50, 100), "bandpass", fs=RATE_HZ, output="sos")
    # Adding the band in phase with itself: 1 dB is a factor of 1.122.
    louder = after + (10 ** (1 / 20) - 1) * signal.sosfiltfilt(sections, after)
    result = compare_densities(density(before), density(louder))
    inside = [level for level in result.bands if level.low_hz > 55 and level.high_hz < 95]
    outside = [level for level in result.bands if level.high_hz < 45 or level.low_hz > 115]
    assert len(inside) == 2
    assert all(level.significant for level in inside)
    for level in inside:
        assert level.change_db == pytest.approx(1.0, abs=4 * level.change_std_db)
        assert level.change_std_db < 0.25
    # Of some 20 bands without change at most one is false, as the share of false discoveries asks.
    assert sum(level.significant for level in outside) <= 1
    assert len(outside) > 10


def test_lines_that_changed_are_found_with_their_size():
    random = np.random.default_rng(3)
    t = np.arange(60_000) / RATE_HZ
    before, after = random.standard_normal((2, 1, t.size))
    after = after + 0.3 * np.sin(2 * np.pi * 77.0 * t)
    result = compare_densities(density(before), density(after))
    found = result.frequency_hz[result.significant[0]]
    assert set(found) >= {76.0, 77.0, 78.0}
    assert np.all(np.abs(found - 77.0) <= 2) or found.size <= 5
    line = int(np.flatnonzero(result.frequency_hz == 77.0)[0])
    expected = 10 * np.log10(1 + 0.3**2 / 2 / 1.5 / (2 / RATE_HZ))
    assert result.change_db[0, line] == pytest.approx(expected, abs=3 * result.change_std_db[0, line])
    (appeared,) = [peak for peak in result.peaks if peak.fate == "appeared"]
    assert appeared.before is None
    assert appeared.after.frequency_hz == pytest.approx(77.0, abs=0.1)
    assert np.isnan(appeared.sigmas)
    (vanished,) = [
        peak for peak in compare_densities(density(after), density(before)).peaks if peak.fate == "vanished"
    ]
    assert vanished.after is None


def test_a_peak_that_moved_by_one_percent_is_said_to_have_moved():
    random = np.random.default_rng(4)
    before = resonant(random, 300_000, 40.0, 0.01, shape=(1,))
    after = resonant(random, 300_000, 40.4, 0.01, shape=(1,))
    result = compare_densities(density(before, resolution_hz=0.1), density(after, resolution_hz=0.1))
    (peak,) = result.peaks
    assert peak.fate == "moved"
    assert peak.shift_hz == pytest.approx(0.4, abs=4 * peak.shift_std_hz)
    assert peak.sigmas > 3.5
    assert peak.before.channels == ("c0",)
    again = resonant(random, 300_000, 40.0, 0.01, shape=(1,))
    (same,) = compare_densities(density(before, resolution_hz=0.1), density(again, resolution_hz=0.1)).peaks
    assert same.fate == "unchanged"


def test_channels_are_matched_by_name_and_the_rest_is_named():
    random = np.random.default_rng(5)
    before = density(random.standard_normal((2, 5000)), names=["a", "b"])
    after = density(random.standard_normal((2, 5000)), names=["c", "a"])
    result = compare_densities(before, after)
    assert [channel.name for channel in result.channels] == ["a"]
    assert result.only_before == ("b",)
    assert result.only_after == ("c",)
    assert any("only before, so not compared: b" in note for note in result.notes)
    np.testing.assert_allclose(result.change_db[0], 10 * np.log10(after.values[1] / before.values[0]), rtol=1e-12)
    copy = pickle.loads(pickle.dumps(result))  # noqa: S301
    assert not copy.change_db.flags.writeable


def test_a_silent_channel_has_no_change_to_tell():
    silent = np.zeros((1, 5000))
    result = compare_densities(density(silent), density(np.ones((1, 5000))))
    assert not result.significant.any()
    assert np.isnan(result.change_db).all()
    assert np.isnan(result.overall[0].change_db)


def test_spectra_too_short_for_bands_say_so():
    random = np.random.default_rng(6)
    pair = [density(random.standard_normal((1, 2000)), resolution_hz=125.0) for _ in range(2)]
    result = compare_densities(*pair)
    assert result.bands == ()
    assert any("levels in bands are not compared" in note for note in result.notes)


def test_what_can_not_be_compared_is_refused_with_both_sides():
    random = np.random.default_rng(7)
    one = density(random.standard_normal((1, 5000)))
    with pytest.raises(EstimateError, match="251 lines to 250 Hz before, 126 lines to 250 Hz after"):
        compare_densities(one, density(random.standard_normal((1, 5000)), resolution_hz=2.0))
    with pytest.raises(EstimateError, match="no channel is in both: c0 before, z after"):
        compare_densities(one, density(random.standard_normal((1, 5000)), names=["z"]))
    with pytest.raises(EstimateError, match=r"'c0' is in m/s\^2 before and in V after"):
        compare_densities(one, density(random.standard_normal((1, 5000)), units="V"))
    with pytest.raises(EstimateError, match="false_discovery"):
        compare_densities(one, one, false_discovery=1.0)


def response(random, samples, *, frequency_hz=40.0, gain=1.0, resolution_hz=0.5, excited=None):
    omega = 2 * np.pi * frequency_hz
    system = signal.cont2discrete(([gain * omega**2], [1, 0.04 * omega, omega**2]), 1 / RATE_HZ, "zoh")
    force = random.standard_normal(samples)
    answer = signal.lfilter(system[0].ravel(), system[1], force) + 0.3 * random.standard_normal(samples)
    series = measured([force, answer], units=["N", "m"], names=["f", "x"])
    result = frequency_response(cross_spectra(series, resolution_hz=resolution_hz), references="f")
    return result if excited is None else replace(result, excited=excited(result.frequency_hz))


def test_the_same_structure_twice_shows_no_change():
    random = np.random.default_rng(8)
    trials, alarms, moved = 25, 0, 0
    for _ in range(trials):
        result = compare_responses(*(response(random, 20_000) for _ in range(2)))
        alarms += bool(result.significant.any())
        moved += sum(peak.fate != "unchanged" for peak in result.peaks)
    # As for densities.
    assert alarms <= 5
    assert moved <= 2


def test_a_stiffer_structure_is_found_with_shift_gain_and_phase():
    random = np.random.default_rng(9)
    before, after = response(random, 200_000), response(random, 200_000, frequency_hz=41.0, gain=1.5)
    result = compare_responses(before, after)
    moved = [peak for peak in result.peaks if peak.fate == "moved"]
    assert len(moved) == 1
    assert moved[0].shift_hz == pytest.approx(1.0, abs=4 * moved[0].shift_std_hz)
    low = (result.frequency_hz > 5) & (result.frequency_hz < 10)
    assert result.significant[0, 0, low].mean() > 0.9
    static_db = 20 * np.log10(1.5)
    deviation = (result.change_db[0, 0, low] - static_db) / result.change_std_db[0, 0, low]
    # Far below the resonance the gain shows; 9 lines, some 0.1 dB of dynamics.
    assert np.abs(deviation.mean()) < 3
    between = np.argmin(np.abs(result.frequency_hz - 40.5))
    assert result.phase_change_deg[0, 0, between] > 20


def test_lines_that_only_one_excites_are_not_compared():
    random = np.random.default_rng(10)
    before = response(random, 20_000, excited=lambda f: f < 100)
    after = response(random, 20_000, excited=lambda f: f > 20, gain=2.0)
    result = compare_responses(before, after)
    both = (result.frequency_hz < 100) & (result.frequency_hz > 20)
    np.testing.assert_array_equal(np.isfinite(result.change_db[0, 0]), both)
    assert not result.significant[0, 0, ~both].any()
    assert result.significant[0, 0, both].any()


def test_functions_are_matched_by_name():
    random = np.random.default_rng(11)
    one = response(random, 20_000)
    other = replace(one, responses=(Channel(name="y", unit="m"),))
    with pytest.raises(EstimateError, match="no response is in both: x before, y after"):
        compare_responses(one, other)
    with pytest.raises(EstimateError, match="no reference is in both"):
        compare_responses(one, replace(one, references=(Channel(name="g", unit="N"),)))
    same = compare_responses(one, one)
    assert not same.significant.any()
    np.testing.assert_allclose(same.change_db[np.isfinite(same.change_db)], 0, atol=1e-12)


def test_only_the_highest_peaks_of_either_side_are_told():
    random = np.random.default_rng(4)
    time_s = np.arange(40_000) / RATE_HZ
    tones = [np.sin(2 * np.pi * 12 * number * time_s) * 0.9**number for number in range(1, 16)]
    before, after = (sum(tones) + 1e-3 * random.standard_normal(time_s.size) for _ in range(2))
    # A tone far below the others comes up; the fifteen that stay are not all told, this one isn't at all.
    faint = 1e-2 * np.sin(2 * np.pi * 237 * time_s)
    result = compare_densities(density([before]), density([after + faint]))
    assert len(result.peaks) == 10
    assert {peak.fate for peak in result.peaks} == {"unchanged"}
    loud = compare_densities(density([before]), density([after + 100 * faint]))
    assert [peak.fate for peak in loud.peaks].count("appeared") == 1
