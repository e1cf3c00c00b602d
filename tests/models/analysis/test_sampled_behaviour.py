"""Behaviour read off samples, against the exact behaviour of the same system."""

import numpy as np
import pytest

from chladni.models.analysis.behaviour import behaviour
from chladni.models.analysis.sampled_behaviour import SampledStep, sampled_quantities, with_sampled
from chladni.models.core.port import Terminal
from chladni.models.core.reading import Quantity
from tests.models.analysis.systems import pt2

ZETA, OMEGA = 0.3, 5.0


def swing(t: np.ndarray) -> np.ndarray:
    damped = OMEGA * np.sqrt(1 - ZETA**2)
    return 1 - np.exp(-ZETA * OMEGA * t) * (np.cos(damped * t) + ZETA / np.sqrt(1 - ZETA**2) * np.sin(damped * t))


def sampled(values, t, *, unit: str = "m/s", size: float = 1.0) -> dict[str, Quantity]:
    step = SampledStep(
        time_s=t, values=values, output=Terminal(name="y", unit=unit), source=Terminal(name="u", unit=unit), size=size
    )
    return {one.name: one for one in sampled_quantities(step)}


def test_samples_of_a_pt2_tell_what_its_equations_do() -> None:
    t = np.linspace(0, 8, 4001)
    found = sampled(swing(t), t)
    exact = behaviour(pt2(OMEGA, ZETA, output_unit="m/s"))

    step = t[1]
    for name in ("answer_time", "peak_time", "rise_time"):
        # A parabola or a line through samples: the error is of the second order of the step.
        assert found[name].value == pytest.approx(exact.value(name), abs=5 * step**2)
    assert found["settling_time"].value == pytest.approx(exact.value("settling_time"), abs=step)
    assert found["overshoot"].value == pytest.approx(exact.value("overshoot"), rel=1e-4)
    assert found["peak_acceleration"].value == pytest.approx(exact.value("peak_acceleration"), rel=1e-4)
    assert found["final_value"].value == pytest.approx(1.0, abs=1e-3)
    assert found["steady_state_error"].value == pytest.approx(0.0, abs=1e-3)
    assert all("simulation with laws" in one.definition for one in found.values())


def test_what_doesn_t_come_to_rest_tells_no_times() -> None:
    t = np.linspace(0, 8, 401)
    found = sampled(t, t)
    assert found["answer_time"].value is None
    assert "doesn't come to rest" in found["settling_time"].definition
    assert found["peak_acceleration"].value == pytest.approx(1.0)


def test_a_rise_without_peak() -> None:
    t = np.linspace(0, 8, 801)
    found = sampled(1 - np.exp(-2 * t), t, unit="N")
    assert found["answer_time"].value is None
    assert found["overshoot"].value == pytest.approx(0.0, abs=1e-3)
    assert found["peak_acceleration"].value is None


def test_a_jump_begins_above_ten_percent() -> None:
    t = np.linspace(0, 8, 801)
    found = sampled(np.ones_like(t), t)
    assert found["rise_time"].value is None
    assert found["settling_time"].value == 0.0


def test_samples_replace_what_the_linear_equations_say() -> None:
    linear = [Quantity(name="overshoot", value=1.0, unit="%"), Quantity(name="bandwidth", value=2.0, unit="Hz")]
    found = with_sampled(linear, [Quantity(name="overshoot", value=3.0, unit="%")])
    assert [one.value for one in found] == [3.0, 2.0]
