"""Labels beside measured values: a table of who writes them so, what context settles, what is refused and why."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.unit_labels import LABELS, UnitLabel, verdict
from chladni.signals.errors import SetupError
from chladni.signals.unit_labels import quantity_of_name, read_label, same_quantity
from chladni.signals.units import si_factor
from tests.strategies import si_units, user_units

G = 9.80665
POUND_FORCE = 0.45359237 * G


@pytest.mark.parametrize("label", LABELS, ids=lambda label: f"{label.text}-{label.quantity}")
def test_no_label_is_read_by_the_letter(label: UnitLabel) -> None:
    assert verdict(label) != "wrong"


def test_of_the_labels_nearly_all_are_read() -> None:
    assert len(LABELS) >= 80
    assert len({(label.text, label.quantity) for label in LABELS}) == len(LABELS)
    counts = Counter(map(verdict, LABELS))
    assert counts["refused"] <= 0.05 * len(LABELS)


@pytest.mark.parametrize(
    ("label", "quantity", "factor", "unit"),
    [
        ("G", "m/s^2", G, "m/s^2"),
        ("G", "T", 1e-4, "T"),
        ("Gs", None, G, "m/s^2"),
        ("Gs", "T", 1e-4, "T"),
        ("mG", "m/s^2", 1e-3 * G, "m/s^2"),
        ("lb", "N", POUND_FORCE, "N"),
        ("lb", "kg", 0.45359237, "kg"),
        ("kg", "N", G, "N"),
        ("kg", "kg", 1.0, "kg"),
        ("t", "N", 1000 * G, "N"),
        ("nm", "N m", 1.0, "N m"),
        ("nm", "m", 1e-9, "m"),
        ("C", "degC", 1.0, "degC"),
        ("C", "C", 1.0, "C"),
        ("C/N", None, 1.0, "C/N"),
        ("gal", "m/s^2", 0.01, "m/s^2"),
        ("g/lb", "(m/s^2)/N", G / POUND_FORCE, "(m/s^2)/N"),
        ("NM", "N m", 1.0, "N m"),
        ("MPA", "Pa", None, None),
        ("kg (m/s^2)", "N", 1.0, "N"),
        ("J/m", "N", 1.0, "N"),
        ("1/kg", "(m/s^2)/N", 1.0, "(m/s^2)/N"),
    ],
)
def test_what_the_values_are_settles_what_a_label_means(
    label: str, quantity: str | None, factor: float | None, unit: str | None
) -> None:
    if factor is None:
        with pytest.raises(SetupError, match="it may be mPa or MPa"):
            read_label(label, quantity=quantity)
        return
    found = read_label(label, quantity=quantity)
    assert found[1] == unit
    assert found[0] == pytest.approx(factor, rel=1e-15)


def test_a_label_of_another_quantity_keeps_its_meaning() -> None:
    # Which of the two is right is for who knows the file to say.
    assert read_label("V", quantity="m/s^2") == (1.0, "V")
    assert read_label("m/s", quantity="m/s^2") == (1.0, "m/s")
    assert read_label("kg", quantity="m/s^2") == (1.0, "kg")


@pytest.mark.parametrize(
    ("label", "word"),
    [
        ("G", "it may be g or gauss; write which"),
        ("mG", "mg or mgauss"),
        ("lb", "lbf or lbm"),
        ("lb/in", "lbf/in or lbm/in"),
        ("C", "degC or C"),
        ("NM", "Nm or nm"),
        ("EU", "whatever unit the sensor was set up in"),
        ("mV/EU", "whatever unit"),
        ("dB(A)", "logarithmic"),
        ("db", "logarithmic"),
        ("F", "offset"),
        ("°F", "offset"),
        ("g/cm^3", "never gram"),
        ("g mm", "never gram"),
        ("g/s", "never gram"),
        ("m/s*s", "once or twice"),
        ("S", "not known"),
        ("Mg", "not known"),
        ("pS", "not known"),
        ("mm Hg", "not known"),
        ("gallon (US)", "not known"),
        ("furlong", "'furlong'"),
        ("\x00g\x01", "can't be read"),
        ("m" * 200, "at most 100"),
    ],
)
def test_what_a_label_leaves_open_is_refused_in_one_line(label: str, word: str) -> None:
    with pytest.raises(SetupError, match="unit") as caught:
        read_label(label)
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_slip_is_mended_only_where_the_quantity_confirms_it() -> None:
    for slip in ("ms2", "ms^2", "m/s^-2", "m/s⁻²", "m/s*s"):
        assert read_label(slip, quantity="m/s^2") == (1.0, "m/s^2")
        for quantity in (None, "N"):
            with pytest.raises(SetupError):
                read_label(slip, quantity=quantity)


@given(user_units)
def test_labels_that_are_units_mean_what_they_say(unit: str) -> None:
    factor, text = si_factor(unit)
    assert read_label(unit) == (factor, text)
    assert read_label(unit, quantity=text) == (factor, text)


@given(st.text(max_size=40), st.none() | si_units)
def test_any_text_is_a_unit_or_a_setup_error(text: str, quantity: str | None) -> None:
    try:
        factor, unit = read_label(text, quantity=quantity)
    except SetupError:
        return
    assert factor > 0
    assert si_factor(unit) == (1.0, unit)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("N", "kg (m/s^2)", True),
        ("Pa", "N/m^2", True),
        ("V", "W/A", True),
        ("ohm", "V/A", True),
        ("J", "N m", True),
        ("T", "V s/m^2", True),
        ("F", "C/V", True),
        ("rad/s", "1/s", False),
        ("degC", "K", False),
        ("m/s^2", "m/s", False),
        ("(m/s^2)/N", "1/kg", True),
    ],
)
def test_quantities_are_compared_by_dimension(one: str, other: str, same: bool) -> None:
    assert same_quantity(one, other) is same
    assert same_quantity(other, one) is same


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("acc_x", "m/s^2"),
        ("AccX", "m/s^2"),
        ("Acceleration 3", "m/s^2"),
        ("a", "m/s^2"),
        ("hammer", "N"),
        ("Fz", "N"),
        ("magnetometer.y", "T"),
        ("Temp1", "degC"),
        ("channel 1", None),
        ("force acceleration", None),
        ("", None),
    ],
)
def test_a_name_may_say_what_is_measured(name: str, quantity: str | None) -> None:
    assert quantity_of_name(name) == quantity
