"""Closing the loop of a controller around a compiled structure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.structures.control_law import control_law
from chladni.models.structures.controller import FILTER, Controller
from chladni.models.structures.limiter import limiter
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

# A direct way around the loop that comes nearer to 1 than this is 1 but for rounding.
_ILL_POSED = 1e-9


def close_loop(plant: CompiledModel, controller: Controller, disturbances: Sequence[Terminal] = ()) -> CompiledModel:
    """Let a controller command one input of a compiled model.

    The reference becomes an input in front of the others, named like the controller; the driven input is one no
    more. Where it has a channel, the command (after the limit) becomes the last output, with that channel. Its
    ``input`` port is where effects act on the command; a limit acts before, at the port ``NAME.limit``.

    Parameters
    ----------
    plant
        With the driven input among its inputs and the feedback among its outputs.
    disturbances
        Added to the controller's command before gain and limit; they become inputs behind the others.

    Raises
    ------
    ModelError
        When the loop has no solution (its direct way has gain 1), a rate is asked for that doesn't exist, or what
        is fed back carries an effect that acts on samples only.
    """
    return _Loop(plant, controller, tuple(disturbances)).closed()


def limit_port(controller: Controller) -> str:
    """Name of the port at which a controller's limit acts."""
    return f"{controller.name}.limit"


class _Loop:
    """One loop; rows are over (states, columns of u, what laws add) of the plant, then of the closed model."""

    def __init__(self, plant: CompiledModel, controller: Controller, disturbances: tuple[Terminal, ...]) -> None:
        self._plant, self._controller, self._disturbances = plant, controller, disturbances
        self._law, self._limit = control_law(controller), controller.force_limit()
        self._driven = [terminal.name for terminal in plant.inputs].index(controller.drives)
        self._feedback = [terminal.name for terminal in plant.outputs].index(controller.feedback)
        self._reference = Terminal(
            name=controller.name,
            unit=plant.outputs[self._feedback].unit,
            channel=controller.reference,
            derivatives=1 if self._law.uses_reference_rate else 0,
            hold=controller.hold,
        )
        # Old ports keep their places, since laws name them by index; what is new comes behind them.
        self._n, self._m, self._q = len(plant.states), plant.columns, len(plant.ports)
        self._k, self._r = len(self._law.states), 1 + self._reference.derivatives
        self._first_port = self._n + self._k + self._r + self._m - 1 + len(disturbances)
        self._size = self._first_port + self._q + (1 if self._limit is None else 2)

    def closed(self) -> CompiledModel:
        """Give the model with the loop closed."""
        self._require_signals_inside()
        plant = self._plant
        old = self._old_signals()
        feedback = self._feedback_rows()
        column = plant.column_of(self._controller.drives)
        direct = feedback[:, self._n + column]
        command = self._command(feedback @ old, direct)
        # What is behind the limit is what the controller asks for; effects of the motor come after it, at the last
        # port, and reach the plant but not the record.
        acting = command + (0.0 if self._limit is None else self._unit(self._first_port + self._q))
        old[self._n + column] = acting + self._unit(self._size - 1)
        rates = np.vstack([np.hstack([plant.a, plant.b, plant.g]) @ old, self._controller_rates(feedback @ old)])
        outputs = np.hstack([plant.c, plant.d, plant.h]) @ old
        if plant.inputs[self._driven].channel is not None:
            outputs = np.vstack([outputs, acting])
        displacement = np.hstack([plant.displacement_state, plant.displacement_column, plant.displacement_port]) @ old
        velocity = np.hstack([plant.velocity_state, plant.velocity_column, plant.velocity_port]) @ old
        added = [acting] if self._limit is None else [command, acting]
        # A command is no motion: its ports have no velocity.
        still = np.zeros((len(added), self._size))
        return self._assembled(rates, outputs, np.vstack([displacement, *added]), np.vstack([velocity, still]))

    def _old_signals(self) -> Real:
        """Signals of the plant from those of the closed model; the row of the driven input is left zero."""
        plant, after_reference = self._plant, self._n + self._k + self._r
        old = np.zeros((self._n + self._m + self._q, self._size))
        old[: self._n, : self._n] = np.eye(self._n)
        old[self._n + self._m :, self._first_port : self._first_port + self._q] = np.eye(self._q)
        generated = len(plant.generated)
        driven = plant.column_of(self._controller.drives)
        for place, column in enumerate(one for one in range(self._m) if one != driven):
            # Generated columns stay behind all inputs, so the disturbances go between.
            behind = len(self._disturbances) if column >= self._m - generated else 0
            old[self._n + column, after_reference + place + behind] = 1.0
        return old

    def _feedback_rows(self) -> Real:
        """What is fed back and its rate, ``[2, signal of the plant]``."""
        plant, row = self._plant, self._feedback
        signal = np.concatenate([plant.c[row], plant.d[row], plant.h[row]])
        # Only asked for where it's used: not every feedback has a rate.
        if not self._law.uses_feedback_rate:
            return np.stack([signal, np.zeros_like(signal)])
        return np.stack([signal, self._rate_row()])

    def _rate_row(self) -> Real:
        """Exact derivative of what is fed back: ``y' = C (A x + B u + G f) + D u'``.

        What laws at the feedback's own port add (a sensor's defects) has no rate and isn't in it.
        """
        plant, row = self._plant, self._feedback
        through = plant.d[row].copy()
        columns = plant.c[row] @ plant.b
        first = 0
        for terminal in plant.inputs:
            # The rate of a signal whose derivatives are columns too is the next column.
            for order in range(terminal.derivatives):
                columns[first + order + 1] += through[first + order]
                through[first + order] = 0.0
            first += 1 + terminal.derivatives
        # A law's force jumps when its law does, so what follows it at once has no derivative.
        of_joints = [place for place, port in enumerate(plant.ports) if port.kind != "output"]
        if np.any(through) or np.any(plant.h[row, of_joints]):
            raise ModelError(
                f"controller {self._controller.name!r}: feedback {self._controller.feedback!r} follows a force at "
                f"once, so it has no rate for the law {self._controller.law}; give the gains a {FILTER} in s, or "
                "feed back a displacement or velocity"
            )
        return np.concatenate([plant.c[row] @ plant.a, columns, plant.c[row] @ plant.g])

    def _command(self, feedback: Real, direct: Real) -> Real:
        """Row of the driven input's command before the limit, with the direct way around the loop solved for."""
        law, gain = self._law, self._controller.gain
        row = law.d_feedback @ feedback
        row[self._n : self._n + self._k] += law.c
        row[self._n + self._k : self._n + self._k + self._r] += law.d_reference[: self._r]
        generated = len(self._plant.generated)
        last = self._first_port - generated
        # Disturbances stand in the command's own unit, before the gain.
        row[last - len(self._disturbances) : last] += 1.0
        around = gain * float(law.d_feedback @ direct)
        if abs(1 - around) < _ILL_POSED * max(1.0, abs(around)):
            raise ModelError(
                f"controller {self._controller.name!r}: its command reaches its own feedback at once with a gain of "
                "one, so the loop has no solution; change a gain or put a lag in the loop"
            )
        # command = row + around (command + what laws add behind it)
        behind = np.zeros(self._size)
        behind[self._first_port + self._q :] = around
        return np.asarray((gain * row + behind) / (1 - around))

    def _controller_rates(self, feedback: Real) -> Real:
        law = self._law
        rates = law.b_feedback @ feedback
        rates[:, self._n : self._n + self._k] += law.a
        rates[:, self._n + self._k : self._n + self._k + self._r] += law.b_reference[:, : self._r]
        return np.asarray(rates)

    def _assembled(self, rates: Real, outputs: Real, displacement: Real, velocity: Real) -> CompiledModel:
        plant, driven = self._plant, self._plant.inputs[self._driven]
        n, u, f = (
            slice(0, self._n + self._k),
            slice(self._n + self._k, self._first_port),
            slice(self._first_port, self._size),
        )
        recorded = () if driven.channel is None else (driven,)
        return replace(
            plant,
            a=rates[:, n], b=rates[:, u], g=rates[:, f],
            c=outputs[:, n], d=outputs[:, u], h=outputs[:, f],
            displacement_state=displacement[:, n],
            displacement_column=displacement[:, u],
            displacement_port=displacement[:, f],
            velocity_state=velocity[:, n], velocity_column=velocity[:, u], velocity_port=velocity[:, f],
            inputs=(
                self._reference,
                *(terminal for terminal in plant.inputs if terminal is not driven),
                *self._disturbances,
            ),
            outputs=(*plant.outputs, *recorded),
            states=(*plant.states, *self._law.states),
            ports=(*plant.ports, *self._new_ports()),
            laws=(*plant.laws, *self._limiting()),
            # Nothing acts on inputs yet; the lengths follow the new inputs.
            input_delays_s=(),
            output_offsets_s=(*plant.output_offsets_s, *(0.0 for _ in recorded)),
        )  # fmt: skip

    def _new_ports(self) -> list[Port]:
        unit = self._plant.inputs[self._driven].unit
        acting = Port(name=self._controller.drives, kind="input", unit=unit, displacement_unit=unit)
        if self._limit is None:
            return [acting]
        return [replace(acting, name=limit_port(self._controller)), acting]

    def _limiting(self) -> list[PortLaw]:
        if self._limit is None:
            return []
        return [PortLaw(port=self._q, function=limiter, parameters=(self._limit,))]

    def _require_signals_inside(self) -> None:
        plant = self._plant
        if plant.input_maps or any(plant.input_delays_s):
            raise ModelError("loops are closed before effects act on inputs")
        # An offset of the recorded channel's clock stays outside: the loop goes on as it is.
        if self._feedback in {place for place, _ in plant.output_maps}:
            raise ModelError(
                f"output {self._controller.feedback!r} feeds the controller {self._controller.name!r}; what acts on "
                "its samples can't act inside the loop"
            )

    def _unit(self, place: int) -> Real:
        row = np.zeros(self._size)
        row[place] = 1.0
        return row
