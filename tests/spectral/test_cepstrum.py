"""Cepstra against closed forms: echoes and families of harmonics."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.cepstrum import cepstrum
from tests.spectral.made_signals import noise, series

RATE_HZ = 1000.0


def echoed(strength, delay, *, samples=400_000, seed=1):
    source = noise(1, samples + delay, seed=seed)[0]
    return source[delay:] + strength * source[:samples]


@pytest.mark.parametrize("strength", [0.4, -0.6])
def test_an_echo_has_the_closed_form_of_its_cepstrum(strength):
    found = cepstrum(echoed(strength, 50), sample_rate_hz=RATE_HZ, resolution_hz=0.5)
    # a/2 at the delay, -a^2/4 at twice it; in segments of 2000 samples the window takes 0.6 % of an echo after 50.
    assert found.at(0, 0.05) == pytest.approx(strength / 2, rel=0.02, abs=3 * found.std[50])
    assert found.at(0, 0.10) == pytest.approx(-(strength**2) / 4, rel=0.03, abs=3 * found.std[100])
    named = (0.05, 0.15) if strength > 0 else ()
    assert [peak_s for peak_s in found.peaks_s[0] if peak_s in (0.05, 0.10, 0.15)] == pytest.approx(list(named))


def test_harmonics_are_one_family_at_one_over_their_distance():
    time_s = np.arange(200_000) / RATE_HZ
    rows = sum(np.cos(2 * np.pi * 12.5 * number * time_s + number**2) for number in range(1, 40))
    found = cepstrum(rows + noise(1, time_s.size)[0], sample_rate_hz=RATE_HZ, resolution_hz=0.5)
    assert found.peaks_s[0][0] == pytest.approx(0.08)
    assert set(np.round(found.peaks_s[0], 6)) >= {0.08, 0.16, 0.24, 0.32}


@pytest.mark.parametrize("resolution_hz", [0.5, 1000 / 1999])
def test_the_power_cepstrum_is_four_times_the_square_of_the_real_one(resolution_hz):
    source = series(noise(2, 50_000) * [[1.0], [1e20]])
    real, power = (cepstrum(source, kind=kind, resolution_hz=resolution_hz) for kind in ("real", "power"))
    np.testing.assert_allclose(power.values, 4 * real.values**2, rtol=1e-12)
    # By the definition, from the averaged power of all lines.
    assert real.quefrency_s[1] == pytest.approx(1 / RATE_HZ)
    assert real.quefrency_s.size == round(RATE_HZ / resolution_hz) // 2 + 1


def test_a_factor_changes_the_value_at_zero_only():
    one = noise(1, 50_000)
    found, scaled = (cepstrum(series(size * one), resolution_hz=1.0) for size in (1.0, 1e3))
    assert scaled.values[0, 0] - found.values[0, 0] == pytest.approx(np.log(1e3), rel=1e-9)
    np.testing.assert_allclose(scaled.values[0, 1:], found.values[0, 1:], atol=1e-9)


@pytest.mark.parametrize("seconds", [20.0, 400.0])
def test_the_stated_scatter_is_that_of_noise_at_every_quefrency(seconds):
    found = cepstrum(noise(30, round(seconds * RATE_HZ), seed=5), sample_rate_hz=RATE_HZ, resolution_hz=2.0)
    relative = found.values[:, 2:-2] / found.std[2:-2]
    # In four parts along the axis, over which it falls to a third.
    for part in np.array_split(relative, 4, axis=1):
        assert part.std() == pytest.approx(1.0, rel=0.12)
    # 5 % of cepstra name a peak; of 30, more than 6 have a chance below 1 %.
    assert sum(bool(peaks_s) for peaks_s in found.peaks_s) <= 6


def test_what_has_no_cepstrum_is_refused():
    with pytest.raises(EstimateError, match="'a' never changes: its spectrum has no logarithm"):
        cepstrum(series(np.ones((1, 5000))))
    with pytest.raises(SetupError, match="kind 'complex' is none of real, power"):
        cepstrum(series(noise(1, 5000)), kind="complex")
