"""Causes at servos: commands that are late, gains, drives that give too little."""

from dataclasses import replace

import numpy as np

from chladni_withheld.robots.cause import ALL_COMMANDS, Cause, Stage, served, share
from chladni_withheld.robots.excitation import Rng


def common_delay(rng: Rng, _stage: Stage, _joint: int) -> Cause:
    """All commands arrive late."""
    delay_s = float(rng.uniform(0.003, 0.02))
    return Cause(effect="delay", site=ALL_COMMANDS, law="dead time", parameters={"delay": delay_s},
                 change=lambda machine: replace(machine, servo=replace(
                     machine.servo, delay_s=machine.servo.delay_s + delay_s)))  # fmt: skip


def joint_delay(rng: Rng, stage: Stage, joint: int) -> Cause:
    """The commands of one joint arrive late."""
    delay_s = float(rng.uniform(0.006, 0.03))
    return Cause(effect="delay", site=stage.name(joint), law="dead time", parameters={"delay": delay_s},
                 change=lambda machine: served(machine, joint=joint, delay_s=delay_s))  # fmt: skip


def gain(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A torque constant that isn't what it's believed to be."""
    value = float(rng.choice([rng.uniform(0.6, 0.9), rng.uniform(1.1, 1.4)]))
    # Without the torque in the log, kp and kd that are off alike are the same.
    also = (("controller_gain", stage.name(joint)),) if stage.scene.recorder.effort == "none" else ()
    return Cause(effect="gain_error", site=stage.name(joint), law="constant", parameters={"gain": value}, also=also,
                 change=lambda machine: served(machine, joint=joint, gain=value))  # fmt: skip


def controller_gain(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A loop whose gains are others than those believed, kp more or less than kd."""
    kp = float(rng.choice([rng.uniform(0.6, 0.85), rng.uniform(1.2, 1.5)]))
    kd = float(1.0 + rng.uniform(-0.4, 0.4) * (kp - 1.0))
    servo = stage.scene.machine.servo
    numbers = {"kp": kp * float(servo.kp[joint]), "kd": kd * float(servo.kd[joint])}
    return Cause(effect="controller_gain", site=stage.name(joint), law="constant", parameters={"kp": kp, "kd": kd},
                 change=lambda machine: served(machine, joint=joint, **numbers))  # fmt: skip


def saturation(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A motor that gives less than its most extreme command."""
    torque = np.abs(stage.quiet.given[joint])
    limit = float(np.quantile(torque, rng.uniform(0.75, 0.93)))
    return Cause(effect="saturation", site=stage.name(joint), law="hard", parameters={"limit": limit},
                 change=lambda machine: served(machine, joint=joint, most=limit))  # fmt: skip


def dead_zone(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A drive that gives nothing below some torque."""
    stage.require_reversals(joint)
    width = share(rng, 0.3, 0.8) * float(stage.swing[joint])
    return Cause(effect="dead_zone", site=stage.name(joint), law="hard", parameters={"width": width},
                 change=lambda machine: served(machine, joint=joint, dead=width))  # fmt: skip
