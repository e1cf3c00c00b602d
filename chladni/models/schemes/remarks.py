"""What a user should know about a scheme before trusting its signals."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from chladni.models.core.port import Terminal
from chladni.models.elements.element import Element
from chladni.models.schemes.block import Block
from chladni.models.schemes.compilation import compiled_scheme
from chladni.models.schemes.scheme_output import SchemeOutput


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
    # Most schemes have no block that differentiates, and compiling takes milliseconds of each turn of a knob.
    if not any(isinstance(block.acting, Element) and not block.acting.transfer.proper for block in blocks):
        return
    compiled = compiled_scheme(blocks, inputs, outputs, sites=frozenset(), filter_time_s=filter_time_s)
    names = np.array([terminal.name for terminal in compiled.outputs])
    touched: dict[str, set[str]] = defaultdict(set)
    for ideal in compiled.derivatives:
        source = compiled.ports[ideal.port].name.rpartition(".")[0]
        touched[source] |= set(names[compiled.h[:, ideal.port] != 0])
    for source, found in touched.items():
        if source in {terminal.name for terminal in inputs}:
            told = ", ".join(name for name in names if name in found)
            yield (
                f"{told}: a step of {source} comes through as an impulse; in time it is computed "
                f"through a lag of {filter_time_s:g} s, in frequency it is exact"
            )
        else:
            yield (
                f"what {source.removesuffix('.delay')} delays is differentiated behind it; "
                f"in time through a lag of {filter_time_s:g} s, which acts in its loops too"
            )
