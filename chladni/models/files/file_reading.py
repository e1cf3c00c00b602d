"""What the readers of all kinds of model file share: numbers with units, names, effects, tolerances."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from chladni.io.toml_reader import TomlMistakes, tables
from chladni.models.core.model import Effect
from chladni.models.core.parameter import Parameters, not_workable
from chladni.models.core.port import HOLDS, HoldKind
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.wording import nearest
from chladni.models.files.quantity import is_finite, number
from chladni.models.files.site_units import SiteUnits, known_site, sites_like, units_at
from chladni.signals.errors import ModelError
from chladni.signals.wording import shown

T = TypeVar("T")
Content = dict[str, Any]
Loc = tuple[str | int, ...]

#: Key of an effect's parameters that names another output, where all others are numbers.
SOURCE = "from"


class FileReading:
    """One file while it's read: raw content, and where mistakes are noted.

    Every method gives None for what can't be read. Wrong types are told by the tables' schema and passed over here,
    so that nothing is told twice.
    """

    def __init__(self, content: Content, mistakes: TomlMistakes) -> None:
        self.content, self.mistakes = content, mistakes

    def tables(self, name: str) -> list[tuple[int, Content]]:
        """Tables ``[[name]]`` with their index."""
        return tables(self.content, name)

    def text(self, table: Content, key: str) -> str | None:
        """Text of a key."""
        found = table.get(key)
        return found if isinstance(found, str) and found else None

    def hold(self, table: Content) -> HoldKind | None:
        """Word of the key ``hold``."""
        return next((hold for hold in HOLDS if hold == table.get("hold")), None)

    def number(self, loc: Loc, found: object, unit: str | None, *, at_least: float | None = None) -> float | None:
        """Give a number in SI; a unit of None takes any."""
        if isinstance(found, bool) or not isinstance(found, int | float | str):
            return None
        if not isinstance(found, str) and not is_finite(found):
            return None
        value = self.tried(loc, lambda: number(found, unit))
        if value is not None and at_least is not None and value < at_least:
            self.mistakes.add(loc, f"found {shown(found)}; must be {at_least:g} or more")
            return None
        return value

    def parameter(self, loc: Loc, found: object, unit: str | None, *, at_least: float | None = None) -> float | None:
        """Give a number in SI that equations can hold."""
        value = self.number(loc, found, unit, at_least=at_least)
        if value is not None and (wrong := not_workable(value, "" if unit in (None, "1") else f" {unit}")):
            self.mistakes.add(loc, f"found {wrong}")
            return None
        return value

    def numbers(
        self, loc: Loc, found: object, units: Mapping[str, str | None], *, what: str
    ) -> dict[str, float] | None:
        """Give numbers by name; unknown names are told with the nearest of those in `units`."""
        if not isinstance(found, dict):
            return {} if found is None else None
        # Goes on after a mistake, so that the next one is told too.
        read: dict[str, float] = {}
        complete = True
        for name, one in found.items():
            if name not in units:
                self.mistakes.add((*loc, name), f"unknown {what}; {nearest(name, list(units), f'{what}s')}")
                complete = False
                continue
            value = self.parameter((*loc, name), one, units[name])
            complete = complete and value is not None
            if value is not None:
                read[name] = value
        return read if complete else None

    def tried(self, loc: Loc, make: Callable[[], T]) -> T | None:
        """Give what `make` gives; its `ModelError` is a mistake at `loc`."""
        try:
            return make()
        except ModelError as error:
            self.mistakes.add(loc, str(error))
            return None

    def refused_with(self, table: str, count: int, made: Callable[[int], object]) -> bool:
        """Whether `made` refuses `count` tables; the mistake is told at one without which it takes those before.

        A compilation of a large model takes seconds, so that table is found by halving.
        """
        low, high, told = 0, count + 1, ""
        middle = count
        while middle > low:
            try:
                made(middle)
                low = middle
            except ModelError as error:
                high, told = middle, str(error)
            middle = (low + high) // 2
        if told:
            self.mistakes.add((table, high - 1), told)
        return bool(told)

    def effects(self, sites: Mapping[str, SiteUnits | None]) -> list[Effect]:
        """Effects of the file; `sites` by name, None where a mistake hides which units they have."""
        found = [self._effect(place, table, sites) for place, table in self.tables("effect")]
        return [effect for effect in found if effect is not None]

    def tolerances(self, parameters: Parameters | None) -> tuple[float | None, dict[str, float]]:
        """Default tolerance (None when not said) and those by name of a parameter.

        Names are not looked at when `parameters` is None, because the model itself couldn't be read.
        """
        default, by_name = None, {}
        stated = self.content.get("tolerance")
        for loc, key, found in _flat(("tolerance",), stated) if isinstance(stated, dict) else []:
            value = self.number(loc, found, "1", at_least=0.0)
            if isinstance(found, bool) or not isinstance(found, int | float | str):
                self.mistakes.add(loc, f"found {found!r:.60}; must be a number: one sigma over the value")
            elif not isinstance(found, str) and not is_finite(found):
                self.mistakes.add(loc, f"found {found}; must be finite")
            elif value is not None and key == "default":
                default = value
            elif value is not None and self._names_parameter(loc, key, parameters):
                by_name[key] = value
        return default, by_name

    def _names_parameter(self, loc: Loc, key: str, parameters: Parameters | None) -> bool:
        if parameters is None or key in parameters:
            return parameters is not None
        self.mistakes.add(loc, f"no parameter {shown(key)}; {nearest(key, list(parameters), 'parameters')}")
        return False

    def _effect(self, place: int, table: Content, sites: Mapping[str, SiteUnits | None]) -> Effect | None:
        loc: Loc = ("effect", place)
        word, site, variant = (self.text(table, key) for key in ("effect", "site", "variant"))
        if site is not None and not known_site(site, sites):
            self.mistakes.add(
                (*loc, "site"), f"no site {site!r:.60}; {nearest(site, sites_like(site, sites), 'sites')}"
            )
            site = None
        if word is not None and word not in CATALOGUE:
            self.mistakes.add(
                (*loc, "effect"), f"no effect {word!r:.60}; {nearest(word, list(CATALOGUE), 'effects')}"
            )
        if word is None or word not in CATALOGUE:
            return None
        kind = CATALOGUE[word]
        chosen = self.tried((*loc, "variant"), lambda: kind.variant(variant).name)
        if chosen is None:
            return None
        units = None if site is None else units_at(site, sites)
        values, source = self._effect_values(loc, table.get("parameters"), kind.parameters_of(chosen), units)
        if site is None or values is None:
            return None
        at = site
        return self.tried(loc, lambda: attached(word, at, values, variant=chosen, source=source))

    def _effect_values(
        self, loc: Loc, found: object, declared: Parameters, site: SiteUnits | None
    ) -> tuple[dict[str, float] | None, str | None]:
        units = {one.name: None if site is None else site.of(one.unit) for one in declared.values()}
        # The one parameter that is no number: taken out before numbers are read.
        source = None
        if isinstance(found, dict) and SOURCE in found:
            source = self.text(found, SOURCE)
            found = {key: one for key, one in found.items() if key != SOURCE}
        return self.numbers((*loc, "parameters"), found, units, what="parameter"), source


def _flat(loc: Loc, found: object) -> list[tuple[Loc, str, object]]:
    """Entries of nested tables: the bare key ``elbow.stiffness`` is a table in a table to TOML."""
    if not isinstance(found, dict):
        return [(loc, ".".join(map(str, loc[1:])), found)]
    return [entry for key, one in found.items() for entry in _flat((*loc, key), one)]
