"""Bristles along a known motion, against the law that is integrated."""

import numpy as np
import pytest

from chladni.models.core.port_law import PortLaw
from chladni.models.effects.bristles import bristles_along
from chladni.models.effects.coulomb_friction import bristle
from chladni.models.integrator.known_motion import force_along_motion

RATE_HZ = 500.0


@pytest.fixture
def motion():
    time_s = np.arange(2000) / RATE_HZ
    return time_s, 0.1 * np.sin(2 * np.pi * 3.0 * time_s) + 0.05 * np.sin(2 * np.pi * 11.3 * time_s)


def test_it_is_the_law_of_the_catalogue(motion) -> None:
    time_s, velocity = motion
    law = PortLaw(port=0, function=bristle, parameters=(1.0, 0.0, 1e-4), state=(0.0,))
    oracle = force_along_motion(law, np.zeros_like(velocity), velocity, time_s, substeps=400)
    np.testing.assert_allclose(bristles_along(velocity, RATE_HZ, 1e-4), oracle, atol=2e-4)


def test_bristles_far_shorter_than_a_sample_s_way_are_dry_friction(motion) -> None:
    _, velocity = motion
    share = bristles_along(velocity, RATE_HZ, 1e-9)
    away = np.abs(velocity) > 0.01
    np.testing.assert_allclose(share[away], np.sign(velocity[away]), atol=1e-9)
