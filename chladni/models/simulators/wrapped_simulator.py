"""A simulator with effects wrapped around it, as a model: implements `BlackBox`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, ModelKind
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import HoldKind, Port, Terminal
from chladni.models.core.simulation import Simulation
from chladni.models.effects.wording import nearest
from chladni.models.simulators.joint_law import JointLaw
from chladni.models.simulators.simulator import RefinableSimulator, Simulator, SimulatorResponse
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class WrappedSimulator:
    """A simulator, numbers that were tuned, and effects at its inputs, joints and outputs.

    Attributes
    ----------
    values
        Parameters that differ from the simulator's own, by name.
    effects
        As `chladni.attached` makes them; at one site in the order of the signal.

    Raises
    ------
    ModelError
        When an effect's site is no input, output or joint of the simulator, or the effect can't act there.
    """

    simulator: Simulator
    values: Mapping[str, float] = field(default_factory=dict)
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        self.simulator.parameters.with_values(self.values)
        known = [site for kind in ("input", "output", "joint") for site in self.sites(kind)]
        for effect in self.effects:
            if effect.site not in known:
                raise ModelError(
                    f"{effect.effect}: {self.simulator.name!r} has no {effect.site!r}; "
                    f"{nearest(effect.site, known, 'sites')}"
                )

    @property
    def name(self) -> str:
        """The simulator's."""
        return self.simulator.name

    @property
    def kind(self) -> ModelKind:
        """Signals only: a scheme without blocks."""
        return "scheme"

    @property
    def parameters(self) -> Parameters:
        """The simulator's, with the values here."""
        return self.simulator.parameters.with_values(self.values)

    @property
    def untold(self) -> tuple[str, ...]:
        """Sentences on what can't be looked for."""
        told = ["effects at bodies and the ground can't be wrapped around a simulator and were not tried"]
        if not self.simulator.joints:
            told.append("the simulator names no joints, so that friction and play were not tried")
        return tuple(told)

    def sites(self, kind: str) -> list[str]:
        """Names of the inputs, outputs or joints."""
        if kind == "joint":
            return [joint.name for joint in self.simulator.joints]
        return [each.name for each in (self.simulator.inputs if kind == "input" else self.simulator.outputs)]

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the same with some parameters replaced."""
        return replace(self, values={**self.values, **values})

    def with_effects(self, effects: Sequence[Effect]) -> Self:
        """Give the same with these effects in place of those it has."""
        return replace(self, effects=tuple(effects))

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:  # noqa: ARG002 - what a model offers
        """Give the same: what happens between samples is the simulator's."""
        return self

    def refined(self) -> Self | None:
        """Give the same with steps half as long, None where the simulator can't tell the error of its step."""
        if not isinstance(self.simulator, RefinableSimulator):
            return None
        return replace(self, simulator=self.simulator.refined())

    def compile(self) -> CompiledModel:
        """Give inputs, outputs and joints, with nothing in between."""
        inputs = [replace(one, hold=one.hold or "foh") for one in self.simulator.inputs]
        return equations(inputs=inputs, outputs=self.simulator.outputs, ports=self.simulator.joints)

    def flags(self, simulation: Simulation) -> tuple[str, ...]:  # noqa: ARG002 - what a model offers
        """None."""
        return ()

    def respond(self, inputs: Real, sample_rate_hz: float) -> SimulatorResponse:
        """Simulate from the start of the log.

        Parameters
        ----------
        inputs
            ``[input, sample]`` as the log holds them, SI.

        Returns
        -------
        What the sensors would record, and the motion at each joint.

        Raises
        ------
        ModelError
            When the simulation diverges, or an effect can't act at its site.
        """
        acting = with_signals_changed(inputs, sample_rate_hz, self.simulator.inputs, self._at("input"), "input")
        acting_at = self._at("joint")
        laws = {
            joint.name: joint_law(joint, [each for each in acting_at if each.site == joint.name])
            for joint in self.simulator.joints
        }
        response = self.simulator.respond(acting, sample_rate_hz, values=self.values, joint_laws=laws)
        return replace(response, outputs=self.recorded(response.outputs, sample_rate_hz))

    def recorded(self, outputs: Real, sample_rate_hz: float) -> Real:
        """Give what sensors record of true outputs."""
        return with_signals_changed(outputs, sample_rate_hz, self.simulator.outputs, self._at("output"), "output")

    def _at(self, kind: str) -> list[Effect]:
        names = self.sites(kind)
        return [effect for effect in self.effects if effect.site in names]


def with_signals_changed(
    signals: Real,
    sample_rate_hz: float,
    terminals: Sequence[Terminal],
    effects: Sequence[Effect],
    kind: str,
) -> Real:
    """Give the signals as effects at inputs (or outputs) leave them.

    Effects attach to the equations y = u, so that every one of the catalogue acts here as it does around a model.

    Parameters
    ----------
    signals
        ``[terminal, sample]``.
    effects
        At sites among `terminals`, in the order of the signal.
    kind
        ``input`` or ``output``.

    Raises
    ------
    ModelError
        When an effect can't act on a signal alone.
    """
    if not effects:
        return signals
    from chladni.models.integrator.integrator import Integrator

    compiled = wire(terminals, kind)
    for effect in effects:
        compiled = effect.attach(compiled)
    return np.asarray(Integrator(compiled, sample_rate_hz).run(signals).outputs)


def joint_law(joint: Port, effects: Sequence[Effect]) -> JointLaw:
    """Give the law that effects make at one joint.

    Raises
    ------
    ModelError
        When an effect needs more than a force at the joint, such as equations of its own.
    """
    compiled = equations(ports=(joint,))
    for effect in effects:
        attached = effect.attach(compiled)
        if len(attached.laws) != len(compiled.laws) + 1 or attached.states != compiled.states:
            raise ModelError(
                f"{effect.effect} at {joint.name!r}: it's no law of its motion, so it can't act in a simulator"
            )
        compiled = attached
    return JointLaw(laws=compiled.laws)


def wire(terminals: Sequence[Terminal], kind: str) -> CompiledModel:
    """Give the equations y = u, with the terminals' names on one side."""
    names = tuple(Terminal(name=each.name, unit=each.unit) for each in terminals)
    # Sites are told by name alone, so the other side's names must be no sites.
    hidden = tuple(Terminal(name=f"/{each.name}", unit=each.unit) for each in terminals)
    through = np.eye(len(names))
    if kind == "input":
        return equations(inputs=names, outputs=hidden, through=through)
    return equations(inputs=hidden, outputs=names, through=through)


def equations(
    *,
    inputs: Sequence[Terminal] = (),
    outputs: Sequence[Terminal] = (),
    ports: Sequence[Port] = (),
    through: Real | None = None,
) -> CompiledModel:
    """Give equations without states: ``through [output, input]`` passes at once, nothing by default."""
    columns, rows, count = len(inputs), len(outputs), len(ports)
    return CompiledModel(
        a=np.zeros((0, 0)),
        b=np.zeros((0, columns)),
        c=np.zeros((rows, 0)),
        d=np.zeros((rows, columns)) if through is None else through,
        g=np.zeros((0, count)),
        h=np.zeros((rows, count)),
        displacement_state=np.zeros((count, 0)),
        displacement_column=np.zeros((count, columns)),
        displacement_port=np.zeros((count, count)),
        velocity_state=np.zeros((count, 0)),
        velocity_column=np.zeros((count, columns)),
        velocity_port=np.zeros((count, count)),
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        states=(),
        ports=tuple(ports),
    )
