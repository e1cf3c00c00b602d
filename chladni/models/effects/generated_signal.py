"""Signals that nothing in a log drives: they enter a model as inputs that are computed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel, GeneratedInput
from chladni.models.core.port import Terminal
from chladni.models.effects.linear_feedback import Signal
from chladni.signals.arrays import Real


def with_generated(
    compiled: CompiledModel, *, name: str, unit: str, samples: Callable[[Real], Real]
) -> tuple[CompiledModel, Signal]:
    """Add a computed input that acts nowhere yet; give the model and the input's signal."""
    # Names of inputs are sites and channels: two floors, or a floor and an input, must not share one.
    taken = [*(one.terminal.name for one in compiled.generated), *(one.name for one in compiled.inputs)]
    number, free = 2, name
    while free in taken:
        free, number = f"{name}.{number}", number + 1
    added = GeneratedInput(terminal=Terminal(name=free, unit=unit), samples=samples)
    wider = replace(
        compiled,
        b=np.pad(compiled.b, ((0, 0), (0, 1))),
        d=np.pad(compiled.d, ((0, 0), (0, 1))),
        displacement_column=np.pad(compiled.displacement_column, ((0, 0), (0, 1))),
        velocity_column=np.pad(compiled.velocity_column, ((0, 0), (0, 1))),
        generated=(*compiled.generated, added),
    )
    signal = Signal(
        states=np.zeros(len(wider.states)),
        columns=np.eye(wider.columns)[-1],
        ports=np.zeros(len(wider.ports)),
    )
    return wider, signal
