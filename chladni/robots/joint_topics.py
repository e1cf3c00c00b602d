"""Which topics of a log tell of a robot's joints, and which of them is the state and which the command."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.known_schemas import is_command
from chladni.signals.errors import LogError
from chladni.signals.join import join_resampled
from chladni.signals.visible import visible
from chladni.signals.wording import near_matches

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from chladni.io.log import Log
    from chladni.io.number_lists import NumberLists
    from chladni.robots.robot import CommandKind, Robot
    from chladni.signals.arrays import Real

# Names of fields by what they hold.
_FIELDS: Final[Mapping[CommandKind, tuple[str, ...]]] = {
    "position": ("position", "positions"),
    "velocity": ("velocity", "velocities"),
    "effort": ("effort", "efforts"),
}
#: Of a list that says nothing of what its numbers are, as std_msgs/Float64MultiArray.
UNNAMED_FIELD: Final = "data"
# Places in messages of controllers (control_msgs), and what a topic is called that isn't measured.
_SET: Final = frozenset({"desired", "reference", "output", "points[0]"})
_MEASURED: Final = frozenset({"actual", "feedback", ""})
_WORDS_OF_COMMANDS: Final = frozenset(
    {"command", "commands", "cmd", "cmds", "commanded", "desired", "reference", "ref"}
    | {"target", "targets", "goal", "setpoint", "setpoints"}
)
_WORDS_OF_STATES: Final = frozenset(["state", "states", "measured", "actual", "feedback", "encoder", "encoders"])
_LONGEST_LAG_S: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTopic:
    """Lists of a topic whose elements are joints.

    Attributes
    ----------
    lists
        Of its messages.
    joints
        Element of each joint of the robot that it has: by number, or by name where places change.
    others
        What else it names.
    remarks
        What is odd about its names.
    """

    lists: NumberLists
    joints: Mapping[str, int | str]
    others: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Topic, and place in its messages."""
        return self.lists.label

    def fields(self) -> dict[CommandKind, str]:
        """Fields that some message fills, by what they hold."""
        found: dict[CommandKind, str] = {}
        for kind, names in _FIELDS.items():
            for name in names:
                if self.lists.elements.get(name):
                    found[kind] = name
        return found

    def paths(self, field: str, joints: Collection[str]) -> dict[str, str]:
        """Path of each joint that a field has."""
        held = self.lists.elements.get(field, 0)
        return {
            name: self.lists.path(field, element)
            for name, element in self.joints.items()
            if name in joints and (isinstance(element, str) or element < held)
        }

    @property
    def may_be_state(self) -> bool:
        """Whether it can be what was measured."""
        return self.lists.place in _MEASURED and "position" in self.fields()


def joint_topics(robot: Robot, log: Log) -> tuple[JointTopic, ...]:
    """Find the topics that name joints of the robot, or whose elements the robot file names."""
    return topics_of_joints(robot, log.number_lists)


def topics_of_joints(robot: Robot, held: Sequence[NumberLists]) -> tuple[JointTopic, ...]:
    """Find those of the lists that name joints of the robot, or whose elements its file names."""
    found = (_joint_topic(robot, lists) for lists in held)
    return tuple(one for one in found if one is not None and one.lists.place in (_SET | _MEASURED))


def _joint_topic(robot: Robot, lists: NumberLists) -> JointTopic | None:
    known = {one.name for one in robot.joints}
    names = lists.names
    unnamed = not any(map(any, names))
    told: list[str] = []
    if unnamed and robot.log.names is not None and lists.label in (robot.log.state, robot.log.command):
        names = (robot.log.names,)
    elements: dict[str, int | str] = {}
    if len(names) == 1:
        elements = {name: place for place, name in enumerate(names[0])}
    elif lists.named_in_message:
        elements = {name: name for one in names for name in one}
        told.append(f"{lists.label}: messages name joints in {len(names)} ways; each joint is read by its name")
    elif names:
        told.append(f"{lists.label}: joint_names change from message to message; it isn't read")
    twice = [name for one in names for name in dict.fromkeys(one) if one.count(name) > 1 and name in known]
    if twice:
        told.append(f"{lists.label}: {', '.join(map(visible, twice))} stands twice in a message; it's left out")
    joints = {name: element for name, element in elements.items() if name in known and name not in twice}
    if not (joints or told or (unnamed and UNNAMED_FIELD in lists.elements)):
        return None
    others = tuple(name for name in elements if name and name not in known)
    return JointTopic(lists=lists, joints=joints, others=others, remarks=tuple(told))


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """State and command of a log, with sentences on how they were chosen."""

    state: JointTopic
    command: JointTopic | None
    remarks: tuple[str, ...]


def choose(
    robot: Robot,
    log: Log,
    *,
    state: str | None,
    command: str | None,
    span_s: tuple[float | None, float | None] = (None, None),
) -> Choice:
    """Choose the topics of state and command.

    A topic that is named (here or in the robot file) is taken. Else messages that are set (trajectories, arrays)
    are commands. Of two that may be either, words of their names tell; where they don't, what moves later follows.

    Raises
    ------
    LogError
        When none can be the state, a named one isn't there, or two can't be told apart.
    """
    topics = joint_topics(robot, log)
    return _Chooser(robot, log, topics, span_s).choice(state or robot.log.state, command or robot.log.command)


class _Chooser:
    def __init__(
        self, robot: Robot, log: Log, topics: Sequence[JointTopic], span_s: tuple[float | None, float | None]
    ) -> None:
        self._robot, self._log, self._topics, self._span_s = robot, log, topics, span_s
        self._file = log.path.name
        self._remarks: list[str] = []

    def choice(self, state: str | None, command: str | None) -> Choice:
        chosen_state = None if state is None else self._named(state, "state")
        chosen_command = None if command is None else self._named(command, "command")
        if chosen_state is None:
            chosen_state = self._state(chosen_command)
        elif "position" not in chosen_state.fields():
            raise LogError(f"{self._file}: {visible(chosen_state.label)} holds no positions; name another as --state")
        if chosen_command is None:
            chosen_command = self._command(chosen_state)
        elif chosen_command == chosen_state:
            raise LogError(f"{self._file}: {visible(chosen_state.label)} can't be state and command; name another")
        return Choice(state=chosen_state, command=chosen_command, remarks=tuple(self._remarks))

    def _named(self, label: str, what: str) -> JointTopic:
        named = [one for one in self._topics if label in (one.label, one.lists.topic) and one.joints]
        if named:
            # A controller's message may hold both.
            return max(named, key=lambda one: _role(one) == what)
        known = [one.label for one in self._topics if one.joints]
        unnamed = next((one for one in self._topics if label == one.label), None)
        if unnamed is not None:
            raise LogError(
                f"{self._file}: messages of {visible(label)} don't name their joints; list them as names in [log] "
                f"of a robot file that has {what} = {label!r}"
            )
        raise LogError(
            f"{self._file}: no topic {label!r} with joints of {self._robot.name}; {near_matches(label, known)}"
        )

    def _state(self, command: JointTopic | None) -> JointTopic:
        """What was measured: of the topics with the most joints."""
        able = [one for one in self._topics if one.may_be_state and one.joints and one != command]
        if not able:
            raise LogError(self._nothing())
        called = [one for one in able if _role(one) != "command"]
        if not called and (unnamed := self._unnamed()) is not None:
            raise LogError(unnamed)
        if not called:
            raise LogError(
                f"{self._file}: {_listed(able)} is a command by its name, and nothing tells what was measured; "
                "record the joints' states, or name it all the same: --state TOPIC"
            )
        most = max(len(one.joints) for one in called)
        fullest = [one for one in called if len(one.joints) == most]
        if len(fullest) == 1 or any(_role(one) == "state" for one in fullest):
            return max(fullest, key=lambda one: _role(one) == "state")
        return self._latest(fullest)

    def _latest(self, topics: Sequence[JointTopic]) -> JointTopic:
        """Of topics whose names don't tell, the one that follows another."""
        if len(topics) > 2:
            raise LogError(
                f"{self._file}: {_listed(topics)} may all be the state; name it: --state TOPIC, and --command TOPIC"
            )
        first, second = topics
        lag_s = self._lag_s(first, second)
        if lag_s is None:
            raise LogError(
                f"{self._file}: {_listed(topics)} move together, and neither name says which is measured; name it: "
                "--state TOPIC"
            )
        late, early = (second, first) if lag_s > 0 else (first, second)
        self._remarks.append(
            f"{visible(late.label)} is taken as the state: it follows {visible(early.label)} by "
            f"{1e3 * abs(lag_s):.3g} ms"
        )
        return late

    def _command(self, state: JointTopic) -> JointTopic | None:
        able = [one for one in self._topics if one != state and set(one.joints) & set(state.joints)]
        able = [one for one in able if one.fields() or UNNAMED_FIELD in one.lists.elements]
        states = [one for one in able if _role(one) == "state"]
        set_ones = [one for one in able if one not in states and self._leads(one, state)]
        unnamed = [one for one in self._topics if not one.joints and UNNAMED_FIELD in one.lists.elements]
        for one in () if set_ones else unnamed:
            self._remarks.append(
                f"{visible(one.label)} may be the command, but doesn't name its joints; list them as names in [log] "
                f'of a robot file that has command = "{one.label}"'
            )
        if states:
            self._remarks.append(f"{_listed(states)} tell of the same joints as the state; not used")
        if not set_ones:
            self._remarks += self._strangers()
            return None
        # By name, by message, by how many joints; of several alike the first in the file.
        best = max(set_ones, key=lambda one: (_role(one) == "command", len(set(one.joints) & set(state.joints))))
        rest = [one for one in set_ones if one != best]
        if rest:
            self._remarks.append(f"{_listed(rest)} may be commands, too; --command TOPIC chooses another")
        return best

    def _leads(self, one: JointTopic, state: JointTopic) -> bool:
        """Whether a topic may be a command: it says so, or the state follows it."""
        if _role(one) == "command" or self._robot.log.state == state.label:
            return True
        lag = self._lag_s(one, state)
        if lag is not None and lag > 0:
            return True
        self._remarks.append(
            f"{visible(one.label)} tells of the same joints, and the state doesn't follow it; not used, unless "
            f"--command {visible(one.label)} says so"
        )
        return False

    def _lag_s(self, first: JointTopic, second: JointTopic) -> float | None:
        """By how much the second follows the first; None where they don't move alike, or together."""
        shared = [name for name in first.joints if name in second.joints]
        if not shared:
            return None
        start_s, end_s = self._span_s
        paths = [one.paths(one.fields()["position"], shared) for one in (first, second)]
        names = [own[name] for own in paths for name in shared if name in paths[0] and name in paths[1]]
        try:
            groups = self._log.read_groups(names, start_s=start_s, end_s=end_s)
        except LogError:
            return None
        fastest = max(groups, key=lambda one: one.sample_rate_hz)
        joined = join_resampled(groups, sample_rate_hz=fastest.sample_rate_hz, method="hold").series.select(names)
        half = len(names) // 2
        values = joined.values.astype(np.float64)
        return lag_s(values[:half], values[half:], fastest.sample_rate_hz)

    def _nothing(self) -> str:
        """Say why no topic is the state."""
        robot, joints = self._robot, [one.name for one in self._robot.joints]
        named = {name for lists in self._log.number_lists for one in lists.names for name in one if name}
        if named:
            near = near_matches(min(named), joints)
            return (
                f"{self._file}: names no joint of {visible(robot.name)}, but {_some(sorted(named))}; {near}; rename "
                "the joints of the description, or name another robot"
            )
        return self._unnamed() or (
            f"{self._file}: no topic tells positions of joints by their names; record sensor_msgs/JointState, or "
            "name the topic as state in a robot file"
        )

    def _unnamed(self) -> str | None:
        """Say which positions have no names; None where all do."""
        for lists in self._log.number_lists:
            if "position" in lists.elements and not any(map(any, lists.names)):
                return (
                    f"{self._file}: messages of {visible(lists.label)} don't name their joints; list them as names "
                    f'in [log] of a robot file that has state = "{lists.label}"'
                )
        return None

    def _strangers(self) -> Iterator[str]:
        """Say which topics would tell of joints, had they names of this robot's."""
        known = {one.label for one in self._topics}
        for lists in self._log.number_lists:
            one = JointTopic(lists=lists, joints={}, others=())
            names = [name for own in lists.names for name in own if name]
            if names and one.fields() and lists.label not in known:
                yield f"{visible(lists.label)} names no joint of {visible(self._robot.name)}, but {_some(names)}"


def lag_s(first: Real, second: Real, rate_hz: float) -> float | None:
    """By how much the second of two sets of signals follows the first.

    Maximum of the cross-correlation of their steps, summed over all signals, as a share of what steps that are the
    same would give (Knapp & Carter, The generalized correlation method for estimation of time delay, 1976).

    Parameters
    ----------
    first, second
        ``[signal, sample]``, on one grid.
    rate_hz
        Of the grid.

    Returns
    -------
    float or None
        Seconds, negative where the first follows; None where they don't move alike, or not apart by a sample.
    """
    steps = [np.nan_to_num(np.diff(values, axis=1)) for values in (first, second)]
    size = [np.linalg.norm(one, axis=1) for one in steps]
    moving = (size[0] > 0) & (size[1] > 0)
    if not moving.any():
        return None
    ahead, behind = (one[moving] / own[moving, None] for one, own in zip(steps, size, strict=True))
    samples = ahead.shape[1]
    spectra = np.conj(np.fft.rfft(ahead, 2 * samples)) * np.fft.rfft(behind, 2 * samples)
    most = min(round(_LONGEST_LAG_S * rate_hz), samples // 2)
    lags = np.arange(-most, most + 1)
    # Each lag by what both have at the same time, or a slow motion would seem to come early.
    energy = [np.append(0.0, np.cumsum((one**2).sum(axis=0))) for one in (ahead, behind)]
    early, late = np.maximum(lags, 0), np.maximum(-lags, 0)
    shared = [energy[0][samples - early] - energy[0][late], energy[1][samples - late] - energy[1][early]]
    alike = np.fft.irfft(spectra.sum(axis=0), 2 * samples)[lags] / np.sqrt(shared[0] * shared[1])
    lag = int(lags[np.argmax(alike)])
    # Chance gives a peak of a few times the root of the samples.
    if not lag or alike.max() < 5 / np.sqrt(samples):
        return None
    return float(lag / rate_hz)


def _role(topic: JointTopic) -> str:
    """What place, type and words of the topic say: ``state``, ``command``, or empty where they say nothing."""
    lists = topic.lists
    if lists.place in _SET or UNNAMED_FIELD in lists.elements or is_command(lists.schema_name):
        return "command"
    words = set(re.findall(r"[a-z]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", topic.label).lower()))
    command, state = bool(words & _WORDS_OF_COMMANDS), bool(words & _WORDS_OF_STATES)
    return "" if command == state else "command" if command else "state"


def _listed(topics: Sequence[JointTopic]) -> str:
    return " and ".join(visible(one.label) for one in topics)


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(map(visible, names[:5])) + more
