"""Reading the model file of a structure."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from chladni.io.toml_reader import TomlMistakes, read_toml
from chladni.models.effects.wording import nearest
from chladni.models.files.controller_table import ControllerEnds, read_controller
from chladni.models.files.file_reading import Content, FileReading
from chladni.models.files.site_units import SiteUnits
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure import GROUND, Body, Joint, Motion, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput, measure_unit
from chladni.models.structures.wiring import Wiring, joint_mistakes, name_mistakes, wiring_mistakes
from chladni.signals.errors import ModelError
from chladni.signals.wording import shown

_PARTS: Final = ("body", "joint", "input", "output", "controller")
_INPUT_KINDS: Final = ("force", "base_acceleration", "displacement", "disturbance")
_MEASURES: Final = ("acceleration", "velocity", "displacement", "force")
_STIFFNESS: Final[dict[Motion, str]] = {"translation": "N/m", "rotation": "N m/rad"}
_DAMPING: Final[dict[Motion, str]] = {"translation": "N s/m", "rotation": "N m s/rad"}


def read_structure(path: Path) -> StructureModel:
    """Read the model file of a structure.

    Raises
    ------
    ModelError
        With a line for each mistake.
    """
    from chladni.models.files.model_tables import StructureFile

    # The reader of TOML validates and checks in one pass, so that all mistakes are told at once; the check makes the
    # model on its way, since it reads every number for that anyway.
    made: list[StructureModel] = []

    def check(content: Content, mistakes: TomlMistakes) -> None:
        made.extend(_StructureReading(content, mistakes).models())

    read_toml(path, StructureFile, kind=ModelError, check=check)
    return made[0]


class _StructureReading:
    """Makes records of the tables as far as they go; what is wrong in one doesn't hide what is wrong in another."""

    def __init__(self, content: Content, mistakes: TomlMistakes) -> None:
        self._file, self._mistakes = FileReading(content, mistakes), mistakes
        # Names and what they refer to are looked at even where numbers are wrong.
        self._motions: dict[str, Motion] = {}
        for _, table in self._file.tables("body"):
            self._motions.setdefault(str(table.get("name")), "rotation" if "inertia" in table else "translation")
        self._ends = self._joint_ends()
        self._inputs, self._outputs = self._read_inputs(), self._read_outputs()
        self._note_names()
        self._note_wiring()

    def models(self) -> list[StructureModel]:
        """Give the model, or none when anything is wrong."""
        bodies = [self._body(place, table) for place, table in self._file.tables("body")]
        joints = [self._joint(place, table) for place, table in self._file.tables("joint")]
        controllers = [self._controller(place, table) for place, table in self._file.tables("controller")]
        effects = self._file.effects(self._sites())
        model = None
        if not self._mistakes and all(bodies):
            model = self._file.tried((), lambda: StructureModel(
                name=str(self._file.content.get("name")),
                structure=Structure(bodies=_made(bodies), joints=_made(joints)),
                inputs=tuple(self._inputs.values()),
                outputs=tuple(self._outputs.values()),
                controllers=_made(controllers),
                effects=tuple(effects),
            ))  # fmt: skip
        # Tolerances name parameters, so they can only be looked at when there is a model.
        default, by_name = self._file.tolerances(None if model is None else model.parameters)
        if model is None or self._mistakes:
            return []
        self._note_equations(model)
        tolerance = model.default_tolerance if default is None else default
        return [replace(model, tolerances=by_name, default_tolerance=tolerance)]

    def _body(self, place: int, table: Content) -> Body | None:
        if ("mass" in table) == ("inertia" in table):
            self._mistakes.add(("body", place), "needs a mass in kg, or an inertia in kg m^2 for a body that rotates")
            return None
        key, unit = ("inertia", "kg m^2") if "inertia" in table else ("mass", "kg")
        name, mass = self._file.text(table, "name"), self._file.parameter(("body", place, key), table[key], unit)
        position = self._position(place, table.get("position", [0.0, 0.0, 0.0]))
        if name is None or mass is None or position is None:
            return None
        motion: Motion = "rotation" if key == "inertia" else "translation"
        return self._file.tried(
            ("body", place, key), lambda: Body(name=name, mass=mass, position=position, motion=motion)
        )

    def _position(self, place: int, found: object) -> tuple[float, float, float] | None:
        if not isinstance(found, list):
            return None
        match [self._file.number(("body", place, "position", axis), one, "m") for axis, one in enumerate(found)]:
            case [float(x), float(y), float(z)]:
                return x, y, z
        return None

    def _joint_ends(self) -> dict[str, tuple[str, str]]:
        ends: dict[str, tuple[str, str]] = {}
        for place, table in self._file.tables("joint"):
            match table.get("between"):
                case [str(first), str(second)]:
                    ends.setdefault(str(table.get("name")), (first, second))
                    for text in joint_mistakes((first, second), self._motions):
                        self._mistakes.add(("joint", place, "between"), text)
        return ends

    def _joint(self, place: int, table: Content) -> Joint | None:
        name = self._file.text(table, "name")
        motion = self._motion_at(name or "") or "translation"
        # Not left to `Joint`, which would tell one of two wrong numbers.
        numbers = {
            key: self._file.parameter(("joint", place, key), table.get(key), unit, at_least=0.0)
            for key, unit in (("stiffness", _STIFFNESS[motion]), ("damping", _DAMPING[motion]))
        }
        match numbers:
            case {"stiffness": float(stiffness), "damping": float(damping)} if name in self._ends:
                return Joint(name=name, between=self._ends[name], stiffness=stiffness, damping=damping)
        return None

    def _motion_at(self, name: str) -> Motion | None:
        """Motion of a body or of a joint's bodies."""
        if name in self._motions:
            return self._motions[name]
        ends = self._ends.get(name, ())
        return next((self._motions[end] for end in ends if end in self._motions), None)

    def _read_inputs(self) -> dict[int, StructureInput]:
        inputs = {}
        for place, table in self._file.tables("input"):
            name, kind = self._file.text(table, "name"), table.get("kind", "force")
            at = self._site_of("input", place, table, GROUND if kind == "base_acceleration" else None)
            if name is not None and at is not None and kind in _INPUT_KINDS:
                channel, hold = self._file.text(table, "channel"), self._file.hold(table)
                inputs[place] = StructureInput(name=name, at=at, kind=kind, channel=channel, hold=hold)
        return inputs

    def _read_outputs(self) -> dict[int, StructureOutput]:
        outputs = {}
        for place, table in self._file.tables("output"):
            name, measures = self._file.text(table, "name"), table.get("measures")
            at = self._site_of("output", place, table, None)
            if name is not None and at is not None and measures in _MEASURES:
                channel, hold = self._file.text(table, "channel"), self._file.hold(table)
                outputs[place] = StructureOutput(name=name, measures=measures, at=at, channel=channel, hold=hold)
        return outputs

    def _site_of(self, part: str, place: int, table: Content, default: str | None) -> str | None:
        """Give the name behind ``at`` or ``joint``; None when a mistake was noted (or the schema will)."""
        given = [key for key in ("at", "joint") if key in table]
        if len(given) != 1:
            if not given and default is not None:
                return default
            wish = "has both at and joint; give one" if given else "needs at (a body), or joint"
            self._mistakes.add((part, place), wish)
            return None
        name = self._file.text(table, given[0])
        joints = self._names("joint")
        if given == ["joint"] and name is not None and name not in joints:
            wish = nearest(name, joints, "joints")
            self._mistakes.add((part, place, "joint"), f"{name!r:.60} is no joint; {wish}")
            return None
        if given == ["at"] and name in joints:
            self._mistakes.add((part, place, "at"), f'{shown(name)} is a joint; write joint = "{name}"')
            return None
        return name

    def _names(self, part: str) -> list[str]:
        """Names of one kind of part, also of those that can't be read otherwise."""
        found = [self._file.text(table, "name") for _, table in self._file.tables(part)]
        return [name for name in found if name is not None]

    def _note_names(self) -> None:
        parts = [
            (part, place, name)
            for part in _PARTS
            for place, table in self._file.tables(part)
            if (name := self._file.text(table, "name")) is not None
        ]
        for mistake in name_mistakes(parts):
            self._mistakes.add((mistake.part, mistake.place, "name"), mistake.text)

    def _note_wiring(self) -> None:
        wirings = {
            place: Wiring(
                name=str(table.get("name")),
                feedback=str(table.get("feedback")),
                drives=str(table.get("drives")),
                reference=self._file.text(table, "reference"),
            )
            for place, table in self._file.tables("controller")
        }
        places = {"input": list(self._inputs), "output": list(self._outputs), "controller": list(wirings)}
        # A joint or output whose own table is wrong is told there, not wherever its name is used.
        unread = {
            *(set(self._names("joint")) - set(self._ends)),
            *(set(self._names("input")) - {one.name for one in self._inputs.values()}),
            *(set(self._names("output")) - {one.name for one in self._outputs.values()}),
        }
        for mistake in wiring_mistakes(
            self._motions, self._ends, [*self._inputs.values()], [*self._outputs.values()], [*wirings.values()]
        ):
            place = places[mistake.part][mistake.place]
            table = self._file.content[mistake.part][place]
            key = "joint" if mistake.key == "at" and "joint" in table else mistake.key
            # What is missing altogether is the schema's to tell; what can't be read is told where it stands.
            if (key in table or key == "at") and self._file.text(table, key) not in unread:
                self._mistakes.add((mistake.part, place, key), mistake.text)

    def _controller(self, place: int, table: Content) -> Controller | None:
        driven = next((one for one in self._inputs.values() if one.name == table.get("drives")), None)
        feedback = next((one for one in self._outputs.values() if one.name == table.get("feedback")), None)
        ends = None
        if driven is not None and feedback is not None:
            motion, measured = self._motion_at(driven.at), self._motion_at(feedback.at)
            if motion is not None and measured is not None:
                ends = ControllerEnds(
                    driven=measure_unit("force", motion), feedback=measure_unit(feedback.measures, measured)
                )
        return read_controller(self._file, place, table, ends)

    def _sites(self) -> dict[str, SiteUnits | None]:
        """Every name that can be a site, also where the rest of its table is wrong."""
        sites: dict[str, SiteUnits | None] = {GROUND: None}
        for part in _PARTS:
            for _, table in self._file.tables(part):
                name = self._file.text(table, "name")
                if name is not None:
                    sites[name] = self._units_of(part, table)
        return sites

    def _units_of(self, part: str, table: Content) -> SiteUnits | None:
        # An input or output has the units of the motion where it acts.
        at = table.get("name") if part in ("body", "joint") else table.get("joint", table.get("at"))
        motion = self._motion_at(str(at))
        if motion is None or part == "controller":
            return None
        force, displacement = measure_unit("force", motion), measure_unit("displacement", motion)
        if part == "output" and table.get("measures") in _MEASURES:
            measured = measure_unit(table["measures"], motion)
            return SiteUnits(force=measured, displacement=displacement, signal=measured)
        if part == "input" and table.get("kind") == "displacement":
            return SiteUnits(force=displacement, displacement=displacement)
        return SiteUnits(force=force, displacement=displacement)

    def _note_equations(self, model: StructureModel) -> None:
        """Note what only the equations show: a loop without solution, an effect that doesn't fit its site."""

        def with_controllers(count: int) -> object:
            closed = {one.name for one in model.controllers[:count]}
            inputs = tuple(one for one in model.inputs if one.kind != "disturbance" or one.at in closed)
            return replace(model, controllers=model.controllers[:count], inputs=inputs, effects=()).compile()

        if self._file.refused_with("controller", len(model.controllers), with_controllers):
            return
        self._file.refused_with(
            "effect", len(model.effects), lambda count: model.with_effects(model.effects[:count]).compile()
        )


def _made(records: Sequence[Any]) -> tuple[Any, ...]:
    return tuple(record for record in records if record is not None)
