"""The gap between a robot's description and a log of its joints."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from chladni.apps.sources import Span
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.measurement import LogUse
from chladni.io.log import Log, open_log
from chladni.models.effects.wording import nearest
from chladni.robots.joint_log import JointLog, joint_log
from chladni.robots.robot import Robot
from chladni.signals.errors import SetupError
from chladni.signals.time_series import TimeSeries


@dataclass(frozen=True, slots=True, kw_only=True)
class Topics:
    """Where a log has the states and commands of a robot's joints; chosen where they aren't given."""

    state: str | None = None
    command: str | None = None


def robot_gap(
    robot: Robot,
    logs: Sequence[Log | TimeSeries | Path | str],
    leave_out: Iterable[str],
    topics: Topics,
    span: Span,
    progress: Callable[[str, float], None] | None,
) -> Diagnosis:
    """Diagnose a robot; see `chladni.diagnose_gap`."""
    # numba and MuJoCo take a moment to load, which a look at the façade shouldn't pay for.
    from chladni.gap.robots.diagnose import WITHOUT_COLUMN, diagnose_robot
    from chladni.gap.robots.words import ROBOT_WORDS

    left_out, known = frozenset(leave_out), (*ROBOT_WORDS, *WITHOUT_COLUMN)
    for word in sorted({each.partition("@")[0] for each in left_out}.difference(known)):
        raise SetupError(f"no effect {word!r} of a robot to leave out; {nearest(word, known, 'effects')}")
    if len(logs) != 1:
        raise SetupError(f"{len(logs)} logs beside robot {robot.name!r}; a robot is diagnosed on one log at a time")
    (given,) = logs
    if isinstance(given, TimeSeries):
        raise SetupError("a series has no names of joints; give the log of the robot's joints, or its path")
    if isinstance(given, Log):
        read = joint_log(
            robot, given, state=topics.state, command=topics.command, start_s=span.start_s, end_s=span.end_s
        )
        recorded_s = _length_s(given, span)
    else:
        with open_log(given) as opened:
            return robot_gap(robot, [opened], left_out, topics, span, progress)
    found = diagnose_robot(robot, read, leave_out=left_out, progress=progress)
    return replace(found, used=(_use(read, recorded_s),))


def _use(read: JointLog, recorded_s: float) -> LogUse:
    return LogUse(
        log=read.log,
        used_s=read.time_s.size / read.sample_rate_hz,
        recorded_s=max(recorded_s, read.time_s.size / read.sample_rate_hz),
        sample_rate_hz=read.sample_rate_hz,
        losses=read.damage,
    )


def _length_s(log: Log, span: Span) -> float:
    whole = log.info().duration_s
    return min(whole, span.end_s if span.end_s is not None else whole) - (span.start_s or 0.0)
