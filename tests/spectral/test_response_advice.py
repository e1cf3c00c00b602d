"""Words about bias: when they are said and when not."""

import numpy as np
import pytest

from chladni.signals.provenance import Provenance
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from chladni.spectral.response_advice import closer_lines, half_power_lines, longest_segment_s
from tests.spectral.made_signals import noise, series
from tests.spectral.mass_chain import MassChain

RATE_HZ = 512.0


def notes_of(values, *, references="a", **options):
    response = frequency_response(cross_spectra(series(values, rate_hz=RATE_HZ), **options), references=references)
    return response.provenance.notes


def oscillator(damping):
    force = noise(1, 60_000)[0]
    return np.concatenate([force[np.newaxis], MassChain(1, damping=damping).respond(force, RATE_HZ)])


@pytest.mark.parametrize("zeta", [0.01, 0.05])
def test_the_half_power_width_is_that_of_the_resonance(zeta):
    # Half-power bandwidth 2 zeta f0; lines every 0.01 Hz around 10 Hz.
    frequency_hz = np.arange(800, 1200) * 0.01
    r = frequency_hz / 10.0
    magnitude = 1 / np.abs(1 - r**2 + 2j * zeta * r)
    width = half_power_lines(magnitude, int(np.argmax(magnitude)))
    # To first order in zeta; the next term is of order zeta^2.
    assert width * 0.01 == pytest.approx(2 * zeta * 10.0, rel=5 * zeta**2 + 0.01)


def test_a_peak_without_foot_has_no_width():
    assert half_power_lines(np.array([1.0, 0.9, 0.8]), 0) == float("inf")


def test_a_resolution_too_coarse_is_told_with_what_to_ask_for():
    # zeta = 6/(2 sqrt(4e4 2)) = 1.06 %, 22.5 Hz: half-power bandwidth 0.48 Hz.
    (note,) = [note for note in notes_of(oscillator(6.0), resolution_hz=0.5) if "half power" in note]
    assert "b: the peak at 22.5 Hz" in note
    wanted_hz = float(note.split("ask for a resolution of ")[1].split(" Hz")[0])
    # A quarter of the width seen, which the window has enlarged from 0.48; asking again comes nearer.
    assert 0.48 / 4 <= wanted_hz <= 0.3


def test_a_fine_resolution_is_not_complained_about():
    assert not any("half power" in note for note in notes_of(oscillator(30.0), resolution_hz=0.25))


def test_noise_on_the_response_is_told_as_spread():
    values = noise(2, 50_000)
    values[1] = 2 * values[0] + values[1]
    (note,) = notes_of(values, resolution_hz=5.0)
    # Coherence 4/5, so H2 is a quarter above H1.
    assert note.startswith(("b: H2 lies above H1 by 24%", "b: H2 lies above H1 by 25%"))


def test_an_unrelated_response_is_told():
    (note,) = notes_of(noise(2, 50_000), resolution_hz=5.0)
    assert "explains little" in note


def test_clean_data_need_no_words():
    x = noise(1, 50_000)
    assert notes_of(np.concatenate([x, 2 * x]), resolution_hz=5.0) == ()


def test_nothing_trusted_means_no_peaks_and_no_spread():
    assert notes_of(np.zeros((2, 5000)), resolution_hz=5.0)[0].endswith("are masked")


# 401 half-overlapping segments of 1 s are 201 s, four of which may be asked for.
AVERAGED = {"segment_s": 1.0, "averages": 401, "overlap": 0.5}


def test_lines_are_asked_for_that_the_record_has():
    account = Provenance(**AVERAGED)
    assert longest_segment_s(account) == pytest.approx(201 / 4)
    assert closer_lines(account, step_hz=1.0, wanted_hz=0.05) == "ask for a resolution of 0.05 Hz"
    told = closer_lines(account, step_hz=1.0, wanted_hz=0.005)
    # 1/50.25 s, rounded up: 0.0199 Hz would be longer than a quarter of the record.
    assert told == "ask for a resolution of 0.02 Hz; a record 4 times as long helps further"
    assert closer_lines(account, step_hz=1.0, wanted_hz=0.05, longest_s=10.0).startswith(
        "ask for a resolution of 0.1 Hz"
    )


def test_no_segment_is_longer_than_the_longest_stretch():
    account = Provenance(longest_s=8.0, **AVERAGED)
    assert longest_segment_s(account) == 8.0
    assert closer_lines(account, step_hz=1.0, wanted_hz=0.05).startswith("ask for a resolution of 0.125 Hz; a record")


def test_where_no_option_helps_the_measurement_does():
    short = Provenance(segment_s=1.0, averages=4)
    assert closer_lines(short, step_hz=1.0, wanted_hz=0.05) == "a record 20 times as long helps"
    hits = Provenance(averaging="impact", segment_s=1.0, averages=5, longest_s=1.0)
    assert closer_lines(hits, step_hz=1.0, wanted_hz=0.5) == "records of 2 s help: hit at longer intervals"
    shortened = Provenance(averaging="impact", segment_s=1.0, averages=5, longest_s=4.0)
    assert closer_lines(shortened, step_hz=1.0, wanted_hz=0.5) == "ask for a resolution of 0.5 Hz"
    file = Provenance(estimator="as in the file")
    assert (
        closer_lines(file, step_hz=1.0, wanted_hz=0.051) == "lines 0.051 Hz apart help, from records 20 times as long"
    )


def test_a_period_is_as_long_as_it_is():
    period = Provenance(averaging="periodic", **AVERAGED)
    assert longest_segment_s(period) == 0
    assert closer_lines(period, step_hz=1.0, wanted_hz=0.01) == "a period 100 times as long helps"
