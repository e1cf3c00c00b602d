"""Effects at inputs, outputs and joints of a system whose equations nobody knows."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.simulators.joint_law import JointLaw
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect
from chladni.models.core.port import Port, Terminal
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


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
    terminals
        What the rows are.
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
    compiled = lone_joint(joint)
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
    count = len(names)
    return _equations(
        d=np.eye(count),
        inputs=names if kind == "input" else hidden,
        outputs=hidden if kind == "input" else names,
        ports=(),
    )


def lone_joint(joint: Port) -> CompiledModel:
    """Give equations that hold nothing but one joint."""
    return _equations(d=np.zeros((0, 0)), inputs=(), outputs=(), ports=(joint,))


def unconnected(inputs: Sequence[Terminal], outputs: Sequence[Terminal], joints: Sequence[Port]) -> CompiledModel:
    """Give equations that hold inputs, outputs and joints, and no way from one to the other."""
    d = np.zeros((len(outputs), len(inputs)))
    return _equations(d=d, inputs=tuple(inputs), outputs=tuple(outputs), ports=tuple(joints))


def _equations(
    *, d: Real, inputs: tuple[Terminal, ...], outputs: tuple[Terminal, ...], ports: tuple[Port, ...]
) -> CompiledModel:
    columns, rows, count = len(inputs), len(outputs), len(ports)
    return CompiledModel(
        a=np.zeros((0, 0)),
        b=np.zeros((0, columns)),
        c=np.zeros((rows, 0)),
        d=d,
        g=np.zeros((0, count)),
        h=np.zeros((rows, count)),
        displacement_state=np.zeros((count, 0)),
        displacement_column=np.zeros((count, columns)),
        displacement_port=np.zeros((count, count)),
        velocity_state=np.zeros((count, 0)),
        velocity_column=np.zeros((count, columns)),
        velocity_port=np.zeros((count, count)),
        inputs=inputs,
        outputs=outputs,
        states=(),
        ports=ports,
    )
