"""Rules on what a structure's parts may be called and what they may refer to."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from chladni.models.structures.structure import GROUND, Motion
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.wording import near_words

NAME_RULE = "names begin with a letter and go on with letters, digits, _ and -, up to 100"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,99}")


class Wiring(NamedTuple):
    """What a controller is connected to."""

    name: str
    feedback: str
    drives: str
    reference: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class WiringMistake:
    """A mistake in one part.

    Attributes
    ----------
    part
        ``body``, ``joint``, ``input``, ``output`` or ``controller``.
    place
        Index among the parts of its kind.
    name
        The part's.
    key
        What is wrong in it: ``name``, ``between``, ``at``, ``measures``, ...
    text
        What was found, and what would be right.
    """

    part: str
    place: int
    name: str
    key: str
    text: str


Told = tuple[str, str]


def wiring_mistakes(
    bodies: Mapping[str, Motion],
    joints: Mapping[str, tuple[str, str]],
    inputs: Sequence[StructureInput],
    outputs: Sequence[StructureOutput],
    controllers: Sequence[Wiring],
) -> Iterator[WiringMistake]:
    """Give every mistake in what is referred to by a structure's inputs, outputs and controllers.

    Parameters
    ----------
    bodies
        Motion by name.
    joints
        Ends by name.
    """
    rules = _Rules(bodies, joints, inputs, outputs, controllers)
    for place, one in enumerate(inputs):
        yield from _placed("input", place, one.name, rules.of_input(one))
    for place, output in enumerate(outputs):
        yield from _placed("output", place, output.name, rules.of_output(output))
    for place, controller in enumerate(controllers):
        yield from _placed("controller", place, controller.name, rules.of_controller(controller))
    yield from _channel_mistakes(inputs, outputs, controllers)


def name_mistakes(parts: Sequence[tuple[str, int, str]]) -> Iterator[WiringMistake]:
    """Give every part (kind, index, name) whose name is reserved, taken, or has characters that no name may have."""
    taken: dict[str, str] = {}
    for part, place, name in parts:
        if name == GROUND:
            text = f"the name {GROUND!r} is reserved for what doesn't move"
        elif not _NAME.fullmatch(name):
            text = f"found {name[:60]!r}; {NAME_RULE}"
        elif name in taken:
            text = (
                f"the name {name!r} is taken by {_article(taken[name])} {taken[name]}; each name stands for one thing"
            )
        else:
            taken[name] = part
            continue
        yield WiringMistake(part=part, place=place, name=name, key="name", text=text)


def joint_mistakes(between: tuple[str, str], bodies: Mapping[str, Motion]) -> list[str]:
    """Say what is wrong with the ends of a joint."""
    unknown = [_nothing(end, "body", [*bodies, GROUND]) for end in between if end not in bodies and end != GROUND]
    if unknown:
        return unknown
    if between[0] == between[1]:
        return [f"both ends are {between[0]!r}; a joint joins two different ones"]
    motions = {bodies[end] for end in between if end != GROUND}
    if len(motions) > 1:
        return [f"{between[0]!r} and {between[1]!r} can't be joined: one has a mass, the other an inertia"]
    return []


class _Rules:
    def __init__(
        self,
        bodies: Mapping[str, Motion],
        joints: Mapping[str, tuple[str, str]],
        inputs: Sequence[StructureInput],
        outputs: Sequence[StructureOutput],
        controllers: Sequence[Wiring],
    ) -> None:
        self._bodies, self._joints = bodies, joints
        self._inputs = {one.name: one for one in inputs}
        self._outputs = [one.name for one in outputs]
        self._controllers = [one.name for one in controllers]
        # The first that claims a body or an input keeps it; later ones are told who has it.
        self._prescribed: dict[str, str] = {}
        for one in inputs:
            if one.kind == "displacement":
                self._prescribed.setdefault(one.at, one.name)
        self._drivers: dict[str, str] = {}
        for controller in controllers:
            self._drivers.setdefault(controller.drives, controller.name)

    def of_input(self, one: StructureInput) -> Iterator[Told]:
        if one.kind == "displacement" and one.hold == "zoh":
            yield (
                "hold",
                "found 'zoh'; a motion that jumps has no velocity: foh (a spline) and band_limited run through",
            )
        # Each kind acts at another kind of site, and the message says at which.
        if one.kind == "disturbance":
            if one.at not in self._controllers:
                yield "at", _nothing(one.at, "controller", self._controllers)
        elif one.kind == "base_acceleration":
            if one.at != GROUND:
                yield "at", f"found {one.at!r}; a base_acceleration acts at {GROUND!r}"
        elif one.kind == "displacement":
            yield from self._of_prescribed(one)
        else:
            yield from self._of_force(one)

    def _of_prescribed(self, one: StructureInput) -> Iterator[Told]:
        if one.at not in self._bodies:
            yield "at", _nothing(one.at, "body", self._bodies)
        elif self._prescribed[one.at] != one.name:
            yield "at", f"the motion of {one.at!r} is prescribed by {self._prescribed[one.at]!r} already"

    def _of_force(self, one: StructureInput) -> Iterator[Told]:
        if one.at == GROUND:
            yield "at", f"a force at {GROUND!r} moves nothing; for a floor that shakes use kind base_acceleration"
        elif one.at not in self._bodies and one.at not in self._joints:
            yield "at", _nothing(one.at, "body or joint", [*self._bodies, *self._joints])
        elif one.at in self._prescribed:
            by = self._prescribed[one.at]
            yield "at", f"a force at {one.at!r} does nothing, because its motion is prescribed by {by!r}"

    def of_output(self, one: StructureOutput) -> Iterator[Told]:
        if one.measures == "force":
            if one.at not in self._joints:
                yield "at", f"{_nothing(one.at, 'joint', self._joints)}; a force is measured in a joint"
        elif one.at == GROUND:
            yield "at", f"{GROUND!r} doesn't move; measure at a body or a joint"
        elif one.at not in self._bodies and one.at not in self._joints:
            yield "at", _nothing(one.at, "body or joint", [*self._bodies, *self._joints])

    def of_controller(self, one: Wiring) -> Iterator[Told]:
        if one.feedback not in self._outputs:
            yield "feedback", _nothing(one.feedback, "output", self._outputs)
        if one.drives not in self._inputs:
            yield "drives", _nothing(one.drives, "input", self._inputs)
        elif self._inputs[one.drives].kind != "force":
            yield "drives", f"{one.drives!r} is no force; a controller drives an input of kind force"
        elif self._drivers[one.drives] != one.name:
            yield "drives", f"{one.drives!r} is driven by {self._drivers[one.drives]!r} already"


def _channel_mistakes(
    inputs: Sequence[StructureInput], outputs: Sequence[StructureOutput], controllers: Sequence[Wiring]
) -> Iterator[WiringMistake]:
    taken: dict[str, str] = {}
    named: list[tuple[str, str, int, str, str | None]]
    named = [("input", "channel", place, one.name, one.channel) for place, one in enumerate(inputs)]
    named += [("output", "channel", place, one.name, one.channel) for place, one in enumerate(outputs)]
    named += [("controller", "reference", place, one.name, one.reference) for place, one in enumerate(controllers)]
    for part, key, place, name, channel in named:
        # Parts without a channel are simulated only, and any number may be.
        if channel is None:
            continue
        if channel in taken:
            text = f"the channel {channel!r} is that of {taken[channel]!r} already; a channel holds one signal"
            yield WiringMistake(part=part, place=place, name=name, key=key, text=text)
        taken.setdefault(channel, name)


def _placed(part: str, place: int, name: str, told: Iterator[Told]) -> Iterator[WiringMistake]:
    for key, text in told:
        yield WiringMistake(part=part, place=place, name=name, key=key, text=text)


def _article(word: str) -> str:
    return "an" if word[0] in "aeiou" else "a"


def _nothing(name: str, what: str, known: Mapping[str, object] | Sequence[str]) -> str:
    names = list(known)
    near = near_words(name, names)
    # A structure may have a thousand bodies; a message holds twenty.
    listed = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
    advice = f"did you mean {near[0]!r}?" if near else f"there are: {listed or 'none'}"
    return f"{name[:60]!r} is no {what}; {advice}"
