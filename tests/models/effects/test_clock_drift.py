import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.clock_drift import drifted
from tests.models.effects.small_models import one_body

RATE_HZ = 1000.0
TIME_S = np.arange(20_000) / RATE_HZ


@pytest.mark.parametrize(("ppm", "offset"), [(120.0, 0.0), (-300.0, 0.002), (0.0, -0.0013)])
def test_a_tone_is_read_at_the_times_of_the_other_clock(ppm: float, offset: float) -> None:
    there = TIME_S * (1 + 1e-6 * ppm) + offset
    inside = (there > 0.01) & (there < TIME_S[-1] - 0.01)
    found = drifted(np.sin(2 * np.pi * 60.0 * TIME_S), RATE_HZ, ppm, offset)
    np.testing.assert_allclose(found[inside], np.sin(2 * np.pi * 60.0 * there)[inside], atol=2e-4)


def test_beyond_the_ends_the_last_samples_hold() -> None:
    found = drifted(TIME_S, RATE_HZ, 1e4, 0.0)
    assert found[-1] == pytest.approx(TIME_S[-1])
    assert found.max() <= TIME_S[-1] + 1e-9


def test_one_channel_drifts_and_no_other() -> None:
    compiled = attached("clock_drift", "speed", {"ppm": 50.0}).attach(one_body(), in_loop=True)
    ((row, _),) = compiled.output_maps
    assert compiled.outputs[row].name == "speed"
    assert np.array_equal(compiled.a, one_body().a)
