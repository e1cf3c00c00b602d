from math import pi

import numpy as np
import pytest
from scipy.signal import lsim, lti

from chladni.models.effects.attached_effect import attached
from tests.models.effects.small_models import one_body, with_loop

FREQUENCY_HZ = np.linspace(0.1, 40.0, 80)
S = 2j * pi * FREQUENCY_HZ
OMEGA, ZETA = 2 * pi * 15.0, 0.08
VALUES = {"frequency": 15.0, "damping_ratio": ZETA}
WAY = OMEGA**2 / (S**2 + 2 * ZETA * OMEGA * S + OMEGA**2)


def test_the_sensors_response_passes_the_mount() -> None:
    before = one_body().frequency_response(FREQUENCY_HZ)
    after = attached("mounting_resonance", "acc", VALUES).attach(one_body()).frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(after[0], before[0] * WAY, rtol=1e-10)
    np.testing.assert_allclose(after[1:], before[1:], rtol=1e-12)


def test_at_its_frequency_it_raises_by_half_the_inverse_of_the_damping_ratio() -> None:
    at = np.array([15.0])
    before = one_body().frequency_response(at)[0, 0, 0]
    after = attached("mounting_resonance", "acc", VALUES).attach(one_body()).frequency_response(at)[0, 0, 0]
    assert after / before == pytest.approx(-0.5j / ZETA, rel=1e-10)


@pytest.mark.parametrize("carried", [0.4, 1.0])
def test_a_damper_below_the_sensor_carries_motion(carried: float) -> None:
    # A base that moves under a spring and a damper (Rao, Mechanical Vibrations, 5th ed., eq. 3.67).
    way = (2 * carried * ZETA * OMEGA * S + OMEGA**2) / (S**2 + 2 * ZETA * OMEGA * S + OMEGA**2)
    before = one_body().frequency_response(FREQUENCY_HZ)
    mount = attached("mounting_resonance", "acc", {**VALUES, "carried": carried})
    after = mount.attach(one_body()).frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(after[0], before[0] * way, rtol=1e-10)


def test_in_a_loop_the_controller_sees_it() -> None:
    plant = 1 / (2.0 * S**2 + 4.0 * S + 800.0)
    for in_loop in (True, False):
        sensor = attached("mounting_resonance", "place", VALUES).attach(one_body(), in_loop=in_loop)
        open_loop = 300.0 * plant * WAY
        np.testing.assert_allclose(
            with_loop(sensor, gain=300.0).frequency_response(FREQUENCY_HZ)[2, 0],
            open_loop / (1 + open_loop),
            rtol=1e-9,
        )


def test_behind_clipping_it_filters_samples_as_straight_lines_join_them() -> None:
    clipped = attached("clipping", "acc", {"limit": 2.0}).attach(one_body())
    mounted = attached("mounting_resonance", "acc", VALUES).attach(clipped)
    assert len(mounted.states) == 2
    samples = np.clip(3 * np.random.default_rng(4).normal(size=300), -2, 2)
    times_s = np.arange(300) / 200.0
    _, wanted, _ = lsim(lti([OMEGA**2], [1.0, 2 * ZETA * OMEGA, OMEGA**2]), samples, times_s)
    given = mounted.output_maps[-1][1](samples, 200.0)
    # lsim joins samples by straight lines and starts at rest, as we do.
    np.testing.assert_allclose(given, wanted, atol=1e-10)
