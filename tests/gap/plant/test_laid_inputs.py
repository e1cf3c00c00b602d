"""Inputs are laid out once for all models that take them alike, and anew for one that doesn't."""

import numpy as np
import pytest

import chladni
from chladni.gap.plant.laid_inputs import LaidInputs
from chladni.models.integrator.exponential import responses
from chladni.models.integrator.hold import hold_of
from chladni.models.integrator.input_rows import input_rows
from chladni.models.integrator.march import linear_march
from tests.gap.arm import RATE_HZ, arm

FORCE = np.random.default_rng(3).standard_normal((1, 400))


def limited(limit: float):
    return arm().with_effects((chladni.attached("saturation", "shaker", {"limit": limit}),)).compile()


def test_models_that_differ_in_their_structure_share_the_rows() -> None:
    laid, heavier = LaidInputs(FORCE, RATE_HZ), arm().with_values({"wrist.mass": 3.0}).compile()
    first, second = (laid.rows(one, hold_of(one, RATE_HZ)) for one in (arm().compile(), heavier))
    assert first is second


@pytest.mark.parametrize("compiled", [arm().compile(), limited(0.5), limited(0.7)])
def test_rows_are_those_of_the_model_whatever_was_asked_before(compiled) -> None:
    laid, hold = LaidInputs(FORCE, RATE_HZ), hold_of(compiled, RATE_HZ)
    for limit in np.linspace(0.1, 1.0, 12):
        laid.rows(limited(limit), hold_of(limited(limit), RATE_HZ))
    expected = input_rows(compiled, hold, FORCE, RATE_HZ, extra=0)
    np.testing.assert_array_equal(laid.rows(compiled, hold), expected)
    np.testing.assert_array_equal(laid.rows(compiled, hold), expected)


@pytest.mark.parametrize("hold", ["zoh", "foh", "band_limited"])
def test_parts_of_steps_carry_the_states_where_whole_ones_do(hold) -> None:
    compiled = arm().compile().with_holds({"shaker": hold})
    laid, layout = LaidInputs(FORCE, RATE_HZ), hold_of(compiled, RATE_HZ)
    ends = []
    for parts in (1, 4):
        step = responses(
            compiled.a, layout.spread(compiled.b), np.zeros((len(compiled.a), 0)), layout,
            step_s=1 / (RATE_HZ * parts), kink_at=layout.kink_at, fractions=np.ones(1),
        )[0].state  # fmt: skip
        rows = laid.rows(compiled, layout, parts)
        states = np.zeros((len(rows), len(compiled.a)))
        linear_march(np.ascontiguousarray(step.T), rows, states)
        ends.append(states[::parts])
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9 * np.abs(ends[0]).max())


def test_parts_of_steps_run_along_the_same_lines() -> None:
    compiled = arm().compile()
    laid, hold = LaidInputs(FORCE, RATE_HZ), hold_of(arm().compile(), RATE_HZ)
    whole, parts = laid.rows(compiled, hold), laid.rows(compiled, hold, 4)
    np.testing.assert_allclose(parts[::4, 0], whole[:, 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(parts[2:-1:4, 0], (whole[:-1, 0] + whole[1:, 0]) / 2, rtol=0, atol=1e-12)
