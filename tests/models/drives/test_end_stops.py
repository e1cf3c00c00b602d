import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.drives.end_stops import end_stops, end_stops_law

LAW = end_stops(low=-0.1, high=0.3, stiffness=1e6, damping=2e3)


def force(d, s=0.0):
    return end_stops_law(d, s, 0.0, LAW.parameters, (), ())


@pytest.mark.parametrize(
    ("d", "s", "expected"),
    [
        (0.0, 5.0, 0.0),
        (0.3, 5.0, 0.0),
        (0.301, 0.0, 1e3),
        (0.301, 0.1, 1.2e3),
        (-0.101, 0.0, -1e3),
        (-0.101, -0.1, -1.2e3),
        # Leaving fast, the damper would pull: a stop doesn't.
        (0.301, -5.0, 0.0),
        (-0.101, 5.0, 0.0),
    ],
)
def test_force_beyond_either_end(d, s, expected):
    assert force(d, s) == pytest.approx(expected, rel=1e-9)


@given(st.floats(-1.0, 1.0), st.floats(-10.0, 10.0))
def test_a_stop_only_pushes_back(d, s):
    found = force(d, s)
    if d >= -0.1:
        assert found >= 0.0
    if d <= 0.3:
        assert found <= 0.0
