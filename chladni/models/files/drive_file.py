"""Reading the model file of a drive."""

from dataclasses import replace
from functools import partial
from pathlib import Path

from chladni.io.toml_reader import TomlMistakes, read_toml
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.drive_model import DriveModel, drive_model
from chladni.models.drives.selection import ChosenSignal
from chladni.models.effects.wording import nearest
from chladni.models.files.file_reading import Content, FileReading
from chladni.models.files.site_units import SiteUnits, compiled_site_units
from chladni.models.files.tolerances import with_tolerances
from chladni.models.structures.wiring import name_mistakes
from chladni.signals.errors import ModelError
from chladni.signals.wording import shown


def read_drive(path: Path) -> DriveModel:
    """Read the model file of a drive.

    Raises
    ------
    ModelError
        With a line for each mistake.
    """
    from chladni.models.files.model_tables import DriveFile

    made: list[DriveModel] = []

    def check(content: Content, mistakes: TomlMistakes) -> None:
        made.extend(_DriveReading(content, mistakes).models())

    read_toml(path, DriveFile, kind=ModelError, check=check)
    return made[0]


class _DriveReading:
    """Looks at every table against the declaration of the kind of drive."""

    def __init__(self, content: Content, mistakes: TomlMistakes) -> None:
        self._file, self._mistakes, self._content = FileReading(content, mistakes), mistakes, content

    def models(self) -> list[DriveModel]:
        """Give the model, or none when anything is wrong."""
        kind = self._kind()
        if kind is None:
            return []
        options = self._options(kind)
        inputs, outputs = self._signals("input", kind), self._signals("output", kind)
        units = {one.name: one.unit for one in kind.parameters.values()}
        values = self._file.numbers(("parameters",), self._content.get("parameters"), units, what="parameter")
        model = self._made(kind, values, options, inputs, outputs)
        effects = self._file.effects(self._sites(kind, model))
        tolerances = self._file.tolerances(None if model is None else model.parameters)
        if model is None or self._mistakes:
            return []
        model = replace(model, parameters=with_tolerances(model.parameters, *tolerances))
        found = model
        self._file.refused_with("effect", len(effects), lambda count: found.with_effects(effects[:count]).compile())
        return [model.with_effects(effects)]

    def _kind(self) -> DriveKind | None:
        word = self._file.text(self._content, "drive")
        if word is None or word in DRIVES:
            return None if word is None else DRIVES[word]
        self._mistakes.add(("drive",), f"no drive {word!r:.60}; {nearest(word, list(DRIVES), 'drives')}")
        return None

    def _options(self, kind: DriveKind) -> dict[str, str] | None:
        found = self._content.get("options", {})
        if not isinstance(found, dict):
            return None
        chosen = {name: word for name, word in found.items() if isinstance(word, str)}
        for name, word in chosen.items():
            # One at a time, so that each mistake has its line.
            self._file.tried(("options", name), partial(kind.choices, {name: word}))
        return chosen

    def _signals(self, part: str, kind: DriveKind) -> list[ChosenSignal]:
        known = [terminal.name for terminal in (kind.inputs if part == "input" else kind.outputs)]
        chosen: list[ChosenSignal] = []
        for place, table in self._file.tables(part):
            signal = self._file.text(table, "signal")
            if signal is None:
                continue
            if signal not in known:
                wish = nearest(signal, known, f"{part}s")
                self._mistakes.add((part, place, "signal"), f"no {part} {signal!r:.60}; {wish}")
            elif signal in [one.signal for one in chosen]:
                self._mistakes.add((part, place, "signal"), f"{shown(signal)} is chosen twice; once is enough")
            else:
                name, channel = self._file.text(table, "name") or "", self._file.text(table, "channel")
                chosen.append(ChosenSignal(signal=signal, name=name, channel=channel, hold=self._file.hold(table)))
        return chosen

    def _made(
        self,
        kind: DriveKind,
        values: dict[str, float] | None,
        options: dict[str, str] | None,
        inputs: list[ChosenSignal],
        outputs: list[ChosenSignal],
    ) -> DriveModel | None:
        self._note_names(inputs, outputs)
        if values is not None and options is not None:
            self._note_values(kind, values, options)
        # Which signals a drive has depends on its options, and only the model itself knows.
        if self._mistakes or values is None or options is None:
            return None
        name = str(self._content.get("name"))
        return self._file.tried(
            (), lambda: drive_model(kind, values, options, name=name, inputs=inputs, outputs=outputs)
        )

    def _note_names(self, inputs: list[ChosenSignal], outputs: list[ChosenSignal]) -> None:
        parts = [
            *(("input", place, one.shown_as) for place, one in enumerate(inputs)),
            *(("output", place, one.shown_as) for place, one in enumerate(outputs)),
        ]
        for mistake in name_mistakes(parts):
            self._mistakes.add((mistake.part, mistake.place, "name"), mistake.text)

    def _note_values(self, kind: DriveKind, values: dict[str, float], options: dict[str, str]) -> None:
        # One at a time, for the line of each.
        for name, value in values.items():
            self._file.tried(("parameters", name), partial(kind.with_values, {name: value}, options))

    def _sites(self, kind: DriveKind, model: DriveModel | None) -> dict[str, SiteUnits | None]:
        if model is not None:
            return dict(compiled_site_units(model.compile()))
        # A model that can't be made hides which sites it has; those it may have are the fairest guess.
        signals = [terminal.name for terminal in (*kind.inputs, *kind.outputs)]
        tables = [table for part in ("input", "output") for _, table in self._file.tables(part)]
        return dict.fromkeys([*signals, *(str(table.get("name")) for table in tables)])
