import numpy as np
import pytest

from chladni.models.instruments.hydraulic_motor import INSTRUMENT


@pytest.mark.parametrize(("loop", "unit"), [("open", "m^3/s"), ("position", "m")])
def test_the_command_is_a_flow_or_a_reference_by_the_loop(loop, unit):
    compiled = INSTRUMENT.model({}, {"loop": loop}).compile()
    assert [(t.name, t.unit) for t in compiled.inputs] == [("command", unit), ("load", "N")]
    assert INSTRUMENT.step_output in [terminal.name for terminal in compiled.outputs]


def test_flow_of_a_corrected_step_is_shown_within_twice_the_step():
    (chart,) = INSTRUMENT.extra_charts(INSTRUMENT.model({}, {"correction": "pd2"}))
    (curve,) = chart.curves
    assert chart.name == "flow"
    assert np.abs(curve.y).max() == pytest.approx(2 * INSTRUMENT.step_size, rel=5e-3)
    assert curve.y[-1] == pytest.approx(INSTRUMENT.step_size, rel=1e-3)


def test_every_option_makes_a_page():
    for option in INSTRUMENT.options:
        for word in option.choices:
            assert INSTRUMENT.model({}, {option.name: word}).compile().states
