"""Numbers as engineers write them: prefixes, digits that the uncertainty allows, percents."""

import re
from math import floor, isfinite, log10

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.unit_text import printed_unit
from chladni.signals.wording import with_sigma

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 3: "k", 6: "M", 9: "G", 12: "T"}
# Between these a number is read as easily without a prefix.
PLAIN_FROM, PLAIN_TO = 0.1, 1e4
# From here on three digits round to an exponent.
LAST_WITH_POINT = 999.5
# Units that take prefixes, when they stand first and without an exponent. Not kg: mkg is no unit, and g is gravity.
_FIRST = re.compile(r"(m|s|N|Hz|V|A|Pa|rad|W|J)(?![A-Za-z^])")
SURE = 0.99
NOTHING = 5e-8
# Such as the error of a model that diverges.
UNKNOWN = "not known"


def engineering(value: float, std: float | None, unit: str) -> str:
    """Print a quantity with one sigma, to the digits that sigma deserves, with a prefix where it helps.

    Parameters
    ----------
    value, std
        In `unit`; a `std` that isn't known or is zero is left out.
    unit
        SI text; ``1`` for pure numbers.

    Examples
    --------
    >>> engineering(8.1234, 0.21, "N"), engineering(2.004e-4, 3.1e-6, "m"), engineering(6.1e5, None, "N/m")
    ('8.12 ± 0.21 N', '200.4 ± 3.1 µm', '610 kN/m')
    >>> engineering(1.2e9, 4e8, "N/m^3"), engineering(0.925, 0.011, "1"), engineering(0.0312, None, "kg")
    ('1.20 ± 0.40 GN/m³', '0.925 ± 0.011', '0.0312 kg')
    >>> engineering(8000.0, None, "N s/m"), engineering(5.3e-6, None, "kg")
    ('8000 N s/m', '5.3e-06 kg')
    """
    scale, prefix = _prefix(value, unit)
    shown = f"{prefix}{printed_unit(unit)}" if unit != "1" else ""
    number = _number(value / scale, None if std is None else std / scale)
    # An exponent would read as that of the uncertainty alone, and a bare sum as divided by the unit's last part.
    return f"({number}) {shown}" if "e" in number and "±" in number and shown else f"{number} {shown}".rstrip()


def span(low: float, high: float, unit: str) -> str:
    """Print a range with one prefix and one unit, which is left out where it isn't known.

    Examples
    --------
    >>> span(-0.0147, 1.2e-4, "m"), span(-0.01, 0.01, "")
    ('-14.7 to 0.12 mm', '-0.01 to 0.01')
    """
    scale, prefix = _prefix(max(abs(low), abs(high)), unit)
    return f"{_digits(low / scale)} to {_digits(high / scale)} {prefix}{printed_unit(unit)}".rstrip()


def axis_scale(values: Real, unit: str) -> tuple[float, str]:
    """Give the scale of an axis and its printed unit, so that the largest of its numbers is easily read.

    Examples
    --------
    >>> axis_scale(np.array([0.0, -2.1e-4]), "m")
    (1e-06, 'µm')
    """
    scale, prefix = _prefix(float(np.max(np.abs(values), initial=0.0)), unit)
    return scale, f"{prefix}{printed_unit(unit)}"


def percent(share: float) -> str:
    """Print a share with two digits, near the whole with three.

    Examples
    --------
    >>> percent(0.4123), percent(0.00998), percent(0.00123), percent(0.9953), percent(0.0)
    ('41 %', '1.0 %', '0.12 %', '99.5 %', '0 %')
    """
    if not isfinite(share):
        return UNKNOWN
    if abs(share) < NOTHING:
        return "0 %"
    value = 100 * share
    if 98.95 <= abs(value) < 99.95:
        return f"{value:.1f} %"
    # Rounded first: 0.998 has its two digits as 1.0.
    rounded = float(f"{value:.1e}")
    return f"{value:.{min(max(0, 1 - floor(log10(abs(rounded)))), 6)}f} %"


def bounded_percent(share: float, *, at_most: bool) -> str:
    """Print a share, and that it's a bound where it is one.

    Examples
    --------
    >>> bounded_percent(0.068, at_most=True), bounded_percent(0.011, at_most=False)
    ('at most 6.8 %', '1.1 %')
    """
    return f"at most {percent(share)}" if at_most else percent(share)


def signed_percent(share: float) -> str:
    """Print a change as a share, with its sign.

    Examples
    --------
    >>> signed_percent(-0.995), signed_percent(3.5), signed_percent(0.02)
    ('-99.5 %', '+350 %', '+2.0 %')
    """
    return f"{'+' if share > 0 else ''}{percent(share)}"


def chance(probability: float) -> str:
    """Print a probability; beyond what a campaign can calibrate only that it lies there.

    Examples
    --------
    >>> chance(0.97), chance(0.9997), chance(0.004)
    ('97 %', 'over 99 %', 'under 1 %')
    """
    if probability > SURE:
        return f"over {SURE:.0%}".replace("%", " %")
    if probability < 1 - SURE:
        return f"under {1 - SURE:.0%}".replace("%", " %")
    return f"{100 * probability:.0f} %"


def _prefix(value: float, unit: str) -> tuple[float, str]:
    size = abs(value)
    if not _FIRST.match(unit) or not isfinite(size) or size == 0 or PLAIN_FROM <= size < PLAIN_TO:
        return 1.0, ""
    # In steps of thousands, so that one to three digits stand before the point.
    power = min(max(3 * floor(log10(size) / 3 + 1e-9), min(_PREFIXES)), max(_PREFIXES))
    return (10.0**power, _PREFIXES[power]) if power else (1.0, "")


def _number(value: float, std: float | None) -> str:
    if std is None or not isfinite(std) or std <= 0:
        return _digits(value)
    return with_sigma(value, std)


def _digits(value: float) -> str:
    """Three digits; four in front of the point are read as they stand, as three they would need an exponent."""
    return f"{value:.0f}" if LAST_WITH_POINT <= abs(value) <= PLAIN_TO else f"{value:.3g}"
