"""The viscous equivalent of the magnetorheological damper."""

import numpy as np
import pytest

from chladni.models.analysis.damper_placement import Damper, place_damper
from chladni.models.analysis.mr_equivalent import mr_damper_of
from chladni.models.analysis.wish import damping_ratio_at_least
from chladni.models.instruments.mr_damper import INSTRUMENT, loop_charts
from chladni.models.instruments.robot_arm import INSTRUMENT as ARM
from chladni.signals.errors import ModelError


def test_it_is_that_of_the_dampers_own_loops() -> None:
    model = INSTRUMENT.model({"current": 1.0})
    numbers = model.parameters.numbers()
    chart = next(one for one in loop_charts(model) if one.name == "equivalent-damping")
    found = mr_damper_of(amplitude_m=numbers["stroke"], frequency_hz=numbers["frequency"])

    currents, damping = chart.curves[0].x, chart.curves[0].y
    # The same loop in other steps.
    assert found.low == pytest.approx(damping[currents == 0.0][0], rel=0.02)
    assert found.high == pytest.approx(damping[currents == 1.0][0], rel=0.02)


def test_forces_that_are_smaller_damp_less_and_larger_motions_too() -> None:
    whole = mr_damper_of(amplitude_m=0.01, frequency_hz=0.5)
    tenth = mr_damper_of(amplitude_m=0.01, frequency_hz=0.5, size=0.1)
    np.testing.assert_allclose([tenth.low, tenth.high], [0.1 * whole.low, 0.1 * whole.high], rtol=1e-9)
    assert mr_damper_of(amplitude_m=0.02, frequency_hz=0.5).high < whole.high


def test_it_can_be_placed_beside_a_viscous_one() -> None:
    arm = ARM.model()
    dampers = [
        Damper(name="viscous", low=0.0, high=3000.0),
        mr_damper_of(amplitude_m=1e-3, frequency_hz=5.0, size=0.01),
    ]
    placed = place_damper(
        arm, damping_ratio_at_least(0.03), dampers, joints=["elbow", "foot"], from_input="push",
        to_output="tool_displacement",
    )  # fmt: skip
    assert {one.damper for one in placed.tried} == {"viscous", "MR"}
    assert placed.best is not None
    assert placed.best.joint == "elbow"


@pytest.mark.parametrize(("amplitude_m", "frequency_hz"), [(0.0, 1.0), (1.0, -1.0), (np.inf, 1.0)])
def test_motions_that_are_none_are_refused(amplitude_m: float, frequency_hz: float) -> None:
    with pytest.raises(ModelError, match="must lie above zero"):
        mr_damper_of(amplitude_m=amplitude_m, frequency_hz=frequency_hz)
