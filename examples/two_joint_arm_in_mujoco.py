"""What a MuJoCo model of an arm forgot: friction in the elbow, and dead time before the shoulder's motor.

The "machine" is MuJoCo too, with four times finer steps, other masses and damping, a friction law that chladni's
catalogue doesn't hold in this form (LuGre's, with Stribeck's dip) and a command that comes 6 ms late. Its log goes to
an MCAP file; the diagnosis sees the file and the plain model, nothing else.

Needs the extra ``[mujoco]``. Give a file name as argument to keep the picture.
"""

import sys
import tempfile
from math import exp
from pathlib import Path

import mujoco
import numpy as np

import chladni
from chladni import Diagnosis, MujocoSimulator, Multisine, diagnose_simulator, explained_simulator, mujoco_simulator

MODEL = """
<mujoco model="two-joint arm">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.6"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03" mass="2"/>
      <body name="forearm" pos="0 0 -0.4">
        <joint name="elbow" type="hinge" axis="0 1 0" damping="0.15"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="1"/>
        <site name="tip" pos="0 0 -0.3"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="shoulder_motor" joint="shoulder"/><motor name="elbow_motor" joint="elbow"/></actuator>
  <sensor>
    <jointpos name="shoulder_angle" joint="shoulder"/>
    <jointpos name="elbow_angle" joint="elbow"/>
    <accelerometer name="tip" site="tip"/>
  </sensor>
</mujoco>
"""
INPUTS = {"shoulder_motor": "/command.shoulder", "elbow_motor": "/command.elbow"}
OUTPUTS = {
    "shoulder_angle": "/angle.shoulder",
    "elbow_angle": "/angle.elbow",
    "tip.x": "/tip.linear_acceleration.x",
    "tip.z": "/tip.linear_acceleration.z",
}
UNITS = ("N m", "N m", "rad", "rad", "m/s^2", "m/s^2")
RATE_HZ, SECONDS, NOISE = 500.0, 8.0, 0.01
# What the machine has and the model hasn't.
DELAY_S = 0.006
COULOMB, STATIC, STRIBECK_SPEED, BRISTLE_STIFFNESS, BRISTLE_DAMPING = 0.22, 0.30, 0.15, 400.0, 0.2


def torques() -> np.ndarray:
    """``[motor, sample]`` random multisines, four periods."""
    rng = np.random.default_rng(3)
    drives = [Multisine(rms=rms, period_s=2.0, band_hz=(0.5, 12.0)) for rms in (2.5, 0.8)]
    return np.array([drive.samples(round(SECONDS * RATE_HZ), RATE_HZ, rng) for drive in drives])


def machine(commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``[output, sample]`` of the machine, and ``[2, sample]`` of speed and friction in its elbow."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    model.opt.timestep /= 4
    model.dof_damping[1] *= 1.15
    model.body_mass[2] *= 1.03
    model.body_inertia[2] *= 1.03
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    late = round(DELAY_S * RATE_HZ)
    outputs, elbow = np.zeros((4, commands.shape[1])), np.zeros((2, commands.shape[1]))
    bend = 0.0
    for sample in range(commands.shape[1]):
        data.ctrl[:] = commands[0, sample - late] if sample >= late else 0.0, commands[1, sample]
        for step in range(round(1 / RATE_HZ / model.opt.timestep)):
            bend, friction = lugre(bend, data.qvel[1], model.opt.timestep)
            data.qfrc_applied[1] = -friction
            mujoco.mj_step(model, data)
            if step == 0:
                outputs[:, sample] = data.sensordata[[0, 1, 2, 4]]
                elbow[:, sample] = data.qvel[1], friction
    return outputs, elbow


def lugre(bend: float, speed: float, step_s: float) -> tuple[float, float]:
    """Give the bend of the bristles after a step, and the friction (IEEE Trans. Automatic Control 40, 1995, 419)."""
    sliding = COULOMB + (STATIC - COULOMB) * exp(-((speed / STRIBECK_SPEED) ** 2))
    after = (bend + step_s * speed) / (1 + step_s * BRISTLE_STIFFNESS * abs(speed) / sliding)
    return after, BRISTLE_STIFFNESS * after + BRISTLE_DAMPING * (after - bend) / step_s


def record(path: Path) -> np.ndarray:
    """Write the machine's log; give speed and friction in its elbow, which the log doesn't hold."""
    commands = torques()
    outputs, elbow = machine(commands)
    noise = NOISE * outputs.std(axis=1, keepdims=True) * np.random.default_rng(5).normal(size=outputs.shape)
    names = [*INPUTS.values(), *OUTPUTS.values()]
    channels = tuple(chladni.Channel(name=name, unit=unit) for name, unit in zip(names, UNITS, strict=True))
    values = np.vstack([commands, outputs + noise])
    chladni.write_mcap(chladni.TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels), path)
    return elbow


def arm() -> MujocoSimulator:
    """Give the model as its engineer believes it."""
    return mujoco_simulator(
        MODEL,
        inputs=INPUTS,
        outputs=OUTPUTS,
        joints=("shoulder", "elbow"),
        parameters={"shoulder.damping": 0.2, "elbow.damping": 0.2, "forearm.mass": 0.05},
    )


def draw(found: Diagnosis, elbow: np.ndarray, path: Path) -> None:
    """Draw the tip's acceleration before and after, and the elbow's friction as it is and as it was found."""
    import matplotlib.pyplot as plt

    signals = found.signals
    if signals is None:
        return
    _, motion = explained_simulator(arm(), found).respond(torques(), RATE_HZ).motions
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(9, 7), layout="constrained")
    span = slice(round(5.0 * RATE_HZ), round(6.0 * RATE_HZ))
    time_s = np.arange(signals.measured.shape[1])[span] / RATE_HZ
    for name, rows, style in (
        ("machine", signals.measured, "k-"),
        ("model", signals.before, "C1--"),
        ("model with what was found", signals.after, "C0-"),
    ):
        top.plot(time_s, rows[2, span], style, label=name, linewidth=1.2)
    top.set(xlabel="time [s]", ylabel="tip, x [m/s²]", title=f"Gap {found.gap.before:.0%} → {found.gap.after:.1%}")
    bottom.plot(*elbow, "k.", markersize=2, label="machine (not in the log)")
    bottom.plot(motion.velocity, motion.force, "C0.", markersize=2, label="found")
    bottom.set(xlabel="speed of the elbow [rad/s]", ylabel="friction [N m]", xlim=(-3, 3))
    # Room above for the legend, which hides no curve there.
    top.margins(y=0.2)
    top.legend(loc="upper center", ncols=3)
    bottom.legend(loc="lower right")
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    print(f"picture: {path}")


def main() -> None:
    """Make the log, diagnose it, print what was found beside the truth."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.mcap"
        elbow = record(path)
        with chladni.open_log(path) as log:
            found = diagnose_simulator(arm(), log.read(), log=path.name)
        for sentence in found.summary():
            print(sentence)
        for cause in found.causes:
            for name, number in cause.parameters.items():
                spread = "" if number.std is None else f" ± {number.std:.2g}"
                print(f"  {cause.effect} at {cause.site}, {name}: {number.value:.4g}{spread} {number.unit}")
        print(f"truth: Coulomb {COULOMB} N m, static {STATIC} N m at elbow; {DELAY_S:g} s at shoulder_motor")
        draw(found, elbow, Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "arm.png")


if __name__ == "__main__":
    main()
