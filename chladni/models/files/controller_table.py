"""Reading one ``[[controller]]`` table."""

from dataclasses import dataclass
from typing import get_args

from chladni.models.files.file_reading import Content, FileReading, Loc
from chladni.models.files.quantity import dimension
from chladni.models.structures.controller import Controller, Law, controller_units, gains_of
from chladni.signals.errors import SetupError
from chladni.signals.units import parse_quantity
from chladni.signals.wording import shown


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerEnds:
    """Units of the input that a controller drives, and of what is fed back to it."""

    driven: str
    feedback: str


@dataclass(frozen=True, slots=True)
class _WithUnit:
    """A number, and its unit where the file says one that matters."""

    value: float | None
    unit: str | None = None


def read_controller(file: FileReading, place: int, table: Content, ends: ControllerEnds | None) -> Controller | None:
    """Make the record, or note what is wrong.

    Parameters
    ----------
    ends
        None when they aren't known because of another mistake; then units aren't looked at.
    """
    loc: Loc = ("controller", place)
    law, gain = _law(file, loc, table), _gain(file, (*loc, "gain"), table.get("gain", 1.0))
    if law is None or gain is None:
        return None
    # Without the ends, names of gains can still be looked at; what their units must be can't.
    units: dict[str, str | None] = dict.fromkeys((*gains_of(law), "command"))
    if ends is not None:
        known = controller_units(law, gain.unit, driven_unit=ends.driven, feedback_unit=ends.feedback)
        units = {name: known[name] for name in units}
    command = units.pop("command")
    gains = file.numbers((*loc, "gains"), table.get("gains"), units, what="gain")
    limit = _limit(file, (*loc, "limit"), table.get("limit"), command, ends)
    num, den = (_polynomial(file, (*loc, key), table.get(key, [])) for key in ("num", "den"))
    name, feedback, drives = (file.text(table, key) for key in ("name", "feedback", "drives"))
    if gains is None or limit is None or num is None or den is None or not (name and feedback and drives):
        return None
    return file.tried(loc, lambda: Controller(
        name=name, feedback=feedback, drives=drives, law=law, gains=gains, num=num, den=den,
        reference=file.text(table, "reference"),
        hold=file.hold(table),
        rate_of="error" if table.get("rate_of") == "error" else "feedback",
        gain=gain.value if gain.value is not None else 1.0, gain_unit=gain.unit,
        limit=limit.value, limit_unit=limit.unit,
    ))  # fmt: skip


def _law(file: FileReading, loc: Loc, table: Content) -> Law | None:
    found = table.get("law", "transfer-function" if "num" in table or "den" in table else None)
    if found is None:
        laws = ", ".join(get_args(Law))
        file.mistakes.add(loc, f"law is missing, and is needed: {laws} (or num and den)")
    return next((law for law in get_args(Law) if law == found), None)


def _gain(file: FileReading, loc: Loc, found: object) -> _WithUnit | None:
    """Any unit will do: it says in what the controller's own command is measured."""
    value = file.parameter(loc, found, None)
    if value == 0:
        file.mistakes.add(loc, f"found {shown(found)}; a gain of zero drives nothing")
    if not value:
        return None
    return _WithUnit(value, parse_quantity(found)[1] if isinstance(found, str) else None)


def _limit(
    file: FileReading, loc: Loc, found: object, command: str | None, ends: ControllerEnds | None
) -> _WithUnit | None:
    """A limit of the command, or, by its unit, of the force behind the gain."""
    if found is None:
        return _WithUnit(None)
    # Where both units agree there's no telling, and no difference but for the gain: the command is meant.
    unit = command
    if isinstance(found, str) and ends is not None and ends.driven != command and _measures(found, ends.driven):
        unit = ends.driven
    value = file.parameter(loc, found, unit)
    if value is not None and value <= 0:
        file.mistakes.add(loc, f"found {shown(found)}; must be above zero")
        return None
    return None if value is None else _WithUnit(value, None if unit == command else unit)


def _measures(text: str, unit: str) -> bool:
    try:
        return dimension(parse_quantity(text)[1]) == dimension(unit)
    except SetupError:
        return False


def _polynomial(file: FileReading, loc: Loc, found: object) -> tuple[float, ...] | None:
    if not isinstance(found, list):
        return None
    read = [file.parameter((*loc, place), one, None) for place, one in enumerate(found)]
    numbers = tuple(one for one in read if one is not None)
    return numbers if len(numbers) == len(read) else None
