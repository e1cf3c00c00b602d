"""What tells a floor that shakes from a law of the joint above it."""

import numpy as np
import pytest

from chladni.gap.diagnosis.shaken_by import own_motion_share
from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines

SAMPLES, RATE_HZ = 8000, 500.0


def motion(force) -> Recovered:
    t = np.arange(SAMPLES) / RATE_HZ
    way, pace = np.sin(2 * np.pi * 3.1 * t) + 0.3 * np.sin(2 * np.pi * 7.7 * t), np.gradient(np.sin(20 * t), t)
    return Recovered(
        site=Site(name="hip", kind="joint"), lines=all_lines(SAMPLES, RATE_HZ), force=force(way, pace),
        displacement=way, velocity=pace, reliable=np.ones(SAMPLES // 2 - 1), z=np.zeros(0),
        transient=np.zeros((0, 1)),
    )  # fmt: skip


def test_a_law_of_way_and_pace_follows_them() -> None:
    assert own_motion_share(motion(lambda d, s: d**3 + 2.0 * np.tanh(s))) > 0.9


def test_noise_follows_nothing() -> None:
    share = own_motion_share(motion(lambda d, _: np.random.default_rng(1).standard_normal(d.size)))
    # A hundred means of eighty samples each explain a hundredth.
    assert share == pytest.approx(100 / SAMPLES, abs=0.01)


def test_no_force_follows_nothing() -> None:
    assert own_motion_share(motion(lambda d, _: np.zeros_like(d))) == 0.0
