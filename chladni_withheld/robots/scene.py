"""A robot with nothing hidden: description, true inertias, servo, trajectory, and how it is logged."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from chladni_withheld.case import Matrix
from chladni_withheld.robots.afloat import draw_afloat
from chladni_withheld.robots.descriptions import SOURCES, Description, Tool, describe
from chladni_withheld.robots.excitation import Rng, draw_reference, draw_room
from chladni_withheld.robots.machine import Commands, Friction, Machine, Motion, Servo, Transmission, simulate

Effort = Literal["none", "measured", "commanded", "current"]
INERTIA_SIGMA = 0.03
#: Runs before the log begins, so that nothing but the log's own motion is in it.
LEAD_S = 1.5
#: Of the integration.
STEP_S = 2e-4
_STATE_HZ = (50.0, 100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0)
_COMMAND_HZ = (50.0, 100.0, 125.0, 200.0, 250.0, 500.0, 1000.0)


class RefusedError(Exception):
    """A draw that makes no fair case; another is drawn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorder:
    """How the log is made: rates, Hz, first stamps, s, encoders' resolution, rad, and which arrays a state has."""

    state_hz: float
    command_hz: float
    state_s: float
    command_s: float
    length_s: float
    resolution: float
    velocity: bool
    effort: Effort
    torque_constant: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A robot that does what its description says, within the tolerances.

    Attributes
    ----------
    robot
        What the user believes.
    machine
        What moves, with nothing hidden.
    commands, recorder, excitation
        What it's told, how it's logged, and the trajectory's word.
    gains
        kp and kd as the user believes them.
    tolerance
        Of inertias and gains, one sigma, relative.
    """

    robot: Description
    machine: Machine
    commands: Commands
    recorder: Recorder
    excitation: str
    gains: tuple[Matrix, Matrix]
    tolerance: Mapping[str, float]

    @property
    def t_s(self) -> Matrix:
        """Stamps of the states."""
        recorder = self.recorder
        return recorder.state_s + np.arange(int(recorder.length_s * recorder.state_hz)) / recorder.state_hz

    def motion(self, machine: Machine | None = None) -> Motion:
        """What the machine, or another one, does on this scene's commands.

        Raises
        ------
        RefusedError
            When it leaves all bounds.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            found = simulate(machine or self.machine, self.commands, self.t_s, step_s=STEP_S,
                             resolution=self.recorder.resolution)  # fmt: skip
        if not np.isfinite(found.acceleration).all() or np.abs(found.speed).max() > 50.0:
            raise RefusedError("unstable")
        return found


def draw_scene(
    rng: Rng, *, inertia: float = INERTIA_SIGMA, declared: float | None = None, floats: bool = False
) -> Scene:
    """A robot whose inertias are off by `inertia`, one sigma, where the user's file says `declared`."""
    robot = _draw_robot(rng, floats=floats)
    recorder = _draw_recorder(rng)
    room = draw_room(rng, robot)
    word, reference = draw_reference(rng, room, recorder.length_s)
    before, after = int(LEAD_S * recorder.command_hz), int(recorder.length_s * recorder.command_hz)
    sent_s = recorder.command_s + np.arange(-before, after) / recorder.command_hz
    values = reference(sent_s)
    # Some logs begin at rest, somewhere: before that the robot is held where it begins.
    if rng.random() < 0.5:
        rise = np.clip((sent_s - 0.2) / 1.0, 0.0, 1.0)
        values = values[:, :1] + (values - values[:, :1]) * (rise**2 * (3.0 - 2.0 * rise))
    commands = Commands(t_s=sent_s, values=values)
    model = true_model(rng, robot.model, inertia)
    servo = _draw_servo(rng, robot, model, commands)
    count = len(robot.joints)
    machine = Machine(model=model, servo=servo, friction=Friction.none(count), transmission=Transmission.rigid(count),
                      offset=np.zeros(count), base=draw_afloat(rng, model) if floats else None)  # fmt: skip
    tolerance = {"inertia": inertia if declared is None else declared, "gains": 0.0}
    return Scene(robot=robot, machine=machine, commands=commands, recorder=recorder, excitation=word,
                  gains=(servo.kp, servo.kd), tolerance=tolerance)  # fmt: skip


def _draw_robot(rng: Rng, *, floats: bool) -> Description:
    # Legs have a base that floats.
    name = str(rng.choice(sorted(one for one in SOURCES if not (floats and SOURCES[one].tool))))
    mass = rng.uniform(0.5, 2.0)
    centre = (*np.round(rng.uniform(-0.04, 0.04, 2), 3).tolist(), round(float(rng.uniform(0.03, 0.1)), 3))
    tool = Tool(mass=mass, centre=centre, radius=float(rng.uniform(0.04, 0.08))) if SOURCES[name].tool else None
    return describe(name, tool=tool, meshes=bool(rng.random() < 0.5))


def _draw_recorder(rng: Rng) -> Recorder:
    state_hz = float(rng.choice(_STATE_HZ))
    slower = [hz for hz in _COMMAND_HZ if hz <= state_hz]
    command_hz = state_hz if rng.random() < 0.4 else float(rng.choice(slower))
    kind = rng.random()
    efforts: tuple[Effort, ...] = ("measured", "commanded", "current")
    effort: Effort = efforts[int(rng.integers(3))] if kind > 0.6 else "none"
    return Recorder(
        state_hz=state_hz, command_hz=command_hz, state_s=_stamp(rng, state_hz), command_s=_stamp(rng, command_hz),
        length_s=float(rng.choice([8.0, 10.0, 12.0, 16.0, 20.0])),
        resolution=2.0 * np.pi / 2.0 ** int(rng.integers(12, 18)), velocity=bool(kind > 0.4), effort=effort,
        torque_constant=round(float(rng.uniform(0.5, 12.0)), 2) if effort == "current" else 1.0,
    )  # fmt: skip


def _stamp(rng: Rng, hz: float) -> float:
    """First stamp of a topic: a whole number of steps inside its period."""
    return float(rng.integers(0, max(1, int(1.0 / hz / STEP_S)))) * STEP_S


def true_model(rng: Rng, model: pin.Model, sigma: float) -> pin.Model:
    """The machine's links: masses, centres and inertias off by `sigma`, two of it at most."""
    true = model.copy()
    for index in range(1, model.njoints):
        inertia = model.inertias[index]
        off = 1.0 + sigma * np.clip(rng.normal(size=5), -2.0, 2.0)
        mass, around = inertia.mass * off[0], inertia.inertia * off[0] * off[4]
        true.inertias[index] = pin.Inertia(mass, inertia.lever * off[1:4], around)
    return true


def _draw_servo(rng: Rng, robot: Description, model: pin.Model, commands: Commands) -> Servo:
    """Gains that a user would have found: some hertz of bandwidth, well damped, stable in all poses of the log."""
    data = model.createData()
    masses = [_mass(model, data, q) for q in commands.values.T[:: max(1, commands.t_s.size // 24)]]
    inertia = np.mean([np.diag(each) for each in masses], axis=0)
    hz = np.minimum(rng.uniform(2.5, 6.0) * (inertia.max() / inertia) ** 0.15, 12.0)
    if not SOURCES[robot.name].tool:
        # Like joints of all legs have like gains.
        inertia, hz = (np.tile(each.reshape(-1, 3).mean(axis=0), inertia.size // 3) for each in (inertia, hz))
    kp = rounded((2.0 * np.pi * hz) ** 2 * inertia, 2)
    kd = rounded(2.0 * rng.uniform(0.5, 1.0) * np.sqrt(kp * inertia), 2)
    period_s = float(rng.choice([1e-3, 5e-4, 2e-4]))
    fastest = max(np.abs(np.linalg.eigvals(np.linalg.solve(each, np.diag(kd)))).max() for each in masses)
    if fastest * period_s > 0.6:
        raise RefusedError("servo too fast for its loop")
    count = len(robot.joints)
    return Servo(kp=kp, kd=kd, limit=rounded(robot.effort), dead=np.zeros(count),
                 most=np.full(count, np.inf), period_s=period_s, delay_s=np.zeros(count),
                 lag_s=np.zeros(count), gain=np.ones(count))  # fmt: skip


def _mass(model: pin.Model, data: pin.Data, q: Matrix) -> Matrix:
    upper = np.triu(pin.crba(model, data, q))
    return np.asarray(upper + np.triu(upper, 1).T)


def rounded(values: Matrix, digits: int = 3) -> Matrix:
    """Numbers as people write them."""
    return np.array([float(f"{value:.{digits}g}") for value in values])
