"""Block schemes: elements, sums and loops as one model."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import isfinite
from typing import Self

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, ModelKind, flags_of_effects
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import HoldKind, Terminal, require_named
from chladni.models.core.simulation import Simulation
from chladni.models.core.stability import growing_poles
from chladni.models.elements.element import Element
from chladni.models.schemes.block import Block
from chladni.models.schemes.compilation import compiled_scheme
from chladni.models.schemes.point_response import point_response
from chladni.models.schemes.points import Point, points_of
from chladni.models.schemes.remarks import scheme_remarks
from chladni.models.schemes.scheme_output import SchemeOutput
from chladni.models.schemes.wiring import nearest, require_wiring
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError

#: Time constant in seconds of the lags through which a derivative is computed in time.
DERIVATIVE_FILTER_S = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class SchemeModel:
    """A scheme of blocks with any number of open and closed loops.

    Attributes
    ----------
    name
        For people and files.
    blocks
        1 to 1000 of them.
    inputs
        Signals from outside: references, loads.
    outputs
        Declared ones, for logs and for what matters. Every other block's output, and the sum that enters each block
        with several inputs (``regulator.input``), follows as an output by itself.
    effects
        Known ones. Their sites are inputs, outputs and blocks: an effect of inputs (saturation) at a block acts on
        what enters it, an effect of outputs (clipping) on what leaves it and all that it feeds.
    derivative_filter_s
        Where a block differentiates and what follows doesn't take it back, the signal is computed in time through a
        lag of this time constant for each power of s too many. In frequency everything is exact.

    Raises
    ------
    ModelError
        When names are taken twice or impossible, a source is unknown, there are too many blocks, or the filter's time
        constant is impossible.

    Examples
    --------
    >>> from chladni.models.schemes.block import element_block
    >>> loop = SchemeModel(
    ...     name="loop",
    ...     blocks=(element_block("regulator", "pi", "+wish", "-plant"), element_block("plant", "pt1", "regulator")),
    ...     inputs=(Terminal(name="wish", unit="1"),),
    ... )
    >>> loop.frequency_response(np.array([0.0]))[:, 0, 0].real
    array([1., 1., 0.])
    >>> [terminal.name for terminal in loop.compile().outputs]
    ['regulator', 'plant', 'regulator.input']
    """

    name: str
    blocks: tuple[Block, ...]
    inputs: tuple[Terminal, ...] = ()
    outputs: tuple[SchemeOutput, ...] = ()
    effects: Sequence[Effect] = ()
    derivative_filter_s: float = DERIVATIVE_FILTER_S

    def __post_init__(self) -> None:
        require_wiring(self.blocks, self.inputs, self.outputs)
        if not (isfinite(self.derivative_filter_s) and self.derivative_filter_s > 0):
            raise ModelError(f"derivative_filter_s = {self.derivative_filter_s:g}; it must be finite and above zero")

    @property
    def kind(self) -> ModelKind:
        """``scheme``."""
        return "scheme"

    @property
    def parameters(self) -> Parameters:
        """Every number of every block: ``regulator.gain``."""
        return Parameters(
            tuple(
                _of_block(block.name, parameter) for block in self.blocks for parameter in block.parameters.values()
            )
        )

    @property
    def points(self) -> tuple[Point, ...]:
        """Every point whose signal is an output, in the order of `compile` and `frequency_response`."""
        return points_of(self.blocks, self.outputs)

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the scheme with some parameters replaced; `ModelError` for an unknown name or impossible value."""
        # Asked of the scheme first: a block would tell a mistake by its own short name.
        by_block = self._by_block(self._changed(values))
        return replace(
            self,
            blocks=tuple(
                block.with_values(by_block[block.name]) if block.name in by_block else block for block in self.blocks
            ),
        )

    def with_usual_value(self, name: str, value: float) -> Self:
        """Give the scheme with one parameter replaced, whose usual range then reaches at least to its value."""
        self.parameters.require(name)
        block, _, parameter = name.partition(".")
        return replace(
            self,
            blocks=tuple(
                replace(one, content=one.content.with_usual_value(parameter, value))
                if one.name == block and isinstance(one.content, Element)
                else one
                for one in self.blocks
            ),
        )

    def with_tolerances(self, tolerances: Mapping[str, float]) -> Self:
        """Give the scheme with some parameters believed more or less: one sigma over the value, by parameter."""
        by_block = self._by_block(tolerances)
        return replace(
            self, blocks=tuple(block.with_tolerances(by_block.get(block.name, {})) for block in self.blocks)
        )

    def with_effects(self, effects: Sequence[Effect]) -> Self:
        """Give the scheme with these effects in place of those it has."""
        return replace(self, effects=tuple(effects))

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:
        """Give the scheme with other holds of its inputs and declared outputs; `ModelError` for another name."""
        names = [*(one.name for one in self.inputs), *(one.name for one in self.outputs)]
        require_named(holds, names)
        return replace(
            self,
            inputs=tuple(replace(one, hold=holds.get(one.name, one.hold)) for one in self.inputs),
            outputs=tuple(replace(one, hold=holds.get(one.name, one.hold)) for one in self.outputs),
        )

    def switched(self, switches: Mapping[str, bool]) -> Self:
        """Give the scheme with some blocks switched on or off.

        Raises
        ------
        ModelError
            When there's no such block; the nearest one is named.
        """
        known = [block.name for block in self.blocks]
        for name in switches:
            if name not in known:
                raise ModelError(f"block {name!r:.80} is unknown; {nearest(name, known)}")
        return replace(
            self, blocks=tuple(block.switched(on=switches.get(block.name, block.on)) for block in self.blocks)
        )

    def block(self, name: str) -> Block:
        """Give the named block; `ModelError` that names the nearest one when there's none."""
        for block in self.blocks:
            if block.name == name:
                return block
        raise ModelError(f"block {name!r:.80} is unknown; {nearest(name, [block.name for block in self.blocks])}")

    def compile(self) -> CompiledModel:
        """Close all loops and attach the effects.

        Raises
        ------
        ModelError
            When the signals of a loop are not determined (its blocks are named), or an effect finds no site.
        """
        compiled = compiled_scheme(
            self.blocks,
            self.inputs,
            self.outputs,
            sites=frozenset(effect.site for effect in self.effects),
            filter_time_s=self.derivative_filter_s,
        )
        # Loops are closed already and every block has its ports, so effects attach in the order given, not by stage.
        for effect in self.effects:
            compiled = effect.attach(compiled)
        return compiled

    def frequency_response(self, frequency_hz: Real) -> Complex:
        """Response of every point to every input, ``[point, input, frequency]``, as `points` orders them.

        Exact with dead times and improper blocks; with effects, that of the linear part of the compiled equations.
        Infinite where the scheme has a pole on the axis.
        """
        if self.effects:
            return self.compile().frequency_response(frequency_hz)
        return point_response(self.blocks, self.inputs, self.points, np.asarray(frequency_hz, dtype=np.float64))

    def flags(self, simulation: Simulation) -> tuple[str, ...]:
        """Sentences: an unstable scheme, what `remarks` says, and what effects say."""
        compiled = self.compile()
        growing = growing_poles(compiled)
        listed = ", ".join(f"{pole.real:.4g} + {pole.imag:.4g}j" for pole in growing)
        unstable = (f"unstable: poles at {listed} rad/s; lower the gain of a loop",) if growing.size else ()
        return (*unstable, *self.remarks(), *flags_of_effects(self.effects, compiled, simulation))

    def remarks(self) -> tuple[str, ...]:
        """Sentences about the scheme itself: what is off, unconnected, or computed through a filter in time."""
        return scheme_remarks(self.blocks, self.inputs, self.outputs, self.derivative_filter_s)

    def _changed(self, values: Mapping[str, float]) -> dict[str, float]:
        """Give the values that are others than now; `ModelError` for an unknown name or impossible value."""
        declared = {parameter.name: parameter for parameter in self.parameters.items_in_order}
        changed = {}
        for name, value in values.items():
            now = declared[name] if name in declared else self.parameters.require(name)
            # While one knob turns all other values are what they were, and possible.
            if now.value != value:
                changed[name] = now.with_value(value).value
        return changed

    def _by_block(self, numbers: Mapping[str, float]) -> dict[str, dict[str, float]]:
        """Sort numbers by the block that their parameter belongs to; unknown names are refused."""
        by_block: dict[str, dict[str, float]] = defaultdict(dict)
        declared = self.parameters
        for name, number in numbers.items():
            declared.require(name)
            block, _, parameter = name.partition(".")
            by_block[block][parameter] = number
        return by_block


# Names are made for every question to a scheme, and while one knob turns all other parameters stay what they are.
@lru_cache(maxsize=4096)
def _of_block(block: str, parameter: Parameter) -> Parameter:
    return replace(parameter, name=f"{block}.{parameter.name}")
