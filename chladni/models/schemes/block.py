"""Blocks of a scheme: what acts between the points, and what each takes in."""

import re
from dataclasses import dataclass, replace
from typing import Literal, Self

from chladni.models.core.parameter import Parameters
from chladni.models.core.state_space import StateSpace
from chladni.models.elements.catalogue import element
from chladni.models.elements.element import Element, Values
from chladni.models.elements.rational import rational
from chladni.signals.errors import ModelError

WhenOff = Literal["pass", "cut"]

#: Names of sites in model files.
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
_SOURCE = re.compile(r"\s*([+-]?)\s*([^\s+-].*?)\s*", re.DOTALL)

# What a block that is off does; as elements, so that nothing else has to know about switches.
_PASS, _CUT = rational((1.0,)), rational((0.0,))


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """One block: the sum of its inputs goes through `content`.

    Attributes
    ----------
    name
        A letter, then letters, digits, ``_`` and ``-``.
    content
        An element (see `chladni.models.elements`), or a state space with one input and one output.
    inputs
        Blocks and inputs of the scheme that it adds up, each with its sign: ``("+reference", "-tachometer")``.
    on
        Whether it acts.
    when_off
        What it does when it's off: ``pass`` gives its input on unchanged (corrections, regulators), ``cut`` gives
        zero (loads, feedback).
    unit, input_unit
        SI units of what comes out and of what goes in; those of the element's kind when not given.

    Raises
    ------
    ModelError
        When the name is not possible, a sign or source is missing, or the state space isn't one by one.
    """

    name: str
    content: Element | StateSpace
    inputs: tuple[str, ...] = ()
    on: bool = True
    when_off: WhenOff = "pass"
    unit: str = ""
    input_unit: str = ""

    def __post_init__(self) -> None:
        require_name(self.name, "block")
        if self.when_off not in ("pass", "cut"):
            raise ModelError(f"block {self.name!r}: when_off = {self.when_off!r}; it is pass or cut")
        if isinstance(self.content, StateSpace) and self.content.d.shape != (1, 1):
            outputs, inputs = self.content.d.shape
            raise ModelError(
                f"block {self.name!r}: its state space has {inputs} inputs and {outputs} outputs; "
                "a block has one of each"
            )
        # Twice the same source would be one entry of a sum: -a and +a, or a gain of two that nobody sees.
        sources = [source for source, _ in self.sources]
        for source in sources:
            if sources.count(source) > 1:
                raise ModelError(f"block {self.name!r}: input {source!r} is named {sources.count(source)} times")
        if isinstance(self.content, Element):
            object.__setattr__(self, "unit", self.unit or self.content.kind.output_unit)
            object.__setattr__(self, "input_unit", self.input_unit or self.content.kind.input_unit)
        else:
            object.__setattr__(self, "unit", self.unit or self.content.outputs[0].unit)
            object.__setattr__(self, "input_unit", self.input_unit or self.content.inputs[0].unit)

    @property
    def sources(self) -> tuple[tuple[str, float], ...]:
        """Name and sign, +1 or -1, of each input."""
        return tuple(_source(self.name, text) for text in self.inputs)

    @property
    def acting(self) -> Element | StateSpace:
        """What acts now: the content, or what stands for it while the block is off."""
        if self.on:
            return self.content
        return _PASS if self.when_off == "pass" else _CUT

    @property
    def parameters(self) -> Parameters:
        """Numbers that may be varied, with names of their own; a state space has none."""
        return self.content.parameters if isinstance(self.content, Element) else Parameters(())

    def with_values(self, values: Values) -> Self:
        """Give the block with some of its numbers replaced."""
        if isinstance(self.content, StateSpace):
            for name in values:
                self.parameters.require(name)
            return self
        return replace(self, content=self.content.with_values(values))

    def with_tolerances(self, tolerances: Values) -> Self:
        """Give the block with some of its numbers believed more or less."""
        if isinstance(self.content, StateSpace):
            return self
        return replace(self, content=self.content.with_tolerances(tolerances))

    def switched(self, *, on: bool) -> Self:
        """Give the block switched on or off."""
        return self if on == self.on else replace(self, on=on)


def element_block(
    name: str, kind: str, *inputs: str, when_off: WhenOff = "pass", unit: str = "", **values: float
) -> Block:
    """Give a block with an element of some kind.

    Examples
    --------
    >>> element_block("regulator", "pi", "+reference", "-speed", gain=2.97, integral_time=9.9).sources
    (('reference', 1.0), ('speed', -1.0))
    """
    return Block(name=name, content=element(kind, **values), inputs=inputs, when_off=when_off, unit=unit)


def require_name(name: str, what: str) -> None:
    """Raise `ModelError` unless `name` can be a site of a model."""
    if not NAME.fullmatch(name) or name == "ground":
        raise ModelError(
            f"{what} {name!r:.80}: a name is a letter, then letters, digits, _ or - (64 at most), and not ground"
        )


def _source(block: str, text: str) -> tuple[str, float]:
    found = _SOURCE.fullmatch(text)
    if found is None:
        raise ModelError(f"block {block!r}: input {text!r:.80} names nothing; write '+name' or '-name'")
    return found[2], -1.0 if found[1] == "-" else 1.0
