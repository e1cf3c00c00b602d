"""Schemes drawn at random, and their signals by brute force."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from chladni.models.core.port import Terminal
from chladni.models.elements.catalogue import ELEMENTS, element
from chladni.models.schemes.block import Block
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.signals.arrays import Real

INPUTS = (Terminal(name="u", unit="1"), Terminal(name="w", unit="1"))
# Elements whose poles, zeros and gains lie within a decade or so of 1: what is tested is the algebra of loops.
KINDS = (
    *("p", "pt1", "pt2", "i", "it1", "d", "dt1", "pd", "pdt1", "pd2", "dead-time", "all-pass"),
    *("pi", "pid", "pidt1", "lead", "lag", "lead-lag", "inertia", "shaft"),
)


@st.composite
def blocks(draw: st.DrawFn, *, name: str, others: list[str], kinds: tuple[str, ...]) -> Block:
    """One block that takes in up to three signals."""
    kind = draw(st.sampled_from(kinds))
    values = {
        item: draw(st.floats(0.2, 3.0)) + (1.0 if item == "ratio" else 0.0) for item in ELEMENTS[kind].parameters
    }
    sources = draw(st.lists(st.sampled_from(others), min_size=1, max_size=3, unique=True))
    signs = [draw(st.sampled_from("+-")) for _ in sources]
    inputs = tuple(sign + source for sign, source in zip(signs, sources, strict=True))
    return Block(name=name, content=element(kind, **values), inputs=inputs)


@st.composite
def schemes(draw: st.DrawFn, *, kinds: tuple[str, ...] = KINDS, most: int = 6) -> SchemeModel:
    """A scheme with any loops, self-loops included; the first block hears both inputs."""
    names = [f"b{number}" for number in range(draw(st.integers(1, most)))]
    drawn = [draw(blocks(name=name, others=[*names, "u", "w"], kinds=kinds)) for name in names]
    return SchemeModel(name="random", blocks=tuple(drawn), inputs=INPUTS)


def brute_force(scheme: SchemeModel, frequency_hz: Real) -> tuple[NDArray, NDArray]:
    """What leaves each block, ``[block, input, frequency]``, by ``(I - H K)^-1 H L``; condition, ``[frequency]``."""
    names = [block.name for block in scheme.blocks]
    k, from_inputs = np.zeros((len(names),) * 2), np.zeros((len(names), 2))
    for row, block in enumerate(scheme.blocks):
        for text in block.inputs:
            matrix, column = (k, names.index(text[1:])) if text[1:] in names else (from_inputs, "uw".index(text[1:]))
            matrix[row, column] = 1.0 if text[0] == "+" else -1.0
    h = np.array([block.content.transfer.frequency_response(frequency_hz) for block in scheme.blocks])
    loops = [np.eye(len(names)) - h[:, line, None] * k for line in range(frequency_hz.size)]
    found = [np.linalg.solve(loop, h[:, line, None] * from_inputs) for line, loop in enumerate(loops)]
    return np.stack(found, axis=-1), np.array([np.linalg.cond(loop) for loop in loops])
