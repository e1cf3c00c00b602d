"""A whole machine from a plan, true numbers and hidden effects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from chladni.gap.blind.assembly import added
from chladni.gap.blind.drive_equations import begin_drive, finish_drive
from chladni.gap.blind.equations import (
    FLOOR,
    Machine,
    begin_structure,
    command,
    effects_at,
    empty_machine,
    finish_structure,
    motion,
    write_motion,
)
from chladni.gap.blind.hidden_forces import at_body, at_joint, tone_name
from chladni.gap.blind.hidden_signals import acting_place, through_actuator, through_sensor
from chladni.gap.blind.plan import Hidden, Output, Plan


def unseen_signals(effects: Sequence[Hidden]) -> list[str]:
    """Name what drives the machine and isn't in the log."""
    tones = [tone_name(one) for one in effects if one.law == "tone"]
    return [*tones, *([FLOOR] if any(one.effect == "base_vibration" for one in effects) else [])]


def built(plan: Plan, numbers: Mapping[str, float], effects: Sequence[Hidden] = (), *, watched: bool = False,
          ) -> Machine:  # fmt: skip
    """Give the machine's equations; its outputs are those of the plan.

    Parameters
    ----------
    watched
        Whether displacement and speed of each joint, and what acts at each input, are outputs too:
        ``JOINT.d``, ``JOINT.s``, ``INPUT.u``, ``INPUT.x`` (where it acts).
    """
    machine = empty_machine(plan, numbers, unseen_signals(effects))
    begin, finish = (begin_drive, finish_drive) if plan.drive else (begin_structure, finish_structure)
    begin(machine)
    _place_bodies(machine, effects)
    _place_inputs(machine, effects)
    for joint in plan.joints:
        for hidden in effects_at(effects, joint.name):
            at_joint(machine, hidden)
    finish(machine)
    write_motion(machine)
    _place_outputs(machine, effects)
    if watched:
        _watch(machine)
    return machine


def _place_bodies(machine: Machine, effects: Sequence[Hidden]) -> None:
    for body in machine.plan.bodies:
        for hidden in effects_at(effects, body):
            at_body(machine, hidden)


def _place_inputs(machine: Machine, effects: Sequence[Hidden]) -> None:
    loop = machine.plan.loop
    for one in machine.plan.inputs:
        signal = {one.name: 1.0}
        if loop is not None and one.name == loop.drives:
            sensor = next(each for each in machine.plan.outputs if each.name == loop.feedback)
            gains = [hidden.numbers["gain"] for hidden in effects_at(effects, sensor.name) if hidden.law == "factor"]
            position = motion(machine, sensor)
            speed = motion(machine, _rate_of(sensor))
            # A wrong gain of the sensor is seen by the controller; anything else at it is kept out of loops.
            for gain in gains:
                position, speed = added((gain, position)), added((gain, speed))
            signal = command(machine, loop, position, speed)
            machine.assembly.outputs[one.name] = dict(signal)
        for hidden in effects_at(effects, one.name):
            signal = through_actuator(machine, hidden, signal)
        machine.acting[one.name] = signal


def _rate_of(sensor: Output) -> Output:
    return replace(sensor, measures="velocity")


def _place_outputs(machine: Machine, effects: Sequence[Hidden]) -> None:
    clean = {one.name: motion(machine, one) for one in machine.plan.outputs}
    for one in machine.plan.outputs:
        signal = clean[one.name]
        for hidden in effects_at(effects, one.name):
            if hidden.law == "share":
                signal = added((1.0, signal), (hidden.numbers["coefficient"], clean[hidden.source]))
            else:
                signal = through_sensor(machine, hidden, signal)
        machine.assembly.outputs[one.name] = signal


def _watch(machine: Machine) -> None:
    for joint in machine.plan.joints:
        d, s = machine.stretch(joint)
        machine.assembly.outputs |= {f"{joint.name}.d": d, f"{joint.name}.s": s}
    if "force" in machine.signals:
        machine.assembly.outputs["drive.force"] = machine.signals["force"]
    for one in machine.plan.inputs:
        machine.assembly.outputs[f"{one.name}.u"] = dict(machine.acting[one.name])
        machine.assembly.outputs[f"{one.name}.x"] = acting_place(machine, one.name)[0]
