"""A MuJoCo model as a simulator: actuators are its inputs, sensors its outputs.

The only module that imports MuJoCo, which comes with the extra ``[mujoco]``.
"""

import ctypes
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from chladni.models.core.parameter import Parameters
from chladni.models.core.port import Port, Terminal
from chladni.models.core.simulation import PortMotion
from chladni.models.effects.wording import nearest
from chladni.models.simulators.joint_law import JointLaw
from chladni.models.simulators.mujoco_numbers import index, names, parameter, set_number, turns
from chladni.models.simulators.simulator import SimulatorResponse
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: Of an interval: so little apart steps and samples fall together.
_TIE = 1e-6
#: MuJoCo's integrators that step in two halves, between which laws can act.
_INTEGRATORS = ("Euler", "implicit", "implicitfast")
_FUNCTIONS = ("mj_step1", "mj_fwdActuation", "mj_fwdAcceleration", "mj_solveM", "mj_step2")
#: Units of what sensors give, by MuJoCo's name; two where it depends on whether the joint turns or slides.
_SENSOR_UNITS = {
    "ACCELEROMETER": "m/s^2", "VELOCIMETER": "m/s", "GYRO": "rad/s", "FORCE": "N", "TORQUE": "N m",
    "FRAMEPOS": "m", "FRAMELINVEL": "m/s", "FRAMEANGVEL": "rad/s", "FRAMELINACC": "m/s^2", "FRAMEANGACC": "rad/s^2",
    "TOUCH": "N", "RANGEFINDER": "m", "TENDONPOS": "m", "TENDONVEL": "m/s", "SUBTREECOM": "m", "SUBTREELINVEL": "m/s",
}  # fmt: skip
_MOTION_UNITS = {
    "JOINTPOS": ("rad", "m"), "JOINTVEL": ("rad/s", "m/s"), "JOINTACTFRC": ("N m", "N"),
    "ACTUATORFRC": ("N m", "N"), "ACTUATORPOS": ("rad", "m"), "ACTUATORVEL": ("rad/s", "m/s"),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class MujocoSimulator:
    """Implements `Simulator`; made by `mujoco_simulator`.

    Attributes
    ----------
    name, parameters, inputs, outputs, joints
        See `Simulator`.
    model
        MuJoCo's ``MjModel``; runs work on copies.
    keyframe
        Where runs start; in the model's reference pose when None.
    """

    name: str
    parameters: Parameters
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    joints: tuple[Port, ...]
    model: Any
    keyframe: str | None = None

    def refined(self) -> Self:
        """Give the same with steps half as long."""
        model = copy(self.model)
        model.opt.timestep /= 2
        return replace(self, model=model)

    def respond(
        self,
        inputs: Real,
        sample_rate_hz: float,
        *,
        values: Mapping[str, float],
        joint_laws: Mapping[str, JointLaw],
    ) -> SimulatorResponse:
        """Simulate; each sample of an input is held until the next, as a controller holds it.

        Laws are solved for implicitly in each step, so that friction sticks. A sample of the outputs is what the
        sensors read just after the input's sample was set.

        Raises
        ------
        ModelError
            When samples and steps don't fit, a name is unknown, or the simulation diverges.
        """
        mujoco = _mujoco()
        model = copy(self.model)
        data = mujoco.MjData(model)
        for name, value in values.items():
            set_number(model, name, self.parameters.require(name).with_value(value).value)
        if values:
            # Masses enter constants that MuJoCo computes once.
            mujoco.mj_setConst(model, data)
        if self.keyframe is not None:
            mujoco.mj_resetDataKeyframe(model, data, index(model, "key", self.keyframe))
        steps = _steps(float(model.opt.timestep), sample_rate_hz)
        _require_commands(self.name, self.inputs, inputs, float(mujoco.mjMAXVAL))
        return _run(self, model, data, np.ascontiguousarray(inputs, dtype=np.float64), steps, joint_laws)


def mujoco_simulator(
    model: Path | str,
    *,
    inputs: Mapping[str, str | None],
    outputs: Mapping[str, str | None],
    joints: Sequence[str] = (),
    parameters: Mapping[str, float] | None = None,
    name: str | None = None,
    keyframe: str | None = None,
) -> MujocoSimulator:
    """Let a MuJoCo model stand in for a model of ours.

    Parameters
    ----------
    model
        Path of an MJCF or URDF file, or the XML itself. Its integrator is implicitfast, implicit or Euler.
    inputs
        Channel of the log by name of the actuator; None where the channel has the actuator's name. Actuators that
        aren't named stay at zero.
    outputs
        Likewise by name of the sensor; one with several numbers is named with its place, ``tip.x`` or ``tip[3]``.
    joints
        Hinges and slides where effects may act.
    parameters
        Relative tolerance (one sigma) of each number that may be tuned: ``elbow.damping``, ``.armature``,
        ``.frictionloss`` and ``.stiffness`` of a joint, ``forearm.mass`` of a body (its inertia goes along),
        ``motor.gear`` of an actuator.
    name
        For people; the model's own by default.
    keyframe
        Where runs start; in the model's reference pose by default.

    Raises
    ------
    ModelError
        When MuJoCo isn't installed, the model is wrong or steps by another integrator, or a name is unknown.
    """
    mujoco = _mujoco()
    loaded = _load(mujoco, model)
    if mujoco.mjtIntegrator(loaded.opt.integrator).name not in {f"mjINT_{name.upper()}" for name in _INTEGRATORS}:
        raise ModelError(
            "MuJoCo model: laws can't act within the steps of its integrator (RK4 or discrete); set "
            f"<option integrator> to {', '.join(_INTEGRATORS)}"
        )
    if keyframe is not None:
        index(loaded, "key", keyframe)
    numbers = tuple(parameter(loaded, each, spread) for each, spread in (parameters or {}).items())
    return MujocoSimulator(
        # Names follow one another in one text; the model's own is the first.
        name=name or bytes(loaded.names).split(b"\0", 1)[0].decode(),
        parameters=Parameters(numbers),
        inputs=tuple(_input(loaded, each, channel) for each, channel in inputs.items()),
        outputs=tuple(
            Terminal(name=each, unit=_sensor(loaded, each)[1], channel=channel) for each, channel in outputs.items()
        ),
        joints=tuple(_joint(loaded, each) for each in joints),
        model=loaded,
        keyframe=keyframe,
    )


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise ModelError("MuJoCo is not installed; install chladni with the extra [mujoco]") from error
    return mujoco


def _load(mujoco: Any, model: Path | str) -> Any:
    text = isinstance(model, str) and "<" in model
    try:
        return mujoco.MjModel.from_xml_string(model) if text else mujoco.MjModel.from_xml_path(str(model))
    except ValueError as error:
        where = "MuJoCo model" if text else str(model)
        raise ModelError(f"{where}: {' '.join(str(error).split())[:300]}") from error


def _joint(model: Any, name: str) -> Port:
    place = index(model, "joint", name)
    rotates = turns(model, place)
    return Port(
        name=name,
        kind="joint",
        unit="N m" if rotates else "N",
        displacement_unit="rad" if rotates else "m",
        stiffness=float(np.ravel(model.jnt_stiffness[place])[0]),
        damping=float(np.ravel(model.dof_damping[model.jnt_dofadr[place]])[0]),
    )


def _input(model: Any, name: str, channel: str | None) -> Terminal:
    place = index(model, "actuator", name)
    # Motors give a force; a servo's command is a position or a velocity, which only its author knows.
    unit = "1"
    drives_joint = int(model.actuator_trntype[place]) == 0
    if drives_joint and int(model.actuator_biastype[place]) == 0:
        unit = "N m" if turns(model, int(model.actuator_trnid[place, 0])) else "N"
    return Terminal(name=name, unit=unit, channel=channel)


def _sensor(model: Any, name: str) -> tuple[int, str]:
    """Place in the sensor data, and unit."""
    import mujoco

    base, offset = _split(name)
    sensor = index(model, "sensor", base if base in names(model, "sensor") else name)
    size = int(model.sensor_dim[sensor])
    # A name without a place stands for a sensor with one number only.
    if (offset is None and size != 1) or (offset is not None and not 0 <= offset < size):
        raise ModelError(
            f"MuJoCo model: sensor {base!r} gives {size} number{'s' * (size > 1)}; name one, such as {base}.x or "
            f"{base}[{size - 1}]"
        )
    kind = mujoco.mjtSensor(int(model.sensor_type[sensor])).name.removeprefix("mjSENS_")
    unit = _SENSOR_UNITS.get(kind, "1")
    if kind in _MOTION_UNITS:
        moved = int(model.sensor_objid[sensor])
        joint = moved if kind.startswith("JOINT") else int(model.actuator_trnid[moved, 0])
        unit = _MOTION_UNITS[kind][0 if turns(model, joint) else 1]
    return int(model.sensor_adr[sensor]) + (offset or 0), unit


def _split(name: str) -> tuple[str, int | None]:
    """Name of a sensor and place of one of its numbers: ``tip.y``, ``tip[1]``."""
    if len(name) > 2 and name[-2] == "." and name[-1] in "xyz":
        return name[:-2], "xyz".index(name[-1])
    base, bracket, rest = name.partition("[")
    if bracket and rest.endswith("]") and rest[:-1].isdecimal():
        return base, int(rest[:-1])
    return name, None


def _steps(step_s: float, sample_rate_hz: float) -> int:
    steps = 1.0 / (step_s * sample_rate_hz)
    if round(steps) < 1 or abs(steps - round(steps)) > _TIE * steps:
        raise ModelError(
            f"MuJoCo model: its step of {step_s:g} s doesn't divide the log's sample interval of "
            f"{1 / sample_rate_hz:g} s; set <option timestep> to the interval over a whole number"
        )
    return round(steps)


def _require_commands(name: str, terminals: Sequence[Terminal], inputs: Real, largest: float) -> None:
    """Refuse what MuJoCo would take for zero, with a word on a file that nobody reads."""
    for terminal, row in zip(terminals, inputs, strict=True):
        if not np.all(np.abs(row) < largest):
            raise ModelError(
                f"MuJoCo model {name!r}: input {terminal.name!r} reaches {np.max(np.abs(row)):g}; every "
                f"sample must be finite and below {largest:g}"
            )


def _run(
    simulator: MujocoSimulator,
    model: Any,
    data: Any,
    inputs: Real,
    steps: int,
    joint_laws: Mapping[str, JointLaw],
) -> SimulatorResponse:
    # numba takes a moment to import, and who only describes a model needs none.
    from chladni.models.simulators.mujoco_kernel import Laws, Record, Simulated, run

    step_s = float(model.opt.timestep)
    rows = np.array([index(model, "actuator", each.name) for each in simulator.inputs], dtype=np.int64)
    sensors = np.array([_sensor(model, each.name)[0] for each in simulator.outputs], dtype=np.int64)
    tables = _laws(Laws, model, [port.name for port in simulator.joints], joint_laws)
    samples, joints = inputs.shape[1], len(simulator.joints)
    record = Record(
        outputs=np.zeros((len(sensors), samples)),
        rows=sensors,
        displacement=np.zeros((joints, samples)),
        motion=np.zeros((joints, samples)),
        force=np.zeros((joints, samples)),
    )
    done = run(_memory(Simulated, model, data), tables, record, inputs, rows, steps, step_s)
    if done < samples or _restarted(data):
        raise ModelError(
            f"MuJoCo model {simulator.name!r} diverges within {min(done + 1, samples) * steps * step_s:.3g} s; "
            "shorten its timestep, or check the inputs' units"
        )
    return SimulatorResponse(
        outputs=record.outputs,
        motions=tuple(
            PortMotion(
                name=port.name,
                kind="joint",
                displacement=record.displacement[row],
                velocity=record.motion[row],
                force=record.force[row],
            )
            for row, port in enumerate(simulator.joints)
            if port.name in joint_laws
        ),
    )


def _restarted(data: Any) -> bool:
    """Whether MuJoCo met numbers that aren't finite, and silently began anew from the reference pose."""
    kinds = _mujoco().mjtWarning
    return any(
        data.warning[int(each)].number for each in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
    )


def _memory(kind: Any, model: Any, data: Any) -> Any:
    column, unit = np.zeros(model.nv), np.zeros(model.nv)
    library = ctypes.CDLL(str(_library()))
    functions = [ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in _FUNCTIONS]
    # MjData tells its address from 3.2 on, and keeps its arrays where they are.
    addresses = [model._address, data._address, *functions, column.ctypes.data, unit.ctypes.data]  # noqa: SLF001
    return kind(
        address=np.array(addresses, dtype=np.int64),
        command=data.ctrl,
        velocity=data.qvel,
        position=data.qpos,
        applied=data.qfrc_applied,
        smooth=data.qacc_smooth,
        sensors=data.sensordata,
        damping=np.ascontiguousarray(model.dof_damping.reshape(model.nv, -1)[:, 0]),
        unit=unit,
        column=column,
    )


def _library() -> Path:
    """MuJoCo's own shared library, which its Python package has loaded already."""
    folder = Path(_mujoco().__file__).parent
    found = sorted(each for pattern in ("libmujoco*", "mujoco.dll") for each in folder.glob(pattern))
    if not found:
        raise ModelError(f"MuJoCo's library is not in {folder}; reinstall the package mujoco")
    return found[0]


def _laws(kind: Any, model: Any, joints: Sequence[str], joint_laws: Mapping[str, JointLaw]) -> Any:
    from chladni.models.integrator.machine_code import law_address

    for name in joint_laws:
        if name not in joints:
            raise ModelError(f"no joint {name!r}; {nearest(name, list(joints), 'joints')}")
    found = [(law, place) for place, name in enumerate(joints) if name in joint_laws for law in joint_laws[name].laws]
    # The record holds what the table's addresses point to.
    numbers = np.array([*(value for law, _ in found for value in law.parameters), 0.0])
    own = numbers.ctypes.data + 8 * np.cumsum([0, *(len(law.parameters) for law, _ in found)])
    counts = [len(law.state) for law, _ in found]
    state = np.array([*(value for law, _ in found for value in law.state), 0.0])
    work = [np.zeros(state.size) for _ in range(3)]
    starts = np.cumsum([0, *counts])[:-1]
    table = np.zeros((max(len(found), 1), 4), dtype=np.int64)
    for row, (law, _) in enumerate(found):
        table[row] = law_address(law.function), own[row], starts[row], counts[row]
    indices = [index(model, "joint", name) for name in joints]
    return kind(
        table=table,
        first=np.searchsorted([place for _, place in found], np.arange(len(joints) + 1)).astype(np.int64),
        dof=np.array([model.jnt_dofadr[each] for each in indices], dtype=np.int64),
        place=np.array([model.jnt_qposadr[each] for each in indices], dtype=np.int64),
        rest=np.array([model.qpos_spring[model.jnt_qposadr[each]] for each in indices], dtype=np.float64),
        state=state,
        trial=work[0],
        rates=work[1],
        nudged=work[2],
        numbers=numbers,
        address=np.array([each.ctypes.data for each in work], dtype=np.int64),
    )
