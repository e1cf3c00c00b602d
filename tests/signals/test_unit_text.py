"""Algebra on the text of units."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.errors import SetupError
from chladni.signals.unit_text import combined, in_unit, read, symbol_as_written, with_unit, write

SYMBOLS = ("m", "s", "rad", "N", "V", "kg", "Hz")
factors = st.tuples(st.sampled_from(SYMBOLS), st.integers(-4, 4))


def written(text: str) -> str:
    return write(read(text, symbol_as_written)[1])


def text_of(parts: list[tuple[str, int]]) -> str:
    return "*".join(f"{symbol}^{power}" for symbol, power in parts) or "1"


def exponents_of(text: str) -> dict[str, int]:
    """Exponent of each symbol, motion taken apart: the physics of a text, whatever its form."""
    total: dict[str, int] = {}
    for (symbol, per_second), power in read(text, symbol_as_written)[1].items():
        total[symbol] = total.get(symbol, 0) + power
        total["s"] = total.get("s", 0) - per_second * power
    return {symbol: power for symbol, power in total.items() if power}


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("", "1"),
        ("1", "1"),
        ("1/s", "1/s"),
        ("m s^-2", "m/s^2"),
        ("m/s2", "m/s^2"),
        ("m/s**2", "m/s^2"),
        ("m·s⁻²", "m/s^2"),
        ("m/s/s", "m/s^2"),
        ("(m/s^2)/N", "(m/s^2)/N"),
        ("m/s^2/N", "(m/s^2)/N"),
        ("(m/s^2)^2/Hz", "(m/s^2)^2/Hz"),
        ("m^2/s^4/Hz", "(m/s^2)^2/Hz"),
        ("m^2/s^3", "m^2/s^3"),
        ("V/(m/s^2)", "V/(m/s^2)"),
        ("m N", "N m"),
        ("s*N/m", "N s/m"),
        ("N/(m/s)", "N/(m/s)"),
        ("m/(V A)", "m/(A V)"),
        ("kg m/s^2", "kg (m/s^2)"),
        ("m/s*s", "m"),
        ("(m/s^2)/(rad/s)", "(m/s^2)/(rad/s)"),
        ("N/N", "1"),
        ("  N   m  ", "N m"),
        ("1/((m/s) (rad/s))", "1/((m/s) (rad/s))"),
        ("1/(m/s)*s", "1/(m/s^2)"),
        ("m/s^2*(1/m)*m/m", "(m/s^2)/m"),
        ("(m/s)^2/m^2*m^2/(m/s)", "m/s"),
        ("ms^-2", "m/s^2"),
        ("ms-2", "m/s^2"),
        ("m s-2", "m/s^2"),
        ("m.s^-2", "m/s^2"),
        ("m s⁻²", "m/s^2"),
        ("m·s−2", "m/s^2"),
        ("rads-1", "rad/s"),
        ("N/ms^-1", "N/(m/s)"),
        ("m/s^{2}", "m/s^2"),
        ("m/s^(2)", "m/s^2"),
        ("m per s squared", "m/s^2"),
        ("N per square m", "N/m^2"),
        ("cubic m per s", "m^3/s"),
        ("N-m", "N m"),
        ("N.m", "N m"),
        ("A./s", "A/s"),
        ("Vs^-1", "1/Vs"),
    ],
)
def test_canonical_text(text: str, canonical: str) -> None:
    assert written(text) == canonical


@given(st.lists(factors, max_size=5))
def test_canonical_text_is_a_fixed_point_with_the_same_physics(parts: list[tuple[str, int]]) -> None:
    once = written(text_of(parts))
    assert written(once) == once
    expected: dict[str, int] = {}
    for symbol, power in parts:
        expected[symbol] = expected.get(symbol, 0) + power
    assert exponents_of(once) == {symbol: power for symbol, power in expected.items() if power}


@given(st.lists(factors, max_size=4), st.lists(factors, max_size=4))
def test_a_quotient_undoes_a_product(left: list[tuple[str, int]], right: list[tuple[str, int]]) -> None:
    a, b = (read(text_of(parts), symbol_as_written) for parts in (left, right))
    both = combined(a, b)
    assert write(both[1]) == write(combined(b, a)[1]), "a product is the same either way round"
    assert exponents_of(write(combined(both, b, power=-1)[1])) == exponents_of(text_of(left))


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("m)", "no place"),
        ("(m", "not closed"),
        ("((((((((((m", "not closed"),
        ("m//s", "'/' where a symbol"),
        ("/s", "'/' where a symbol"),
        ("m/", "its end"),
        ("()", "')' where a symbol"),
        ("m 2", "'2' where a symbol"),
        ("2", "'2' where a symbol"),
        ("N/m s", "ambiguous"),
        ("m^", "can't be read"),
        ("m/s^-2", "divides twice"),
        ("m/s-2", "divides twice"),
        ("ms^2", "may be meant as m/s^2"),
        ("ms2", "may be meant as m/s^2"),
        ("m0", "'0' where a symbol"),
        ("m^m", "can't be read"),
        ("9.8 m", "can't be read"),
        ("__import__('os')", "can't be read"),
        ("m^999999999", "go to 99"),
        ("m^" + "9" * 80, "go to 99"),
        ("(m^99)^99", "go to 99"),
        ("m" * 101, "at most 100"),
    ],
)
def test_text_that_is_no_unit_is_refused_in_one_line(text: str, word: str) -> None:
    with pytest.raises(SetupError, match="unit") as caught:
        written(text)
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.text(max_size=120))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        canonical = written(text)
    except SetupError:
        return
    assert written(canonical) == canonical


def test_scales_multiply_and_stay_bounded() -> None:
    kilo = (1e3, {("N", 0): 1})
    assert combined(kilo, kilo, power=-1) == (1.0, {})
    assert combined((1.0, {}), kilo, power=2) == (1e6, {("N", 0): 2})
    with pytest.raises(SetupError, match="1e150"):
        combined((1.0, {}), kilo, power=99)
    with pytest.raises(SetupError, match="1e150"):
        combined((1.0, {}), (1e-12, {("N", 0): 1}), power=-99)


@pytest.mark.parametrize(("unit", "amount", "place"), [("N", "3 N", "in N"), ("1", "3", "without unit")])
def test_people_read_no_unit_where_there_is_none(unit: str, amount: str, place: str) -> None:
    assert (with_unit("3", unit), in_unit(unit)) == (amount, place)
