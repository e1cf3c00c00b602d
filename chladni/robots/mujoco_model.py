"""MuJoCo compiles a description; the only module of robots that imports it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from chladni.robots.robot import RobotJoint, Servo
from chladni.robots.urdf import LEAST_MASS
from chladni.signals.errors import ModelError
from chladni.signals.wording import counted

# What the dynamics are made of.
_FINITE = (
    "body_mass", "body_inertia", "body_pos", "body_ipos", "body_quat", "dof_damping", "dof_armature",
    "dof_frictionloss", "jnt_axis", "jnt_pos", "qpos0", "actuator_gainprm", "actuator_biasprm", "actuator_gear",
)  # fmt: skip

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from chladni.robots.robot import BaseKind, CommandKind


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compiled:
    """What MuJoCo made of a description; fields as in `Robot`, and the names of its sites."""

    name: str
    model: Any
    joints: tuple[RobotJoint, ...]
    links: tuple[str, ...]
    sites: tuple[str, ...]
    base: BaseKind
    delay_s: float
    remarks: tuple[str, ...]


def compile_robot(xml: str, *, file: str, velocity_limits: Mapping[str, float]) -> Compiled:
    """Compile a description.

    Parameters
    ----------
    xml
        MJCF or URDF that refers to no missing file.
    file
        What messages call it.
    velocity_limits
        Of joints by name, which MuJoCo doesn't keep.

    Raises
    ------
    ModelError
        When MuJoCo isn't installed or refuses the description, or the robot can't be diagnosed.
    """
    mujoco = _mujoco()
    warned: list[str] = []
    before = mujoco.get_mju_user_warning()
    # Otherwise MuJoCo writes them to a file in the current folder.
    mujoco.set_mju_user_warning(warned.append)
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise ModelError(f"{file}: MuJoCo refuses it: {_told(str(error))}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    found = _Reading(mujoco, model, file, velocity_limits).compiled()
    return replace(found, remarks=(*found.remarks, *(f"MuJoCo warns: {_told(one)}" for one in warned)))


def mjcf_of(xml: str, *, file: str) -> str:
    """Give a description as MJCF; arguments and errors as of `compile_robot`."""
    mujoco = _mujoco()
    try:
        spec = mujoco.MjSpec.from_string(xml)
        spec.compile()
        return str(spec.to_xml())
    except ValueError as error:
        raise ModelError(f"{file}: MuJoCo refuses it: {_told(str(error))}") from None


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise ModelError(
            "robots need MuJoCo, which is not installed; install it by pip install 'chladni[mujoco]'"
        ) from error
    return mujoco


def _told(error: str) -> str:
    line = " ".join(error.split())[:300]
    if "mass and inertia of moving bodies" in line:
        return f"{line}; give each link that moves an <inertial>"
    return line


def _pair(numbers: Any) -> tuple[float, float]:
    low, high = (float(one) for one in numbers)
    return low, high


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drive:
    """One actuator at its joint: effort = gain command + bias_position q + bias_velocity dq, within a limit."""

    name: str
    gain: float
    kp: float
    kd: float
    limit: float
    constant: float
    scaled: bool
    lag_s: float


class _Reading:
    """Reads joints, servos and what can't be diagnosed off a compiled model."""

    def __init__(self, mujoco: Any, model: Any, file: str, velocity_limits: Mapping[str, float]) -> None:
        self._mujoco, self._model, self._file = mujoco, model, file
        self._velocity_limits = velocity_limits
        self._remarks: list[str] = []

    def compiled(self) -> Compiled:
        """Give all of it; `ModelError` for a robot that can't be diagnosed."""
        model = self._model
        self._require_finite()
        free = self._free_roots()
        self._tell_world()
        drives = self._drives()
        follows = self._equalities()
        self._tell_tendons()
        joints = tuple(self._joints(drives, follows))
        if not joints:
            raise ModelError(f"{self._file}: has no hinge and no slide with a name; there's nothing to diagnose")
        self._tell_massless(joints)
        roots = {int(model.body_rootid[model.jnt_bodyid[self._number(one)]]) for one in joints}
        return Compiled(
            # Names follow one another in one text; the model's own is the first.
            name=bytes(model.names).split(b"\0", 1)[0].decode(),
            model=model,
            joints=joints,
            links=tuple(model.body(place).name for place in range(1, model.nbody)),
            sites=tuple(model.site(place).name for place in range(model.nsite)),
            base="floating" if roots & free else "fixed",
            delay_s=self._delay_s(),
            remarks=tuple(self._remarks),
        )

    def _number(self, joint: RobotJoint) -> int:
        return int(self._model.joint(joint.name).id)

    def _require_finite(self) -> None:
        for name in _FINITE:
            if not np.isfinite(getattr(self._model, name)).all():
                raise ModelError(f"{self._file}: not all numbers are finite ({name.replace('_', ' ')}); mend them")

    # --- joints ---

    def _kind(self, place: int) -> str:
        return str(self._mujoco.mjtJoint(int(self._model.jnt_type[place])).name).removeprefix("mjJNT_").lower()

    def _free_roots(self) -> set[int]:
        """Bodies of the world that float; ball joints are refused."""
        model = self._model
        for place in range(model.njnt):
            if self._kind(place) == "ball":
                name = model.joint(place).name
                raise ModelError(
                    f"{self._file}: {name or 'a joint'} is a ball joint, whose pose no JointState tells; describe it "
                    "as three hinges"
                )
        free = (place for place in range(model.njnt) if self._kind(place) == "free")
        return {int(model.body_rootid[model.jnt_bodyid[place]]) for place in free}

    def _joints(self, drives: Mapping[int, list[_Drive]], follows: Mapping[int, str]) -> Iterator[RobotJoint]:
        model, nameless = self._model, 0
        for place in range(model.njnt):
            kind = self._kind(place)
            if kind not in ("hinge", "slide"):
                continue
            name, dof = model.joint(place).name, int(model.jnt_dofadr[place])
            nameless += not name
            if not name:
                continue
            yield RobotJoint(
                name=name,
                kind="hinge" if kind == "hinge" else "slide",
                link=model.body(int(model.jnt_bodyid[place])).name,
                position=int(model.jnt_qposadr[place]),
                dof=dof,
                range=_pair(model.jnt_range[place]) if model.jnt_limited[place] else None,
                damping=float(model.dof_damping.reshape(model.nv, -1)[dof, 0]),
                armature=float(model.dof_armature[dof]) + self._motor_inertia(place),
                friction=float(model.dof_frictionloss[dof]),
                servo=self._servo(place, name, drives.get(place, [])),
                effort_limit=self._effort_limit(place),
                velocity_limit=self._velocity_limits.get(name),
                follows=follows.get(place),
            )
        if nameless:
            self._remarks.append(f"{counted(nameless, 'joint')} without a name: no log can tell their motion")

    def _motor_inertia(self, joint: int) -> float:
        """Inertia of motors, which MuJoCo gives actuators from version 4 on."""
        model = self._model
        inertia = getattr(model, "actuator_armature", None)
        if inertia is None:
            return 0.0
        own = [place for place in range(model.nu) if self._driven(place) == joint]
        return float(sum(inertia[place] * model.actuator_gear[place, 0] ** 2 for place in own))

    def _effort_limit(self, joint: int) -> float | None:
        if not self._model.jnt_actfrclimited[joint]:
            return None
        return max(abs(one) for one in _pair(self._model.jnt_actfrcrange[joint])) or None

    # --- servos ---

    def _driven(self, actuator: int) -> int | None:
        """Joint of an actuator that drives one alone."""
        kinds = self._mujoco.mjtTrn
        alone = (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT))
        return (
            int(self._model.actuator_trnid[actuator, 0])
            if int(self._model.actuator_trntype[actuator]) in alone
            else None
        )

    def _drives(self) -> dict[int, list[_Drive]]:
        """Actuators by the number of their joint."""
        found: dict[int, list[_Drive]] = {}
        for place in range(self._model.nu):
            name = self._model.actuator(place).name or f"number {place + 1}"
            joint, drive = self._driven(place), self._drive(place, name)
            if joint is None:
                self._remarks.append(f"actuator {name} drives no single joint: it's left out")
            elif drive is None:
                self._remarks.append(f"actuator {name} is of a kind that isn't read: its gains count as unknown")
            else:
                found.setdefault(joint, []).append(drive)
        return found

    def _drive(self, place: int, name: str) -> _Drive | None:
        model, mujoco = self._model, self._mujoco
        fixed = int(model.actuator_gaintype[place]) == int(mujoco.mjtGain.mjGAIN_FIXED)
        bias_kind, dynamics = int(model.actuator_biastype[place]), int(model.actuator_dyntype[place])
        affine = bias_kind == int(mujoco.mjtBias.mjBIAS_AFFINE)
        none = int(mujoco.mjtDyn.mjDYN_NONE)
        filters = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))
        if not fixed or not (affine or bias_kind == int(mujoco.mjtBias.mjBIAS_NONE)):
            return None
        if dynamics not in (none, *filters):
            return None
        gear, gain = float(model.actuator_gear[place, 0]), float(model.actuator_gainprm[place, 0])
        constant, position, velocity = (float(one) for one in model.actuator_biasprm[place, :3] * affine)
        limit = inf
        if model.actuator_forcelimited[place]:
            limit = max(map(abs, _pair(model.actuator_forcerange[place]))) * abs(gear)
        if not position and not velocity and model.actuator_ctrllimited[place]:
            limit = min(limit, abs(gain * gear) * max(map(abs, _pair(model.actuator_ctrlrange[place]))))
        wanted = -position or -velocity or gain
        return _Drive(
            name=name,
            gain=gain * gear,
            kp=-position * gear**2,
            kd=-velocity * gear**2,
            limit=limit,
            constant=constant * gear,
            scaled=abs(gain - wanted) > 1e-9 * abs(wanted),
            lag_s=0.0 if dynamics == none else float(model.actuator_dynprm[place, 0]),
        )

    def _servo(self, joint: int, name: str, drives: list[_Drive]) -> Servo | None:
        """Servo of a joint, which a position and a velocity actuator may be together."""
        if not drives:
            return None
        kp, kd = sum(one.kp for one in drives), sum(one.kd for one in drives)
        kind: CommandKind = "position" if kp else "velocity" if kd else "effort"
        limits = [one.limit for one in drives]
        of_joint = self._effort_limit(joint)
        limit = min(max(limits) if kind == "effort" else min(limits), inf if of_joint is None else of_joint)
        for one in drives:
            if one.scaled:
                self._remarks.append(f"actuator {one.name} scales its command; commands of a log are those of {name}")
            if one.constant:
                self._remarks.append(f"actuator {one.name} adds a constant {one.constant:g}: left out")
        return Servo(
            kind=kind,
            kp=kp if kind == "position" else None,
            kd=kd if kind != "effort" else None,
            limit=None if limit == inf else limit,
            actuator=drives[0].name,
            lag_s=max(one.lag_s for one in drives),
        )

    def _delay_s(self) -> float:
        """Delay that all actuators have, which MuJoCo knows from version 3.5 on."""
        found = getattr(self._model, "actuator_delay", None)
        delays = set() if found is None else {float(one) for one in found}
        if len(delays) > 1:
            told = ", ".join(f"{1e3 * one:g}" for one in sorted(delays))
            self._remarks.append(f"delays of actuators differ ({told} ms): commands are taken without")
        return delays.pop() if len(delays) == 1 else 0.0

    # --- what can't be diagnosed, or not alone ---

    def _tell_world(self) -> None:
        model = self._model
        gravity_off = int(model.opt.disableflags) & int(self._mujoco.mjtDisableBit.mjDSBL_GRAVITY)
        if gravity_off or not model.opt.gravity.any():
            self._remarks.append("the description has no gravity: <option gravity> or its flag switches it off")
        compensated = [model.body(place).name for place in range(model.nbody) if model.body_gravcomp[place]]
        if compensated:
            self._remarks.append(f"gravity is compensated on {_some(compensated)}, as the description says")

    def _equalities(self) -> dict[int, str]:
        """Joints that follow others, by number; loops are refused."""
        model, kinds = self._model, self._mujoco.mjtEq
        follows: dict[int, str] = {}
        for place in range(model.neq):
            kind = int(model.eq_type[place])
            one, other = int(model.eq_obj1id[place]), int(model.eq_obj2id[place])
            if not model.eq_active0[place]:
                continue
            if kind == int(kinds.mjEQ_JOINT):
                self._tell_following(follows, place, one, other)
            elif kind in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
                self._require_open(place, one, other)
            else:
                name = str(self._mujoco.mjtEq(kind).name).removeprefix("mjEQ_").lower()
                self._remarks.append(f"an equality of kind {name} is left out: what it carries counts for the joints")
        return follows

    def _tell_following(self, follows: dict[int, str], place: int, one: int, other: int) -> None:
        model = self._model
        name = model.joint(one).name
        if other < 0:
            self._remarks.append(f"{name} is held by an equality: its effort isn't told from that of the hold")
            return
        follows[one] = model.joint(other).name
        ratio = float(model.eq_data[place, 1])
        self._remarks.append(
            f"{name} follows {follows[one]} ({ratio:g} to 1): the two are told apart by the log alone"
        )

    def _require_open(self, place: int, one: int, other: int) -> None:
        """Refuse a constraint that closes a loop through joints of the robot."""
        model = self._model
        bodies = [one, other]
        if int(model.eq_objtype[place]) == int(self._mujoco.mjtObj.mjOBJ_SITE):
            bodies = [int(model.site_bodyid[site]) for site in bodies]
        moved = [body for body in bodies if self._carried_by_joints(body)]
        followed = [body for body in bodies if int(model.body_mocapid[model.body_rootid[body]]) >= 0]
        name = model.equality(place).name or "an equality"
        if not moved or followed:
            self._remarks.append(f"{name} is left out: it holds a body that no joint of the robot moves")
            return
        ends = " and ".join(model.body(body).name for body in bodies)
        raise ModelError(
            f"{self._file}: {name} closes a loop ({ends}), in which a log's efforts aren't those of single joints; a "
            "robot is diagnosed as an open chain: take the constraint out, or describe the part before it"
        )

    def _carried_by_joints(self, body: int) -> bool:
        """Whether a hinge or slide lies between a body and the world."""
        model = self._model
        while body:
            first = int(model.body_jntadr[body])
            kinds = [self._kind(place) for place in range(first, first + int(model.body_jntnum[body]))]
            if "hinge" in kinds or "slide" in kinds:
                return True
            body = int(model.body_parentid[body])
        return False

    def _tell_tendons(self) -> None:
        model = self._model
        for place in range(model.ntendon):
            acts = (
                model.tendon_stiffness.reshape(model.ntendon, -1)[place].any()
                or model.tendon_damping.reshape(model.ntendon, -1)[place].any()
                or model.tendon_frictionloss[place]
                or model.tendon_limited[place]
            )
            if acts:
                name = model.tendon(place).name or f"number {place + 1}"
                self._remarks.append(f"tendon {name} pulls at several joints: what it does counts for each of them")

    def _tell_massless(self, joints: tuple[RobotJoint, ...]) -> None:
        """Say which links hardly have a mass of their own: least ones are taken there."""
        model = self._model
        mass = model.body_mass.copy()
        for body in range(model.nbody - 1, 0, -1):
            if not model.body_jntnum[body]:
                mass[model.body_parentid[body]] += mass[body]
        bodies = {int(model.jnt_bodyid[self._number(one)]) for one in joints}
        # Several frames of least mass may be fixed to one another.
        light = [model.body(body).name for body in sorted(bodies) if mass[body] < 100 * LEAST_MASS]
        if light:
            self._remarks.append(f"{_some(light)}: no mass is given, so the least that can be simulated is taken")


def _some(names: list[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more
