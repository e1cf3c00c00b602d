"""What the measured logs of robots ask for, beside what is known of the machines: a row for each demand.

The Go2's reference is a fit by PACE, whose simulation runs the drives' loop once a step of 5 ms. `--reference` fits
the log by such a simulation, at that step and at a fifth of it: the step itself makes an armature. What was found is
fitted so, too.
"""

import argparse
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import mujoco
import numpy as np

import chladni
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.robots.forward import simulated
from chladni.gap.robots.torques import torques_of
from chladni.signals.arrays import Real

LOGS = {
    "iiwa_made": ("iiwa14.xml", ""),
    "tx40": ("tx40.urdf", "tx40"),
    "go2": ("go2_fixed.xml", "go2_pace_iit"),
    "so101_elbow": ("so101.urdf", "so101_sage_single_joint_elbow"),
    "so101_multisine": ("so101.urdf", "so101_sage_multisine"),
    "so101_friction": ("so101.urdf", "so101_sage_friction_gravity"),
}
#: Of the TX40: `../shared/robots.md`.
TX40_COULOMB = (7.14, 8.26, 6.34, 2.48, 3.03)
TX40_VISCOUS = (8.05, 5.53, 1.97, 1.11)
WRIST = "joint_5~joint_6"
LEGS = ("FL", "FR", "RL", "RR")
KP, KD, STEP_S = 20.0, 1.5, 0.005
#: Of a made log, whose machine rubs at one joint of a KUKA iiwa 14: seconds, Hz, and N m.
MADE, MADE_S, MADE_HZ, RUBS = "iiwa_made", 10.0, 250.0, 4.0
Row = tuple[str, str, str]


def number(found: Diagnosis, word: str, site: str, name: str) -> float:
    """A cause's number; NaN where it wasn't named."""
    there = (one for one in found.causes if (one.effect, one.site) == (word, site))
    return next((one.parameters[name].value for one in there), float("nan"))


def tx40(found: Diagnosis) -> Iterator[Row]:
    """Friction of the joints against the drives' own identification."""
    of_joints = (
        ("coulomb_friction", "force", TX40_COULOMB, "10 %"),
        ("viscous_friction", "coefficient", TX40_VISCOUS, "5 %"),
    )
    for word, name, known, asked in of_joints:
        off = [number(found, word, f"joint_{k}", name) / one - 1.0 for k, one in enumerate(known, 1)]
        yield f"{word} of joints 1 to {len(known)}", asked, " ".join(f"{100 * one:+.1f} %" for one in off)
    wrist = [f"{one.effect} {one.probability:.2f}" for one in found.causes if one.site == WRIST]
    yield "coupling of the wrist", "told", ", ".join(wrist) or "not told"
    yield "its Coulomb friction", "1.95 N m", f"{number(found, 'coulomb_friction', WRIST, 'force'):.2f}"
    yield "its viscous friction", "0.62 N m s/rad", f"{number(found, 'viscous_friction', WRIST, 'coefficient'):.2f}"


def go2(found: Diagnosis) -> Iterator[Row]:
    """Twelve joints of which four each are made alike."""
    for word, name, asked in (
        ("coulomb_friction", "force", "alike within 25 %"),
        ("armature", "inertia", "0.035 to 0.045, alike within 10 %"),
    ):
        seen = [number(found, word, f"{leg}_calf_joint", name) for leg in LEGS]
        yield f"{word} of the calves", asked, " ".join(f"{one:.3g}" for one in seen)
    late = number(found, "delay", "all commands", "delay")
    yield "delay of all commands", "-", f"{1e3 * late:.2f} ms"
    offsets = [one.site for one in found.causes if one.effect == "encoder_offset"]
    yield "offsets", "told", ", ".join(offsets) or "not told"


def so101(found: Diagnosis) -> Iterator[Row]:
    """Servos of which nobody says the gains."""
    sure = [f"{one.effect} {one.site} {one.probability:.2f}" for one in found.causes if one.probability >= 0.6]
    yield "named with 0.6 or more", "loaded joints: load_friction or unknown", ", ".join(sure) or "nothing"
    gains = [name for name in found.tuned_parameters if name.endswith(".kp")]
    told = ", ".join(f"{name[:-3]} {found.tuned_parameters[name].value:.1f}" for name in gains)
    yield "stiffness", "about 7 N m/rad", told
    motion = found.motion
    if motion is None or motion.after is None:
        yield "error of the wrist", "12 mrad", "not simulated"
        return
    place = motion.joints.index("wrist_flex")
    left = 1e3 * np.sqrt(np.mean((motion.after - motion.measured)[place] ** 2))
    yield "error of the wrist", "12 mrad", f"{left:.1f} mrad"


def iiwa(found: Diagnosis) -> Iterator[Row]:
    """Seven joints of which one rubs."""
    named = ", ".join(f"{one.effect} {one.site} {one.probability:.2f}" for one in found.causes)
    force = number(found, "coulomb_friction", "joint4", "force")
    yield "named", f"coulomb_friction joint4 {RUBS:g} N m", f"{named}: {force:.2f} N m"


def make_iiwa(description: Path, path: Path) -> None:
    """Write the bag of a machine that MuJoCo runs by its own servos."""
    model = mujoco.MjModel.from_xml_path(str(description))
    # An implicit step acts by the speed at its end: an armature of half a step times kd.
    model.opt.timestep = 5e-5
    joints = [model.joint(place).name for place in range(model.nq)]
    model.dof_frictionloss[joints.index("joint4")] += RUBS
    data, samples = mujoco.MjData(model), round(MADE_S * MADE_HZ)
    time_s, every = np.arange(samples) / MADE_HZ, round(1.0 / MADE_HZ / model.opt.timestep)
    ways = 2.0 * np.pi * np.outer(0.3 + 0.1 * np.arange(model.nq), time_s)
    command = 0.4 * np.sin(ways) + 0.1 * np.sin(2.7 * ways)
    position = np.empty_like(command)
    data.qpos[:] = command[:, 0]
    for sample in range(samples):
        position[:, sample], data.ctrl[:] = data.qpos, command[:, sample]
        mujoco.mj_step(model, data, every)
    step = 2.0 * np.pi / 2**14
    series = [
        chladni.TimeSeries(
            values=values, sample_rate_hz=MADE_HZ,
            channels=tuple(chladni.Channel(name=f"{topic}.position[{one}]") for one in joints),
        )
        for topic, values in (("/joint_states", step * np.rint(position / step)), ("/joint_commands", command))
    ]  # fmt: skip
    chladni.write_mcap(series, path)


ROWS = {MADE: iiwa, "tx40": tx40, "go2": go2, "so101_elbow": so101, "so101_multisine": so101, "so101_friction": so101}


def found_machine(folder: Path) -> Real:
    """``[joint, sample]``: what the machine that was found makes of the Go2's commands, delay and all."""
    description, log = (folder / one for one in (LOGS["go2"][0], f"{LOGS['go2'][1]}.mcap"))
    machine = chladni.diagnose_gap(description, log).machine
    robot = chladni.load_robot(description)
    with chladni.open(log) as opened:
        torques = torques_of(robot, chladni.joint_log(robot, opened))
    return simulated(machine, torques, [(0, torques.log.position.shape[1])])


def reference(folder: Path, splits: int, position: Real | None = None) -> tuple[Real, float]:
    """Fit armature, damping, dry friction and a constant of each joint by simulations without a delay.

    Parameters
    ----------
    position
        ``[joint, sample]``: what is fitted; the log's own when None.

    Returns
    -------
    tuple[Real, float]
        ``[leg, joint]`` armatures, kg m^2, and the RMS error of positions, rad.
    """
    path, name = folder / LOGS["go2"][0], LOGS["go2"][1]
    robot, model = chladni.load_robot(path), mujoco.MjModel.from_xml_path(str(path))
    with chladni.open(folder / f"{name}.mcap") as log:
        joints = chladni.joint_log(robot, log)
    # Semi-implicit Euler, whose loop acts by the state at the step's begin.
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_EULER, STEP_S / splits
    model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION | mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    at, place = [one.dof for one in robot.joints], [one.position for one in robot.joints]
    measured, command = joints.position if position is None else position, joints.command
    assert command is not None
    length = 400
    starts = range(10, measured.shape[1] - length, length)

    def left(numbers: Real) -> Real:
        model.dof_armature[at], model.dof_damping[at], model.dof_frictionloss[at] = numbers[:3]
        found, data = [], mujoco.MjData(model)
        for start in starts:
            data.qpos[place], data.qvel[at] = (
                measured[:, start],
                (measured[:, start + 1] - measured[:, start - 1]) / (2 * STEP_S),
            )
            for k in range(start, start + length):
                found.append(data.qpos[place] - measured[:, k])
                for _ in range(splits):
                    asked = KP * (command[:, k] - data.qpos[place]) - KD * data.qvel[at] + numbers[3]
                    data.qfrc_applied[at] = asked
                    mujoco.mj_step(model, data)
        return np.array(found).T

    steps = np.array([1e-3, 1e-2, 2e-2, 1e-2])
    numbers = np.repeat([[0.03], [0.1], [0.3], [0.0]], 12, axis=1)
    rest, damped = left(numbers), 1e-3
    for _ in range(8):
        slopes = np.zeros((4, 3, *rest.shape))
        for kind in range(4):
            for joint in range(3):
                # Legs on a trunk that is fixed don't feel each other.
                moved = numbers.copy()
                moved[kind, joint::3] += steps[kind]
                slopes[kind, joint] = left(moved) - rest
        tried = numbers.copy()
        for leg in range(4):
            rows = slice(3 * leg, 3 * leg + 3)
            columns = slopes[:, :, rows].reshape(12, -1)
            square = columns @ columns.T
            found = np.linalg.solve(square + damped * np.diag(np.diag(square)), -columns @ rest[rows].ravel())
            tried[:, rows] += found.reshape(4, 3) * steps[:, None]
        tried[0], tried[1:3] = np.maximum(tried[0], 1e-5), np.maximum(tried[1:3], 0.0)
        other = left(tried)
        if np.mean(other**2) < np.mean(rest**2):
            numbers, rest, damped = tried, other, damped / 5.0
        else:
            damped *= 20.0
    return numbers[0].reshape(4, 3), float(np.sqrt(np.mean(rest**2)))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", choices=[*LOGS, []], help="all if none is named")
    parser.add_argument("--folder", type=Path, default=Path("../shared/data/robots"))
    parser.add_argument("--reference", action="store_true", help="armatures of the Go2 as PACE's simulation has them")
    options = parser.parse_args()
    if options.reference:
        found = found_machine(options.folder)
        for what, splits, position in (
            ("the log", 1, None),
            ("the log", 5, None),
            ("the machine that was found", 1, found),
        ):
            armature, error = reference(options.folder, splits, position)
            told, step_ms = " ".join(f"{one:.4f}" for one in armature[:, 2]), 1e3 * STEP_S / splits
            print(f"{what}, step {step_ms:g} ms: calves {told} kg m^2, error {1e3 * error:.2f} mrad", flush=True)
        return
    print("| log | what | asked or known | seen |\n| --- | --- | --- | --- |")
    for name in options.logs or LOGS:
        description, log = LOGS[name]
        bag = options.folder / f"{log}.mcap"
        if name == MADE:
            bag = Path(tempfile.mkdtemp()) / "iiwa.mcap"
            make_iiwa(options.folder / description, bag)
        begin = time.process_time()
        found = chladni.diagnose_gap(options.folder / description, bag)
        seconds, memory = time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        for what, asked, seen in ROWS[name](found):
            print(f"| {name} | {what} | {asked} | {seen} |", flush=True)
        print(f"| {name} | error before, after | - | {found.gap.before:.1%}, {found.gap.after:.1%} |")
        print(f"| {name} | processor time; memory so far | - | {seconds:.1f} s; {memory:.0f} MB |", flush=True)


if __name__ == "__main__":
    main()
