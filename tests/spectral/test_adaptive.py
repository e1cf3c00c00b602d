"""The default way of averaging, chosen by the excitation."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.signals.testing import assert_close
from chladni.spectral import adaptive as module
from chladni.spectral.adaptive import adaptive_cross_spectra
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frequency_response import frequency_response
from chladni.spectral.periodic import find_period, periodic_cross_spectra
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
