"""A robot as its description has it, run from a log's poses by the log's commands."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.apps.documents import Document
from chladni.io.log import Log
from chladni.robots.joint_log import joint_log
from chladni.robots.joint_topics import choose
from chladni.robots.robot import Robot
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.engineering import percent
from chladni.signals.errors import ModelError
from chladni.signals.number_range import rms
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted


@dataclass(frozen=True, slots=True, kw_only=True)
class JointError:
    """RMS of a joint's simulated position less the measured one, and of its motion about its mean; rad or m.

    The error is infinite where a run went astray.
    """

    joint: str
    unit: str
    error: float
    motion: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedRobot:
    """What a log would read of a robot as described.

    Attributes
    ----------
    robot, log
        Names.
    series
        Simulated positions under the names that the measured ones have in the log; missing where nothing was run.
    joints
        Errors.
    horizon_s
        How long the longest run lasts before the next starts from the log's pose.
    runs
        How many.
    remarks
        What limits it.
    """

    robot: str
    log: str
    series: TimeSeries
    joints: tuple[JointError, ...]
    horizon_s: float
    runs: int
    remarks: tuple[str, ...]


def simulate_robot(robot: Robot, log: Log, *, state: str | None = None, command: str | None = None) -> SimulatedRobot:
    """Run a robot as described: freely where its drives hold positions, else anew every period of the cutoff.

    Parameters
    ----------
    state, command
        Topics of the joints; chosen where they aren't given.

    Raises
    ------
    ModelError
        When nothing tells the torque of a joint's drive.
    """
    # numba and MuJoCo take a moment to load.
    from chladni.gap.robots.forward import simulated
    from chladni.gap.robots.torques import torques_of
    from chladni.gap.robots.trial import runs_of
    from chladni.robots.machine import as_described

    read = joint_log(robot, log, state=state, command=command)
    torques = torques_of(robot, read)
    unknown = [name for name, driven in zip(read.joints, torques.driven, strict=True) if not driven]
    if unknown:
        raise ModelError(
            f"{robot.name}: nothing tells the torque of {', '.join(unknown)}; give kp and kd in [control] of a robot "
            "file, or record efforts"
        )
    runs = runs_of(torques, list(torques.stretches))
    found = simulated(as_described(robot), torques, runs)
    astray = ~np.isfinite(np.where(np.isnan(found), 0.0, found)).all(axis=0)
    found[:, astray] = np.nan
    whole = _between(found, runs)
    remarks = [*robot.remarks, *read.remarks, *read.damage]
    if astray.any():
        remarks.append(
            f"runs go astray in {percent(float(astray.mean()))} of the log, where nothing is given back: what "
            "drives it there doesn't hold this robot"
        )
    places = choose(robot, log, state=state, command=command).state
    paths = places.paths(places.fields()["position"], read.joints)
    units = ["rad" if joint.kind == "hinge" else "m" for joint in torques.joints]
    rows = np.rint(read.time_s * read.sample_rate_hz).astype(np.intp)
    values = np.full((len(read.joints), int(rows[-1]) + 1), np.nan)
    values[:, rows] = whole
    return SimulatedRobot(
        robot=robot.name,
        log=read.log,
        series=TimeSeries(
            values=values,
            sample_rate_hz=read.sample_rate_hz,
            start_time_ns=read.start_time_ns,
            channels=tuple(
                Channel(name=paths[name], unit=unit) for name, unit in zip(read.joints, units, strict=True)
            ),
            valid=np.isfinite(values),
        ),
        joints=tuple(
            _error(name, unit, *both, astray=bool(astray.any()))
            for name, unit, *both in zip(read.joints, units, whole, read.position, strict=True)
        ),
        horizon_s=max(b - a for a, b in runs) / read.sample_rate_hz,
        runs=len(runs),
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _between(found: Real, runs: Sequence[tuple[int, int]]) -> Real:
    """Fill samples that are nearer to one another than the step, within a run."""
    whole = np.full_like(found, np.nan)
    for a, b in runs:
        known = a + np.flatnonzero(np.isfinite(found[0, a:b]))
        if known.size:
            at = np.arange(known[0], known[-1] + 1)
            whole[:, at] = [np.interp(at, known, row[known]) for row in found]
    return whole


def _error(joint: str, unit: str, simulated: Real, measured: Real, *, astray: bool) -> JointError:
    there = np.isfinite(simulated)
    error = np.inf if astray else float(rms(simulated[there] - measured[there]))
    return JointError(joint=joint, unit=unit, error=error, motion=float(rms(measured - np.mean(measured))))


def simulated_robot_document(found: SimulatedRobot) -> Document:
    """Give how far a robot as described comes to a log, joint by joint; errors that aren't known are null."""
    return {
        "format": "chladni.simulate/1",
        "robot": found.robot,
        "driven_by": found.log,
        "horizon_s": found.horizon_s,
        "runs": found.runs,
        "joints": [
            {
                "name": one.joint,
                "unit": one.unit,
                "error": one.error if np.isfinite(one.error) else None,
                "motion": one.motion,
            }
            for one in found.joints
        ],
        "remarks": list(found.remarks),
    }


def run_told(found: SimulatedRobot) -> str:
    """Say how it was run."""
    if found.runs == 1:
        return "one run from the log's first pose"
    return f"{counted(found.runs, 'run')} of at most {found.horizon_s:.3g} s, each from the log's pose"
