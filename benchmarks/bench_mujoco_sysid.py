"""Robots beside mujoco.sysid: what each says of six made logs whose truth is known.

A machine by Pinocchio (its own steps, LuGre friction, a digital position loop at 1 kHz that reads 14-bit encoders)
follows a motion of `chladni.excite`. Positions and commands are logged at 250 Hz. Both get the same MJCF and log.

chladni gets one call and no settings. mujoco.sysid gets all that its README says it finds, from nominal values on:

- of each joint frictionloss, damping, armature, and a factor on both gains of its servo (damping and kd are one
  number: kd alone isn't free); all ten inertial numbers of the last body;
- one delay of all positions. It's one of all commands, as nothing else drives the arm;
- bounds: nothing is negative. Parameters at a bound are moved off it, as its messages advise;
- MuJoCo steps once a period of the loop. Measured stamps are a step later, as its simulated sensors are; commands are
  held, not interpolated.

It says what is three of its own sigma away from nominal. In the rows `joints only` frictionloss, damping and armature
alone are free: what it says when the cause isn't among the parameters that it was given.
"""

import argparse
import contextlib
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
try:
    import pinocchio as pin
    from mujoco import sysid
    from mujoco.sysid import optimize
except ImportError:
    sys.exit("needs Pinocchio, robots, and mujoco.sysid: pip install pin example-robot-data 'mujoco[sysid]'")

import chladni
from chladni.robots.joint_log import JointLog, joint_log
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni_withheld.case import PARAMETER, START_TIME_NS, Matrix
from chladni_withheld.robots.cause import ALL_COMMANDS, rubbing, served
from chladni_withheld.robots.descriptions import Description, Tool, describe
from chladni_withheld.robots.machine import Commands, Friction, Machine, Motion, Servo, Transmission, simulate
from chladni_withheld.robots.scene import LEAD_S, STEP_S, rounded, true_model

RATE_HZ, LOOP_S, REST_S = 250.0, 1e-3, 0.5
RESOLUTION = 2.0 * np.pi / 2**14
TOOL = Tool(mass=1.0, centre=(0.0, 0.0, 0.05), radius=0.05)
DELAY_S, GAIN, PAYLOAD_KG = 8e-3, 0.75, 1.2
#: Shares of a joint's torque: Coulomb, viscous at one joint, viscous at each of all.
COULOMB, VISCOUS, VISCOUS_OF_ALL = 0.3, 0.2, 0.1
#: Way over which dry friction builds up, rad; levels of the withheld robots are 0.2 to 1 mrad.
BRISTLE = 3e-4
SIGMAS = 3.0
#: Half width of an interval of this significance is one sigma.
ONE_SIGMA = 0.3173
#: Damping, N m s/rad: without any MuJoCo steps otherwise, and a jump of 1e-10 spoils differences of steps of 1e-8.
LEAST = 1e-6
Place = tuple[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """A number away from nominal; `value` and `sigma` in SI, mass of a payload beyond nominal."""

    value: float
    sigma: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """A log: what it's called, the machine, and the true numbers by word and place."""

    name: str
    machine: Machine
    truth: Mapping[Place, float]


# --- the logs -------------------------------------------------------------------------------------------------------


def servo_of(robot: Description, poses: Matrix) -> Servo:
    """Gains of some hertz of bandwidth, damped by 0.7, as the withheld robots have."""
    data, count = robot.model.createData(), len(robot.joints)
    inertia = np.mean([np.diag(pin.crba(robot.model, data, q)) for q in poses.T[::100]], axis=0)
    hz = np.minimum(4.0 * (inertia.max() / inertia) ** 0.15, 12.0)
    kp = rounded((2.0 * np.pi * hz) ** 2 * inertia, 2)
    kd = rounded(1.4 * np.sqrt(kp * inertia), 2)
    # Below 2 a held torque is stable.
    if LOOP_S * max(np.max(np.diag(pin.computeMinverse(robot.model, data, q)) * kd) for q in poses.T[::100]) > 1.0:
        sys.exit(f"{robot.name}: such gains aren't stable in a loop at 1 kHz; try ur3, ur5 or ur10")
    zero = np.zeros(count)
    return Servo(kp=kp, kd=kd, limit=robot.effort, dead=zero, most=np.full(count, np.inf), period_s=LOOP_S,
                 delay_s=zero, lag_s=zero, gain=np.ones(count))  # fmt: skip


def mjcf(robot: Description, servo: Servo) -> str:
    """Description that both tools get: links, position servos, a sensor of each joint; steps of the loop's period."""
    spec = mujoco.MjSpec.from_string(robot.urdf)
    spec.option.timestep = LOOP_S
    for joint, kp, kd, limit in zip(robot.joints, servo.kp, servo.kd, servo.limit, strict=True):
        drive = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        drive.set_to_position(kp=kp, kv=kd)
        drive.forcerange = [-limit, limit]
        spec.add_sensor(name=f"{joint}_pos", type=mujoco.mjtSensor.mjSENS_JOINTPOS,
                        objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)  # fmt: skip
    spec.compile()
    return str(spec.to_xml())


def commands_along(poses: Matrix) -> Commands:
    """Rest, the motion, rest; times from the log's start."""
    before, after = (round(rest_s * RATE_HZ) for rest_s in (LEAD_S + REST_S, REST_S))
    values = np.pad(poses, ((0, 0), (before, after)), mode="edge")
    return Commands(t_s=np.arange(values.shape[1]) / RATE_HZ - LEAD_S, values=values)


def run(machine: Machine, commands: Commands) -> Motion:
    stamps = commands.t_s[commands.t_s > -0.5 / RATE_HZ]
    return simulate(machine, commands, stamps, step_s=STEP_S, resolution=RESOLUTION)


def write(robot: Description, motion: Motion, commands: Commands, path: Path) -> None:
    readings = np.rint(motion.reading / RESOLUTION) * RESOLUTION
    topics = {"/joint_states": readings, "/joint_commands": commands.values[:, -motion.t_s.size :]}
    chladni.write_mcap(
        [
            TimeSeries(values=values, sample_rate_hz=RATE_HZ, start_time_ns=START_TIME_NS,
                       channels=tuple(Channel(name=f"{topic}.position[{joint}]") for joint in robot.joints))
            for topic, values in topics.items()
        ],
        path,
    )  # fmt: skip


def loaded(machine: Machine) -> Machine:
    """With a payload at the flange, beside its axis."""
    model = machine.model.copy()
    body = pin.Inertia(PAYLOAD_KG, np.array([0.0, 0.08, 0.03]), PAYLOAD_KG * 0.03**2 * np.eye(3))
    model.inertias[model.njoints - 1] += body
    return replace(machine, model=model)


def six(robot: Description, quiet: Machine, motion: Motion, joint: int) -> list[Made]:
    """Nothing, delay, gain, payload, friction in one joint and in all; of the size that the motion asks for."""
    here, count = robot.joints[joint], len(robot.joints)
    swing, fast = motion.given.std(axis=1), motion.speed.std(axis=1)

    def rubs(joints: Iterable[int], share: float, name: str) -> Made:
        machine, truth = quiet, dict[Place, float]()
        for one in joints:
            force, viscous = float(COULOMB * swing[one]), float(share * swing[one] / fast[one])
            machine = rubbing(
                machine, joint=one, coulomb=force, static=force, bristle=force / BRISTLE, viscous=viscous
            )
            truth |= {("Coulomb", robot.joints[one]): force, ("viscous", robot.joints[one]): viscous}
        return Made(name=name, machine=machine, truth=truth)

    late = replace(quiet, servo=replace(quiet.servo, delay_s=np.full(count, DELAY_S)))
    weak = served(quiet, joint=joint, gain=GAIN)
    return [
        Made(name="nothing", machine=quiet, truth={}),
        Made(name="delay", machine=late, truth={("delay", ALL_COMMANDS): DELAY_S}),
        Made(name="gain", machine=weak, truth={("gain", here): GAIN}),
        Made(name="payload", machine=loaded(quiet), truth={("payload", robot.links[-1]): PAYLOAD_KG}),
        rubs([joint], VISCOUS, "friction"),
        rubs(range(count), VISCOUS_OF_ALL, "friction in all"),
    ]


# --- chladni --------------------------------------------------------------------------------------------------------

#: Without the torque in the log kp and kd that are off alike are a gain.
_WORDS = {"coulomb_friction": "Coulomb", "viscous_friction": "viscous"} | dict.fromkeys(
    ("gain_error", "controller_gain"), "gain"
)
_NUMBERS = ("delay", "gain", "mass", "force", "coefficient")


def by_chladni(description: Path, log: Path) -> dict[Place, Said]:
    found = chladni.diagnose_gap(description, log)
    said = {("unknown", ""): Said(value=np.nan, sigma=np.nan)} if found.verdict == "unknown" else {}
    for cause in found.causes:
        key = next((name for name in _NUMBERS if name in cause.parameters), next(iter(cause.parameters)))
        number, word, site = cause.parameters[key], _WORDS.get(cause.effect, cause.effect), cause.site
        # A link that is heavier than described carries something.
        if word == PARAMETER and site.endswith(".mass"):
            word, site = "payload", site.removesuffix(".mass")
        nominal = number.nominal or 0.0 if cause.effect == PARAMETER else 0.0
        said[word, site] = Said(value=number.value - nominal, sigma=np.nan if number.std is None else number.std)
    return said


# --- mujoco.sysid ---------------------------------------------------------------------------------------------------

Modifier = Callable[[mujoco.MjSpec, sysid.Parameter], object]


def joint_parameters(spec: mujoco.MjSpec, joint: str, inertia: float) -> dict[Place, sysid.Parameter]:
    """Friction up to a tenth of the drive's limit, damping to its kd, armature to what the joint moves."""
    drive = spec.actuator(joint)
    kp, kd, limit = drive.gainprm[0], -drive.biasprm[2], drive.forcerange[1]

    def damp(changed: mujoco.MjSpec, given: sysid.Parameter) -> None:
        changed.joint(joint).damping[0] = given.value[0]

    def put(name: str) -> Modifier:
        return lambda changed, given: setattr(changed.joint(joint), name, given.value[0])

    def amplify(changed: mujoco.MjSpec, given: sysid.Parameter) -> None:
        sysid.apply_pdgain(changed, joint, given.value[0] * np.array([kp, kd]))

    rows: list[tuple[str, float, float, float, Modifier]] = [
        ("Coulomb", 0.0, 0.0, 0.1 * limit, put("frictionloss")),
        ("viscous", 0.0, LEAST, kd, damp),
        ("armature", 0.0, 0.0, inertia, put("armature")),
        ("gain", 1.0, 0.3, 3.0, amplify),
    ]
    return {
        (word, joint): sysid.Parameter(f"{word} {joint}", usual, low, high, modifier=change)
        for word, usual, low, high, change in rows
    }


def parameters_of(
    spec: mujoco.MjSpec, joints: Iterable[str], pose: Matrix, words: tuple[str, ...]
) -> dict[Place, sysid.Parameter]:
    model = spec.compile()
    data, masses, last = mujoco.MjData(model), np.zeros((model.nv, model.nv)), spec.bodies[-1].name
    data.qpos[:] = pose
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, masses)
    found: dict[Place, sysid.Parameter] = {}
    for joint, inertia in zip(joints, np.diag(masses), strict=True):
        found |= joint_parameters(spec, joint, float(inertia))
    found["payload", last] = sysid.body_inertia_param(
        spec, model, last, sysid.InertiaType.Pseudo, param_name=f"payload {last}",
        modifier=lambda changed, given: put_inertia(changed, last, given),
    )  # fmt: skip
    found["delay", ALL_COMMANDS] = sysid.Parameter(f"delay {ALL_COMMANDS}", 0.0, 0.0, 0.05)
    return {place: one for place, one in found.items() if place[0] in words}


def put_inertia(changed: mujoco.MjSpec, body: str, given: sysid.Parameter) -> None:
    sysid.apply_body_inertia(changed, body, given)
    # It leaves NaN there, which MuJoCo 4.0 doesn't compile.
    changed.body(body).iquat = [1.0, 0.0, 0.0, 0.0]


def measured(spec: mujoco.MjSpec, log: JointLog) -> sysid.ModelSequences:
    """The log as its tutorial lays it out."""
    model = spec.compile()
    step_s, times = model.opt.timestep, np.arange(log.position.shape[1]) / log.sample_rate_hz
    fine = step_s * np.arange(round(times[-1] / step_s) + 2)
    held = log.command[:, np.searchsorted(times, fine + 1e-9, "right") - 1]
    return sysid.ModelSequences(
        "robot", spec, "log", sysid.create_initial_state(model, log.position[:, 0], np.zeros(model.nv)),
        sysid.TimeSeries.from_control_names(fine, held.T, model),
        sysid.TimeSeries.from_names(times + step_s, log.position.T, model),
    )  # fmt: skip


def by_sysid(description: Path, log: Path, words: tuple[str, ...]) -> dict[Place, Said]:
    robot = chladni.load_robot(description)
    with chladni.open(log) as opened:
        joints = joint_log(robot, opened)
    spec = mujoco.MjSpec.from_file(str(description))
    free = parameters_of(spec, [one.name for one in robot.joints], joints.position[:, 0], words)
    start, transform = sysid.ParameterDict(), sysid.SignalTransform()
    for place, one in free.items():
        start.add(one)
        if place[0] == "delay":
            transform.delay("*_pos", one)
    start.move_off_bounds()
    residual = sysid.build_residual_fn(models_sequences=[measured(spec, joints)], modify_residual=transform.apply)
    with contextlib.redirect_stdout(sys.stderr):
        best, result = optimize(start, residual, verbose=False)
    left, _, _ = residual(result.x, best.copy())
    _, sigmas = sysid.calculate_intervals(left, result.jac, alpha=ONE_SIGMA)
    said, first = {}, 0
    for place in free:
        number = best[" ".join(place)]
        sigma, first = sigmas[first : first + number.size], first + number.size
        if np.any(np.abs(number.as_vector() - number.as_nominal_vector()) > SIGMAS * sigma):
            said[place] = told(number, sigma)
    return said


def told(number: sysid.Parameter, sigma: Matrix) -> Said:
    """One number; of the last body its mass beyond nominal, exp(2 alpha), alpha the first of its ten."""
    value = float(number.value[0])
    if number.size == 1:
        return Said(value=value, sigma=float(sigma[0]))
    mass = np.exp(2.0 * value)
    return Said(value=float(mass - np.exp(2.0 * number.nominal[0])), sigma=float(2.0 * mass * sigma[0]))


# --- the table ------------------------------------------------------------------------------------------------------

JOINT_WORDS = ("Coulomb", "viscous", "armature")
Sayer = Callable[[Path, Path], dict[Place, Said]]
TOOLS: Mapping[str, Sayer] = {
    "chladni": by_chladni,
    "mujoco.sysid": lambda description, log: by_sysid(description, log, (*JOINT_WORDS, "gain", "payload", "delay")),
    "mujoco.sysid, joints only": lambda description, log: by_sysid(description, log, JOINT_WORDS),
}
#: Unit, and how many of it make one in SI.
UNITS = {"Coulomb": ("N m", 1.0), "viscous": ("N m s/rad", 1.0), "armature": ("kg m²", 1.0), "payload": ("kg", 1.0),
         "delay": ("ms", 1e3)}  # fmt: skip
HEADER = ("log", "hidden", "who", "finds", "off by", "and says besides", "", "s")
_FEW = 2
#: Numbers this near, relative, are right.
NEAR = 0.2


def shown(place: Place, number: Said | float) -> str:
    """Word, place, value with two digits of its sigma."""
    unit, size = UNITS.get(place[0], ("", 1.0))
    if isinstance(number, float):
        text = f"{size * number:.3g}"
    elif np.isnan(number.value):
        text = ""
    else:
        sigma = size * number.sigma
        digits = max(0, 1 - int(np.floor(np.log10(sigma)))) if sigma > 0.0 else 3
        text = f"{size * number.value:.{digits}f} ± {sigma:.{digits}f}"
    return " ".join(one for one in (*place, text, unit) if one)


def few(items: list[str], count: str = "") -> str:
    listed = items if len(items) <= _FEW else [*items[:_FEW], f"{len(items) - _FEW} more"]
    return "; ".join([count, *listed] if count else listed) or "-"


def sureness(place: Place, said: Said) -> float:
    """Sigmas from nominal."""
    return abs(said.value - (place[0] == "gain")) / said.sigma


def row(made: Made, tool: str, said: Mapping[Place, Said], seconds: float) -> list[str]:
    hits = {place: said[place] for place in made.truth if place in said}
    missed = [" ".join(place) for place in made.truth if place not in said]
    others = sorted((place for place in said if place not in made.truth), key=lambda one: -sureness(one, said[one]))
    off = {place: abs(one.value / made.truth[place] - 1.0) for place, one in hits.items()}
    worst = {word: max(off[place] for place in off if place[0] == word) for word, _ in hits}
    right = not missed and not others and max(off.values(), default=0.0) <= NEAR
    found = [shown(*one) for one in hits.items()] if len(made.truth) <= _FEW else []
    return [
        made.name,
        few([shown(*one) for one in made.truth.items()]),
        tool,
        few(found + [f"not {one}" for one in missed], f"{len(hits)} of {len(made.truth)}" if made.truth else ""),
        ", ".join(f"{word} {100 * error:.1f} %" for word, error in worst.items()) or "-",
        few([shown(one, said[one]) for one in others]),
        "right" if right else "wrong",
        f"{seconds:.1f}",
    ]


def main() -> None:
    """Print the table, a row as soon as it's known."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="ur5", help="arm of example-robot-data, by its name in chladni_withheld")
    parser.add_argument("--joint", type=int, default=2, help="number of the joint that has the gain and the friction")
    parser.add_argument("--inertia", type=float, default=0.0, help="by which true inertias are off: one sigma")
    parser.add_argument("--seed", type=int, default=0, help="of the inertias and the motion")
    parser.add_argument("--tool", action="append", choices=tuple(TOOLS), help="all if none is given")
    parser.add_argument("--keep", type=Path, default=None, help="folder for the description and the logs")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = chosen.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        print(f"| {' | '.join(HEADER)} |\n| {' | '.join('---' for _ in HEADER)} |")
        for made, description, log in logs(folder, chosen):
            for tool in chosen.tool or TOOLS:
                start = time.perf_counter()
                said = TOOLS[tool](description, log)
                print(f"| {' | '.join(row(made, tool, said, time.perf_counter() - start))} |", flush=True)


def logs(folder: Path, chosen: argparse.Namespace) -> Iterator[tuple[Made, Path, Path]]:
    robot, description = describe(chosen.robot, tool=TOOL), folder / "robot.xml"
    (bare := folder / "robot.urdf").write_text(robot.urdf, encoding="utf-8")
    poses = chladni.excite(bare, sample_rate_hz=RATE_HZ, seed=chosen.seed).position
    servo, commands, count = servo_of(robot, poses), commands_along(poses), len(robot.joints)
    description.write_text(mjcf(robot, servo), encoding="utf-8")
    model = true_model(np.random.default_rng(chosen.seed), robot.model, chosen.inertia)
    quiet = Machine(
        model=model, servo=servo, friction=Friction.none(count), transmission=Transmission.rigid(count),
        offset=np.zeros(count),
    )  # fmt: skip
    for number, made in enumerate(six(robot, quiet, run(quiet, commands), chosen.joint)):
        write(robot, run(made.machine, commands), commands, log := folder / f"{number}.mcap")
        yield made, description, log


if __name__ == "__main__":
    main()
