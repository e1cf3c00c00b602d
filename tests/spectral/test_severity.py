"""Vibration severity against closed forms and the numbers of the standard."""

import numpy as np
import pytest
import scipy.fft

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.levels import levels
from chladni.spectral.severity import BOUNDARIES_MM_S, BOUNDARIES_UM, THIRD_OCTAVE, severity
from tests.spectral.made_signals import blocks, series

RATE_HZ = 5000.0


def tone(frequency_hz, amplitude, *, rate_hz=RATE_HZ, seconds=8.0):
    return amplitude * np.sin(2 * np.pi * frequency_hz * np.arange(round(seconds * rate_hz)) / rate_hz)


def test_an_acceleration_and_its_velocity_have_the_severity_of_the_closed_form():
    # 24.9 Hz and 9.8 m/s^2 peak, with gravity; the same motion measured as velocity; and a force.
    omega = 2 * np.pi * 24.9
    values = np.stack([9.81 + tone(24.9, 9.8), tone(24.9, 1.0), tone(24.9, 9.8 / omega)])
    found = severity(series(values, rate_hz=RATE_HZ, units=["m/s^2", "N", "m/s"]))
    assert [channel.name for channel in found.channels] == ["a", "c"]
    assert [channel.unit for channel in found.channels] == ["m/s", "m/s"]
    assert found.velocity_mm_s.round(1).tolist() == [44.3, 44.3]
    np.testing.assert_allclose(found.velocity_mm_s, 1e3 * 9.8 / omega / np.sqrt(2), rtol=1e-3)
    assert (found.zones, found.boundaries_mm_s, found.notes) == ((), (), ())
    np.testing.assert_allclose(found.displacement_um, 1e6 * 9.8 / omega**2 / np.sqrt(2), rtol=1e-3)
    np.testing.assert_allclose(found.running_displacement.rms[:, 0].mean(axis=-1), 283.1e-6, rtol=1e-2)
    np.testing.assert_allclose(found.running.rms[:, 0].mean(axis=-1), 0.0443, rtol=1e-2)


@pytest.mark.parametrize("frequency_hz", [10.0, 20.0, 80.0, 500.0, 1000.0])
def test_the_band_is_as_flat_as_iso_2954_asks(frequency_hz):
    # Least and greatest relative sensitivity: 0.8 to 1.1 at the ends of the band, 0.9 to 1.1 inside.
    found = severity(series(tone(frequency_hz, 2 * np.pi * frequency_hz), rate_hz=RATE_HZ))
    least = 0.8 if frequency_hz in (10.0, 1000.0) else 0.9
    assert least < found.velocity_mm_s[0] / (1e3 / np.sqrt(2)) < 1.1


def test_what_lies_outside_the_band_hardly_counts():
    rate_hz = 20_000.0
    slow, fast = (severity(series(tone(hz, 2 * np.pi * hz, rate_hz=rate_hz), rate_hz=rate_hz)) for hz in (2.5, 4e3))
    # Two octaves outside the band, 1.67 outside the corners: 30 dB at 18 dB an octave.
    assert max(slow.velocity_mm_s[0], fast.velocity_mm_s[0]) < 1e3 / np.sqrt(2) * 10 ** (-29 / 20)
    asked = severity(series(tone(4.0, 8 * np.pi), rate_hz=RATE_HZ), slow=True)
    assert asked.velocity_mm_s[0] == pytest.approx(1e3 / np.sqrt(2), rel=0.02)
    assert asked.band_hz == (2.0, 1000.0)


@pytest.mark.parametrize(
    ("machine", "zones"),
    [
        ("large-rigid", "ABBC"),
        ("large-flexible", "AABB"),
        ("medium-rigid", "ABCD"),
        ("medium-flexible", "ABBC"),
    ],
)
def test_zones_are_those_of_the_class(machine, zones):
    omega = 2 * np.pi * 50
    wanted_mm_s = np.array([1.3, 2.7, 4.4, 6.9])
    values = np.stack([tone(50.0, 1e-3 * one * np.sqrt(2) * omega) for one in wanted_mm_s])
    found = severity(series(values, rate_hz=RATE_HZ), machine=machine)
    np.testing.assert_allclose(found.velocity_mm_s, wanted_mm_s, rtol=2e-3)
    assert "".join(found.zones) == zones
    assert found.boundaries_mm_s == BOUNDARIES_MM_S[machine]


@pytest.mark.parametrize("machine", BOUNDARIES_UM)
def test_slow_motion_is_judged_by_its_displacement(machine):
    # 8 Hz: velocity is 2 pi 8 times displacement. A little inside each zone of displacement.
    low, middle, high = BOUNDARIES_UM[machine]
    wanted_um = np.array([0.9 * low, 1.1 * low, 1.1 * middle, 1.1 * high])
    omega = 2 * np.pi * 8
    values = np.stack([tone(8.0, 1e-6 * one * np.sqrt(2) * omega**2, seconds=16.0) for one in wanted_um])
    found = severity(series(values, rate_hz=RATE_HZ), machine=machine, slow=True)
    np.testing.assert_allclose(found.displacement_um, wanted_um, rtol=2e-3)
    np.testing.assert_allclose(found.velocity_mm_s, 1e-3 * wanted_um * omega, rtol=2e-3)
    assert found.boundaries_um == BOUNDARIES_UM[machine]
    assert ("".join(found.velocity_zones), "".join(found.displacement_zones)) == ("AABC", "ABCD")
    assert "".join(found.zones) == "ABCD"


def test_blocks_give_what_the_whole_gives():
    whole = series(np.random.default_rng(1).standard_normal((2, 30_000)), rate_hz=RATE_HZ)
    found, expected = severity(blocks(whole, [1000, 77, 12_000])), severity(whole)
    np.testing.assert_allclose(found.velocity_mm_s, expected.velocity_mm_s, rtol=1e-9)
    np.testing.assert_allclose(found.displacement_um, expected.displacement_um, rtol=1e-9)


def test_a_rate_that_shows_part_of_the_band_is_told_and_one_that_shows_nothing_refused():
    found = severity(series(tone(50.0, 1.0, rate_hz=400.0), rate_hz=400.0))
    assert found.band_hz == (10.0, 200.0)
    assert "at least as told: samples end at 200 Hz" in found.notes[0]
    with pytest.raises(EstimateError, match="samples at 20 Hz end at 10 Hz; measure at 2518 Hz or more"):
        severity(series(tone(5.0, 1.0, rate_hz=20.0), rate_hz=20.0))


def test_what_is_no_motion_or_no_class_is_refused():
    with pytest.raises(EstimateError, match="needs an acceleration"):
        severity(series(tone(50.0, 1.0), rate_hz=RATE_HZ, units=["N"]))
    with pytest.raises(SetupError, match="machine 'huge' is none of large-rigid"):
        severity(series(tone(50.0, 1.0), rate_hz=RATE_HZ), machine="huge")


def test_velocity_and_displacement_are_of_one_transform(monkeypatch):
    values = np.random.default_rng(5).standard_normal((2, 60_000))
    whole = series(values, rate_hz=RATE_HZ)
    alone = [
        levels(whole, bands_hz=[(10 / THIRD_OCTAVE, 1000 * THIRD_OCTAVE)], integrations=often) for often in (1, 2)
    ]
    seen, rfft = [], scipy.fft.rfft

    def counting(some, length):
        seen.append(np.ndim(some))
        return rfft(some, length)

    monkeypatch.setattr(scipy.fft, "rfft", counting)
    found = severity(iter(blocks(whole, [7000, 20_000, 33_000])))
    # Those of samples have two axes, each beside two impulse responses.
    assert seen.count(1) == 2 * seen.count(2) > 2
    np.testing.assert_allclose(found.velocity_mm_s, 1e3 * alone[0].rms[:, 0], rtol=1e-9)
    np.testing.assert_allclose(found.displacement_um, 1e6 * alone[1].rms[:, 0], rtol=1e-9)
