"""Who feeds whom: a scheme's sums as matrices, checked."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.core.port import Terminal
from chladni.models.schemes.block import Block, require_name
from chladni.models.schemes.scheme_output import SchemeOutput
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value
from chladni.signals.wording import near_words

#: Most blocks of a scheme: matrices grow with the square of the number.
MAX_BLOCKS = 1000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wiring(Value):
    """``e = K v + L u``: what goes into each block from what comes out of blocks and from the inputs.

    Attributes
    ----------
    blocks
        K, ``[block, block]`` with entries -1, 0 and 1.
    inputs
        L, ``[block, input]``, likewise.
    """

    blocks: Real
    inputs: Real

    def __post_init__(self) -> None:
        self._freeze()


def wired(blocks: Sequence[Block], inputs: Sequence[Terminal]) -> Wiring:
    """Give the matrices of a scheme whose names were checked."""
    columns = {name: place for place, name in enumerate(_source_names(blocks, inputs))}
    sums = np.zeros((len(blocks), len(columns)))
    for row, block in enumerate(blocks):
        for source, sign in block.sources:
            sums[row, columns[source]] = sign
    return Wiring(blocks=sums[:, : len(blocks)], inputs=sums[:, len(blocks) :])


def require_wiring(blocks: Sequence[Block], inputs: Sequence[Terminal], outputs: Sequence[SchemeOutput]) -> None:
    """Check names and sources.

    Raises
    ------
    ModelError
        When there's no block or there are too many, a name is taken twice, or a source is unknown (the nearest one is
        named).
    """
    if not 1 <= len(blocks) <= MAX_BLOCKS:
        raise ModelError(f"a scheme has 1 to {MAX_BLOCKS} blocks, this one has {len(blocks)}")
    for terminal in inputs:
        require_name(terminal.name, "input")
        if terminal.derivatives:
            raise ModelError(f"input {terminal.name!r}: a scheme takes signals without their derivatives")
    names = _source_names(blocks, inputs)
    # An output may have the name of its own block: it's the same signal, and one site.
    _require_unique(names + [output.name for output in outputs if output.name != output.at])
    _require_unique([output.name for output in outputs])
    known = set(names)
    for block in blocks:
        for source, _ in block.sources:
            if source not in known:
                raise ModelError(f"block {block.name!r}: input {source!r:.80} is unknown; {nearest(source, names)}")
    own = [block.name for block in blocks]
    for output in outputs:
        if output.at not in own:
            raise ModelError(f"output {output.name!r}: block {output.at!r:.80} is unknown; {nearest(output.at, own)}")


def _source_names(blocks: Sequence[Block], inputs: Sequence[Terminal]) -> list[str]:
    return [block.name for block in blocks] + [terminal.name for terminal in inputs]


def nearest(name: str, known: Iterable[str]) -> str:
    """Advice for a name that is unknown."""
    known = list(known)
    near = near_words(name, known)
    return f"did you mean {near[0]}?" if near else f"there are: {', '.join(known[:20])}"


def _require_unique(names: Sequence[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise ModelError(f"the name {name!r} is taken; names of blocks, inputs and outputs are unique")
        seen.add(name)
