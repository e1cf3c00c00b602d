"""Numbers of a machine set in an MJCF file."""

from __future__ import annotations

from math import ceil, degrees
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chladni.robots.machine import about_centre, as_described
from chladni.robots.mujoco_motion import gravity_of
from chladni.robots.written_urdf import differs, written

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET

    from chladni.robots.machine import Machine, MachineJoint
    from chladni.signals.arrays import Real

#: Shortest step for which a delay's history is as long as the delay, s.
_SHORTEST_S: Final = 1e-4
#: Ways to state how an inertia is turned, and its moments.
_TURNED: Final = ("quat", "axisangle", "xyaxes", "zaxis", "euler", "diaginertia")


class MjcfEdit:
    """Edits an MJCF file in place.

    Parameters
    ----------
    add_drives
        Whether actuators are made of servos that the file doesn't have.

    Attributes
    ----------
    not_held
        Sentences on what MJCF can't hold, of MuJoCo as it's installed.
    """

    def __init__(self, root: ET.Element, machine: Machine, *, add_drives: bool = False) -> None:
        self._add_drives = add_drives
        self._root, self._machine, self._model = root, machine, machine.robot.model
        self._described = as_described(machine.robot)
        self.not_held: list[str] = []

    def edit(self) -> bool:
        """Set what differs; give whether all delays are held."""
        joints, bodies = self._below_world("joint"), self._below_world("body")
        delays = []
        for one, old in zip(self._machine.joints, self._described.joints, strict=True):
            element = joints.get(one.joint.name)
            if element is not None:
                self._edit_joint(element, one, old)
            elif _numbers(one) != _numbers(old):
                self.not_held.append(
                    f"joint {one.joint.name}: it's made by a replica, which has no numbers of its own"
                )
            delays.append(self._edit_drives(one, old))
        self._edit_links(bodies)
        if any(self._machine.tilt):
            option = self._root.makeelement("option", {})
            option.set("gravity", written(gravity_of(self._model, self._machine.tilt)))
            self._root.append(option)
        self._add_couplings()
        return all(delays)

    def _below_world(self, tag: str) -> dict[str, ET.Element]:
        found = [one for world in self._root.findall("worldbody") for one in world.iter(tag)]
        return {one.get("name", ""): one for one in found}

    # --- joints ---

    def _edit_joint(self, element: ET.Element, one: MachineJoint, old: MachineJoint) -> None:
        dof = one.joint.dof
        if one.friction != old.friction:
            element.set("frictionloss", written(one.friction))
        if one.armature != old.armature:
            # The motor's inertia stands at the actuator.
            element.set("armature", written(float(self._model.dof_armature[dof]) + one.armature - old.armature))
        if one.damping != old.damping or one.quadratic:
            element.set("damping", self._damping(one))
        if one.stiffness or one.torque:
            self._edit_spring(element, one)

    def _damping(self, one: MachineJoint) -> str:
        """Coefficients of the speed and its square; MuJoCo has the latter from 3.6 on."""
        more = getattr(self._model, "dof_dampingpoly", None)
        if more is None:
            if one.quadratic:
                self.not_held.append(
                    f"{one.joint.name}: damping by the square of the speed, {one.quadratic:.4g}; this MuJoCo has none"
                )
            return written(one.damping)
        higher = np.array(more[one.joint.dof], dtype=np.float64)
        higher[0] += one.quadratic
        return written(np.array([one.damping, *higher]) if higher.any() else one.damping)

    def _edit_spring(self, element: ET.Element, one: MachineJoint) -> None:
        joint = self._model.dof_jntid[one.joint.dof]
        own = float(np.ravel(self._model.jnt_stiffness[joint])[0])
        stiffness = own + one.stiffness
        if stiffness <= 0:
            self.not_held.append(f"{one.joint.name}: a constant torque of {-one.torque:.4g}; MJCF has springs alone")
            return
        rest = (own * float(self._model.qpos_spring[one.joint.position]) - one.torque) / stiffness
        in_degrees = one.joint.kind == "hinge" and self._compiler("angle", "degree") != "radian"
        element.set("stiffness", written(stiffness))
        element.set("springref", written(degrees(rest) if in_degrees else rest))

    def _compiler(self, name: str, default: str) -> str:
        found = [one.get(name, "") for one in self._root.findall("compiler") if one.get(name)]
        return found[-1] if found else default

    # --- links ---

    def _edit_links(self, bodies: dict[str, ET.Element]) -> None:
        pairs = list(zip(self._machine.robot.links, self._machine.inertial, self._described.inertial, strict=True))
        if not any(differs(numbers, old) for _, numbers, old in pairs):
            return
        # Masses that MuJoCo makes of others' would change with them.
        whole = self._compiler("settotalmass", "-1") != "-1" or self._compiler("inertiafromgeom", "auto") == "true"
        for one in self._root.findall("compiler"):
            for name in ("settotalmass", "inertiafromgeom") if whole else ():
                one.attrib.pop(name, None)
        for name, numbers, old in pairs:
            if not (whole or differs(numbers, old)) or numbers[0] <= 0:
                continue
            if name in bodies:
                _edit_body(bodies[name], numbers)
            else:
                self.not_held.append(f"link {name}: mass and inertia; it has no body of its name in the file")

    # --- drives ---

    def _edit_drives(self, one: MachineJoint, old: MachineJoint) -> bool:
        """Set gains, limit and delay of a joint's actuators; give whether the delay is held."""
        if self._add_drives:
            element = self._add_drive(one)
            return element is None or one.delay_s == 0 or self._edit_delay([element], one)
        drives = [element for _, element in self._numbered(one.joint.name)]
        changed = one.gains() != old.gains()
        if not drives:
            if changed and one.servo is not None and one.servo.actuator is not None:
                self.not_held.append(f"{one.joint.name}: gains of its actuator, which isn't told from others by name")
            return one.delay_s == 0
        if changed:
            self._edit_gains(self._numbered(one.joint.name), one)
        if one.delay_s == old.delay_s:
            return True
        return self._edit_delay(drives, one)

    def _numbered(self, joint: str) -> list[tuple[int, ET.Element]]:
        """Actuators of a joint, by number; those of the file stand in MuJoCo's order."""
        # But for comments, which have no name.
        found = [one for one in self._root.iterfind("actuator/*") if one.keys()]
        if len(found) != self._model.nu:
            return []
        return [
            (place, one) for place, one in enumerate(found) if joint in (one.get("joint"), one.get("jointinparent"))
        ]

    def _edit_gains(self, drives: list[tuple[int, ET.Element]], one: MachineJoint) -> None:
        model = self._model
        kp, kd, limit = one.gains()
        gears = {place: float(model.actuator_gear[place, 0]) for place, _ in drives}
        own_kp = -sum(float(model.actuator_biasprm[place, 1]) * gears[place] ** 2 for place, _ in drives)
        own_kd = -sum(float(model.actuator_biasprm[place, 2]) * gears[place] ** 2 for place, _ in drives)
        for place, element in drives:
            _edit_gain(
                element, model, place, kp / own_kp if own_kp else one.gain, kd / own_kd if own_kd else one.gain
            )
            if own_kp and not own_kd and kd:
                # Its damping was the robot file's.
                _set_damping(element, kd / gears[place] ** 2)
            if np.isfinite(limit) and element.tag != "motor":
                force = limit / abs(gears[place])
                element.attrib |= {"forcerange": written(np.array([-force, force])), "forcelimited": "true"}

    def _add_drive(self, one: MachineJoint) -> ET.Element[str] | None:
        """Make an actuator of a servo whose gains are known."""
        servo, name = one.servo, one.joint.name
        kp, kd, limit = one.gains()
        if servo is None or (servo.kind == "position" and not kp) or (servo.kind == "velocity" and not kd):
            return None
        actuators = self._root.find("actuator")
        if actuators is None:
            actuators = self._root.makeelement("actuator", {})
            self._root.append(actuators)
        tag: str = "motor" if servo.kind == "effort" else servo.kind
        element = actuators.makeelement(tag, {"name": name, "joint": name})
        actuators.append(element)
        if servo.kind == "effort":
            element.set("gear", written(one.gain))
            limit /= one.gain
        else:
            element.attrib |= {"kp": written(kp)} if kp else {}
            element.set("kv", written(kd))
        if servo.lag_s:
            element.attrib |= {"timeconst": written(servo.lag_s)} if servo.kind == "position" else {}
        if np.isfinite(limit):
            element.attrib |= {"forcerange": written(np.array([-limit, limit])), "forcelimited": "true"}
        return element

    def _edit_delay(self, drives: list[ET.Element], one: MachineJoint) -> bool:
        if not hasattr(self._model, "actuator_delay"):
            self.not_held.append(
                f"{one.joint.name}: commands arrive {1e3 * one.delay_s:.3g} ms late; this MuJoCo has no delays"
            )
            return False
        step_s = min(float(self._model.opt.timestep), _SHORTEST_S)
        for element in drives:
            element.attrib |= {"delay": written(one.delay_s), "nsample": str(ceil(one.delay_s / step_s) + 1)}
        return True

    # --- couplings ---

    def _add_couplings(self) -> None:
        if not self._machine.couplings:
            return
        tendons = self._root.makeelement("tendon", {})
        self._root.append(tendons)
        for place, each in enumerate(self._machine.couplings, start=1):
            fixed = tendons.makeelement("fixed", {"name": f"coupling_{place}"})
            fixed.attrib |= {
                name: written(number)
                for name, number in (("frictionloss", each.friction), ("damping", each.damping))
                if number
            }
            if each.stiffness:
                fixed.attrib |= {"stiffness": written(each.stiffness), "springlength": written(each.rest)}
            tendons.append(fixed)
            for joint, share in zip(each.joints, (1.0, each.ratio), strict=True):
                fixed.append(fixed.makeelement("joint", {"joint": joint, "coef": written(share)}))


def _numbers(one: MachineJoint) -> tuple[float, ...]:
    return one.friction, one.damping, one.armature, one.quadratic, one.stiffness, one.torque


def _edit_body(body: ET.Element, numbers: Real) -> None:
    mass, centre, inertia = about_centre(numbers)
    inertial = body.find("inertial")
    if inertial is None:
        inertial = body.makeelement("inertial", {})
        body.insert(0, inertial)
    for name in _TURNED:
        inertial.attrib.pop(name, None)
    moments = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    inertial.attrib |= {"pos": written(centre), "mass": written(mass), "fullinertia": written(moments)}


def _edit_gain(element: ET.Element, model: Any, place: int, kp: float, kd: float) -> None:
    """Multiply the gains of an actuator."""
    gain, bias = float(model.actuator_gainprm[place, 0]), np.array(model.actuator_biasprm[place, :3])
    if element.tag == "motor":
        gear = np.array(model.actuator_gear[place])
        gear[0] *= kp
        element.set("gear", written(gear))
    elif element.tag == "position":
        element.attrib.pop("dampratio", None)
        element.attrib |= {"kp": written(gain * kp), "kv": written(-bias[2] * kd)}
    elif element.tag == "velocity":
        element.set("kv", written(gain * kd))
    else:
        forward = kp if bias[1] else kd
        element.set("gainprm", written(gain * forward))
        element.set("biasprm", written(bias * [forward, kp, kd]))


def _set_damping(element: ET.Element, kd: float) -> None:
    if element.tag == "position":
        element.set("kv", written(kd))
    elif "biasprm" in element.attrib:
        bias = element.get("biasprm", "").split()
        element.set("biasprm", " ".join([*bias[:2], written(-kd)]))
