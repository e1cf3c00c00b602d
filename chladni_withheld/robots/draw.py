"""Cases of all kinds: the robot's files, the log's topics, and the truth of what they hide."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from chladni.signals.errors import EstimateError
from chladni.signals.linear_algebra import in_one_thread
from chladni_withheld.case import HiddenEffect, Kind, WithheldCase
from chladni_withheld.robots.at_joints import coulomb
from chladni_withheld.robots.at_links import heavy_link
from chladni_withheld.robots.cause import Cause, Stage
from chladni_withheld.robots.causes import CAUSES, OUTSIDE_CAUSES
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Machine, Motion
from chladni_withheld.robots.recording import URDF, described, robot_toml, topics
from chladni_withheld.robots.scene import INERTIA_SIGMA, RefusedError, Scene, draw_scene, rounded
from chladni_withheld.robots.severity import lacking, severity
from chladni_withheld.vocabulary import FAMILY_OF

DEFAULT: Mapping[Kind, int] = MappingProxyType(
    {
        "effect": 100, "none": 24, "two": 30, "faint": 12, "leave_out": 16, "outside": 24, "all_joints": 16,
        "ordinary": 20, "gains": 20, "afloat": 20, "afloat_none": 10,
    }
)  # fmt: skip
_MOST_DRAWS = 300
_AFLOAT: tuple[Kind, ...] = ("afloat", "afloat_none")
#: A clear cause leaves at least so many times what the log can't tell when inertias take what they may; and at most.
CLEAR, TOO_CLEAR = 3.0, 300.0
#: An ordinary robot's inertias are known so well, and one link is heavier by the share that users report.
ORDINARY_SIGMA, HEAVIER = 0.01, 0.04
#: Gains that users don't know are off by so much at most.
GAINS_OFF = 0.2
#: Where a word that is left out has others that say the same, nothing would be left out.
_LEFT_OUT = tuple(word for word in CAUSES if word not in ("payload", "gain_error"))


@in_one_thread()
def draw_case(seed: int, index: int, kind: Kind) -> WithheldCase:
    """Draw a case of a kind; see `chladni_withheld.case.DrawCase`.

    Raises
    ------
    EstimateError
        When no draw makes a fair case, which is a defect.
    """
    refused: list[str] = []
    # The words stay when a draw is refused: what is hard to draw would be rare.
    words = _words(kind, seed, index)
    for rng in np.random.default_rng((seed, index)).spawn(_MOST_DRAWS):
        try:
            return _drawn(rng, kind, words, refused)
        except RefusedError as refusal:
            refused.append(str(refusal))
    raise EstimateError(f"no {kind} case for seed {seed}, index {index}: {', '.join(sorted(set(refused)))}")


def _words(kind: Kind, seed: int, index: int) -> list[str]:
    """All words that a kind draws from, in the order of this case: each comes as often as the others."""
    words: tuple[str, ...] = tuple(OUTSIDE_CAUSES) if kind == "outside" else tuple(CAUSES)
    if kind == "leave_out":
        words = _LEFT_OUT
    if kind == "afloat":
        words = ("coulomb_friction", "viscous_friction", "joint_delay", "common_delay")
    if kind == "gains":
        # A gain that is off where all are would be the same twice.
        words = tuple(word for word in CAUSES if word not in ("gain_error", "controller_gain"))
    turn = np.random.default_rng((seed, index // len(words))).permutation(len(words))
    return [words[place] for place in np.roll(turn, -(index % len(words)))]


def _drawn(rng: Rng, kind: Kind, words: Sequence[str], refused: Sequence[str]) -> WithheldCase:
    exact = kind in ("none", "afloat_none") and bool(rng.random() < 0.5)
    sigma = ORDINARY_SIGMA if kind == "ordinary" else INERTIA_SIGMA
    scene = draw_scene(rng, inertia=0.0 if exact else sigma, declared=sigma, floats=kind in _AFLOAT)
    if kind == "gains":
        scene = _doubtful(rng, scene)
    stage = Stage(scene=scene, quiet=scene.motion())
    _require_room(scene, stage.quiet)
    causes = PLOTS[kind](rng, stage, words)
    machine = _with(scene.machine, causes)
    motion = scene.motion(machine) if causes else stage.quiet
    _require_room(scene, motion)
    told = [_told(stage, cause, motion if len(causes) == 1 else None) for cause in causes]
    _require_fair(kind, told)
    whole = severity(scene, lacking(scene, scene.machine.model, motion), motion) if causes else None
    return WithheldCase(
        kind=kind, model=robot_toml(scene), model_file="robot.toml", beside={URDF: described(scene)},
        topics=topics(rng, scene, motion), effects=tuple(told), ratio=None if whole is None else whole[0],
        ratio_tuned=None if whole is None else whole[1], excitation=(scene.excitation,),
        starts_in_motion=bool(np.abs(motion.speed[:, 0]).max() > 0.01), leave_out=_leave_out(rng, kind, told),
        further={"robot": _robot(scene, machine), **({"gains": _gains(scene)} if kind == "gains" else {}),
                 "inertias_exact": exact, "refused": list(refused)},
    )  # fmt: skip


def _doubtful(rng: Rng, scene: Scene) -> Scene:
    """A user who doesn't know the gains: they are off, and the file says how far they may be."""
    kp, kd = (rounded(gains * rng.uniform(1.0 - GAINS_OFF, 1.0 + GAINS_OFF, gains.size)) for gains in scene.gains)
    return replace(scene, gains=(kp, kd), tolerance={**scene.tolerance, "gains": GAINS_OFF})


def _gains(scene: Scene) -> dict[str, dict[str, float]]:
    """The machine's gains over those of the file."""
    servo, (kp, kd) = scene.machine.servo, scene.gains
    return {
        joint: {"kp": float(servo.kp[place] / kp[place]), "kd": float(servo.kd[place] / kd[place])}
        for place, joint in enumerate(scene.robot.joints)
    }


def _leave_out(rng: Rng, kind: Kind, told: Sequence[HiddenEffect]) -> tuple[str, ...]:
    """Words that must not take part: that of what is hidden, or in a quarter of the others one of no use."""
    hidden = {one.effect for one in told}
    if kind == "leave_out":
        return tuple(hidden)
    same = {word for one in told for word, _ in one.also}
    useless = [word for word in _LEFT_OUT if word in FAMILY_OF and word not in hidden | same]
    return (str(rng.choice(useless)),) if rng.random() < 0.25 else ()


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


def _told(stage: Stage, cause: Cause, motion: Motion | None) -> HiddenEffect:
    """The cause and how clear it is alone: in the log, or in a run of its own."""
    scene = stage.scene
    own = scene.motion(cause.change(scene.machine)) if motion is None else motion
    ratio, tuned = severity(scene, lacking(scene, scene.machine.model, own), own, but=cause.link)
    return HiddenEffect(effect=cause.effect, site=cause.site, law=cause.law, parameters=cause.parameters,
                        severity=ratio, severity_tuned=tuned, also=cause.also)  # fmt: skip


def _require_fair(kind: Kind, told: Sequence[HiddenEffect]) -> None:
    tuned = [one.severity_tuned or 0.0 for one in told]
    if kind == "faint":
        fair = 0.2 < tuned[0] < CLEAR
    elif kind == "ordinary":
        # Four hundredths of a link's torque can't be clear; a third of that is seen in a whole log.
        fair = min(tuned[:-1]) > CLEAR and tuned[-1] > CLEAR / 3.0
    elif kind == "all_joints":
        # Joints that hardly rub aren't asked for.
        fair = sum(one > CLEAR for one in tuned) > 0.8 * len(tuned)
    else:
        fair = all(CLEAR < one < TOO_CLEAR for one in tuned)
    if not fair:
        raise RefusedError(f"{kind}: {', '.join(f'{one.effect} {one.severity_tuned or 0.0:.0e}' for one in told)}")


def _robot(scene: Scene, machine: Machine) -> dict[str, Any]:
    recorder, servo = scene.recorder, machine.servo
    inertias = [inertia.toDynamicParameters().tolist() for inertia in machine.model.inertias.tolist()[1:]]
    return {
        "name": scene.robot.name, "base": "fixed" if machine.base is None else machine.base.word,
        "joints": list(scene.robot.joints), "links": list(scene.robot.links),
        "state_hz": recorder.state_hz, "command_hz": recorder.command_hz, "length_s": recorder.length_s,
        "resolution": recorder.resolution, "velocity": recorder.velocity, "effort": recorder.effort,
        "kp": servo.kp.tolist(), "kd": servo.kd.tolist(), "loop_s": servo.period_s,
        "inertial_parameters": dict(zip(scene.robot.links, inertias, strict=True)),
    }  # fmt: skip


Plot = Callable[[Rng, Stage, Sequence[str]], list[Cause]]


def _draw(rng: Rng, stage: Stage, word: str) -> Cause:
    return ALL_CAUSES[word](rng, stage, int(rng.integers(len(stage.scene.robot.joints))))


def _one(rng: Rng, stage: Stage, words: Sequence[str]) -> list[Cause]:
    return [_draw(rng, stage, words[0])]


def _none(_rng: Rng, _stage: Stage, _words: Sequence[str]) -> list[Cause]:
    return []


def _two(rng: Rng, stage: Stage, words: Sequence[str]) -> list[Cause]:
    first, second = (_draw(rng, stage, word) for word in words[:2])
    if first.site == second.site:
        raise RefusedError("both are at one place")
    return [first, second]


def _all_joints(rng: Rng, stage: Stage, _words: Sequence[str]) -> list[Cause]:
    return [coulomb(rng, stage, joint) for joint in range(len(stage.scene.robot.joints))]


def _ordinary(rng: Rng, stage: Stage, words: Sequence[str]) -> list[Cause]:
    """Friction, a common delay, and the link whose weight tells most."""
    friction = _all_joints(rng, stage, words) if rng.random() < 0.5 else [_draw(rng, stage, "coulomb_friction")]
    links = [heavy_link(HEAVIER, stage, joint) for joint in range(len(stage.scene.robot.joints))]
    alone = [_told(stage, one, None).severity_tuned or 0.0 for one in links]
    return [*friction, _draw(rng, stage, "common_delay"), links[int(np.argmax(alone))]]


ALL_CAUSES = {**CAUSES, **OUTSIDE_CAUSES}
PLOTS: Mapping[Kind, Plot] = {
    "effect": _one, "faint": _one, "none": _none, "two": _two, "all_joints": _all_joints, "ordinary": _ordinary,
    "gains": _one, "leave_out": _one, "outside": _one, "afloat": _one, "afloat_none": _none,
}  # fmt: skip
