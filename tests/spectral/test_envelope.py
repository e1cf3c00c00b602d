"""Envelope spectra, kurtogram and bearing frequencies: made faults whose lines are known, and closed forms."""

import numpy as np
import pytest
from scipy import signal

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.bearings import Bearing
from chladni.spectral.envelope import envelope
from chladni.spectral.kurtogram import kurtogram
from tests.spectral.made_signals import blocks, noise, series

RATE_HZ = 20_000.0
#: SKF 6205-2RS of the Case Western Reserve bearing data, diameters in inches.
SKF_6205 = Bearing(elements=9, element_diameter=0.3126, pitch_diameter=1.537)
SHAFT_HZ = 25.0


def struck(fault_hz, *, resonance_hz=4200.0, seconds=6.0, jitter=0.01, blow=3.0, seed=1):
    """Blows at a rate, each a jittered interval after the last, that ring a resonance in noise beside a strong tone.

    The model of Randall & Antoni (2011, section 3): intervals of independent errors add up to a random walk.
    """
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    values = rng.standard_normal(time_s.size) + 2 * np.sin(2 * np.pi * SHAFT_HZ * time_s)
    intervals = (1 + jitter * rng.standard_normal(round(1.1 * seconds * fault_hz))) / fault_hz
    for at_s in np.cumsum(intervals)[:-1]:
        since_s = time_s[round(at_s * RATE_HZ) + 1 :][:200] - at_s
        ringing = blow * np.exp(-since_s / 1e-3) * np.sin(2 * np.pi * resonance_hz * since_s)
        values[round(at_s * RATE_HZ) + 1 :][: since_s.size] += ringing
    return series(values, rate_hz=RATE_HZ)


@pytest.mark.parametrize("name", ["BPFO", "BPFI"])
@pytest.mark.parametrize("resonance_hz", [4200.0, 7000.0])
def test_the_fault_that_was_made_stands_out_within_a_line(name, resonance_hz):
    fault_hz = SKF_6205.frequencies_hz(SHAFT_HZ)[name]
    (found,) = envelope(struck(fault_hz, resonance_hz=resonance_hz), bearing=SKF_6205, shaft_hz=SHAFT_HZ)
    # The band holds the resonance, and is wide enough for multiples.
    assert found.band_hz[0] < resonance_hz < found.band_hz[1]
    assert found.band_hz[1] - found.band_hz[0] >= 3 * SKF_6205.frequencies_hz(SHAFT_HZ)["BPFI"]
    spacing_hz = found.frequency_hz[1]
    highest = found.frequency_hz[3:][np.argmax(found.amplitude[3:])]
    assert abs(highest - fault_hz) <= spacing_hz
    over = {fault.name: fault.over_background for fault in found.faults}
    assert over[name] > 10
    assert all(value < 3 for other, value in over.items() if name not in other and other not in ("2 BPFI", "3 BPFO"))
    assert found.notes == ()


def test_noise_has_no_band_and_no_line_and_that_is_told():
    (found,) = envelope(series(noise(1, 100_000, seed=3), rate_hz=RATE_HZ), bearing=SKF_6205, shaft_hz=SHAFT_HZ)
    assert max(fault.over_background for fault in found.faults) < 2.5
    assert found.band_kurtosis < 0.3
    if found.notes:
        assert "no band is more impulsive than noise" in found.notes[0]


def test_a_modulated_carrier_has_the_closed_form_of_its_squared_envelope():
    time_s = np.arange(80_000) / RATE_HZ
    values = 3.0 * (1 + 0.4 * np.cos(2 * np.pi * 50 * time_s)) * np.sin(2 * np.pi * 5000 * time_s)
    (found,) = envelope(series(values, rate_hz=RATE_HZ), band_hz=(4000.0, 6000.0), resolution_hz=1.0)
    # 9 (1 + 0.4 cos)^2 = 9 (1.08 + 0.8 cos wt + 0.08 cos 2wt).
    # The filter's reach at the ends leaves no whole number of periods.
    assert found.mean == pytest.approx(9 * 1.08, rel=2e-3)
    assert found.amplitude[50] == pytest.approx(9 * 0.8, rel=2e-3)
    assert found.amplitude[100] == pytest.approx(9 * 0.08, rel=2e-3)
    assert found.density.channels[0].unit == "(m/s^2)^2"
    assert found.frequency_hz[-1] == pytest.approx(2000.0)
    assert found.kurtogram is None


def test_spectral_kurtosis_of_noise_tones_and_gated_noise_is_the_closed_form():
    white = noise(3, 400_000, seed=2)
    time_s = np.arange(400_000) / RATE_HZ
    tone = 100 * np.sin(2 * np.pi * 3000 * time_s)
    # Noise that is there for a quarter of the time: 2 / 0.25 - 2.
    gate = (time_s % 0.4 < 0.1) * 1.0
    found = kurtogram(series(np.stack([white[0], white[1] + tone, gate * white[2]]), rate_hz=RATE_HZ))
    # Of 220 bands at this scatter none lies beyond five sigma.
    assert np.abs(found.kurtosis[0] / found.std[0]).max() < 5
    holds = (found.low_hz < 2900) & (found.high_hz > 3100)
    np.testing.assert_allclose(found.kurtosis[1, holds], -1.0, atol=0.01)
    wide = found.high_hz - found.low_hz > 1000
    np.testing.assert_allclose(found.kurtosis[2, wide], 6.0, rtol=0.1)


def test_kurtosis_of_a_band_is_that_by_another_filter():
    whole = struck(90.0)
    found = kurtogram(whole)
    band = found.best()
    edges = (found.low_hz[band], found.high_hz[band])
    sections = signal.butter(6, edges, "bandpass", fs=RATE_HZ, output="sos")
    power = np.abs(signal.hilbert(signal.sosfiltfilt(sections, whole.values[0]))) ** 2
    other = np.mean(power**2) / np.mean(power) ** 2 - 2
    # Flanks differ, and with them how long blows ring in the band.
    assert found.kurtosis[0, band] == pytest.approx(other, rel=0.15)


def test_a_kurtogram_does_not_depend_on_where_blocks_are_cut():
    whole = struck(90.0, seconds=8.0)
    expected = kurtogram(whole)
    found = kurtogram(blocks(whole, [100, 70_000, 3, 50_000]))
    np.testing.assert_allclose(found.kurtosis, expected.kurtosis, rtol=1e-9, atol=1e-9)


def test_what_can_not_be_done_is_refused():
    short = series(noise(1, 4000), rate_hz=RATE_HZ)
    with pytest.raises(EstimateError, match="unbroken run of 4096 samples, and the longest has 4000"):
        kurtogram(short)
    with pytest.raises(SetupError, match="give the shaft's revolutions a second, too"):
        envelope(short, bearing=SKF_6205)
    with pytest.raises(EstimateError, match=r"no band is 16245\.\d* Hz wide"):
        envelope(series(noise(1, 8000), rate_hz=RATE_HZ), bearing=SKF_6205, shaft_hz=1000.0)


def test_lines_that_stand_out_are_named_by_their_amplitude_and_their_absence_is_told():
    # (1 + cos a)^2/2 of a carrier: amplitudes 2 and 0.5 of sines at 87 and 174 Hz in the squared envelope.
    time_s = np.arange(40_000) / 10_000
    blows = (1 + np.cos(2 * np.pi * 87 * time_s)) * np.sin(2 * np.pi * 3000 * time_s)
    (found,) = envelope(series(blows, rate_hz=1e4), band_hz=(2500, 3500))
    assert [round(peak.frequency_hz) for peak in found.peaks[:2]] == [87, 174]
    assert [peak.height for peak in found.peaks[:2]] == pytest.approx([2.0, 0.5], rel=0.01)
    once = np.zeros(40_000)
    once[20_000] = 1.0
    (still,) = envelope(series(once, rate_hz=1e4), band_hz=(1000, 4000))
    assert still.peaks == ()
    assert "no line of the envelope stands out" in still.notes[-1]
