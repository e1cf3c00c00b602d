"""Peaks: no false alarms, true frequencies and heights with honest errors, names shared by channels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from chladni.spectral.impact import find_impacts, impact_cross_spectra
from chladni.spectral.peaks import find_peaks, find_response_peaks
from chladni.spectral.period import find_period
from chladni.spectral.periodic import periodic_cross_spectra
from chladni.spectral.psd import power_spectral_density
from tests.spectral.measured_logs import aircraft, hammer

RATE_HZ = 1000.0


def series(rows, units="m/s^2"):
    units = [units] * len(rows) if isinstance(units, str) else units
    channels = tuple(Channel(name=f"c{row}", unit=unit) for row, unit in enumerate(units))
    return TimeSeries(values=np.atleast_2d(rows), sample_rate_hz=RATE_HZ, channels=channels)


def density(rows, units="m/s^2", **options):
    return power_spectral_density(cross_spectra(series(rows, units), **options))


def one_channel(psd, row):
    return replace(psd, values=psd.values[[row]], std=psd.std[[row]], channels=psd.channels[row : row + 1])


def noise(kind, random, samples):
    white = random.standard_normal(samples)
    if kind == "white":
        return white
    if kind == "band":
        return signal.lfilter(*signal.butter(2, [0.1, 0.3], "band"), white)
    return signal.lfilter([1.0], [1.0, -0.999], white)


SETTINGS = ((4000, 0.5, "hann"), (4000, 1.0, "boxcar"), (20_000, 1.0, "hann"))


# In the gate each kind of noise at one of the settings.
@pytest.mark.parametrize(
    ("kind", "samples", "resolution_hz", "window"),
    [
        pytest.param(kind, *each, marks=() if place == number else pytest.mark.nightly)
        for number, kind in enumerate(("white", "band", "falling"))
        for place, each in enumerate(SETTINGS)
    ],
)
def test_peakless_noise_gives_no_peak(kind, samples, resolution_hz, window):
    random = np.random.default_rng(11)
    channels = 40
    rows = [noise(kind, random, samples) for _ in range(channels)]
    psd = density(rows, resolution_hz=resolution_hz, window=window)
    alarms = sum(bool(find_peaks(one_channel(psd, row), false_alarm=0.05)) for row in range(channels))
    # 2 are allowed in the mean; a binomial count exceeds 7 with a chance of 0.1 %.
    assert alarms <= 7


def test_drift_and_offset_give_no_peak():
    t = np.arange(20_000) / RATE_HZ
    x = 100 + 5 * t + 0.5 * t**2 + 1e-3 * np.random.default_rng(2).standard_normal(t.size)
    assert find_peaks(density([x], resolution_hz=1.0)) == ()


@pytest.mark.parametrize("window", ["hann", "boxcar", "flattop", ("kaiser", 8.6)])
@pytest.mark.parametrize("offset", [0.0, 0.25, 0.5])
def test_a_tone_is_found_between_the_lines(window, offset):
    random = np.random.default_rng(3)
    frequency_hz, amplitude = 100 + offset, 2.0
    t = np.arange(20_000) / RATE_HZ
    x = amplitude * np.sin(2 * np.pi * frequency_hz * t + 0.3) + 0.1 * random.standard_normal(t.size)
    psd = density([x], resolution_hz=1.0, window=window)
    (peak,) = find_peaks(psd)
    assert abs(peak.frequency_hz - frequency_hz) < 0.05
    assert abs(peak.frequency_hz - frequency_hz) < 4 * peak.frequency_std_hz
    # On its line a tone of amplitude A has the density A^2 / (2 bandwidth), wherever it lies between the lines.
    assert peak.height * psd.bandwidth_hz == pytest.approx(amplitude**2 / 2, rel=0.02)
    assert peak.unit == psd.units[0]
    assert peak.channels == ("c0",)


@pytest.mark.parametrize(
    ("frequency_hz", "damping", "resolution_hz", "samples"),
    [(100, 0.005, 0.25, 30_000), (100, 0.02, 0.25, 30_000), (50, 0.02, 0.5, 20_000), (200, 0.01, 1.0, 4000)],
)
def test_a_resonance_is_found_with_an_honest_error(frequency_hz, damping, resolution_hz, samples):
    random = np.random.default_rng(4)
    omega = 2 * np.pi * frequency_hz
    numerator, denominator, _ = signal.cont2discrete(
        ([1.0, 0, 0], [1, 2 * damping * omega, omega**2]), 1 / RATE_HZ, "foh"
    )
    fine_hz, gain = signal.freqz(numerator.ravel(), denominator, worN=100_000, fs=RATE_HZ)
    truth_hz = fine_hz[np.argmax(np.abs(gain))]
    truth_height = np.abs(gain).max() ** 2 / (RATE_HZ / 2)
    trials = 30
    rows = [signal.lfilter(numerator.ravel(), denominator, random.standard_normal(samples)) for _ in range(trials)]
    psd = density(rows, resolution_hz=resolution_hz)
    found = [find_peaks(one_channel(psd, row)) for row in range(trials)]
    assert [len(peaks) for peaks in found] == [1] * trials
    deviations = np.array([(peak.frequency_hz - truth_hz) / peak.frequency_std_hz for (peak,) in found])
    # Thirty deviates: their RMS is 1 +- 0.13; 1.6 also holds what the interpolation isn't told (correlated lines).
    assert 0.5 < np.sqrt(np.mean(deviations**2)) < 1.6
    # The highest line was chosen for being high, which raises the mean by a part of the stated error.
    heights, errors = np.array([(peak.height, peak.height_std) for (peak,) in found]).T
    assert abs(heights.mean() - truth_height) < 0.6 * errors.mean()


def test_tones_are_given_highest_first_and_no_more_than_asked_for():
    t = np.arange(20_000) / RATE_HZ
    x = sum(a * np.sin(2 * np.pi * f * t) for f, a in ((50, 1.0), (120, 3.0), (300, 2.0)))
    x = x + 0.01 * np.random.default_rng(5).standard_normal(t.size)
    psd = density([x], resolution_hz=1.0)
    assert [round(peak.frequency_hz) for peak in find_peaks(psd)] == [120, 300, 50]
    assert [round(peak.frequency_hz) for peak in find_peaks(psd, count=2)] == [120, 300]


def test_channels_share_a_name_within_the_resolution():
    random = np.random.default_rng(6)
    t = np.arange(20_000) / RATE_HZ
    rows = [
        np.sin(2 * np.pi * 80.0 * t) + 2 * np.sin(2 * np.pi * 200 * t),
        3 * np.sin(2 * np.pi * 80.4 * t),
        0.1 * np.sin(2 * np.pi * 300 * t),
    ]
    rows = np.array(rows) + 0.01 * random.standard_normal((3, t.size))
    peaks = find_peaks(density(rows, resolution_hz=1.0))
    assert [(round(peak.frequency_hz, 1), peak.channels) for peak in peaks] == [
        (80.4, ("c1", "c0")),
        (200.0, ("c0",)),
        (300.0, ("c2",)),
    ]


def test_channels_of_different_units_are_ranked_by_height_over_their_floor():
    random = np.random.default_rng(7)
    t = np.arange(20_000) / RATE_HZ
    tone = np.sin(2 * np.pi * 80.0 * t)
    rows = [1000 * (tone + random.standard_normal(t.size)), tone + 0.01 * random.standard_normal(t.size)]
    (peak,) = find_peaks(density(rows, ["N", "m/s^2"], resolution_hz=1.0))
    assert peak.channels == ("c1", "c0")
    assert peak.unit == density(rows, ["N", "m/s^2"], resolution_hz=1.0).units[1]


def line_spectrum(values, std, averaging):
    return PowerSpectralDensity(
        frequency_hz=np.arange(values.size) * 0.5,
        values=values[np.newaxis],
        std=std[np.newaxis],
        channels=(Channel(name="a", unit="N"),),
        bandwidth_hz=0.5,
        provenance=Provenance(averaging=averaging, averages=8),
    )


def test_a_periodic_spectrum_is_read_at_its_lines():
    line = np.arange(200)
    # An odd comb: power on every second line from 20 to 180, scatter between.
    power = 1e-6 + np.where((line % 2 == 1) & (line > 20) & (line < 180), 1 / (1 + ((line - 71) / 4) ** 2), 0)
    (peak,) = find_peaks(line_spectrum(power, np.where(power > 1e-5, 1e-3 * power, power), "periodic"))
    assert peak.frequency_hz == 35.5
    assert peak.height == power[71]
    assert peak.height_std == pytest.approx(1e-3 * power[71])
    # Anywhere within the spacing of the comb's lines.
    assert peak.frequency_std_hz == pytest.approx(1.0 / np.sqrt(12), rel=0.01)


def oscillators(excited, relative_std=0.01):
    frequency_hz = np.arange(0, 100, 0.25)
    shapes = [1 / (1 - (frequency_hz / f0) ** 2 + 0.04j * frequency_hz / f0) for f0 in (20.0, 60.0)]
    values = np.array([shapes[0] + shapes[1], shapes[0] - 0.5 * shapes[1]])[:, np.newaxis]
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=relative_std * np.abs(values),
        coherence=np.full((2, frequency_hz.size), 0.999),
        excited=excited(frequency_hz),
        responses=(Channel(name="a", unit="m/s^2"), Channel(name="b", unit="m/s^2")),
        references=(Channel(name="f", unit="N", role="reference"),),
        provenance=Provenance(estimator="H1", window="hann", effective_averages=50.0),
    )


def test_resonances_of_each_function_are_named_with_response_and_reference():
    response = oscillators(lambda f: np.ones(f.size, dtype=bool))
    peaks = find_response_peaks(response)
    assert sorted(peak.channels for peak in peaks) == [("a", "f"), ("a", "f"), ("b", "f"), ("b", "f")]
    assert [peak.height for peak in peaks] == sorted((peak.height for peak in peaks), reverse=True)
    near_20 = next(peak for peak in peaks if peak.channels[0] == "a" and peak.frequency_hz < 30)
    # The maximum of one oscillator lies at f0 sqrt(1 - 2 zeta^2), zeta = 0.02; the other one shifts it a little.
    assert near_20.frequency_hz == pytest.approx(19.99, abs=0.02)
    assert near_20.height == pytest.approx(np.abs(response.values[0]).max(), rel=0.01)
    assert near_20.height_std == pytest.approx(0.01 * near_20.height, rel=1e-6)
    assert near_20.unit == response.unit(0, 0)
    assert [peak.channels[0] for peak in find_response_peaks(response, count=1)] in (["a", "b"], ["b", "a"])


def test_lines_without_excitation_hold_no_peak():
    response = oscillators(lambda f: f < 40)
    assert all(peak.frequency_hz < 40 for peak in find_response_peaks(response))
    assert find_response_peaks(oscillators(lambda f: np.zeros(f.size, dtype=bool))) == ()
    # The edge of what is excited is no maximum either, though the function still rises there.
    assert find_response_peaks(oscillators(lambda f: (f > 25) & (f < 55))) == ()


def test_a_response_as_uncertain_as_it_is_high_has_no_peak():
    assert find_response_peaks(oscillators(lambda f: np.ones(f.size, dtype=bool), relative_std=2.0)) == ()
    unknown = oscillators(lambda f: np.ones(f.size, dtype=bool), relative_std=np.inf)
    assert find_response_peaks(unknown) == ()


def test_a_peak_stands_out_between_lines_of_which_nothing_is_known():
    response = oscillators(lambda f: np.ones(f.size, dtype=bool))
    std = response.std.copy()
    # Above 80 Hz the sensors see only noise, which looks smaller than it may be.
    std[..., response.frequency_hz > 80] = np.inf
    values = np.where(response.frequency_hz > 80, 1e-6, response.values)
    peaks = find_response_peaks(replace(response, values=values, std=std), count=1)
    assert all(peak.frequency_hz == pytest.approx(20.0, abs=0.1) for peak in peaks)
    assert len(peaks) == 2


def test_a_response_that_few_averages_can_not_tell_from_chance_has_no_peak():
    response = oscillators(lambda f: np.ones(f.size, dtype=bool))
    # Three averages: unrelated channels show a coherence of 0.95 on (1 - 0.95)^2 = 1/400 of all lines.
    few = replace(
        response,
        coherence=np.full(response.coherence.shape, 0.95),
        provenance=replace(response.provenance, effective_averages=3.0),
    )
    assert find_response_peaks(few) == ()
    assert find_response_peaks(replace(few, coherence=np.full(response.coherence.shape, 0.99)))


def test_the_resonances_of_the_hammered_structure_are_named(shared_data):
    log = hammer(shared_data)
    spectra = impact_cross_spectra(log, find_impacts(log, force="/daq.hammer"))
    response = frequency_response(spectra, references="/daq.hammer")
    peaks = [peak for peak in find_response_peaks(response, count=60) if peak.frequency_hz < 3500]
    for published_hz in (242, 447, 558, 731, 872, 1407, 2085, 2249, 2607, 2959, 3295):
        # Published to 1 Hz from all lines of five records; three hits know broad peaks to a few hertz.
        assert min(abs(peak.frequency_hz - published_hz) for peak in peaks) < 4
    assert peaks[0].frequency_hz == pytest.approx(3295, abs=3)


def test_a_neighbouring_mode_that_skews_a_peak_does_not_shift_it():
    frequency_hz = np.arange(10.0, 150.0, 0.1)
    fine_hz = np.arange(60.0, 70.0, 1e-4)

    def magnitude(at_hz):
        strong = 1 / (48.0**2 - at_hz**2 + 0.04j * 48.0 * at_hz)
        weak = 0.8 / (66.0**2 - at_hz**2 + 0.05j * 66.0 * at_hz)
        return np.abs(strong - weak)

    true_hz = fine_hz[np.argmax(magnitude(fine_hz))]
    assert abs(true_hz - 66.0) > 0.1  # the neighbour does skew it
    values = magnitude(frequency_hz)[np.newaxis, np.newaxis].astype(complex)
    response = FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=1e-3 * np.abs(values),
        coherence=np.ones((1, frequency_hz.size)),
        excited=np.ones(frequency_hz.size, dtype=bool),
        responses=(Channel(name="a", unit="m/s^2"),),
        references=(Channel(name="f", unit="N"),),
        provenance=Provenance(window="hann", averages=100, effective_averages=100.0),
    )
    found = min(find_response_peaks(response), key=lambda peak: abs(peak.frequency_hz - true_hz))
    # A tenth of a line: what the cubic leaves. The parabola alone is off by more than a line.
    assert abs(found.frequency_hz - true_hz) < 0.01


@pytest.mark.parametrize("options", [{"count": 0}, {"false_alarm": 0.0}, {"false_alarm": 1.0}])
def test_arguments_out_of_range_are_refused(options):
    with pytest.raises(EstimateError, match=next(iter(options))):
        find_peaks(line_spectrum(np.ones(10), np.ones(10), "linear"), **options)
    with pytest.raises(EstimateError, match=next(iter(options))):
        find_response_peaks(oscillators(lambda f: f > 0), **options)


def test_too_few_lines_hold_no_peak():
    assert find_peaks(line_spectrum(np.array([1.0, 9.0, 1.0]), np.full(3, 0.01), "linear")) == ()


@pytest.mark.parametrize(
    ("level", "frequency_hz", "height"), [(1, 7.324, 0.258), (3, 7.275, 0.233), (5, 7.227, 0.097), (7, 7.227, 0.075)]
)
def test_the_torsion_of_the_aircraft_is_read_as_published(shared_data, level, frequency_hz, height):
    log = aircraft(shared_data, level)
    spectra = periodic_cross_spectra(log, find_period(log, channel="/shaker"))
    peaks = find_response_peaks(frequency_response(spectra, references="/shaker"))
    assert peaks[0].frequency_hz == pytest.approx(frequency_hz, abs=0.02)
    assert peaks[0].height == pytest.approx(height, rel=0.05)
    assert all(2 < peak.frequency_hz < 15 for peak in peaks)


def test_few_averages_do_not_lend_a_weak_peak_the_height_of_its_neighbour():
    # Harmonics of a falling line spectrum with three averages: lines scatter by 60 %, and are smoothed over.
    frequency_hz = np.arange(0.0, 60.0) / 10
    values = np.full(frequency_hz.size, 1e-3)
    heights = {5: 1e7, 15: 4e5, 26: 5e4, 36: 8e3}
    for line, height in heights.items():
        values[line - 1 : line + 2] = [0.3 * height, height, 0.3 * height]
    psd = PowerSpectralDensity(
        frequency_hz=frequency_hz,
        values=values[None],
        std=0.59 * values[None],
        channels=(Channel(name="force", unit="N"),),
        bandwidth_hz=0.15,
        provenance=Provenance(window="hann"),
    )
    found = find_peaks(psd)
    assert [round(10 * peak.frequency_hz) for peak in found] == list(heights)
    for peak, height in zip(found, heights.values(), strict=True):
        # A tone between lines shows up to 1.4 dB less on its nearest line (Hann's scalloping).
        assert height <= peak.height * (1 + 1e-9) <= 1.4 * height
        # It lies within the lines that are its own, not those up to the neighbour a hertz away.
        assert peak.frequency_std_hz < 0.5


# --- functions that a file holds ready-made, without error bars --------------------------------------------------


def held(values, spacing_hz=0.5):
    rows = np.atleast_2d(values)[:, np.newaxis]
    lines = rows.shape[-1]
    return FrequencyResponse(
        frequency_hz=spacing_hz * np.arange(1, lines + 1),
        values=rows,
        std=np.full(rows.shape, np.inf),
        coherence=np.full((len(rows), lines), np.nan),
        excited=np.ones(lines, dtype=bool),
        responses=tuple(Channel(name=f"c{row}", unit="m/s^2") for row in range(len(rows))),
        references=(Channel(name="f", unit="N"),),
        provenance=Provenance(estimator="as in the file"),
    )


def as_in_a_file(response):
    return replace(
        response,
        std=np.full(response.std.shape, np.inf),
        coherence=np.full(response.coherence.shape, np.nan),
        provenance=Provenance(estimator="as in the file"),
    )


def accelerance(frequency_hz, natural_hz, damping_ratio):
    ratio = frequency_hz / natural_hz
    return -(ratio**2) / (1 - ratio**2 + 2j * damping_ratio * ratio)


@pytest.mark.parametrize("damping_ratio", [0.02, 2e-3, 2e-4])
@pytest.mark.parametrize("natural_hz", [40.0, 40.1, 40.2])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_functions_without_error_bars_show_their_resonances(damping_ratio, natural_hz, noise):
    frequency_hz = 0.5 * np.arange(1, 401)
    random = np.random.default_rng(7)
    scatter = noise * (random.standard_normal(400) + 1j * random.standard_normal(400))
    (peak,) = find_response_peaks(held(accelerance(frequency_hz, natural_hz, damping_ratio) + scatter))
    # Three points tell a lone resonance; the mass line beside it shifts the top by some hundredths of a line.
    assert peak.frequency_hz == pytest.approx(natural_hz, abs=max(0.05, 4 * peak.frequency_std_hz))


def test_noise_without_error_bars_gives_no_peak():
    random = np.random.default_rng(11)
    rows = random.standard_normal((60, 400)) + 1j * random.standard_normal((60, 400))
    alarms = sum(bool(find_response_peaks(held(row), false_alarm=0.05)) for row in rows)
    # 3 are allowed in the mean; a binomial count exceeds 9 with a chance of 0.1 %.
    assert alarms <= 9


def test_functions_of_a_file_have_their_peaks_without_std_coherence_and_averages():
    response = oscillators(lambda f: np.ones(f.size, dtype=bool))
    peaks, known = find_response_peaks(as_in_a_file(response)), find_response_peaks(response)
    assert [peak.channels for peak in peaks] == [peak.channels for peak in known]
    np.testing.assert_allclose([p.frequency_hz for p in peaks], [p.frequency_hz for p in known], atol=0.01)


def test_noise_in_a_file_has_no_peaks():
    response = as_in_a_file(oscillators(lambda f: np.ones(f.size, dtype=bool)))
    # One in a hundred functions may have one by chance; so have 3 or more of 40 once in 100 times.
    found = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(response.values.shape) + 1j * rng.standard_normal(response.values.shape)
        found += len(find_response_peaks(replace(response, values=noise)))
    assert found <= 2


def test_a_single_hit_has_its_peaks_and_a_single_segment_none():
    response = oscillators(lambda f: np.ones(f.size, dtype=bool))
    one = replace(as_in_a_file(response), coherence=np.ones(response.coherence.shape))
    hit = Provenance(averaging="impact", averages=1, effective_averages=1.0)
    assert len(find_response_peaks(replace(one, provenance=hit))) == 4
    segment = Provenance(averages=1, effective_averages=1.0)
    assert find_response_peaks(replace(one, provenance=segment)) == ()
