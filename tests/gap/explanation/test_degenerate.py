"""What a fit drove an effect to, where that is no longer what its word means."""

import pytest

from chladni.gap.explanation.degenerate import is_degenerate
from chladni.gap.explanation.excited_band import excited_band_hz
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.extra_mode import STIFF_MOUNT
from tests.gap.arm import arm, measured
from tests.gap.fitted import contestant


@pytest.fixture(scope="module")
def run() -> FreeRun:
    return FreeRun(arm(), measured(()))


def hanging(frequency_hz: float, damping_ratio: float = 0.02) -> Contestant:
    """A fit that ended at a mass that hangs at a body with this frequency."""
    values = {"mass": 0.5, "frequency": frequency_hz, "damping_ratio": damping_ratio}
    return contestant(attached("extra_mode", "arm", values))


def changing(at: float, rise: float) -> Contestant:
    """A fit that ended at a spring that changes about a time, slowly or not."""
    values = {"relative_change": 0.2, "time": at, "rise": rise}
    return contestant(attached("varying_stiffness", "elbow", values, variant="step"))


def test_an_oscillator_that_never_swings_in_a_log_is_a_spring_to_where_it_stands(run: FreeRun) -> None:
    lowest_hz = max(1.0 / run.measurement.duration_s, excited_band_hz(run.measurement)[0] / STIFF_MOUNT)
    assert is_degenerate(run, hanging(0.9 * lowest_hz))
    assert not is_degenerate(run, hanging(1.1 * lowest_hz))


def test_an_oscillator_far_below_all_that_moved_is_a_spring_to_where_it_stands(run: FreeRun) -> None:
    lowest_hz = excited_band_hz(run.measurement)[0]
    # Long enough for it to swing: so it's the band alone that says it stands still.
    assert 0.9 * lowest_hz / STIFF_MOUNT > 1.0 / run.measurement.duration_s
    assert is_degenerate(run, hanging(0.9 * lowest_hz / STIFF_MOUNT))


def test_what_is_damped_far_too_much_to_swing_is_a_mass_that_a_dashpot_carries(run: FreeRun) -> None:
    middle_hz = 0.5 * excited_band_hz(run.measurement)[1]
    # Critical is 1; a fit isn't exact.
    assert not is_degenerate(run, hanging(middle_hz, damping_ratio=1.2))
    assert is_degenerate(run, hanging(middle_hz, damping_ratio=3.0))


def test_an_oscillator_far_above_all_that_moved_is_a_mass(run: FreeRun) -> None:
    highest_hz = excited_band_hz(run.measurement)[1]
    assert not is_degenerate(run, hanging(0.9 * STIFF_MOUNT * highest_hz))
    assert is_degenerate(run, hanging(1.1 * STIFF_MOUNT * highest_hz))


def test_a_change_that_is_over_at_once_or_never_comes_is_a_stiffness(run: FreeRun) -> None:
    length = run.measurement.duration_s
    assert not is_degenerate(run, changing(0.04 * length, 0.01 * length))
    assert is_degenerate(run, changing(0.01 * length, 0.005 * length))
    assert is_degenerate(run, changing(0.99 * length, 0.005 * length))
    assert is_degenerate(run, changing(1.5 * length, 0.1 * length))


def test_a_slow_change_is_seen_though_half_of_it_comes_after_the_log(run: FreeRun) -> None:
    length = run.measurement.duration_s
    assert not is_degenerate(run, changing(1.02 * length, 2.0 * length))
