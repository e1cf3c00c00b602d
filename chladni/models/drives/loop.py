"""A controller around a drive, and closing its loop."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.core.state_space import StateSpace
from chladni.models.drives.signal_ports import limit_port, with_limit, with_port
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

# Below this, the direct way around the loop is one but for rounding.
_ILL_POSED = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """A controller that commands one input of a drive.

    Attributes
    ----------
    controller
        Its output has the name of the input that it commands, which then is no input any more. Each of its inputs
        that has the name of an output of the drive is fed back; the others become inputs of the drive.
    tracking
        One number for each state of the controller: the state's rate for each unit that the limit of the commanded
        input adds. It takes away, so that an integral that tracks it doesn't wind up. Empty for none.
    limit
        Law that limits the command, or None; its ``port`` is filled in. A limit that the drive has already is kept.
    """

    controller: StateSpace
    tracking: tuple[float, ...] = ()
    limit: PortLaw | None = None

    @property
    def command(self) -> str:
        """Name of the input that the loop commands."""
        return self.controller.outputs[0].name

    def renamed(self, names: Mapping[str, str]) -> "Loop":
        """Give the same loop with other names of its signals."""
        controller = replace(
            self.controller,
            inputs=tuple(_renamed(terminal, names) for terminal in self.controller.inputs),
            outputs=tuple(_renamed(terminal, names) for terminal in self.controller.outputs),
        )
        return replace(self, controller=controller)


def close_loop(plant: CompiledModel, loop: Loop) -> CompiledModel:
    """Put a controller around a compiled model.

    ``u_c = C_k x_k + D_k w`` takes the place of the commanded input u_c; w are new inputs, which stand in front of
    those that remain, and outputs that are fed back with all that laws add to them.

    Raises
    ------
    ModelError
        When the command acts at once on what is fed back and the loop has no solution (``1 - D_k D = 0``); when
        something acts on the samples of a signal inside the loop.
    """
    _require_no_maps(plant, loop)
    plant = with_port(plant, loop.command, "input")
    if loop.limit is not None:
        plant = with_limit(plant, loop.command, loop.limit)
    command = plant.column_of(loop.command)
    references = _references(plant, loop)
    n, m, k, r = len(plant.states), plant.columns, len(loop.controller.states), len(references)
    # The commanded input is no input any more; generated ones stay behind the others.
    rest = [column for column in range(m) if column != command]
    # Row by row: what x, u and f of the plant are in the coordinates (x, x_k, references, rest of u, f).
    old = np.zeros((n + m + len(plant.ports), n + k + r + m - 1 + len(plant.ports)))
    old[:n, :n] = np.eye(n)
    old[[n + column for column in rest], n + k + r : n + k + r + m - 1] = np.eye(m - 1)
    old[n + m :, n + k + r + m - 1 :] = np.eye(len(plant.ports))
    own = np.eye(old.shape[1])[n : n + k]
    # First as if the command were zero, then solved for the command that answers itself.
    taken = _taken(plant, loop, references, old)
    direct = _direct(plant, loop, command)
    old[n + command] = _command_row(loop, own, taken, direct)
    taken += np.outer(direct, old[n + command])
    rates = loop.controller.a @ own + loop.controller.b @ taken + _tracking(plant, loop, old.shape[1])
    return _assembled(plant, loop, references, old, rates)


def _references(plant: CompiledModel, loop: Loop) -> list[int]:
    outputs = {terminal.name for terminal in plant.outputs}
    return [place for place, terminal in enumerate(loop.controller.inputs) if terminal.name not in outputs]


def _require_no_maps(plant: CompiledModel, loop: Loop) -> None:
    fed_back = {terminal.name for terminal in loop.controller.inputs}
    # A clock that is late is the log's: the controller reads its sensor by its own, and the loop goes on as it is.
    for place in sorted({place for place, _ in plant.output_maps}):
        if plant.outputs[place].name in fed_back:
            raise ModelError(
                f"output {plant.outputs[place].name!r} feeds a loop; what acts on samples can't act inside it"
            )


def _taken(plant: CompiledModel, loop: Loop, references: list[int], old: Real) -> Real:
    """Inputs of the controller in the new coordinates, with the command at zero."""
    n, k = len(plant.states), len(loop.controller.states)
    outputs = np.hstack([plant.c, plant.d, plant.h]) @ old
    names = [terminal.name for terminal in plant.outputs]
    rows = np.zeros((len(loop.controller.inputs), old.shape[1]))
    for place, terminal in enumerate(loop.controller.inputs):
        if place in references:
            rows[place, n + k + references.index(place)] = 1.0
        else:
            rows[place] = outputs[names.index(terminal.name)]
    return rows


def _direct(plant: CompiledModel, loop: Loop, command: int) -> Real:
    """How much of the command each input of the controller sees at once."""
    names = [terminal.name for terminal in plant.outputs]
    return np.array(
        [plant.d[names.index(t.name), command] if t.name in names else 0.0 for t in loop.controller.inputs]
    )


def _command_row(loop: Loop, own: Real, taken: Real, direct: Real) -> Real:
    around = (loop.controller.d @ direct).item()
    if abs(1.0 - around) < _ILL_POSED * max(1.0, abs(around)):
        raise ModelError(
            f"the loop over {loop.command!r} is ill-posed: its command acts on what it feeds back "
            "at once with a gain of one; put a lag into the loop"
        )
    return np.asarray((loop.controller.c @ own + loop.controller.d @ taken)[0] / (1.0 - around), dtype=np.float64)


def _tracking(plant: CompiledModel, loop: Loop, columns: int) -> Real:
    rows = np.zeros((len(loop.controller.states), columns))
    limits = [place for place, port in enumerate(plant.ports) if port.name == limit_port(loop.command)]
    if loop.tracking and limits:
        rows[:, columns - len(plant.ports) + limits[0]] = loop.tracking
    return rows


def _assembled(plant: CompiledModel, loop: Loop, references: list[int], old: Real, rates: Real) -> CompiledModel:
    states, count = len(plant.states) + len(loop.controller.states), len(plant.ports)
    end = old.shape[1] - count

    # Every row of the plant is a sum of x, u and f, so one product rewrites them all.
    def split(*blocks: Real) -> tuple[Real, Real, Real]:
        rows = np.hstack(blocks) @ old
        return rows[:, :states], rows[:, states:end], rows[:, end:]

    a, b, g = split(plant.a, plant.b, plant.g)
    c, d, h = split(plant.c, plant.d, plant.h)
    pd, qd, rd = split(plant.displacement_state, plant.displacement_column, plant.displacement_port)
    ps, qs, rs = split(plant.velocity_state, plant.velocity_column, plant.velocity_port)
    # References stand in front: the first input is the one that a simulation excites unless told otherwise.
    commanded = [t.name for t in plant.inputs].index(loop.command)
    return replace(
        plant,
        a=np.vstack([a, rates[:, :states]]), b=np.vstack([b, rates[:, states:end]]), c=c, d=d,
        g=np.vstack([g, rates[:, end:]]), h=h,
        displacement_state=pd, displacement_column=qd, displacement_port=rd,
        velocity_state=ps, velocity_column=qs, velocity_port=rs,
        inputs=(
            *(loop.controller.inputs[place] for place in references),
            *(t for place, t in enumerate(plant.inputs) if place != commanded),
        ),
        states=(*plant.states, *loop.controller.states),
        input_maps=tuple(
            (len(references) + place - (place > commanded), action) for place, action in plant.input_maps
        ),
        input_delays_s=(
            *(0.0 for _ in references),
            *(delay for place, delay in enumerate(plant.input_delays_s) if place != commanded),
        ),
    )  # fmt: skip


def _renamed(terminal: Terminal, names: Mapping[str, str]) -> Terminal:
    return replace(terminal, name=names.get(terminal.name, terminal.name))
