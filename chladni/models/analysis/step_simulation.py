"""A step as a simulation: with the laws of a model where it has some, exactly from the linear equations where not."""

import numpy as np

from chladni.models.analysis.exponential import exponential
from chladni.models.analysis.horizon import horizon
from chladni.models.analysis.linear_path import LinearPath, linear_path
from chladni.models.analysis.step_response import TransientResponse
from chladni.models.analysis.trajectory import powers
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.models.core.simulation import Simulation
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

SAMPLES = 500
# Laws may swing faster than the linear part, and a stop is met in an instant.
NONLINEAR_SAMPLES = 600


def needs_simulation(compiled: CompiledModel) -> bool:
    """Whether laws, maps or dead time inside loops act, so that no linear equations give the whole response."""
    return not compiled.is_linear() or bool(compiled.delays)


def step_simulation(
    model: Model, compiled: CompiledModel, *, from_input: str, size: float, path: LinearPath | None = None
) -> Simulation:
    """Simulate a step of one input from rest, the others being zero.

    Parameters
    ----------
    model
        The model.
    compiled
        The same, compiled.
    from_input
        Which steps at 0 s.
    size
        In the input's unit.
    path
        From that input to all outputs, when there is one already.

    Raises
    ------
    ModelError
        When the model diverges.
    """
    path = path or linear_path(compiled, from_input=from_input)
    seconds = horizon(path.poles).seconds
    if needs_simulation(compiled):
        # Imported here: it brings the compiler of laws, which linear models have no use for.
        from chladni.models.integrator.simulate import simulate

        rate_hz = NONLINEAR_SAMPLES / seconds
        return simulate(model, _series([path.source], np.full((1, NONLINEAR_SAMPLES + 1), size), rate_hz))
    return _exact(model, compiled, path, size, seconds)


def simulated_response(simulation: Simulation, compiled: CompiledModel, source: Terminal) -> TransientResponse:
    """Give the outputs of a simulated step as a response."""
    count = simulation.outputs.values.shape[1]
    time_s = np.arange(count) / simulation.outputs.sample_rate_hz
    return TransientResponse(
        time_s=np.broadcast_to(time_s, simulation.outputs.values.shape),
        values=np.asarray(simulation.outputs.values, dtype=np.float64),
        source=source,
        outputs=compiled.outputs,
        dead_time_s=np.zeros(len(compiled.outputs)),
        notes=("simulated with the laws that act; spectra, roots and margins are those of the linear equations",),
    )


def _exact(model: Model, compiled: CompiledModel, path: LinearPath, size: float, seconds: float) -> Simulation:
    count, step_s = path.b.size, seconds / SAMPLES
    generator = np.zeros((count + 1, count + 1))
    generator[:count, :count], generator[:count, count] = path.a, path.b
    start = np.append(np.zeros(count), size)
    # Equidistant, unlike the response that is drawn: limits are told with their time, read off samples.
    moved = powers(exponential(generator * step_s), start, SAMPLES + 1)
    states = np.zeros((len(compiled.states), SAMPLES + 1))
    states[path.kept] = moved[:count] * path.scale[:, None]
    outputs = np.append(path.c, path.d[:, None], axis=1) @ moved
    return Simulation(
        model=model.name,
        inputs=_series([path.source], np.full((1, SAMPLES + 1), size), 1 / step_s),
        outputs=_series(path.outputs, outputs, 1 / step_s),
        states=states,
        state_names=compiled.states,
    )


def _series(terminals: list[Terminal] | tuple[Terminal, ...], values: Real, rate_hz: float) -> TimeSeries:
    channels = tuple(Channel(name=one.channel or one.name, unit=one.unit) for one in terminals)
    return TimeSeries(values=values, sample_rate_hz=rate_hz, start_time_ns=0, channels=channels)
