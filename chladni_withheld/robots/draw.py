"""Cases of all kinds: the robot's files, the log's topics, and the truth of what they hide."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from chladni.signals.errors import EstimateError
from chladni.signals.linear_algebra import in_one_thread
from chladni_withheld.case import HiddenEffect, Kind, WithheldCase
from chladni_withheld.robots.causes import CAUSES, Cause, Stage, coulomb
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Machine, Motion
from chladni_withheld.robots.recording import URDF, robot_toml, topics
from chladni_withheld.robots.scene import RefusedError, Scene, draw_scene
from chladni_withheld.robots.severity import lacking, severity

DEFAULT: Mapping[Kind, int] = MappingProxyType({"effect": 50, "none": 20, "two": 15, "all_joints": 5, "faint": 10})
_MOST_DRAWS = 200
#: A clear cause leaves at least so many times what the log can't tell when inertias take what they may; and at most.
CLEAR, TOO_CLEAR = 3.0, 300.0


@in_one_thread()
def draw_case(seed: int, index: int, kind: Kind) -> WithheldCase:
    """Draw a case of a kind; see `chladni_withheld.case.DrawCase`.

    Raises
    ------
    EstimateError
        When no draw makes a fair case, which is a defect.
    """
    refused: list[str] = []
    # The word stays when a draw is refused: what is hard to draw would be rare.
    for rng in np.random.default_rng((seed, index)).spawn(_MOST_DRAWS):
        words = np.random.default_rng((seed, index, 1)).permutation(sorted(CAUSES)).tolist()
        try:
            return _drawn(rng, kind, words, refused)
        except RefusedError as refusal:
            refused.append(str(refusal))
    raise EstimateError(f"no {kind} case for seed {seed}, index {index}: {', '.join(sorted(set(refused)))}")


def _drawn(rng: Rng, kind: Kind, words: Sequence[str], refused: Sequence[str]) -> WithheldCase:
    exact = kind == "none" and bool(rng.random() < 0.5)
    scene = draw_scene(rng, inertia=0.0 if exact else 0.03, declared=0.03)
    stage = Stage(scene=scene, quiet=scene.motion())
    _require_room(scene, stage.quiet)
    causes = PLOTS[kind](rng, stage, words)
    machine = _with(scene.machine, causes)
    motion = scene.motion(machine) if causes else stage.quiet
    _require_room(scene, motion)
    told = [_told(stage, kind, cause, alone=len(causes) == 1, motion=motion) for cause in causes]
    whole = severity(scene, lacking(scene, scene.machine.model, motion), motion) if causes else None
    return WithheldCase(
        kind=kind, model=robot_toml(scene), model_file="robot.toml", beside={URDF: scene.robot.urdf},
        topics=topics(rng, scene, motion), effects=tuple(told), ratio=None if whole is None else whole[0],
        ratio_tuned=None if whole is None else whole[1], excitation=(scene.excitation,),
        starts_in_motion=bool(np.abs(motion.speed[:, 0]).max() > 0.01),
        further={"robot": _robot(scene, machine), "inertias_exact": exact, "refused": list(refused)},
    )  # fmt: skip


def _with(machine: Machine, causes: Sequence[Cause]) -> Machine:
    for cause in causes:
        machine = cause.change(machine)
    return machine


def _require_room(scene: Scene, motion: Motion) -> None:
    """A user's log stays inside the robot's torques and ranges."""
    if np.any(np.abs(motion.asked) > 0.95 * scene.machine.servo.limit[:, None]):
        raise RefusedError("needs more torque than there is")
    robot = scene.robot
    if np.any(motion.link < robot.low[:, None] - 0.1) or np.any(motion.link > robot.high[:, None] + 0.1):
        raise RefusedError("leaves its ranges")


def _told(stage: Stage, kind: Kind, cause: Cause, *, alone: bool, motion: Motion) -> HiddenEffect:
    scene = stage.scene
    own = motion if alone else scene.motion(cause.change(scene.machine))
    ratio, tuned = severity(scene, lacking(scene, scene.machine.model, own), own)
    if kind == "faint":
        if not 0.2 < tuned < CLEAR:
            raise RefusedError(f"{cause.effect} isn't faint")
    elif not CLEAR < tuned < TOO_CLEAR:
        raise RefusedError(f"{cause.effect} isn't clear")
    return HiddenEffect(effect=cause.effect, site=cause.site, law=cause.law, parameters=cause.parameters,
                        severity=ratio, severity_tuned=tuned, also=cause.also)  # fmt: skip


def _robot(scene: Scene, machine: Machine) -> dict[str, Any]:
    recorder, servo = scene.recorder, machine.servo
    inertias = [inertia.toDynamicParameters().tolist() for inertia in machine.model.inertias.tolist()[1:]]
    return {
        "name": scene.robot.name, "joints": list(scene.robot.joints), "links": list(scene.robot.links),
        "state_hz": recorder.state_hz, "command_hz": recorder.command_hz, "length_s": recorder.length_s,
        "resolution": recorder.resolution, "velocity": recorder.velocity, "effort": recorder.effort,
        "kp": servo.kp.tolist(), "kd": servo.kd.tolist(), "loop_s": servo.period_s,
        "inertial_parameters": dict(zip(scene.robot.links, inertias, strict=True)),
    }  # fmt: skip


Plot = Callable[[Rng, Stage, Sequence[str]], list[Cause]]


def _one(rng: Rng, stage: Stage, words: Sequence[str]) -> list[Cause]:
    return [CAUSES[words[0]](rng, stage, stage.pick(rng))]


def _none(_rng: Rng, _stage: Stage, _words: Sequence[str]) -> list[Cause]:
    return []


def _two(rng: Rng, stage: Stage, words: Sequence[str]) -> list[Cause]:
    return [CAUSES[word](rng, stage, stage.pick(rng)) for word in words[:2]]


def _all_joints(rng: Rng, stage: Stage, _words: Sequence[str]) -> list[Cause]:
    return [coulomb(rng, stage, joint) for joint in range(len(stage.scene.robot.joints))]


PLOTS: Mapping[Kind, Plot] = {
    "effect": _one, "faint": _one, "none": _none, "two": _two, "all_joints": _all_joints,
}  # fmt: skip
