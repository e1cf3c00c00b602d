"""What one page knows: the setting that is asked for, and the last one that could be computed."""

from math import isclose

from chladni.models.core.instrument import Instrument
from chladni.models.core.reading import InstrumentReading
from chladni.viewers.bench.knob_scale import KnobScale
from chladni.viewers.bench.tools import Variant

#: A label names so many changes; a longer one wouldn't fit beside a chart.
NAMED_CHANGES = 2


class Desk:
    """Settings of one instrument on one page; no toolkit, no thread.

    Attributes
    ----------
    asked
        What the knobs say.
    good
        The last setting that gave a reading.
    reading
        That reading, or None before the first.
    """

    def __init__(self, instrument: Instrument) -> None:
        self.instrument = instrument
        # Of every parameter once, since each turn of a knob asks for the label of its setting.
        self._scales = tuple((one, KnobScale.of(one)) for one in instrument.parameters.values())
        self.asked = self._labelled(
            instrument.parameters.numbers(), {option.name: option.default for option in instrument.options}
        )
        self.good = self.asked
        self.reading: InstrumentReading | None = None

    def turn(self, name: str, value: float) -> None:
        """Ask for another value (SI) of a parameter."""
        self.asked = self._labelled({**self.asked.values, name: value}, dict(self.asked.options))

    def switch(self, name: str, word: str) -> None:
        """Ask for another choice of an option."""
        self.asked = self._labelled(dict(self.asked.values), {**self.asked.options, name: word})

    def load(self, variant: Variant) -> None:
        """Ask for a whole setting."""
        self.asked = self._labelled(dict(variant.values), dict(variant.options))

    def accept(self, setting: Variant, reading: InstrumentReading) -> None:
        """Take a reading as the last good one."""
        self.good, self.reading = setting, reading

    def give_up(self) -> None:
        """Go back to the last setting that gave a reading."""
        self.asked = self.good

    def _labelled(self, values: dict[str, float], options: dict[str, str]) -> Variant:
        """Label a setting by what differs from the declaration."""
        changes = [
            f"{parameter.symbol or parameter.name} {scale.text(values[parameter.name])} {scale.unit}".rstrip()
            for parameter, scale in self._scales
            # Turned away and back again is no change, whatever rounding left.
            if not isclose(values[parameter.name], parameter.value, rel_tol=1e-9)
        ]
        changes += [
            f"{option.name.replace('_', ' ')} {options[option.name]}"
            for option in self.instrument.options
            if options[option.name] != option.default
        ]
        label = ", ".join(changes[:NAMED_CHANGES]) or "as declared"
        more = len(changes) - NAMED_CHANGES
        return Variant(label=f"{label} and {more} more" if more > 0 else label, values=values, options=options)
