"""Numbers with units, and the units that effects have at their sites."""

import pytest

from chladni.models.files.quantity import dimension, number
from chladni.models.files.site_units import SiteUnits
from chladni.signals.errors import ModelError


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (3, "N/m", 3.0),
        ("1.2 kN/mm", "N/m", 1.2e6),
        ("2 kg/s^2", "N/m", 2.0),
        ("3 N m", "N m/rad", 3.0),
        ("5 %", "1", 0.05),
        ("12 ms", "s", 0.012),
        ("3 W/A", "V", 3.0),
        ("3 zz", None, None),
        ("3 J", None, 3.0),
    ],
)
def test_numbers_in_si(value: float | str, unit: str | None, expected: float | None) -> None:
    if expected is None:
        with pytest.raises(ModelError, match="'zz'"):
            number(value, unit)
    else:
        assert number(value, unit) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (
            "3 kg",
            "N/m",
            "found '3 kg', which is in kg; must be a number in N/m, or text with a unit such as '2.5 N/m'",
        ),
        ("3", "N/m", "found '3', which is without unit; must be a number in N/m"),
        ("3 N", "1", "found '3 N', which is in N; must be a plain number, or a share such as '5 %'"),
        # Turns and radians a second differ by 2 pi, so one isn't taken for the other.
        ("2 rad/s", "Hz", "which is in rad/s; must be a number in Hz"),
        (float("nan"), "N", "found nan; must be finite"),
        (10**400, "N", "must be finite"),
        ("much", "N", "begins with no finite number"),
    ],
)
def test_numbers_that_are_none(value: float | str, unit: str, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        number(value, unit)
    assert words in str(caught.value)


def test_dimensions_know_what_derived_units_are_made_of() -> None:
    for left, right in (("V", "W/A"), ("N m", "J"), ("Pa", "N/m^2"), ("ohm", "V/A"), ("C", "A s"), ("F", "C/V"),
                        ("T", "V s/m^2"), ("N", "kg m/s^2"), ("rad/s", "1/s")):  # fmt: skip
        assert dimension(left) == dimension(right), (left, right)
    assert dimension("N") != dimension("kg")
    assert dimension("Hz") != dimension("1/s")


@pytest.mark.parametrize(
    ("site", "declared", "expected"),
    [
        (SiteUnits(), "N s^2/m^2", "N s^2/m^2"),
        (SiteUnits(force="N m", displacement="rad"), "N/m^3", "N m/rad^3"),
        (SiteUnits(force="N m", displacement="rad"), "m/s^2", "rad/s^2"),
        (SiteUnits(force="m^3/s"), "N/s", "(m^3/s)/s"),
        (SiteUnits(force="V", signal="V"), "m/s^2", "V"),
        (SiteUnits(force="V", signal="V"), "Hz", "Hz"),
    ],
)
def test_units_follow_the_site(site: SiteUnits, declared: str, expected: str) -> None:
    assert site.of(declared) == expected
    dimension(site.of(declared))
