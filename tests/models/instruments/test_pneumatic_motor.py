import numpy as np

from chladni.models.instruments.pneumatic_motor import INSTRUMENT


def test_knobs_of_options_that_are_off_do_nothing():
    plain = INSTRUMENT.model({"stop_stiffness": 1e7})
    assert "stop_stiffness" not in plain.parameters
    assert plain.compile().is_linear()
    stopped = INSTRUMENT.model({"stop_stiffness": 1e7}, {"end_stops": "on"})
    assert stopped.parameters["stop_stiffness"].value == 1e7


def test_the_page_steps_the_flow_and_tells_the_velocity():
    compiled = INSTRUMENT.model().compile()
    column = compiled.column_of(INSTRUMENT.step_input)
    row = [terminal.name for terminal in compiled.outputs].index(INSTRUMENT.step_output)
    static = -(compiled.c[row, 1:] @ np.linalg.solve(compiled.a[1:, 1:], compiled.b[1:, column]))
    # 50 cm^3/s through 70 cm^2, but for what leaks.
    assert 0.99 < static * INSTRUMENT.step_size / (50 / 70 * 1e-2) <= 1.0
    assert INSTRUMENT.load_input in [terminal.name for terminal in compiled.inputs]
