"""Random vibration tests against closed forms: profiles and their tolerances."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.random_vibration import check_profile, random_profile
from tests.spectral.made_signals import made_density

G = 9.80665
NAVMAT = [(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)]


def test_the_level_of_a_profile_is_the_integral_of_its_power_laws():
    # NAVMAT P-9492 states 6.06 g RMS.
    assert random_profile(NAVMAT).rms() / G == pytest.approx(6.06, abs=0.005)
    # -3 dB an octave, G = 1/f: the integral is a logarithm.
    pink = random_profile([(10.0, 0.1), (1000.0, 0.001)], unit="m/s^2")
    assert pink.rms() == pytest.approx(np.sqrt(np.log(100)), rel=1e-12)
    grid = np.geomspace(20, 2000, 200_000)
    profile = random_profile(NAVMAT)
    assert profile.rms() == pytest.approx(np.sqrt(np.trapezoid(profile.at(grid), grid)), rel=1e-6)
    assert np.isnan(profile.at(np.array([19.9, 2001.0]))).all()


def test_what_lies_outside_the_tolerance_is_told():
    profile = random_profile(NAVMAT, upper_db=3.0, lower_db=1.0)
    asked = profile.at(np.linspace(0, 2500, 2501))
    measured = np.stack([asked * 10**0.2, asked * 10**-0.2, asked])
    # One line 6 dB too high, in a spectrum that keeps the profile.
    measured[2, 500] *= 4
    found = check_profile(made_density(np.nan_to_num(measured)), profile)
    assert found.frequency_hz[[0, -1]].tolist() == [20.0, 2000.0]
    np.testing.assert_allclose(found.deviation_db[0], 2.0)
    np.testing.assert_allclose(found.outside, [0.0, 1.0, 1 / 1981], atol=1e-12)
    # The integral over the lines is coarse where the profile bends.
    np.testing.assert_allclose(found.rms[:2] / found.profile_rms, [10**0.1, 10**-0.1], rtol=1e-4)
    np.testing.assert_allclose(found.std_db, 0.1 * 10 / np.log(10))


@pytest.mark.parametrize(
    ("points", "options", "words"),
    [
        ([(20, 0.1)], {}, "two breakpoints or more"),
        ([(0, 0.1), (20, 0.1)], {}, "above 0 Hz"),
        ([(20, 0.1), (10, 0.1)], {}, "10 Hz follows 20 Hz"),
        ([(20, 0.1), (30, 0.0)], {}, "finite and above 0"),
        (NAVMAT, {"upper_db": -1.0}, "both must be 0 or more"),
        (NAVMAT, {"unit": "gg"}, "gg"),
    ],
)
def test_what_is_no_profile_is_refused(points, options, words):
    with pytest.raises((EstimateError, SetupError), match=words):
        random_profile(points, **options)


def test_another_unit_and_too_few_lines_are_refused():
    with pytest.raises(EstimateError, match="c0 is in N, the profile in m/s"):
        check_profile(made_density(np.ones(100), unit="N"), random_profile(NAVMAT))
    with pytest.raises(EstimateError, match="between 20 and 2000 Hz; ask for a finer resolution"):
        check_profile(made_density(np.ones(100), last_hz=15.0), random_profile(NAVMAT))
