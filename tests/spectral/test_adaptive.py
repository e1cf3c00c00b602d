"""The default way of averaging, chosen by the excitation."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.testing import assert_close
from chladni.spectral import adaptive as module
from chladni.spectral.adaptive import adaptive_auto_spectra, adaptive_cross_spectra
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.excitation import excited_lines
from chladni.spectral.frf import frequency_response
from chladni.spectral.impact import find_impacts, impact_cross_spectra
from chladni.spectral.periodic import find_period, periodic_cross_spectra
from chladni.spectral.psd import power_spectral_density
from tests.spectral.aircraft import PAYLOAD, SHAKER, aircraft
from tests.spectral.made_signals import blocks, multisine, noise, part, series


def repeating(periods=8):
    x = np.tile(multisine(500, np.arange(5, 60)), periods)
    return series(np.stack([noise(1, x.size)[0], x]))


def with_role(source, name):
    roles = [replace(c, role="reference") if c.name == name else c for c in source.channels]
    return source.with_channels(roles)


@pytest.mark.parametrize("references", ["b", ["b"], ["a", "b"], None])
def test_a_reference_that_repeats_is_averaged_over_its_periods(references):
    source = repeating()
    spectra = adaptive_cross_spectra(source, references=references)
    assert_close(spectra, periodic_cross_spectra(source, find_period(source, channel="b")), rtol=0)


def test_without_names_the_channels_marked_as_reference_are_looked_at():
    assert adaptive_cross_spectra(with_role(repeating(), "b")).provenance.averaging == "periodic"
    assert adaptive_cross_spectra(with_role(repeating(), "a")).provenance.averaging == "linear"


def test_what_does_not_repeat_is_averaged_after_welch():
    source = series(noise(2, 20_000))
    spectra = adaptive_cross_spectra(source, references="a")
    assert_close(spectra, cross_spectra(source), rtol=0)
    assert spectra.provenance.notes == ()


@pytest.mark.parametrize("forced", [{"window": "hann"}, {"resolution_hz": 2.0}, {"overlap": 0.25}])
def test_what_is_asked_for_is_done_and_its_price_is_told(forced):
    spectra = adaptive_cross_spectra(repeating(), references="b", **forced)
    assert spectra.provenance.averaging == "linear"
    (note,) = spectra.provenance.notes
    assert note.startswith("b repeats every 0.5 s; a hann window over")
    assert note.endswith("leave window, resolution and overlap out to average whole periods")


def test_a_period_between_samples_is_averaged_with_a_window_and_a_word():
    phases = 2 * np.pi * np.random.default_rng(1).random(55)
    time = np.arange(5000) / 500.3
    signal = np.sum(np.cos(2 * np.pi * np.outer(np.arange(5, 60), time) + phases[:, np.newaxis]), axis=0)
    spectra = adaptive_cross_spectra(series(signal))
    assert spectra.provenance.window == "hann"
    (note,) = spectra.provenance.notes
    assert "no whole number of samples" in note
    assert "resample" in note


@pytest.mark.parametrize("lengths", [[300] * 20, [1700], [5000]])
@pytest.mark.parametrize("source", [repeating(), series(noise(2, 4000))], ids=["periodic", "random"])
def test_a_stream_is_its_series(source, lengths):
    assert_close(adaptive_cross_spectra(blocks(source, lengths)), adaptive_cross_spectra(source), rtol=0)


def test_a_period_is_looked_for_in_the_lead_and_averaged_to_the_end(monkeypatch):
    monkeypatch.setattr(module, "SAMPLES_EXAMINED", 2500)
    source = repeating(20)
    spectra = adaptive_cross_spectra(blocks(source, [400] * 20))
    assert spectra.provenance.averages == 20


def test_a_break_in_the_lead_ends_what_is_examined():
    source = repeating()
    stream = [part(source, 0, 2100), part(source, 2600, source.samples)]
    spectra = adaptive_cross_spectra(stream, references="b")
    assert (spectra.provenance.averages, spectra.provenance.skipped) == (4 + 2, 1)


def test_invalid_samples_in_some_blocks_are_heeded():
    source = repeating()
    late = part(source, 2000, source.samples)
    valid = np.ones(late.values.shape, dtype=bool)
    valid[0, 100] = False
    spectra = adaptive_cross_spectra([part(source, 0, 2000), replace(late, valid=valid)], references="b")
    assert (spectra.provenance.averages, spectra.provenance.skipped) == (7, 1)


def test_a_missing_reference_is_named():
    with pytest.raises(EstimateError, match="no channel 'x'"):
        adaptive_cross_spectra(repeating(), references="x")


def test_the_aircraft_by_default_and_by_hann(shared_data):
    source = aircraft(shared_data, 1)
    heights = {}
    for window in (None, "hann"):
        spectra = adaptive_cross_spectra(source, references=SHAKER, window=window)
        response = frequency_response(spectra, references=SHAKER, responses=[PAYLOAD])
        band = (response.frequency_hz > 7) & (response.frequency_hz < 7.6)
        heights[window] = np.abs(response.values[0, 0, band]).max()
    assert heights[None] == pytest.approx(0.258, abs=0.001)
    # What a window costs: 0.151 is what an analyser that doesn't know better reads.
    assert heights["hann"] < 0.16
    assert any("reads sharp peaks low" in note for note in response.provenance.notes)


def hammer_test(seconds=10):
    """A hit a second, 2 ms long, and an oscillator that rings in between; 5 kHz."""
    force = np.zeros(seconds * 5000)
    for hit in range(500, force.size, 5000):
        force[hit : hit + 10] = 100 * np.hanning(12)[1:-1]
    time_s = np.arange(5000) / 5000
    ringing = np.convolve(force, np.exp(-20 * time_s) * np.sin(2 * np.pi * 200 * time_s))[: force.size]
    return with_role(series(np.stack([force, ringing]) + 1e-4 * noise(2, force.size), rate_hz=5000.0), "a")


@pytest.mark.parametrize("references", ["a", ["a"], None])
def test_the_hits_of_a_hammer_are_averaged(references):
    source = hammer_test()
    spectra = adaptive_cross_spectra(source, references=references)
    assert spectra.provenance.averaging == "impact"
    assert_close(spectra, impact_cross_spectra(source, find_impacts(source, force="a")), rtol=0)
    assert_close(adaptive_cross_spectra(blocks(source, [7000] * 7 + [1000])), spectra, rtol=0)


@pytest.mark.parametrize("resolution_hz", [0.0, -1.0, float("nan"), float("inf"), 2000.0])
def test_an_impossible_resolution_of_hits_is_refused_with_its_bounds(resolution_hz):
    with pytest.raises(SetupError, match=r"resolution .* Hz must be above 0 and at most 1250 Hz"):
        adaptive_cross_spectra(hammer_test(), references="a", resolution_hz=resolution_hz)


def test_the_resolution_sets_the_length_of_a_hits_record():
    spectra = adaptive_cross_spectra(hammer_test(), references="a", resolution_hz=2.0)
    assert spectra.provenance.segment_s == 0.5


@pytest.mark.parametrize("forced", [{"window": "hann"}, {"overlap": 0.0}])
def test_a_window_asked_for_is_used_on_hits_too(forced):
    assert adaptive_cross_spectra(hammer_test(), references="a", **forced).provenance.averaging == "linear"


def test_hits_after_a_break_in_time_are_not_used_and_that_is_said():
    first, second = hammer_test(6), hammer_test(3)
    later = replace(second, start_time_ns=first.start_time_ns + 60 * 10**9)
    spectra = adaptive_cross_spectra([first, later], references="a")
    assert_close(spectra, adaptive_cross_spectra(first, references="a"), rtol=0)
    assert "hits after the break in time at 6 s are not used: 3 s of record" in spectra.provenance.notes


def test_a_hammer_excites_to_30_db_below_its_plateau():
    spectra = adaptive_cross_spectra(hammer_test(), references="a")
    power = spectra.density[0, 0].real
    mask = excited_lines(spectra, ["a"])[0]
    # The plateau is flat at low frequency, where the 99th percentile is as good as the maximum.
    np.testing.assert_array_equal(mask, power > 1e-3 * np.percentile(power, 99))
    assert 500 < spectra.frequency_hz[mask].max() < 2000


@pytest.mark.parametrize("options", [{}, {"window": "hann"}, {"resolution_hz": 5.0}])
@pytest.mark.parametrize(
    ("source", "averaging"),
    [(series(noise(7, 20_000)), "linear"), (with_role(repeating(), "b"), "periodic"), (hammer_test(), "impact")],
    ids=["segments", "periods", "hits"],
)
def test_powers_alone_are_those_of_the_matrix_to_rounding(source, averaging, options):
    pairs, alone = adaptive_cross_spectra(source, **options), adaptive_auto_spectra(source, **options)
    assert options or alone.provenance.averaging == averaging
    # BLAS of some processors sums a large product in another order than a small one.
    assert_close(power_spectral_density(alone), power_spectral_density(pairs), rtol=64 * np.finfo(float).eps, atol=0)


@pytest.mark.parametrize("make", [noise, lambda channels, samples: np.tile(noise(channels, samples // 8), 8)])
def test_powers_alone_take_memory_by_the_channel(make):
    def peak(channels):
        source = series(make(channels, 800), names=[f"c{number}" for number in range(channels)])
        source = with_role(source, "c0")
        tracemalloc.start()
        assert adaptive_auto_spectra(source).density.shape[0] == channels
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    # Four times as much, were there nothing besides; pairs take sixteen times as much.
    assert peak(400) < 5 * peak(100)
