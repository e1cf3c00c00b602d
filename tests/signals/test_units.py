"""Units from people and logs to SI."""

import subprocess
import sys

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.errors import SetupError
from chladni.signals.units import (
    SI_SYMBOLS,
    differentiated,
    integrated,
    parse_quantity,
    power,
    power_density_unit,
    product,
    quotient,
    si_factor,
)
from tests.strategies import si_units, user_units

# Ground truth by definition (SI brochure; international yard and pound; CGPM 1901), not by our own table.
G = 9.80665
INCH = 0.0254
POUND_FORCE = 0.45359237 * G


@pytest.fixture(scope="module")
def oracle() -> pint.UnitRegistry:
    """Stock pint, with g as gravity."""
    registry: pint.UnitRegistry = pint.UnitRegistry(on_redefinition="ignore")
    registry.define("g = 9.80665 * meter / second ** 2")
    return registry


def in_stock_pint(text: str, oracle: pint.UnitRegistry) -> pint.Quantity:
    for ours, theirs in (("kg", "kilogram"), ("²", "**2"), ("m/s2", "m/s**2"), ("^", "**"), ("%", "percent")):
        text = text.replace(ours, theirs)
    return oracle.Quantity(1.0, text if text != "1" else "")


@pytest.mark.parametrize(
    ("unit", "factor", "si_unit"),
    [
        ("g", G, "m/s^2"),
        ("mg", G * 1e-3, "m/s^2"),
        ("ug", G * 1e-6, "m/s^2"),
        ("gn", G, "m/s^2"),
        ("m/s2", 1.0, "m/s^2"),
        ("m/s^2", 1.0, "m/s^2"),
        ("m/s²", 1.0, "m/s^2"),
        ("m/s**2", 1.0, "m/s^2"),
        ("Gal", 1e-2, "m/s^2"),
        ("mm/s^2", 1e-3, "m/s^2"),
        ("mm/s", 1e-3, "m/s"),
        ("in/s", INCH, "m/s"),
        ("ips", INCH, "m/s"),
        ("in/s^2", INCH, "m/s^2"),
        ("ft", 12 * INCH, "m"),
        ("mil", INCH * 1e-3, "m"),
        ("km/h", 1 / 3.6, "m/s"),
        ("N", 1.0, "N"),
        ("kN", 1e3, "N"),
        ("mN", 1e-3, "N"),
        ("lbf", POUND_FORCE, "N"),
        ("kgf", G, "N"),
        ("daN", 10.0, "N"),
        ("L/min", 1e-3 / 60, "m^3/s"),
        ("kg", 1.0, "kg"),
        ("lb", 0.45359237, "kg"),
        ("V", 1.0, "V"),
        ("mV", 1e-3, "V"),
        ("uV", 1e-6, "V"),
        ("µV", 1e-6, "V"),
        ("μV", 1e-6, "V"),
        ("kΩ", 1e3, "ohm"),
        ("Pa", 1.0, "Pa"),
        ("hPa", 1e2, "Pa"),
        ("kPa", 1e3, "Pa"),
        ("MPa", 1e6, "Pa"),
        ("bar", 1e5, "Pa"),
        ("psi", POUND_FORCE / INCH**2, "Pa"),
        ("deg", 0.017453292519943295, "rad"),
        ("rad", 1.0, "rad"),
        ("deg/s", 0.017453292519943295, "rad/s"),
        ("°/s", 0.017453292519943295, "rad/s"),
        ("deg/s^2", 0.017453292519943295, "rad/s^2"),
        ("rpm", 0.10471975511965977, "rad/s"),
        ("Hz", 1.0, "Hz"),
        ("kHz", 1e3, "Hz"),
        ("mA", 1e-3, "A"),
        ("ms", 1e-3, "s"),
        ("min", 60.0, "s"),
        ("T", 1.0, "T"),
        ("K", 1.0, "K"),
        ("°C", 1.0, "degC"),
        ("%", 1e-2, "1"),
        ("", 1.0, "1"),
        ("1", 1.0, "1"),
        ("mV/g", 1e-3 / G, "V/(m/s^2)"),
        ("pC/N", 1e-12, "C/N"),
        ("N s/m", 1.0, "N s/m"),
        ("kN/mm", 1e6, "N/m"),
        ("N m", 1.0, "N m"),
        ("V/(m/s^2)", 1.0, "V/(m/s^2)"),
        ("g^2/Hz", G**2, "(m/s^2)^2/Hz"),
        ("meters", 1.0, "m"),
        ("volts", 1.0, "V"),
        ("Nm", 1.0, "N m"),
        ("kNm", 1e3, "N m"),
        ("Ns", 1.0, "N s"),
        ("mAh", 3.6, "A s"),
        ("ms^-2", 1.0, "m/s^2"),
        ("mms^-1", 1e-3, "m/s"),
        ("mV/ms^-2", 1e-3, "V/(m/s^2)"),
        ("Gs", G, "m/s^2"),
        ("deg C", 1.0, "degC"),
        ("dps", 0.017453292519943295, "rad/s"),
        ("gauss", 1e-4, "T"),
    ],
)
def test_si_factor(unit: str, factor: float, si_unit: str) -> None:
    found, text = si_factor(unit)
    assert text == si_unit
    assert found == pytest.approx(factor, rel=4e-16 * 4)  # a few roundings


@given(user_units)
def test_canonical_units_are_their_own(unit: str) -> None:
    _, text = si_factor(unit)
    assert si_factor(text) == (1.0, text)


@pytest.mark.parametrize("symbol", sorted(SI_SYMBOLS))
def test_si_symbols_stand_for_themselves_in_the_registry_too(symbol: str) -> None:
    # A prefix goes through the definition file, so this compares the file with the list in the module.
    factor, text = si_factor(f"m{symbol}" if symbol not in {"kg", "degC"} else symbol)
    assert text == symbol
    assert factor == (1e-3 if symbol not in {"kg", "degC"} else 1.0)


# Not "mil": stock pint takes it for an angle.
COMMON = "g mg m/s2 in/s ft lbf psi bar rpm deg/s kN/mm mV/g N*s/m % uT pC/N hour km/hour slug ounce_force atm ppm"


@pytest.mark.parametrize("unit", COMMON.split())
def test_factor_and_dimension_agree_with_stock_pint(unit: str, oracle: pint.UnitRegistry) -> None:
    factor, text = si_factor(unit)
    stock = in_stock_pint(unit, oracle).to_base_units()
    ours = (factor * in_stock_pint(text.replace(" ", "*"), oracle)).to_base_units()
    assert ours.dimensionality == stock.dimensionality
    assert ours.magnitude == pytest.approx(stock.magnitude, rel=1e-9)  # pint's psi has ten digits


@given(a=si_units, b=si_units)
def test_quotient_undoes_product(a: str, b: str) -> None:
    back = quotient(product(a, b), b)
    registry = pint.application_registry
    dimension = [registry.parse_units(text.replace("^", "**").replace(" ", "*")) for text in (back, a)]
    assert dimension[0].dimensionality == dimension[1].dimensionality
    assert product(a, b) == product(b, a)
    assert quotient(a, a) == "1"


@given(unit=user_units, number=st.floats(-1e9, 1e9, allow_subnormal=False))
def test_a_quantity_is_its_number_times_the_factor(unit: str, number: float) -> None:
    factor, text = si_factor(unit)
    value, found = parse_quantity(f"{number!r} {unit}")
    assert found == text
    assert value == number * factor


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("100 mV/g", 0.1 / G, "V/(m/s^2)"),
        ("50 g", 50 * G, "m/s^2"),
        ("3g", 3 * G, "m/s^2"),
        ("1.2 kN/mm", 1.2e6, "N/m"),
        ("-3 N", -3.0, "N"),
        ("+.5 s", 0.5, "s"),
        ("5.", 5.0, "1"),
        ("1.2e6", 1.2e6, "1"),
        ("10V", 10.0, "V"),
    ],
)
def test_parse_quantity(text: str, value: float, unit: str) -> None:
    found = parse_quantity(text)
    assert found[1] == unit
    assert found[0] == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["", "N", "inf N", "nan", "1e999 N", "1..2 N", "1 N\n2 N", "- 3 N"])
def test_a_quantity_without_a_finite_number_is_refused(text: str) -> None:
    with pytest.raises(SetupError, match="finite number"):
        parse_quantity(text)


def test_a_quantity_that_overflows_is_refused() -> None:
    with pytest.raises(SetupError, match="too large"):
        parse_quantity("1e308 kN")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("1,2 N", "can't be read"),
        ("5e", "'e': not known"),
        ("0x10 N", "'x': not known"),
        ("1 2 N", "where a symbol is due"),
        ("10 NK", "near: N K"),
    ],
)
def test_a_quantity_with_a_wrong_unit_names_it(text: str, word: str) -> None:
    with pytest.raises(SetupError, match="unit") as caught:
        parse_quantity(text)
    assert word in str(caught.value)


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("NK", ("'NK'", "near: N K")),
        ("AK", ("near: A K",)),
        ("Gm", ("'Gm'",)),
        ("hg", ("'hg'",)),
        ("cV", ("'cV'",)),
        ("hz", ("'hz'", "Hz")),
        ("Mpa", ("MPa",)),
        ("metr", ("metre",)),
        ("xyzzy", ("'xyzzy'", "not known; units look like")),
        ("dB", ("logarithmic",)),
        ("degF", ("offset",)),
        ("gram", ("gravity",)),
        ("mV/foo", ("'foo'",)),
        ("km^99", ("1e150",)),
    ],
)
def test_an_unknown_unit_is_named_with_near_matches(unit: str, words: tuple[str, ...]) -> None:
    with pytest.raises(SetupError, match="unit") as caught:
        si_factor(unit)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.text(max_size=40))
def test_any_text_is_a_unit_or_a_setup_error(text: str) -> None:
    try:
        factor, canonical = si_factor(text)
    except SetupError:
        return
    assert factor > 0
    assert si_factor(canonical) == (1.0, canonical)


def test_densities() -> None:
    assert power_density_unit("m/s^2") == "(m/s^2)^2/Hz"
    assert power_density_unit("N") == "N^2/Hz"
    assert power_density_unit("1") == "1/Hz"
    assert power("m/s", 3) == "(m/s)^3"


@pytest.mark.parametrize(
    "chain", [("m/s^2", "m/s", "m"), ("rad/s^2", "rad/s", "rad"), ("(m/s^2)/N", "(m/s)/N", "m/N")]
)
def test_integration_and_differentiation_step_through_motion(chain: tuple[str, str, str]) -> None:
    assert [integrated(unit) for unit in chain[:2]] == list(chain[1:])
    assert [differentiated(unit) for unit in chain[:0:-1]] == list(chain[1::-1])
    with pytest.raises(SetupError, match="can't be integrated"):
        integrated(chain[2])


@pytest.mark.parametrize("unit", ["V", "N", "1", "(m/s^2)^2/Hz", "V/(m/s^2)", "m/s^6"])
def test_what_is_no_motion_has_no_derivative(unit: str) -> None:
    with pytest.raises(SetupError, match="can't be differentiated"):
        differentiated(unit)


def test_si_units_never_load_pint() -> None:
    code = (
        "import sys; from chladni.signals.units import *; si_factor('(m/s^2)/N'); power_density_unit('V'); "
        "assert 'pint' not in sys.modules; si_factor('g'); assert 'pint' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
