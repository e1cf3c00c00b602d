"""Exact response of every output to a step or an impulse of one input."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from chladni.models.analysis.horizon import PERIODS, Horizon, horizon
from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.trajectory import Trajectory, trajectory
from chladni.models.core.port import Terminal
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransientResponse(Value):
    """Outputs after a step or an impulse at 0 s.

    Attributes
    ----------
    time_s
        ``[output, point]``, not falling, denser at the start: each output begins after its own dead time.
    values
        ``[output, point]``, each output in its own unit.
    source, outputs
        Terminals.
    dead_time_s
        ``[output]``: each output rests that long before it answers; already in `values`.
    notes
        Sentences: where the picture ends before the response does.
    """

    time_s: Real
    values: Real
    source: Terminal
    outputs: tuple[Terminal, ...]
    dead_time_s: Real
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()


def step_response(path: LinearPath, *, size: float = 1.0, seconds: float | None = None) -> TransientResponse:
    """Give the response of every output to a step, exact at each point.

    Parameters
    ----------
    path
        From the input that steps.
    size
        In the input's unit.
    seconds
        Length; by the poles when None: until the slowest decay is over, five growths of what grows, one second of
        what only integrates.

    Raises
    ------
    ModelError
        When a dead time acts inside a loop; such a system is simulated instead.
    """
    chosen = _chosen(path, seconds)
    # The size last: whoever reads behaviour off the unit step has followed the same states already.
    rows = size * np.append(path.c, path.d[:, None], axis=1)
    return _response(path, step_trajectory(path, chosen), rows, chosen)


def impulse_response(path: LinearPath, *, area: float = 1.0, seconds: float | None = None) -> TransientResponse:
    """Give the response of every output to an impulse, after it; arguments as of `step_response`.

    An output that the input reaches directly (d is not 0) also repeats the impulse itself at 0 s; this isn't shown,
    and a note says it.
    """
    chosen = _chosen(path, seconds)
    motion = trajectory(
        path.a,
        area * path.b,
        seconds=chosen.seconds,
        fastest_s=chosen.fastest_s,
        longest_step_s=chosen.longest_step_s,
    )
    direct = [output.name for output, through in zip(path.outputs, path.d, strict=True) if through]
    notes = (f"{', '.join(direct)}: the impulse itself passes too; it isn't shown",) if direct else ()
    return _response(path, motion, path.c, chosen, notes)


def step_trajectory(path: LinearPath, chosen: Horizon) -> Trajectory:
    """Follow the states, and last the constant input, after a unit step.

    ::

        d/dt [x; u] = [A b; 0 0] [x; u],   [x; u](0) = [0; 1]
    """
    count = path.b.size
    generator = np.zeros((count + 1, count + 1))
    generator[:count, :count], generator[:count, count] = path.a, path.b
    return _unit_step(generator.tobytes(), count + 1, chosen)


# Of one setting the numbers and the charts need the same motion.
@lru_cache(maxsize=2)
def _unit_step(generator: bytes, states: int, chosen: Horizon) -> Trajectory:
    return trajectory(
        np.frombuffer(generator).reshape(states, states),
        np.eye(states)[-1],
        seconds=chosen.seconds,
        fastest_s=chosen.fastest_s,
        longest_step_s=chosen.longest_step_s,
    )


def _chosen(path: LinearPath, seconds: float | None) -> Horizon:
    if path.looped:
        raise ModelError(
            "a dead time acts inside a loop, so that no matrix exponential gives the response; simulate the model"
        )
    found = horizon(path.poles, periods=PERIODS)
    if seconds is None:
        return found
    if not (np.isfinite(seconds) and seconds > 0):
        raise ModelError(f"a response of {seconds} s can't be shown; give a length above 0 s")
    step_s = min(found.longest_step_s, seconds / 500)
    return Horizon(seconds=seconds, fastest_s=found.fastest_s, longest_step_s=max(step_s, seconds / 20_000))


def _response(
    path: LinearPath, motion: Trajectory, rows: Real, chosen: Horizon, notes: tuple[str, ...] = ()
) -> TransientResponse:
    values = rows @ motion.states
    time_s = motion.time_s + path.dead_time_s[:, None]
    if np.any(path.dead_time_s):
        # Each output rests from 0 s on until it answers; a clock that is early shows the answer before 0 s.
        rest = np.zeros((len(rows), 1))
        time_s = np.concatenate([np.minimum(rest, time_s[:, :1]), time_s[:, :1], time_s], axis=1)
        values = np.concatenate([rest, rest, values], axis=1)
    return TransientResponse(
        time_s=time_s,
        values=values,
        source=path.source,
        outputs=path.outputs,
        dead_time_s=path.dead_time_s,
        notes=notes + ((chosen.note,) if chosen.note else ()),
    )
