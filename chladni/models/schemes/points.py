"""Points of a scheme: where a signal can be looked at."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.models.core.port import Terminal
from chladni.models.schemes.block import Block
from chladni.models.schemes.scheme_output import SchemeOutput


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One point.

    Attributes
    ----------
    terminal
        Name, unit and channel of its signal.
    block
        Index of the block that it lies behind or before.
    before
        Whether it's the sum that enters the block.
    """

    terminal: Terminal
    block: int
    before: bool = False


def points_of(blocks: Sequence[Block], outputs: Sequence[SchemeOutput]) -> tuple[Point, ...]:
    """Give every point: declared outputs, then what leaves the other blocks, then sums of several signals."""
    rows = {block.name: row for row, block in enumerate(blocks)}
    declared = [
        Point(
            terminal=Terminal(
                name=output.name,
                unit=output.unit or blocks[rows[output.at]].unit,
                channel=output.channel,
                hold=output.hold,
            ),
            block=rows[output.at],
        )
        for output in outputs
    ]
    named = {output.name for output in outputs}
    behind = [
        Point(terminal=Terminal(name=block.name, unit=block.unit), block=row)
        for row, block in enumerate(blocks)
        if block.name not in named
    ]
    sums = [
        Point(terminal=Terminal(name=f"{block.name}.input", unit=block.input_unit), block=row, before=True)
        for row, block in enumerate(blocks)
        # With one input the sum is that signal itself, with another sign perhaps: no point of its own.
        if len(block.inputs) > 1
    ]
    return (*declared, *behind, *sums)
