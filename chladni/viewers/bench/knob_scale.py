"""How a knob stands for a parameter: unit shown, place on the slider, text in the entry."""

import re
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from typing import Self

from chladni.models.core.parameter import Parameter
from chladni.signals.errors import ModelError, SetupError
from chladni.signals.text_reading import real_number
from chladni.signals.unit_text import printed_unit
from chladni.signals.units import parse_quantity, si_factor

STEPS = 100
_EXPONENT = re.compile(r"e\+?(-?)0*(?=\d)")
#: A range that spans more than this is a matter of orders of magnitude.
DECADES_FROM = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class KnobScale:
    """The scale of one knob.

    Attributes
    ----------
    factor
        SI value of one shown unit.
    unit
        What is shown behind the number.
    logarithmic
        Whether the slider's place is the decimal logarithm of the shown value.
    start, end, step
        Of the slider's place.

    Examples
    --------
    >>> area = Parameter(name="area", value=0.007, unit="m^2", low=0.005, high=0.008, shown_unit="cm^2")
    >>> scale = KnobScale.of(area)
    >>> scale.text(0.007), scale.unit, scale.start, scale.end, scale.step
    ('70', 'cm²', 50.0, 80.0, 0.2)
    """

    parameter: Parameter
    factor: float
    unit: str
    logarithmic: bool
    start: float
    end: float
    step: float

    @classmethod
    def of(cls, parameter: Parameter) -> Self:
        """Give the scale of a parameter."""
        shown = parameter.shown_unit or parameter.unit
        factor = si_factor(shown)[0]
        low, high = parameter.low / factor, parameter.high / factor
        logarithmic = low > 0 and high / low > DECADES_FROM
        # The slider itself is linear in the browser, so that its place is the logarithm.
        if logarithmic:
            low, high = log10(low), log10(high)
        low, high = _clean(low), _clean(high)
        if high <= low:
            # A knob needs room to turn in, whatever its declaration says.
            low, high = low - 0.5 * max(abs(low), 1.0), high + 0.5 * max(abs(high), 1.0)
        return cls(
            parameter=parameter,
            factor=factor,
            unit="" if shown == "1" else printed_unit(shown),
            logarithmic=logarithmic,
            start=low,
            end=high,
            step=_nice_step((high - low) / STEPS),
        )

    def place(self, value: float) -> float:
        """Place on the slider of a value in SI; its end when the value lies beyond."""
        shown = value / self.factor
        if self.logarithmic:
            shown = log10(shown) if shown > 0 else self.start
        # A slider can't stand outside itself; the entry says the value.
        return min(max(shown, self.start), self.end)

    def value(self, place: float) -> float:
        """Value in SI at a place of the slider."""
        # Rounded in the shown unit, so that the entry reads 70 and not 70.00000000000001.
        shown = float(f"{10**place:.3g}") if self.logarithmic else _clean(place)
        return shown * self.factor

    def text(self, value: float) -> str:
        """Give the number that the entry shows for a value in SI."""
        return _EXPONENT.sub(r"e\1", f"{value / self.factor:.6g}")

    def read(self, text: str) -> float:
        """Value in SI of what was typed: a number in the shown unit, or a number with any fitting unit.

        Raises
        ------
        SetupError
            When it is no number, or its unit is of another kind.
        ModelError
            When the parameter can't have that value.
        """
        value = self._number(text.strip())
        low, high = self.parameter.minimum, self.parameter.maximum
        if not low <= value <= high:
            raise ModelError(f"{self.parameter.name} = {self._shown(value)} is not possible; {self._allowed()}")
        return value

    def usual_range(self) -> str:
        """Words for the usual range."""
        low, high = self.text(self.parameter.low), self.text(self.parameter.high)
        return f"usually {low} to {high} {self.unit}".rstrip()

    def _number(self, text: str) -> float:
        try:
            # Plain numbers first: "65" means 65 of what is shown, though it would also be a quantity without unit.
            number = real_number(text)
        except ValueError:
            value, unit = parse_quantity(text)
            expected = si_factor(self.parameter.unit)[1]
            if unit != expected:
                raise SetupError(
                    f"{self.parameter.name} = {text!r} is in {unit}; give a number in {self.unit or 'no unit'}"
                ) from None
            return value
        if not isfinite(number):
            raise SetupError(f"{self.parameter.name} = {text!r} is not finite; {self._allowed()}")
        return number * self.factor

    def _allowed(self) -> str:
        low, high = self.parameter.minimum, self.parameter.maximum
        if isfinite(low) and isfinite(high):
            return f"give a value from {self._shown(low)} to {self._shown(high)}"
        if isfinite(low):
            return f"give a value of at least {self._shown(low)}"
        return f"give a value of at most {self._shown(high)}" if isfinite(high) else f"give a number in {self.unit}"

    def _shown(self, value: float) -> str:
        return f"{self.text(value)} {self.unit}".rstrip()


def _clean(number: float) -> float:
    """Take away the rounding of unit conversion."""
    return float(f"{number:.12g}")


def _nice_step(step: float) -> float:
    """Largest of 1, 2 or 5 times a power of ten that is at most `step`."""
    decade = 10.0 ** floor(log10(step) + 1e-9)
    leading = max(nice for nice in (1, 2, 5) if nice * decade <= step * (1 + 1e-9))
    # Built from text: 2 times 10 to the -1 is 0.2 and not 0.2000...01.
    return float(f"{leading}e{ceil(log10(decade) - 0.5)}")
