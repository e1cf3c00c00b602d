"""Which channels are references and which responses."""

import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.channel_choice import choose_channels
from chladni.spectral.cross_spectra import cross_spectra
from tests.spectral.made_signals import noise, series

SPECTRA = cross_spectra(series(noise(3, 1000)), resolution_hz=10.0)


def test_all_other_channels_respond_by_default():
    chosen = choose_channels(SPECTRA, "b", None)
    assert (chosen.references, chosen.responses) == ([1], [0, 2])


def test_order_is_that_asked_for():
    chosen = choose_channels(SPECTRA, ["c", "a"], ["b", "a"])
    assert (chosen.references, chosen.responses) == ([2, 0], [1, 0])


@pytest.mark.parametrize(
    ("references", "responses", "words"),
    [
        ("x", None, "no channel 'x'"),
        ("a", ["b", "b"], "response b is named twice"),
        (["a", "a"], None, "reference a is named twice"),
        ([], None, "no reference among a, b, c"),
        (["a", "b", "c"], None, "no response among"),
    ],
)
def test_bad_choices_are_named(references, responses, words):
    with pytest.raises(EstimateError, match=words):
        choose_channels(SPECTRA, references, responses)


def test_peak_hold_has_no_responses():
    held = cross_spectra(series(noise(3, 1000)), resolution_hz=10.0, averaging="peak-hold")
    with pytest.raises(EstimateError, match="peak hold keeps no phase"):
        choose_channels(held, "a", None)
