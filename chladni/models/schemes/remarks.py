"""What a user should know about a scheme before trusting its signals."""

from collections.abc import Iterator, Sequence

import numpy as np

from chladni.models.core.port import Terminal
from chladni.models.schemes.block import Block
from chladni.models.schemes.equations import solved_equations
from chladni.models.schemes.points import points_of
from chladni.models.schemes.scheme_output import SchemeOutput
from chladni.models.schemes.wiring import wired


def scheme_remarks(
    blocks: Sequence[Block], inputs: Sequence[Terminal], outputs: Sequence[SchemeOutput], filter_time_s: float
) -> tuple[str, ...]:
    """Give sentences: what is off, unconnected, or computed through a filter in time."""
    return (
        *_switched_off(blocks),
        *_unconnected(blocks, inputs, outputs),
        *_filtered(blocks, inputs, outputs, filter_time_s),
    )


def _switched_off(blocks: Sequence[Block]) -> Iterator[str]:
    for block in blocks:
        if not block.on:
            what = "passes what enters it on" if block.when_off == "pass" else "gives zero"
            yield f"block {block.name} is off: it {what}"


def _unconnected(
    blocks: Sequence[Block], inputs: Sequence[Terminal], outputs: Sequence[SchemeOutput]
) -> Iterator[str]:
    used = {source for block in blocks for source, _ in block.sources}
    declared = {output.at for output in outputs}
    for block in blocks:
        if not block.inputs:
            yield f"block {block.name} has no input: its signal is zero"
        # Without declared outputs every block is looked at, and none is loose.
        elif outputs and block.name not in used | declared:
            yield f"block {block.name} feeds nothing"
    for terminal in inputs:
        if terminal.name not in used:
            yield f"input {terminal.name} feeds nothing"


def _filtered(
    blocks: Sequence[Block], inputs: Sequence[Terminal], outputs: Sequence[SchemeOutput], filter_time_s: float
) -> Iterator[str]:
    wiring = wired(blocks, inputs)
    powers = solved_equations(blocks, wiring.blocks, wiring.inputs).d[1:]
    behind = np.asarray(powers.any(axis=0))
    before = np.asarray((wiring.blocks @ powers).any(axis=0))
    for column, terminal in enumerate(inputs):
        named = [
            point.terminal.name
            for point in points_of(blocks, outputs)
            if (before if point.before else behind)[point.block, column]
        ]
        if named:
            yield (
                f"{', '.join(named)}: a step of {terminal.name} comes through as an impulse; in time it is computed "
                f"through a lag of {filter_time_s:g} s, in frequency it is exact"
            )
