"""Samples of a signal that a simulation didn't record, from those that it did."""

from collections.abc import Sequence

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Terminal
from chladni.models.core.simulation import Simulation
from chladni.signals.arrays import Real


def computed_output(
    compiled: CompiledModel, simulation: Simulation, name: str, driven: Sequence[Terminal]
) -> Real | None:
    """Give ``y = C x + D u + H f`` of one output, ``[sample]``, whether or not the model shows it.

    Parameters
    ----------
    compiled
        All signals of the model that was simulated.
    driven
        Its inputs that the simulation recorded, with their channels; others are zero.

    Returns
    -------
    None where the equations alone don't tell: behind dead time, or what acts on the samples of inputs.
    """
    names = [terminal.name for terminal in compiled.outputs]
    ports = sorted({law.port for law in compiled.laws})
    told = simulation.state_names == compiled.states and len(simulation.motions) == len(ports)
    # The recorded input is the command, before all that acts on its samples; forces of dead times aren't recorded.
    changed = compiled.delays or compiled.input_maps or any(compiled.input_delays_s)
    if name not in names or changed or not told:
        return None
    row = names.index(name)
    samples = compiled.c[row] @ simulation.states
    recorded = [channel.name for channel in simulation.inputs.channels]
    for terminal in driven:
        channel = terminal.channel or terminal.name
        if channel in recorded:
            signal = np.asarray(simulation.inputs.values[recorded.index(channel)], dtype=np.float64)
            samples = samples + compiled.d[row, compiled.column_of(terminal.name)] * signal
    for port, motion in zip(ports, simulation.motions, strict=True):
        samples = samples + compiled.h[row, port] * motion.force
    return np.asarray(samples, dtype=np.float64)
