"""Roots against closed forms, where Newton's steps do well and where they fail."""

from collections.abc import Callable
from math import cos, inf, pi, sin, tanh

import pytest

from chladni.models.analysis.bracketed_root import MOST_STEPS, bracketed_root


def found(
    measure: Callable[[float], tuple[float, float]], low: float, high: float, **more: float
) -> tuple[float, int]:
    calls = []

    def counted(x: float) -> tuple[float, float]:
        calls.append(x)
        assert low <= x <= high
        return measure(x)

    below = measure(low)[0] < 0
    guess = more.get("guess", 0.5 * (low + high))
    root = bracketed_root(
        counted, low, high, begins_below=below, guess=guess, rounding=more.get("rounding", 1e-16 * abs(high))
    )
    return root, len(calls)


def test_a_smooth_signal_takes_a_few_steps() -> None:
    root, calls = found(lambda x: (cos(x), -sin(x)), 1.0, 2.0)
    assert root == pytest.approx(pi / 2, rel=4e-16)
    # Five digits doubled three times are all that a double has.
    assert calls <= 5


@pytest.mark.parametrize(
    ("measure", "low", "high", "expected"),
    [
        # Newton's steps alone would go to infinity from the ends of a tanh, and swing for ever about a square root.
        (lambda x: (tanh(20 * (x - 0.3)), 20 * (1 - tanh(20 * (x - 0.3)) ** 2)), -5.0, 5.0, 0.3),
        (lambda x: (abs(x) ** 0.5 * (1 if x > 0 else -1), 0.5 * abs(x) ** -0.5 if x else inf), -1.0, 2.0, 0.0),
        # A jump: the slope on both sides says nothing.
        (lambda x: (-1.0 if x < 0.7 else 1.0, 0.0), 0.0, 1.0, 0.7),
        # A slope of the wrong sign.
        (lambda x: (x - 0.4, -1.0), 0.0, 1.0, 0.4),
    ],
)
def test_it_stays_inside_and_arrives_where_newton_fails(
    measure: Callable[[float], tuple[float, float]], low: float, high: float, expected: float
) -> None:
    root, calls = found(measure, low, high)
    assert root == pytest.approx(expected, abs=1e-14)
    assert calls < MOST_STEPS


def test_a_triple_root_is_not_taken_for_found_too_early() -> None:
    # Steps shrink by a third only each time, however small they are.
    root, _ = found(lambda x: ((x - 1) ** 3, 3 * (x - 1) ** 2), 0.0, 3.0, guess=1.5)
    assert root == pytest.approx(1.0, abs=1e-14)


def test_a_falling_signal_and_a_root_at_the_guess() -> None:
    assert found(lambda x: (2 - x * x, -2 * x), 0.0, 4.0)[0] == pytest.approx(2**0.5, rel=4e-16)
    assert found(lambda x: (x, 1.0), -1.0, 2.0, guess=0.0) == (0.0, 1)
