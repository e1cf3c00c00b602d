"""Impact tests with hits of known shape, and the measured one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.frf import frequency_response
from chladni.spectral.impact import find_impacts, impact_cross_spectra, is_impact_test
from chladni.spectral.peaks import find_response_peaks
from tests.spectral.measured_logs import hammer

RATE_HZ = 10_000.0
FORCE = Channel(name="/hammer", unit="N", role="reference")
RESPONSE = Channel(name="/plate", unit="m/s^2")
MASS, FREQUENCY_HZ, DAMPING = 2.0, 180.0, 0.01


def pulses(seconds, hits, *, width_s=0.001, rate_hz=RATE_HZ):
    """Sum of half sines (time, peak); a pulse begins at its time and lasts `width_s`."""
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    force = np.zeros(t.size)
    for time_s, peak in hits:
        inside = (t >= time_s) & (t < time_s + width_s)
        force[inside] += peak * np.sin(np.pi * (t[inside] - time_s) / width_s)
    return force


def receptance(s, damping=DAMPING):
    """Transfer function of one mass on a spring, displacement over force, at the complex frequency s."""
    omega = 2 * np.pi * FREQUENCY_HZ
    return 1 / (MASS * (s**2 + 2 * damping * omega * s + omega**2))


def respond(force, rate_hz=RATE_HZ, damping=DAMPING):
    """Acceleration of the mass, exact at the lines of the whole record (the response has died away at its end)."""
    s = 2j * np.pi * np.fft.rfftfreq(force.size, 1 / rate_hz)
    return np.fft.irfft(np.fft.rfft(force) * s**2 * receptance(s, damping), force.size)


def hammer_log(force, *, noise=0.0, seed=1, rate_hz=RATE_HZ, channels=(FORCE, RESPONSE), damping=DAMPING):
    random = np.random.default_rng(seed)
    values = np.vstack([force, respond(force, rate_hz, damping)])
    values += noise * np.abs(values).max(axis=1, keepdims=True) * random.standard_normal(values.shape)
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=channels)


FIVE = [(0.1, 150.0), (2.1, 200.0), (4.1, 170.0), (6.1, 120.0), (8.1, 190.0)]


def numbers(rejected):
    return [rejection.record for rejection in rejected]


@given(
    noise=st.sampled_from([0.0, 1e-4, 1e-3, 3e-3]),
    scale=st.sampled_from([1e-3, 1.0, 5e3]),
    sign=st.sampled_from([-1.0, 1.0]),
    width_s=st.floats(0.0006, 0.008),
    peaks=st.lists(st.floats(0.5, 1.5), min_size=2, max_size=6),
    offset=st.floats(-0.5, 0.5),
    seed=st.integers(0, 1000),
)
def test_clean_hits_are_all_found_and_accepted(noise, scale, sign, width_s, peaks, offset, seed):
    times = [0.1 + 1.5 * k for k in range(len(peaks))]
    force = pulses(1.5 * len(peaks), zip(times, peaks, strict=True), width_s=width_s)
    log = hammer_log(sign * scale * force, noise=noise, seed=seed)
    log = replace(log, values=log.values + scale * np.array([[offset], [0.0]]))
    impacts = find_impacts(log, force="/hammer")
    assert impacts.rejected == ()
    found = np.array([hit.time_s for hit in impacts.accepted])
    assert np.all((found >= np.array(times)) & (found <= np.array(times) + width_s / 2))
    # The sampling misses the crest by up to half a sample, the noise adds up to 4 sigma.
    tolerance = scale * 1.5 * (0.5 * (np.pi / (2 * width_s * RATE_HZ)) ** 2 + 5 * noise)
    np.testing.assert_allclose([hit.peak for hit in impacts.accepted], sign * scale * np.array(peaks), atol=tolerance)
    assert is_impact_test(log, "/hammer")


@pytest.mark.parametrize("share", [0.05, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("delay_s", [0.003, 0.01, 0.0228, 0.06])
@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_double_hit_is_rejected_and_no_other(share, delay_s, noise):
    force = pulses(10, [*FIVE, (4.1 + delay_s, 170.0 * share)])
    impacts = find_impacts(hammer_log(force, noise=noise), force="/hammer")
    assert numbers(impacts.rejected) == [3]
    reason = impacts.rejected[0].reason
    assert reason.startswith("double hit")
    delay_ms = float(reason.split("), ")[1].split(" ms")[0])
    assert delay_ms == pytest.approx(delay_s * 1e3, abs=0.5)
    assert "N" in reason


def test_a_touch_before_the_hit_is_a_double_hit_too():
    force = pulses(10, [*FIVE, (2.08, 60.0)])
    rejected = find_impacts(hammer_log(force, noise=1e-3), force="/hammer").rejected
    assert numbers(rejected) == [2]
    assert "-20.0 ms" in rejected[0].reason


def test_the_ringing_of_an_anti_alias_filter_is_no_double_hit():
    # A pulse of 4 samples, limited to 0.35 of the sample rate by a steep filter, rings by 3.3 % of its peak.
    fine = pulses(10, FIVE, width_s=0.0004, rate_hz=8 * RATE_HZ)
    spectrum = np.fft.rfft(fine)
    spectrum[np.fft.rfftfreq(fine.size, 1 / (8 * RATE_HZ)) > 0.35 * RATE_HZ] = 0
    force = np.fft.irfft(spectrum, fine.size)[::8]
    after = force[1005:1060] / force[1002]
    assert np.ptp(after) > 0.03
    assert find_impacts(hammer_log(force), force="/hammer").rejected == ()


def test_when_noise_hides_second_pulses_it_is_said():
    impacts = find_impacts(hammer_log(pulses(10, FIVE), noise=0.008), force="/hammer")
    assert impacts.rejected == ()
    assert any("can't be told from the noise" in note for note in impacts.notes)


@pytest.mark.parametrize("cut", [0.5, 0.9])
def test_a_crest_cut_flat_is_an_overload(cut):
    force = pulses(10, FIVE, width_s=0.004)
    inside = slice(20_000, 22_000)
    force[inside] = np.minimum(force[inside], cut * 200.0)
    rejected = find_impacts(hammer_log(force), force="/hammer").rejected
    assert numbers(rejected) == [2]
    assert rejected[0].reason.startswith("overload: /hammer reads up to")


def test_a_response_cut_flat_is_an_overload_too():
    log = hammer_log(pulses(10, FIVE))
    values = log.values.copy()
    values[1, 60_000:80_000] = np.clip(values[1, 60_000:80_000], -0.5 * values[1].max(), 0.5 * values[1].max())
    rejected = find_impacts(replace(log, values=values), force="/hammer").rejected
    assert numbers(rejected) == [4]
    assert "/plate" in rejected[0].reason


def test_a_rounded_crest_with_coarse_quantisation_is_no_overload():
    force = pulses(10, FIVE, width_s=0.008)
    step = 200.0 / 256
    assert find_impacts(hammer_log(np.round(force / step) * step), force="/hammer").rejected == ()


def test_the_range_of_a_sensor_is_an_overload():
    channels = (replace(FORCE, overload=195.0), RESPONSE)
    rejected = find_impacts(hammer_log(pulses(10, FIVE), channels=channels), force="/hammer").rejected
    assert numbers(rejected) == [2]


def test_weak_hits_are_rejected_and_bumps_below_the_trigger_are_counted():
    force = pulses(10, [(0.1, 200.0), (2.1, 30.0), (4.1, 170.0), (6.1, 180.0), (8.1, 2.0)])
    impacts = find_impacts(hammer_log(force, noise=1e-5), force="/hammer")
    assert numbers(impacts.rejected) == [2]
    assert impacts.rejected[0].reason == "too weak: its peak is 16% of the usual one"
    assert any(note.startswith("1 bumps below the trigger level") for note in impacts.notes)


def test_a_record_must_fit_into_the_log():
    force = pulses(10, [(-0.0005, 100.0), (2.0, 100.0), (4.0, 100.0), (9.5, 100.0)])
    impacts = find_impacts(hammer_log(force), force="/hammer", record_s=1.0, pretrigger_s=0.01)
    reasons = {rejection.record: rejection.reason for rejection in impacts.rejected}
    assert reasons == {1: "its pulse begins before the log", 4: "its record ends after the log"}


@pytest.mark.parametrize("start_s", [0.0, 0.0002, 0.001])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_hit_at_the_start_of_the_record_is_a_hit(start_s, noise):
    """A single hit, fewer samples after the start than a record has before its trigger; 1 s decays by e^-11."""
    log = hammer_log(pulses(1.0, [(start_s, 100.0)]), noise=noise)
    assert is_impact_test(log, "/hammer")
    impacts = find_impacts(log, force="/hammer")
    assert impacts.rejected == ()
    assert impacts.accepted[0].time_s < start_s + 0.0005
    spectra = impact_cross_spectra(log, impacts)
    response = frequency_response(spectra, references="/hammer")
    inside = (response.frequency_hz > 50) & (response.frequency_hz < 500)
    s = 2j * np.pi * response.frequency_hz[inside]
    exact = s**2 * receptance(s)
    # Half a record or more of noise of 1e-4 of the greatest sample against the spectrum of the pulse.
    tolerance = 1e-4 if noise == 0 else 0.03
    np.testing.assert_allclose(response.values[0, 0, inside], exact, atol=tolerance * np.abs(exact).max())
    (peak,) = find_response_peaks(response, count=1)
    assert peak.frequency_hz == pytest.approx(FREQUENCY_HZ, abs=0.1)


def test_several_hits_of_which_the_first_is_at_the_start():
    impacts = find_impacts(hammer_log(pulses(10, [(0.0, 150.0), *FIVE[1:]])), force="/hammer")
    assert impacts.rejected == ()
    assert len(impacts.accepted) == 5


def test_records_longer_than_the_time_between_hits_are_told_with_the_longest():
    log = hammer_log(pulses(10, FIVE))
    impacts = find_impacts(log, force="/hammer", record_s=2.5)
    assert impacts.longest_s == pytest.approx(1.9, abs=0.1)
    with pytest.raises(EstimateError, match=r"records of 2.5 s are longer .* Ask for a resolution of") as told:
        impact_cross_spectra(log, impacts)
    asked_hz = float(str(told.value).split("a resolution of ")[1].split(" Hz")[0])
    followed = impact_cross_spectra(log, find_impacts(log, force="/hammer", record_s=1 / asked_hz))
    assert followed.provenance.averages == 5


def test_a_hit_while_the_one_before_still_rings():
    force = pulses(10, [*FIVE, (4.6, 150.0)])
    rejected = find_impacts(hammer_log(force), force="/hammer", record_s=1.0).rejected
    assert [(r.record, r.reason.split(":")[0]) for r in rejected] == [
        (3, "double hit"),
        (4, "the hit 0.5 s before still rings in this record"),
    ]


def test_hits_with_missing_samples_are_left_out():
    log = hammer_log(pulses(10, FIVE))
    valid = np.ones(log.values.shape, dtype=bool)
    valid[1, 45_000] = False
    values = np.where(valid, log.values, np.nan)
    rejected = find_impacts(replace(log, values=values, valid=valid), force="/hammer").rejected
    assert [(r.record, r.reason) for r in rejected] == [(3, "samples are missing in it")]


def test_a_given_level_is_the_trigger():
    impacts = find_impacts(hammer_log(pulses(10, FIVE)), force="/hammer", level=180.0, record_s=1.0)
    assert impacts.trigger_level == 180.0
    assert [hit.peak > 180 for hit in impacts.accepted] == [True, True]


def test_what_is_not_there_is_refused():
    quiet = hammer_log(np.random.default_rng(3).standard_normal(20_000))
    with pytest.raises(EstimateError, match="'/hammer' holds no pulse above its noise"):
        find_impacts(quiet, force="/hammer")
    with pytest.raises(EstimateError, match="no channel '/hamer'"):
        find_impacts(quiet, force="/hamer")
    log = hammer_log(pulses(10, FIVE))
    with pytest.raises(EstimateError, match="double_hit_share"):
        find_impacts(log, force="/hammer", double_hit_share=1.5)
    with pytest.raises(EstimateError, match="pretrigger; make it longer"):
        find_impacts(log, force="/hammer", pretrigger_s=2.0, record_s=1.0)
    nothing = replace(log, valid=np.zeros(log.values.shape, dtype=bool))
    with pytest.raises(EstimateError, match="no valid sample"):
        find_impacts(nothing, force="/hammer")


@pytest.mark.parametrize("length", [10_000, 9_999])
def test_energy_of_the_force_is_kept(length):
    log = hammer_log(pulses(10, FIVE))
    impacts = find_impacts(log, force="/hammer", record_s=length / RATE_HZ)
    spectra = impact_cross_spectra(log, impacts)
    energy = spectra.density[0, 0].real.sum() * spectra.bandwidth_hz * impacts.record_s
    truth = np.mean([peak**2 * 0.001 / 2 for _, peak in FIVE])
    # The half sines are sampled 10 times, where the rectangle rule is exact for sin^2.
    np.testing.assert_allclose(energy, truth, rtol=1e-9)
    assert spectra.provenance.averaging == "impact"
    assert spectra.provenance.averages == 5
    np.testing.assert_allclose(spectra.density[0, 1], spectra.density[1, 0].conj(), rtol=1e-14)


def h1(spectra):
    return spectra.density[0, 1] / spectra.density[0, 0]


def test_h1_is_the_closed_form_of_the_oscillator():
    log = hammer_log(pulses(10, FIVE))
    spectra = impact_cross_spectra(log, find_impacts(log, force="/hammer", record_s=1.9))
    s = 2j * np.pi * spectra.frequency_hz
    truth = s**2 * receptance(s)
    band = (spectra.frequency_hz > 20) & (spectra.frequency_hz < 800)
    # The response is cut at the Nyquist frequency and so rings around the hit; a record loses 1e-5 of it at its ends.
    np.testing.assert_allclose(h1(spectra)[band], truth[band], rtol=1e-4)


def test_the_exponential_window_shifts_the_pole_by_what_the_provenance_carries():
    # Hits far apart, so that nothing of the one before is left: exp(-2.3 * 9) = 1e-9.
    log = hammer_log(pulses(30, [(1.0, 150.0), (10.0, 200.0), (20.0, 180.0)]), damping=0.002)
    impacts = find_impacts(log, force="/hammer", record_s=1.5)
    plain = impact_cross_spectra(log, impacts)
    assert any("/plate: not died away" in note for note in plain.provenance.notes)
    spectra = impact_cross_spectra(log, impacts, decay_per_s=8.0)
    assert spectra.provenance.window_decay_per_s == 8.0
    assert not any("not died away" in note for note in spectra.provenance.notes)
    s = 2j * np.pi * spectra.frequency_hz + spectra.provenance.window_decay_per_s
    truth = s**2 * receptance(s, 0.002)
    band = (spectra.frequency_hz > 100) & (spectra.frequency_hz < 300)
    # The residual is what the window leaves of the ringing at the record's end, exp(-(8 + 2.3) 1.5) = 2e-7.
    np.testing.assert_allclose(h1(spectra)[band], truth[band], rtol=2e-3)


def test_the_force_window_takes_noise_off_the_force_and_leaves_h1():
    log = hammer_log(pulses(10, FIVE), noise=2e-3)
    impacts = find_impacts(log, force="/hammer", record_s=1.9)
    spectra, bare = (impact_cross_spectra(log, impacts, force_window=on) for on in (True, False))
    s = 2j * np.pi * spectra.frequency_hz
    band = (spectra.frequency_hz > 100) & (spectra.frequency_hz < 260)
    truth = (s**2 * receptance(s))[band]
    error, bare_error = (np.abs(h1(x)[band] / truth - 1).mean() for x in (spectra, bare))
    assert error < 0.8 * bare_error
    assert "force" in spectra.provenance.window
    assert bare.provenance.window == "boxcar"


def test_without_an_accepted_hit_the_reasons_are_told():
    log = hammer_log(pulses(2, [(0.1, 100.0), (0.12, 60.0)]))
    impacts = find_impacts(log, force="/hammer")
    with pytest.raises(EstimateError, match=r"no hit of '/hammer' was accepted \(record 1: double hit"):
        impact_cross_spectra(log, impacts)
    good = find_impacts(hammer_log(pulses(10, FIVE)), force="/hammer")
    with pytest.raises(EstimateError, match="decay_per_s"):
        impact_cross_spectra(hammer_log(pulses(10, FIVE)), good, decay_per_s=-1.0)
    with pytest.raises(EstimateError, match="leaves the series"):
        impact_cross_spectra(log, good)


def test_few_hits_are_said_to_be_few():
    impacts = find_impacts(hammer_log(pulses(4, FIVE[:2])), force="/hammer")
    assert any(note.startswith("only 2 accepted") for note in impacts.notes)


def test_other_excitations_are_no_impact_test():
    random = np.random.default_rng(5)
    t = np.arange(100_000) / RATE_HZ
    noise = random.standard_normal(t.size)
    burst = noise * (np.mod(t, 1.0) < 0.3) + 1e-3 * random.standard_normal(t.size)
    square = 5.0 * (np.mod(t, 2.0) < 0.1) + 1e-3 * random.standard_normal(t.size)
    spike = 1e-3 * random.standard_normal(t.size)
    spike[30_000] = 50.0
    ringing = respond(pulses(10, FIVE))
    for values in (noise, np.sin(2 * np.pi * 30 * t), burst, square, spike, ringing, 0 * t):
        series = TimeSeries(values=values[np.newaxis], sample_rate_hz=RATE_HZ, channels=(FORCE,))
        assert not is_impact_test(series, "/hammer")
    missing = TimeSeries(
        values=np.full((1, 100), np.nan),
        sample_rate_hz=RATE_HZ,
        channels=(FORCE,),
        valid=np.zeros((1, 100), dtype=bool),
    )
    assert not is_impact_test(missing, "/hammer")


@pytest.fixture(scope="module")
def measured(shared_data):
    return hammer(shared_data)


def test_of_the_measured_hits_exactly_the_overload_and_the_double_hit_are_rejected(measured):
    impacts = find_impacts(measured, force="/daq.hammer")
    assert numbers(impacts.rejected) == [1, 3]
    assert "overload: /daq.hammer reads up to 2000" in impacts.rejected[0].reason
    assert "37.9 N (20%), 22.8 ms after" in impacts.rejected[1].reason
    assert [hit.record for hit in impacts.accepted] == [2, 4, 5]
    assert is_impact_test(measured, "/daq.hammer")
    assert not is_impact_test(measured, "/daq.response")


def test_h1_of_the_measured_hits_peaks_where_it_was_published(measured):
    spectra = impact_cross_spectra(measured, find_impacts(measured, force="/daq.hammer"))
    frequency_hz, magnitude = spectra.frequency_hz, np.abs(h1(spectra))
    for published_hz in (242, 447, 558, 731, 872, 1362, 1407, 2085, 2249, 2607, 2959, 3295):
        near = np.abs(frequency_hz - published_hz) < 12
        found_hz = frequency_hz[near][np.argmax(magnitude[near])]
        # Published to 1 Hz, lines 1 Hz apart.
        assert found_hz == pytest.approx(published_hz, abs=2)
    assert frequency_hz[np.argmax(np.where(frequency_hz < 3500, magnitude, 0))] == pytest.approx(3295, abs=2)


def test_h1_of_the_measured_hits_is_that_of_pyfrf(measured):
    from pyFRF import FRF

    impacts = find_impacts(measured, force="/daq.hammer", record_s=0.9)
    spectra = impact_cross_spectra(measured, impacts, force_window=False)
    length = round(0.9 * 51_200)
    starts = [round((hit.time_s - impacts.pretrigger_s) * 51_200) for hit in impacts.accepted]
    records = np.stack([measured.values[:, start : start + length] for start in starts]).astype(float)
    peer = FRF(51_200, exc=records[:, :1], resp=records[:, 1:], window="none", fft_len=length)
    # Double precision sums over 46 000 samples; 0 Hz is left out since we take offsets off.
    np.testing.assert_allclose(h1(spectra)[1:], peer.get_FRF(frf_form="accelerance")[0, 0, 1:], rtol=1e-7)
