import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.drives.limit_law import limit_law


@given(st.floats(-1e6, 1e6), st.floats(0.0, 10.0), st.floats(0.0, 100.0))
def test_command_and_law_together_never_leave_the_limit(command, half_width, limit):
    law = limit_law(half_width=half_width, limit=limit)
    left = command + law.function(command, 0.0, 0.0, law.parameters, (), ())
    # What is left is a difference of numbers as large as the command.
    rounding = 4 * np.finfo(float).eps * abs(command)
    assert abs(left) <= limit + rounding
    assert abs(left) <= max(abs(command) - half_width, 0.0) + rounding


def test_without_numbers_nothing_is_taken_away():
    law = limit_law()
    assert law.function(123.0, 0.0, 0.0, law.parameters, (), ()) == 0.0
    assert np.all(np.isfinite(law.parameters))


@pytest.mark.parametrize("command", [-3.0, -1.0, 0.0, 1.0, 3.0])
def test_the_law_is_odd(command):
    law = limit_law(half_width=0.5, limit=1.5)

    def added(d):
        return law.function(d, 0.0, 0.0, law.parameters, (), ())

    assert added(-command) == -added(command)
