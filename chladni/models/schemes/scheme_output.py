"""Outputs that a scheme declares: points that a log measures, or that matter."""

from dataclasses import dataclass

from chladni.models.core.port import HoldKind
from chladni.models.schemes.block import require_name


@dataclass(frozen=True, slots=True, kw_only=True)
class SchemeOutput:
    """The signal behind a block, under a name of its own.

    Attributes
    ----------
    name
        Name of the output; it may be the block's own.
    at
        The block; by default the one with the output's name.
    unit
        SI unit; the block's when not given.
    channel
        Channel of a log that measures it, or None.
    hold
        How it's sampled, see `Terminal`.
    """

    name: str
    at: str = ""
    unit: str = ""
    channel: str | None = None
    hold: HoldKind | None = None

    def __post_init__(self) -> None:
        require_name(self.name, "output")
        object.__setattr__(self, "at", self.at or self.name)
