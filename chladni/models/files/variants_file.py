"""Files of variants: rows of parameters, one row a variant, which may grow while they are watched."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from csv import Error as CsvError
from csv import reader
from dataclasses import dataclass
from pathlib import Path

from chladni.io.regular_file import read_text
from chladni.io.toml_reader import TomlDocument
from chladni.models.analysis.variants import Variant
from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameters
from chladni.models.files.quantity import number
from chladni.signals.errors import ModelError
from chladni.signals.text_reading import lines_of, real_number
from chladni.signals.wording import near_words, shown

FORMAT = "chladni.variants/1"
MAX_BYTES = 1 << 20
#: More curves than this say nothing.
MAX_VARIANTS = 1000
NAME = "name"
POLL_S = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class VariantsState:
    """What a watched file holds.

    Attributes
    ----------
    variants
        Of the last state of the file that was right.
    mistake
        One line on what is wrong with the state it has now; empty when it's right.
    """

    variants: tuple[Variant, ...] = ()
    mistake: str = ""


def read_variants(path: Path | str, parameters: Parameters, options: Sequence[Option] = ()) -> tuple[Variant, ...]:
    """Read the variants of a file.

    CSV: a line of titles, ``name`` (may be left out) and names of parameters or options, a unit in brackets after a
    parameter that isn't in SI (``active_area [cm^2]``); then a row for each variant. An empty cell is the default.
    TOML (by its ending): ``format = "chladni.variants/1"`` and a table ``[[variant]]`` for each, with the same names;
    numbers in SI or texts with a unit.

    Parameters
    ----------
    path
        At most 1 MiB and 1000 variants.
    parameters, options
        Of the model or instrument that the rows are for.

    Raises
    ------
    ModelError
        One line with file, line and column for what is wrong; the nearest name for an unknown one.
    """
    path = Path(path)
    return _parsed(path, read_text(path, MAX_BYTES, ModelError), parameters, options)


class VariantsWatch:
    """Looks at a file of variants again and again.

    A state that is wrong is told, and the variants of the last right one stay. What is being written is given time: a
    last line without its end, or a mistake, counts only once the file has been the same at two looks.

    Parameters
    ----------
    path
        The file; may not be there yet.
    parameters, options
        As of `read_variants`.
    """

    def __init__(self, path: Path | str, parameters: Parameters, options: Sequence[Option] = ()) -> None:
        self._path = Path(path)
        self._parameters, self._options = parameters, tuple(options)
        self._state = VariantsState()
        self._seen: str | None = None
        self._settled = False

    @property
    def state(self) -> VariantsState:
        """The last state."""
        return self._state

    def poll(self) -> VariantsState:
        """Look at the file, and give what holds now."""
        try:
            text = read_text(self._path, MAX_BYTES, ModelError)
        except ModelError as error:
            self._state = VariantsState(variants=self._state.variants, mistake=str(error))
            self._seen, self._settled = None, False
            return self._state
        again, self._seen = text == self._seen, text
        if again and self._settled:
            return self._state
        self._settled = again
        return self._taken(text, again)

    def _taken(self, text: str, again: bool) -> VariantsState:
        whole = text if again or self._path.suffix.lower() == ".toml" else text[: text.rfind("\n") + 1]
        try:
            found = _parsed(self._path, whole, self._parameters, self._options)
        except ModelError as error:
            if again:
                self._state = VariantsState(variants=self._state.variants, mistake=str(error))
            return self._state
        self._state = VariantsState(variants=found)
        return self._state


def watch_variants(
    path: Path | str,
    parameters: Parameters,
    options: Sequence[Option] = (),
    *,
    poll_s: float = POLL_S,
    go_on: Callable[[], bool] = lambda: True,
) -> Iterator[VariantsState]:
    """Give the state of a file of variants whenever it changes, first as it is, until `go_on` says no."""
    watch = VariantsWatch(path, parameters, options)
    told: VariantsState | None = None
    while go_on():
        state = watch.poll()
        if state != told:
            told = state
            yield state
        time.sleep(poll_s)


def _parsed(path: Path, text: str, parameters: Parameters, options: Sequence[Option]) -> tuple[Variant, ...]:
    rows = _Rows(path, parameters, options)
    found = tuple(rows.from_toml(text) if path.suffix.lower() == ".toml" else rows.from_csv(text))
    names = [variant.name for variant in found]
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f"{path}: {names.count(name)} variants are called {shown(name)}; give each its own name")
    return found


class _Rows:
    """Turns rows of a file into variants."""

    def __init__(self, path: Path, parameters: Parameters, options: Sequence[Option]) -> None:
        self._path, self._parameters = path, parameters
        self._options = {option.name: option for option in options}

    def from_csv(self, text: str) -> Iterator[Variant]:
        lines = reader(lines_of(text), strict=True)
        titles: list[tuple[str, str]] | None = None
        count = 0
        try:
            for cells in lines:
                if not any(cell.strip() for cell in cells):
                    continue
                if titles is None:
                    titles = self._titles(cells, lines.line_num)
                    continue
                count += 1
                yield self._row(titles, cells, lines.line_num, count)
        except CsvError as error:
            raise ModelError(f"{self._path}:{lines.line_num}: not CSV: {error}") from None

    def from_toml(self, text: str) -> Iterator[Variant]:
        content = TomlDocument(text, name=str(self._path), kind=ModelError).content
        if content.get("format") != FORMAT:
            raise ModelError(f'{self._path}: format is {shown(content.get("format"))}; write format = "{FORMAT}"')
        extra = [key for key in content if key not in ("format", "variant")]
        tables = content.get("variant", [])
        if extra or not isinstance(tables, list):
            raise ModelError(
                f"{self._path}: found {', '.join(extra) or 'variant'}; each variant is a [[variant]] table"
            )
        for count, table in enumerate(tables, start=1):
            where = f"{self._path}: [[variant]] {count}"
            if not isinstance(table, dict):
                raise ModelError(f"{where}: must be a table")
            for key in table:
                self._require_known(key, where)
            yield self._variant({str(key): (value, "") for key, value in table.items()}, where, count)

    def _titles(self, cells: Sequence[str], line: int) -> list[tuple[str, str]]:
        titles = []
        for cell in cells:
            name, _, unit = cell.strip().partition("[")
            name = name.strip()
            self._require_known(name, f"{self._path}:{line}")
            titles.append((name, unit.removesuffix("]").strip()))
        names = [name for name, _ in titles]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(
                    f"{self._path}:{line}: column {name} stands there {names.count(name)} times; keep one"
                )
        return titles

    def _row(self, titles: Sequence[tuple[str, str]], cells: Sequence[str], line: int, count: int) -> Variant:
        where = f"{self._path}:{line}"
        if len(cells) != len(titles):
            raise ModelError(f"{where}: has {len(cells)} cells, the line of titles {len(titles)}; give as many")
        filled = {
            name: (cell.strip(), unit) for (name, unit), cell in zip(titles, cells, strict=True) if cell.strip()
        }
        return self._variant(filled, where, count)

    def _variant(self, cells: Mapping[str, tuple[object, str]], where: str, count: int) -> Variant:
        if count > MAX_VARIANTS:
            raise ModelError(f"{where}: more than {MAX_VARIANTS} variants can't be shown; split the file")
        values, options, name = {}, {}, str(cells.get(NAME, (f"variant {count}", ""))[0])
        for key, (found, unit) in cells.items():
            if key in self._parameters:
                values[key] = self._number(key, found, unit, where)
            elif key in self._options:
                options[key] = self._word(key, found, where)
        return Variant(name=name, values=values, options=options)

    def _number(self, key: str, found: object, unit: str, where: str) -> float:
        parameter = self._parameters[key]
        try:
            return parameter.with_value(_si(found, unit, parameter.unit)).value
        except ModelError as error:
            raise ModelError(f"{where}: column {key}: {str(error).removeprefix(f'{key}: ')}") from None

    def _word(self, key: str, found: object, where: str) -> str:
        choices = self._options[key].choices
        if found not in choices:
            raise ModelError(f"{where}: column {key}: found {shown(found)}; must be one of {', '.join(choices)}")
        return str(found)

    def _require_known(self, name: str, where: str) -> None:
        known = [NAME, *self._parameters, *self._options]
        if name not in known:
            near = near_words(name, known)
            advice = f"did you mean {near[0]}?" if near else f"columns: {', '.join(known)}"
            raise ModelError(f"{where}: no parameter is called {shown(name)}; {advice}")


def _si(found: object, written: str, wanted: str) -> float:
    """Give a cell in SI: a bare number is in the unit `written` after its title, or in SI without one."""
    if isinstance(found, bool) or not isinstance(found, (int, float, str)):
        raise ModelError(f"found {shown(found)}; must be a number, or text with a unit")
    if isinstance(found, str):
        try:
            found = real_number(found)
        except ValueError:
            return number(found, wanted)
    return number(f"{found!r} {written}" if written else found, wanted)
