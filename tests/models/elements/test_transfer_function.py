from math import inf, nan

import numpy as np
import pytest

from chladni.models.elements.transfer_function import MAX_ORDER, TransferFunction
from chladni.signals.errors import ModelError


def test_leading_zeros_are_dropped_and_numbers_kept() -> None:
    transfer = TransferFunction(num=(0, 0, 3), den=(0.0, 2, 1))
    assert (transfer.num, transfer.den) == ((3.0,), (2.0, 1.0))
    assert TransferFunction(num=(0, 0)).num == (0.0,)


@pytest.mark.parametrize(
    ("num", "den", "order", "relative_degree", "proper"),
    [
        ((1,), (1, 1), 1, 1, True),
        ((1, 2), (1, 1), 1, 0, True),
        ((1, 0, 0), (1, 1), 1, -1, False),
        ((0,), (1, 1), 1, 0, True),
    ],
)
def test_degrees(
    num: tuple[float, ...], den: tuple[float, ...], order: int, relative_degree: int, proper: bool
) -> None:
    transfer = TransferFunction(num=num, den=den)
    assert (transfer.order, transfer.relative_degree, transfer.proper) == (order, relative_degree, proper)


def test_poles_and_zeros_are_roots() -> None:
    transfer = TransferFunction(num=(2.0, 6.0), den=tuple(np.poly([-1.0, -2 + 3j, -2 - 3j]).real))
    np.testing.assert_allclose(transfer.zeros(), [-3.0])
    np.testing.assert_allclose(
        np.sort_complex(transfer.poles()), np.sort_complex([-1.0, -2 + 3j, -2 - 3j]), rtol=1e-12
    )


def test_a_dead_time_turns_the_phase_and_nothing_else() -> None:
    frequency_hz = np.linspace(0.1, 5.0, 50)
    found = TransferFunction(num=(2,), delay_s=0.3).frequency_response(frequency_hz)
    np.testing.assert_allclose(found, 2 * np.exp(-2j * np.pi * frequency_hz * 0.3), rtol=1e-13)


@pytest.mark.parametrize(
    ("num", "den", "gain"),
    [
        ((3, 4), (5, 2), 2.0),
        ((3, 4), (5, 0), inf),
        ((-3, -4), (5, 0), -inf),
        ((3, 0), (5, 0), 0.6),
        ((3, 0), (5, 1), 0.0),
        ((1,), (1, 0, 0), inf),
        ((0,), (1, 1), 0.0),
    ],
)
def test_static_gain(num: tuple[float, ...], den: tuple[float, ...], gain: float) -> None:
    assert TransferFunction(num=num, den=den).static_gain() == gain


def test_a_pole_on_the_axis_answers_infinitely() -> None:
    found = TransferFunction(num=(1,), den=(1, 0)).frequency_response(np.array([0.0, 1.0]))
    assert np.isinf(found[0].real)
    assert np.isfinite(found[1])


def test_polynomial_and_rest_add_up() -> None:
    transfer = TransferFunction(num=(2, 3, 4, 5), den=(1, 2))
    quotient, rest = transfer.polynomial_and_rest()
    np.testing.assert_allclose(np.polyadd(np.polymul(quotient, transfer.den), rest), transfer.num)


def test_filter_adds_just_the_lags_that_are_missing() -> None:
    improper = TransferFunction(num=(1, 0, 0), den=(1, 1), delay_s=0.1)
    filtered = improper.filtered(0.01)
    np.testing.assert_allclose(filtered.den, (0.01, 1.01, 1))
    assert filtered.relative_degree == 0
    assert filtered.delay_s == 0.1
    proper = TransferFunction(num=(1, 0), den=(1, 1))
    assert proper.filtered(0.01) == proper


def test_series_multiplies_responses_and_adds_dead_times() -> None:
    first, second = TransferFunction(num=(1, 2), den=(3, 4), delay_s=0.1), TransferFunction(num=(5,), delay_s=0.2)
    f = np.array([0.3, 2.0])
    found = (first * second).frequency_response(f)
    np.testing.assert_allclose(found, first.frequency_response(f) * second.frequency_response(f), rtol=1e-13)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"num": ()}, r"num = \[\]; give finite numbers"),
        ({"num": (1, nan)}, "num = .* give finite numbers"),
        ({"num": (1,), "den": (inf,)}, "den = .* give finite numbers"),
        ({"num": (1,), "den": (0, 0)}, "den is zero"),
        ({"num": (1,), "delay_s": -0.1}, "delay_s = -0.1"),
        ({"num": (1,), "delay_s": inf}, "delay_s = inf"),
        ({"num": (1,), "den": (1,) * (MAX_ORDER + 2)}, "order 41; at most 40"),
    ],
)
def test_impossible_ones_are_refused(parts: dict[str, object], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        TransferFunction(**parts)


@pytest.mark.parametrize("time_s", [0.0, -1.0, nan, inf])
def test_impossible_filters_are_refused(time_s: float) -> None:
    with pytest.raises(ModelError, match="filter time constant"):
        TransferFunction(num=(1, 0)).filtered(time_s)
