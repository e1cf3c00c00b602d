"""The joints of a robot in a log: matched by name, on the grid of the states, commands held beside them."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import TYPE_CHECKING, Final, get_args

import numpy as np

from chladni.robots.held_commands import read_held
from chladni.robots.imu_log import ImuLog, read_imu
from chladni.robots.joint_topics import UNNAMED_FIELD, choose
from chladni.robots.robot import DEFAULT_JOINT, CommandKind, EffortKind
from chladni.signals.errors import LogError
from chladni.signals.visible import visible

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from chladni.io.log import Log
    from chladni.robots.joint_topics import Choice, JointTopic
    from chladni.robots.robot import Robot
    from chladni.signals.arrays import Index, Mask, Real

_DEGREES: Final = 180 / pi
# Nearer to degrees than to radians.
_LIKE_DEGREES: Final = sqrt(_DEGREES)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLog:
    """Joints of a robot on one grid, that of the states; SI units.

    Attributes
    ----------
    log
        Name of the file.
    joints
        Matched, in the robot's order.
    sample_rate_hz, start_time_ns
        Of the grid.
    time_s
        ``[sample]`` seconds from the grid's start: uniform, but for `breaks`.
    position
        ``[joint, sample]`` as measured, always finite.
    velocity, effort
        ``[joint, sample]`` as measured; the row of a joint without is NaN; None where the log has none of any joint.
        Currents are given as efforts, by the robot file's constants.
    effort_kind
        What the effort is; None without.
    command
        ``[joint, sample]``, each held until the next (zero-order); the row of a joint without is NaN.
    command_messages
        For each joint the times from which its commands hold, seconds from the grid's start, and the commands.
    command_kind, command_rate_hz
        What the command is; its own rate, None where it comes at no rate.
    imu
        Of the base, see `read_imu`.
    breaks
        Samples at which a new stretch begins: what lies before isn't there, and nothing is bridged.
    state_topic, command_topic
        Topics.
    unmatched, unknown
        Joints of the robot that the log doesn't have, and names of the log that the robot doesn't have.
    remarks, damage
        Sentences on how it was read, and on what was lost.
    """

    log: str
    joints: tuple[str, ...]
    sample_rate_hz: float
    start_time_ns: int
    time_s: Real
    position: Real
    velocity: Real | None
    effort: Real | None
    effort_kind: EffortKind | None
    command: Real | None
    command_messages: tuple[tuple[Real, Real], ...] | None
    command_kind: CommandKind | None
    command_rate_hz: float | None
    breaks: tuple[int, ...]
    state_topic: str
    command_topic: str | None
    unmatched: tuple[str, ...]
    unknown: tuple[str, ...]
    remarks: tuple[str, ...]
    damage: tuple[str, ...]
    imu: ImuLog | None = None


def joint_log(
    robot: Robot,
    log: Log,
    *,
    state: str | None = None,
    command: str | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> JointLog:
    """Match the joints of a robot with a log.

    Parameters
    ----------
    robot
        Made by `chladni.load_robot`.
    log
        With JointState messages, or others that name their joints, see docs/robots.md.
    state, command
        Topics; chosen by `chladni.robots.joint_topics.choose` where they aren't given.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the log's start.

    Raises
    ------
    LogError
        When no topic tells the state, it can't be told from the command, its samples aren't uniform, or they are in
        degrees.
    """
    choice = choose(robot, log, state=state, command=command, span_s=(start_s, end_s))
    return _Reader(robot, log, choice, start_s, end_s).joint_log()


#: Of a joint that nobody commands.
_NO_MESSAGES = (np.zeros(0), np.zeros(0))


class _Reader:
    def __init__(self, robot: Robot, log: Log, choice: Choice, start_s: float | None, end_s: float | None) -> None:
        self._robot, self._log, self._choice = robot, log, choice
        self._start_s, self._end_s = start_s, end_s
        self._file = log.path.name
        self._remarks = [*choice.state.remarks, *(choice.command.remarks if choice.command else ()), *choice.remarks]
        self._joints = tuple(one.name for one in robot.joints if one.name in choice.state.joints)

    def joint_log(self) -> JointLog:
        """Read states and commands, and lay out what both have."""
        state, command = self._choice.state, self._choice.command
        rows = self._rows(state)
        kind, commanded = (None, {}) if command is None else self._commanded(command)
        paths = [path for own in rows.values() for path in own.values()]
        read = read_held(self._log, paths, list(commanded.values()), (self._start_s, self._end_s))
        self._remarks += read.remarks
        series = read.states
        measured = {channel.name: series.values[row] for row, channel in enumerate(series.channels)}
        self._keep_live(self._laid(measured, rows["position"], series.samples))
        position = self._laid(measured, rows["position"], series.samples)
        velocity, effort = (
            self._measured(name, self._laid(measured, rows.get(name, {}), series.samples), position)
            for name in ("velocity", "effort")
        )
        if effort is not None and command is not None and self._is_same_effort(state, command):
            effort = None
        held = None if kind is None else self._laid(read.commands, commanded, series.samples)
        imu, remarks = read_imu(self._robot, self._log, series)
        kept = self._kept(position, velocity, effort, held, imu, series.sample_rate_hz)

        def at(values: Real | None) -> Real | None:
            return None if values is None else np.ascontiguousarray(values[:, kept])

        position, held = position[:, kept], at(held)
        self._require_radians(position)
        messages = [read.messages.get(commanded.get(name, ""), _NO_MESSAGES) for name in self._joints]
        before = None if held is None else held.copy()
        position, held = self._unwrapped(position, held, kind)
        if held is not None and before is not None:
            # Commands of a joint that was made to run on are known where its states are.
            messages = [
                own if np.array_equal(row, was, equal_nan=True) else (kept / series.sample_rate_hz, row)
                for own, row, was in zip(messages, held, before, strict=True)
            ]
        self._remarks += remarks
        return JointLog(
            log=self._file,
            joints=self._joints,
            sample_rate_hz=series.sample_rate_hz,
            start_time_ns=series.start_time_ns,
            time_s=kept / series.sample_rate_hz,
            position=position,
            velocity=at(velocity),
            effort=at(effort),
            effort_kind=None if effort is None else self._robot.log.effort or "measured",
            command=held,
            command_messages=None if held is None else tuple(messages),
            command_kind=kind,
            command_rate_hz=read.command_rate_hz,
            imu=None if imu is None else imu.at(kept),
            breaks=tuple((np.flatnonzero(np.diff(kept) > 1) + 1).tolist()),
            state_topic=state.label,
            command_topic=None if command is None or kind is None else command.label,
            unmatched=tuple(one.name for one in self._robot.joints if one.name not in self._joints),
            unknown=state.others,
            remarks=tuple(dict.fromkeys(self._remarks)),
            damage=tuple(one.what for one in self._log.damage),
        )

    # --- what is read ---

    def _rows(self, state: JointTopic) -> dict[CommandKind, dict[str, str]]:
        """Paths of the joints by field, the positions first; joints without a position are no matched ones."""
        fields = state.fields()
        positions = state.paths(fields["position"], self._joints)
        self._joints = tuple(name for name in self._joints if name in positions)
        found: dict[CommandKind, dict[str, str]] = {"position": positions}
        for name in ("velocity", "effort"):
            if name in fields and not (name == "effort" and self._robot.log.effort == "none"):
                found[name] = state.paths(fields[name], self._joints)
        return found

    def _commanded(self, command: JointTopic) -> tuple[CommandKind | None, dict[str, str]]:
        """Kind of the command, and paths of its joints."""
        kind, why = self._command_kind(command)
        field = command.fields().get(kind, UNNAMED_FIELD)
        paths = command.paths(field, self._joints)
        if not paths:
            self._remarks.append(
                f"{visible(command.label)} holds no {kind} of these joints; command_kind in [log] of a robot file "
                f"says what it holds: {', '.join(command.fields()) or 'nothing'}"
            )
            return None, {}
        if why:
            self._remarks.append(f"{visible(command.label)} is taken as a {kind}, {why}")
        without = [name for name in self._joints if name not in paths]
        if without:
            self._remarks.append(f"{visible(command.label)} has no command for {_some(without)}")
        return kind, paths

    def _command_kind(self, command: JointTopic) -> tuple[CommandKind, str]:
        """What a command is, and why: by the robot file, the fields filled, the topic's words, the servos."""
        if self._robot.log.command_kind is not None:
            return self._robot.log.command_kind, ""
        servos = {one.servo.kind for one in self._robot.joints if one.servo is not None and one.name in self._joints}
        kinds = list(command.fields())
        if len(kinds) == 1:
            return kinds[0], ""
        if kinds:
            # An effort beside a position is fed forward, or nobody fills it.
            kind: CommandKind = "velocity" if servos == {"velocity"} and "velocity" in kinds else kinds[0]
            beside = " and ".join(one for one in kinds if one != kind)
            return kind, f"though it holds {beside}, too; command_kind in [log] of a robot file says another"
        for kind in get_args(CommandKind):
            if kind in command.label.lower():
                return kind, "as its topic says"
        for kind in servos if len(servos) == 1 else ():
            return kind, "as the servos take it"
        return "position", "since nothing says what it is; command_kind in [log] of a robot file does"

    # --- rows ---

    def _laid(self, rows: Mapping[str, NDArray[np.floating]], paths: Mapping[str, str], samples: int) -> Real:
        """Rows of the matched joints; NaN where a joint has none."""
        found = np.full((len(self._joints), samples), np.nan)
        for place, name in enumerate(self._joints):
            if paths.get(name) in rows:
                found[place] = rows[paths[name]]
        return found

    def _keep_live(self, position: Real) -> None:
        """Leave out joints whose position is mostly no number."""
        live = np.isfinite(position).mean(axis=1)
        if not live.max(initial=0.0):
            raise LogError(f"{self._file}: {visible(self._choice.state.label)} holds no position that is a number")
        dead = [name for name, share in zip(self._joints, live, strict=True) if share < live.max() / 2]
        if dead:
            self._remarks.append(f"{_some(dead)}: position is mostly no number; left out")
            self._joints = tuple(name for name in self._joints if name not in dead)

    def _kept(
        self, position: Real, velocity: Real | None, effort: Real | None, held: Real | None, imu: ImuLog | None,
        rate_hz: float,
    ) -> Index:  # fmt: skip
        """Samples that have all that is there at all."""
        measured = np.isfinite(position).all(axis=0) & _filled(velocity, position) & _filled(effort, position)
        there = measured & _filled(held, position)
        kept = np.flatnonzero(there)
        if not kept.size:
            raise LogError(f"{self._file}: states and commands have no time in common; name another --command TOPIC")
        self._tell_left_out("commands", measured, there, rate_hz)
        if imu is None or self._robot.base == "fixed":
            return kept
        # Nothing is told of joints on a base whose motion isn't known.
        known = there & imu.there
        if not known.any():
            raise LogError(
                f"{self._file}: states and {visible(imu.topic)} have no time in common; record them together"
            )
        self._tell_left_out(f"samples of {visible(imu.topic)}", there, known, rate_hz)
        return np.flatnonzero(known)

    def _measured(self, name: str, values: Real, position: Real) -> Real | None:
        """Give velocities or efforts; None where nobody fills them."""
        known = np.isfinite(values).any(axis=1)
        if not known.any():
            return None
        # Many drivers send zeros for what they don't measure.
        zero = known & ~np.nan_to_num(values).any(axis=1) & (np.nanstd(position, axis=1) > 0)
        values[zero] = np.nan
        if (zero == known).all():
            self._remarks.append(f"{visible(self._choice.state.label)}: {name} is 0 throughout; it counts as absent")
            return None
        return self._in_newton_metres(values) if name == "effort" else values

    def _is_same_effort(self, state: JointTopic, command: JointTopic) -> bool:
        """Whether states hold a copy of the commands' efforts, which measures nothing unless somebody says so."""
        if self._robot.log.effort is not None:
            return False
        fields = [one.fields().get("effort", "") for one in (state, command)]
        both = [one.paths(field, self._joints[:1]) for one, field in zip((state, command), fields, strict=True)]
        paths = [path for own in both for path in own.values()]
        if len(paths) < 2:
            return False
        try:
            measured, commanded = self._log.stamped(paths, start_s=self._start_s, end_s=self._end_s)
        except LogError:
            return False
        same = np.array_equal(measured.values, commanded.values, equal_nan=True)
        if same:
            self._remarks.append(
                f"{visible(state.label)} and {visible(command.label)} hold the same efforts: they count as absent, "
                "unless effort in [log] of a robot file says what they are"
            )
        return same

    def _in_newton_metres(self, values: Real) -> Real | None:
        """Give efforts, of currents by the robot file's constants."""
        if self._robot.log.effort != "current":
            return values
        constants = self._robot.log.torque_constant
        factor = np.array([constants.get(one, constants.get(DEFAULT_JOINT, np.nan)) for one in self._joints])
        without = [one for one, constant in zip(self._joints, factor, strict=True) if not np.isfinite(constant)]
        if without:
            self._remarks.append(
                f"{_some(without)}: current without a torque_constant in [log] of the robot file is no effort"
            )
        return values * factor[:, None] if len(without) < factor.size else None

    def _unwrapped(self, position: Real, command: Real | None, kind: CommandKind | None) -> tuple[Real, Real | None]:
        """Let hinges that were logged as angles from -pi to pi turn on, and their commands beside them."""
        hinges = {one.name for one in self._robot.joints if one.kind == "hinge"}
        # No joint turns by more than half a turn from one sample to the next.
        leaps = [
            place
            for place, name in enumerate(self._joints)
            if name in hinges and (np.abs(np.diff(position[place])) > pi).any()
        ]
        if leaps:
            position[leaps] = np.unwrap(position[leaps], axis=1)
            if command is not None and kind == "position":
                command[leaps] += 2 * pi * np.round((position[leaps] - command[leaps]) / (2 * pi))
            self._remarks.append(
                f"{_some([self._joints[place] for place in leaps])}: angles leap by a turn; made to run on"
            )
        return position, command

    # --- what is told ---

    def _tell_left_out(self, what: str, measured: Mask, there: Mask, rate_hz: float) -> None:
        """Say what part of the states has no command, or no IMU."""
        places = np.flatnonzero(measured)
        both = np.flatnonzero(there)
        before, after = both[0] - places[0], places[-1] - both[-1]
        if before > 1:
            self._remarks.append(f"{what} begin {before / rate_hz:.3g} s after the states: that part is left out")
        if after > 1:
            self._remarks.append(f"{what} end {after / rate_hz:.3g} s before the states: that part is left out")
        inside = np.count_nonzero(measured[both[0] : both[-1] + 1]) - both.size
        if inside:
            self._remarks.append(f"{inside / rate_hz:.3g} s amid the log lack {what}: left out, and not bridged")

    def _require_radians(self, position: Real) -> None:
        """Refuse degrees: motions that are many times as large as the description's range."""
        ranges = {one.name: one.range for one in self._robot.joints if one.kind == "hinge"}
        beyond: list[tuple[str, float, float]] = []
        for name, values in zip(self._joints, position, strict=True):
            stops = ranges.get(name)
            if stops is not None and (width := stops[1] - stops[0]) > 0:
                beyond.append((name, float(np.ptp(values)), width))
        like_degrees = [one for one in beyond if one[1] > _LIKE_DEGREES * one[2]]
        if like_degrees:
            name, moved, width = like_degrees[0]
            raise LogError(
                f"{self._file}: {visible(name)} moves by {moved:.4g}, where the description has room for {width:.4g} "
                f"rad; if that is in degrees, say so in a setup file (--setup): [[channel]] path = "
                f'"{self._choice.state.paths(self._choice.state.fields()["position"], [name])[name]}", unit = "deg", '
                "and so for each joint"
            )
        far = [name for name, moved, width in beyond if moved > width]
        if far:
            self._remarks.append(f"{_some(far)}: moves farther than the description's range; is it in radians?")


def _filled(values: Real | None, position: Real) -> Mask:
    """Samples that every row has; rows that are mostly empty are no signals, and don't count."""
    if values is None:
        return np.ones(position.shape[1], np.bool_)
    finite = np.isfinite(values)
    share = finite.mean(axis=1)
    return np.asarray(finite[share >= share.max() / 2].all(axis=0))


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(map(visible, names[:5])) + more
