"""Reading a scheme's tables: every key checked, every mistake noted with its place."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TypeVar

from chladni.models.core.port import HOLDS, HoldKind, Terminal
from chladni.models.elements.catalogue import ELEMENTS, element_kind
from chladni.models.elements.element import Element
from chladni.models.elements.rational import rational
from chladni.models.schemes.block import NAME, Block
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.schemes.scheme_output import SchemeOutput
from chladni.models.schemes.wiring import MAX_BLOCKS, nearest
from chladni.signals.errors import ModelError, SetupError
from chladni.signals.units import parse_quantity, si_factor
from chladni.signals.wording import shown

T = TypeVar("T")
#: Place of a value: ``("block", 2, "parameters", "gain")``, tables counted from 0.
Loc = tuple[str | int, ...]
#: ``number(value, unit) -> float`` in SI; a unit of None takes any.
Number = Callable[[float | str, str | None], float]

BLOCK_KEYS = ("name", "kind", "parameters", "num", "den", "delay", "input", "on", "when_off", "unit", "input_unit")
INPUT_KEYS = ("name", "unit", "channel", "hold")
OUTPUT_KEYS = ("name", "at", "unit", "channel", "hold")


@dataclass(frozen=True, slots=True, kw_only=True)
class SchemeReading:
    """What tables give: a scheme, or what is wrong with them.

    Attributes
    ----------
    model
        None when there are mistakes.
    mistakes
        Place and sentence of each.
    """

    model: SchemeModel | None
    mistakes: tuple[tuple[Loc, str], ...]


def plain_number(value: float | str, unit: str | None) -> float:
    """Read a number, or text with exactly the unit that is expected or a multiple of it.

    Examples
    --------
    >>> plain_number("20 ms", "s")
    0.02
    """
    if not isinstance(value, str):
        return float(value)
    try:
        found, found_unit = parse_quantity(value)
        expected = None if unit is None else si_factor(unit)[1]
    except SetupError as error:
        raise ModelError(str(error)) from None
    if expected is not None and found_unit != expected:
        raise ModelError(f"found {value[:60]!r}, which is in {found_unit}; give it in {expected}")
    return found


class TableReader:
    """Reads tables and collects mistakes; what can't be read becomes None.

    Parameters
    ----------
    number
        Reader of numbers.
    """

    def __init__(self, number: Number) -> None:
        self._number = number
        self.mistakes: list[tuple[Loc, str]] = []

    def tried(self, loc: Loc, make: Callable[[], T]) -> T | None:
        """Give what `make` gives; its `ModelError` is a mistake at `loc`. Nothing is made after a mistake."""
        if self.mistakes:
            return None
        return self._attempt(loc, make)

    def tables(self, content: Mapping[str, object], name: str) -> Iterator[tuple[Loc, Mapping[str, object]]]:
        """Tables ``[[name]]`` with their places."""
        found = content.get(name, [])
        if not isinstance(found, list) or not all(isinstance(table, dict) for table in found):
            self._tell((name,), f"must be a list of tables [[{name}]]")
            return
        if len(found) > MAX_BLOCKS:
            self._tell((name,), f"there are {len(found)}; at most {MAX_BLOCKS} are taken")
            return
        for place, table in enumerate(found):
            yield (name, place), table

    def known_keys(self, loc: Loc, table: Mapping[str, object], known: Sequence[str]) -> None:
        """Note keys that mean nothing here."""
        for key in table:
            if key not in known:
                self._tell((*loc, key), f"unknown key; {nearest(key, known)}")

    def input(self, loc: Loc, table: Mapping[str, object]) -> Terminal | None:
        """``[[input]]``."""
        self.known_keys(loc, table, INPUT_KEYS)
        name, unit = self._name(loc, table), self._unit(loc, table, "unit") or "1"
        channel, hold = self._text((*loc, "channel"), table.get("channel")), self._hold(loc, table)
        return None if name is None else Terminal(name=name, unit=unit, channel=channel, hold=hold)

    def output(self, loc: Loc, table: Mapping[str, object]) -> SchemeOutput | None:
        """``[[output]]``."""
        self.known_keys(loc, table, OUTPUT_KEYS)
        name, unit = self._name(loc, table), self._unit(loc, table, "unit")
        at = self._text((*loc, "at"), table.get("at")) or ""
        channel, hold = self._text((*loc, "channel"), table.get("channel")), self._hold(loc, table)
        return None if name is None else SchemeOutput(name=name, at=at, unit=unit, channel=channel, hold=hold)

    def block(self, loc: Loc, table: Mapping[str, object]) -> Block | None:
        """``[[block]]``."""
        self.known_keys(loc, table, BLOCK_KEYS)
        name, content = self._name(loc, table), self._content(loc, table)
        sources = self._sources((*loc, "input"), table.get("input", []))
        on = table.get("on", True)
        if not isinstance(on, bool):
            self._tell((*loc, "on"), f"found {on!r:.60}; must be true or false")
        when_off = table.get("when_off", "pass")
        if when_off not in ("pass", "cut"):
            self._tell((*loc, "when_off"), f"found {when_off!r:.60}; must be pass or cut")
        unit, input_unit = self._unit(loc, table, "unit"), self._unit(loc, table, "input_unit")
        if name is None or content is None or sources is None:
            return None
        return self._attempt(
            (*loc, "input"),
            lambda: Block(
                name=name,
                content=content,
                inputs=sources,
                on=bool(on),
                when_off="cut" if when_off == "cut" else "pass",
                unit=unit,
                input_unit=input_unit,
            ),
        )

    def wiring(
        self,
        blocks: Sequence[Block | None],
        inputs: Sequence[Terminal | None],
        outputs: Sequence[SchemeOutput | None],
    ) -> None:
        """Note every source that names nothing; only when all names could be read."""
        # A block that couldn't be read would make every reference to it look like a second mistake.
        whole = [block for block in blocks if block is not None]
        if len(whole) < len(blocks) or None in inputs or None in outputs:
            return
        own = [block.name for block in whole]
        entries = [terminal.name for terminal in inputs if terminal is not None]
        known = own + entries
        self._unique([("block", own), ("input", entries)])
        for place, block in enumerate(whole):
            for number, (source, _) in enumerate(block.sources):
                if source not in known:
                    self._tell(("block", place, "input", number), f"found {source!r:.80}; {nearest(source, known)}")
        for place, output in enumerate(outputs):
            if output is not None and output.at not in own:
                self._tell(("output", place, "at"), f"no block {output.at!r:.80}; {nearest(output.at, own)}")

    def _unique(self, named: Sequence[tuple[str, Sequence[str]]]) -> None:
        taken: set[str] = set()
        for kind, names in named:
            for place, name in enumerate(names):
                if name in taken:
                    self._tell((kind, place, "name"), f"the name {shown(name)} is taken; names are unique")
                taken.add(name)

    def number(self, loc: Loc, value: object, unit: str | None) -> float | None:
        """Give a number in SI."""
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            self._tell(loc, f"found {value!r:.60}; must be a number, or text with a unit")
            return None
        if not isinstance(value, str) and not _finite(value):
            self._tell(loc, "must be finite, not inf or nan")
            return None
        return self._attempt(loc, lambda: self._number(value, unit))

    def with_tolerances(self, model: SchemeModel, table: object) -> SchemeModel:
        """``[tolerance]``: ``default`` and parameters by name."""
        if not isinstance(table, dict):
            self._tell(("tolerance",), "must be a table")
            return model
        read: dict[str, float] = {}
        known = ["default", *model.parameters]
        for name, value in table.items():
            found = self.number(("tolerance", name), value, "1")
            if name not in known:
                self._tell(("tolerance", name), f"unknown parameter; {nearest(name, known)}")
            elif found is not None and found < 0:
                self._tell(("tolerance", name), f"found {found:g}; must be 0 or more")
            elif found is not None:
                read[name] = found
        # The default is put under the parameters that have one of their own.
        if "default" in read:
            default = read.pop("default")
            read = dict.fromkeys(model.parameters, default) | read
        return model.with_tolerances(read)

    def _content(self, loc: Loc, table: Mapping[str, object]) -> Element | None:
        """An element by kind, or by num and den."""
        if "kind" in table:
            for key in ("num", "den", "delay"):
                if key in table:
                    self._tell((*loc, key), "a block has either a kind or num and den")
            return self._element(loc, table)
        if "num" not in table and "delay" not in table:
            self._tell(loc, f"has neither kind nor num; kinds: {', '.join(ELEMENTS)}")
            return None
        if "parameters" in table:
            self._tell((*loc, "parameters"), "belong to a kind; num and den are parameters themselves")
        num = self._numbers((*loc, "num"), table.get("num", [1.0]))
        den = self._numbers((*loc, "den"), table.get("den", [1.0]))
        delay = self.number((*loc, "delay"), table.get("delay", 0.0), "s")
        if num is None or den is None or delay is None:
            return None
        return self._attempt(loc, lambda: rational(num, den, delay_s=delay))

    def _element(self, loc: Loc, table: Mapping[str, object]) -> Element | None:
        word, parameters = table["kind"], table.get("parameters", {})
        if not isinstance(word, str):
            self._tell((*loc, "kind"), f"found {word!r:.60}; must be text, one of {', '.join(ELEMENTS)}")
            return None
        kind = self._attempt((*loc, "kind"), lambda: element_kind(word))
        if kind is None or not isinstance(parameters, dict):
            if kind is not None:
                self._tell((*loc, "parameters"), "must be a table, such as { gain = 2.0 }")
            return None
        element: Element | None = Element(kind=kind, parameters=kind.parameters)
        for name, value in parameters.items():
            element = self._with_parameter((*loc, "parameters", name), element, name, value)
        return element

    def _with_parameter(self, loc: Loc, element: Element | None, name: str, value: object) -> Element | None:
        if element is None:
            return None
        if name not in element.parameters:
            self._tell(loc, f"unknown parameter of {element.kind.name}; {nearest(name, element.parameters)}")
            return element
        unit = element.parameters[name].unit
        # A gain without unit takes the units of what it joins, such as N/V.
        number = self.number(loc, value, None if unit == "1" and name == "gain" else unit)
        return element if number is None else self._attempt(loc, lambda: element.with_usual_value(name, number))

    def _numbers(self, loc: Loc, values: object) -> tuple[float, ...] | None:
        if not isinstance(values, list) or not values:
            self._tell(loc, "must be a list of coefficients, of descending powers of s")
            return None
        # Coefficients have the units of their block and power, which nobody writes: any unit is taken, in SI.
        found = [self.number((*loc, place), value, None) for place, value in enumerate(values)]
        whole = tuple(value for value in found if value is not None)
        return whole if len(whole) == len(found) else None

    def _sources(self, loc: Loc, values: object) -> tuple[str, ...] | None:
        listed = [values] if isinstance(values, str) else values
        if not isinstance(listed, list) or not all(isinstance(one, str) for one in listed):
            self._tell(loc, 'must be a list of names with signs, such as ["+reference", "-feedback"]')
            return None
        return tuple(listed)

    def _name(self, loc: Loc, table: Mapping[str, object]) -> str | None:
        name = table.get("name")
        if name is None:
            self._tell((*loc, "name"), "is missing")
        elif not isinstance(name, str) or not NAME.fullmatch(name) or name == "ground":
            self._tell(
                (*loc, "name"), f"found {name!r:.80}; must be a letter, then letters, digits, _ or -, and not ground"
            )
            return None
        return name

    def _text(self, loc: Loc, value: object) -> str | None:
        if value is None or isinstance(value, str):
            return value
        self._tell(loc, f"found {value!r:.60}; must be text in quotes")
        return None

    def _hold(self, loc: Loc, table: Mapping[str, object]) -> HoldKind | None:
        found = table.get("hold")
        known = next((hold for hold in HOLDS if hold == found), None)
        if found is not None and known is None:
            self._tell((*loc, "hold"), f"found {found!r:.60}; must be one of {', '.join(HOLDS)}")
        return known

    def _unit(self, loc: Loc, table: Mapping[str, object], key: str) -> str:
        """Unit of a signal, in SI; empty when it isn't given."""
        text = self._text((*loc, key), table.get(key))
        return "" if not text else self._attempt((*loc, key), lambda: _si_unit(text)) or ""

    def _attempt(self, loc: Loc, make: Callable[[], T]) -> T | None:
        try:
            return make()
        except ModelError as error:
            self._tell(loc, str(error))
            return None

    def _tell(self, loc: Loc, text: str) -> None:
        self.mistakes.append((loc, text))


def _si_unit(text: str) -> str:
    try:
        factor, unit = si_factor(text)
    except SetupError as error:
        raise ModelError(str(error)) from None
    # Numbers would have to be converted with the unit, and nothing here knows which ones.
    if factor != 1:
        raise ModelError(f"found {text!r:.60}; signals of a scheme are in SI, here {unit}")
    return unit


def _finite(value: float) -> bool:
    """A whole number of a file may be too large for a float."""
    try:
        return isfinite(value)
    except OverflowError:
        return False
