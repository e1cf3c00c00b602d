"""Values in the unit that people ask for: the same quantity, counted otherwise."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from chladni.signals.channel import UNKNOWN, Channel, Names, as_names
from chladni.signals.errors import SetupError
from chladni.signals.mode_set import ModeSet
from chladni.signals.units import si_factor
from chladni.signals.value import Value

ValueT = TypeVar("ValueT", bound=Value)

# Of each SI unit of vibration, units that people read it in.
_USUAL = {
    "m/s^2": "g, m/s^2 or mm/s^2",
    "m/s": "m/s or mm/s",
    "m": "m, mm or um",
    "N": "N, kN or lbf",
    "N m": "N m or kN m",
    "rad/s": "rad/s or deg/s",
    "rad": "rad or deg",
    "Pa": "Pa, kPa or bar",
    "V": "V or mV",
}
_CHANNELS = ("channels", "responses", "references")


def units_by_quantity(units: Sequence[str]) -> dict[str, str]:
    """Give each unit that was asked for by the SI unit of its quantity.

    Raises
    ------
    SetupError
        When a unit isn't known, or two are of one quantity.

    Examples
    --------
    >>> units_by_quantity(["g", "kN"])
    {'m/s^2': 'g', 'N': 'kN'}
    """
    asked: dict[str, str] = {}
    for unit in units:
        _, si_unit = si_factor(unit)
        if si_unit in asked:
            raise SetupError(f"--unit {asked[si_unit]} and --unit {unit} are of one quantity; give one of them")
        asked[si_unit] = unit.strip()
    return asked


def in_units(value: ValueT, units: Names | None) -> ValueT:
    """Give a value with its channels in other units of the same quantities; other channels stay as they are.

    Parameters
    ----------
    value
        With channels in SI.
    units
        One unit for each quantity, such as ``"g"`` or ``["g", "kN"]``; None or nothing leaves all in SI.

    Raises
    ------
    SetupError
        When a unit isn't known, two are of one quantity, or no channel is of it.

    Examples
    --------
    >>> from chladni.signals.power_spectral_density import PowerSpectralDensity
    >>> density = PowerSpectralDensity.from_arrays([1.0, 2.0], [[96.17038422, 0.0]])
    >>> density = replace(density, channels=(Channel(name="tip", unit="m/s^2"),))
    >>> shown = in_units(density, "g")
    >>> shown.values[0, 0].round(6), shown.units
    (np.float64(1.0), ('g^2/Hz',))
    """
    (found,) = all_in_units([value], units)
    return found


def all_in_units(values: Sequence[ValueT], units: Names | None) -> tuple[ValueT, ...]:
    """Give several values of one log in other units, see `in_units`; each unit fits a channel of one."""
    if not units:
        return tuple(values)
    require_units([channel for value in values for channel in _channels(value)], units)
    asked = units_by_quantity(as_names(units))
    return tuple(_shown(value, asked) for value in values)


def require_units(channels: Iterable[Channel], units: Names | None) -> None:
    """Raise `SetupError` when none of the channels is of the quantity of a unit."""
    held = [channel.unit for channel in channels]
    for si_unit, unit in units_by_quantity(as_names(units or ())).items():
        if si_unit not in held:
            raise SetupError(_misfit(unit, si_unit, list(dict.fromkeys(held))))


def synthesis_in_units(modes: ModeSet, units: Names | None) -> ModeSet:
    """Give modes whose synthesised functions, and channels, are in other units, see `in_units`.

    Shapes stay as they are: ratios of SI, which don't change where all responses are of one quantity.
    """
    if not units or modes.fit is None:
        return modes
    asked = units_by_quantity(as_names(units))
    shown, over = ([asked.get(one.unit, one.unit) for one in of] for of in (modes.channels, modes.references))
    response, reference = (np.array([si_factor(unit)[0] for unit in names]) for names in (shown, over))
    factors = (reference / response[:, np.newaxis])[..., np.newaxis]
    return replace(
        modes,
        channels=tuple(replace(one, unit=unit) for one, unit in zip(modes.channels, shown, strict=True)),
        references=tuple(replace(one, unit=unit) for one, unit in zip(modes.references, over, strict=True)),
        fit=replace(modes.fit, synthesised=modes.fit.synthesised * factors),
    )


def _misfit(unit: str, si_unit: str, held: Sequence[str]) -> str:
    known = [one for one in held if one != UNKNOWN]
    if not known:
        return (
            f"--unit {unit}: the log gives no unit of its channels; state it in a setup file (--setup), or of a data "
            f"file with --read units=CHANNEL:{unit}"
        )
    fitting = "; ".join(_USUAL.get(one, one) for one in known)
    same = "" if si_unit == unit else f" is one of {si_unit}, and"
    return f"--unit {unit}{same or ':'} no channel is in {si_unit}; what fits: {fitting}"


def _shown(value: ValueT, asked: Mapping[str, str]) -> ValueT:
    """Convert each field of `AXES` by the ratio of its units before and after, and the values within."""
    changed: dict[str, Any] = {
        name: tuple(replace(one, unit=asked.get(one.unit, one.unit)) for one in getattr(value, name))
        for name in _channel_fields(value)
    }
    if not changed:
        return value
    named: Any = replace(value, **changed)  # type: ignore[type-var]  # every value is a dataclass
    for name in value.OF_ROW:
        scale = np.array([si_factor(channel.unit)[0] for channel in changed[value.ROWS]])
        changed[name] = (getattr(value, name).T / scale).T
    for name, axes in value.AXES.items():
        rows_apart = [len(value.coordinate(axis)) for axis in axes if axis != value.ROWS]
        factors = np.ones(rows_apart)
        for place in np.ndindex(*rows_apart):
            if unit := named.unit_at(name, place):
                factors[place] = 1 / si_factor(unit)[0]
        if (factors != 1).any():
            along = tuple(place for place, axis in enumerate(axes) if axis == value.ROWS)
            changed[name] = getattr(value, name) * np.expand_dims(factors, along)
    numbers = {name: one for name, one in changed.items() if name in value.AXES}
    shown: ValueT = replace(named, **numbers, **_within(value, asked))
    return shown


def _within(value: Value, asked: Mapping[str, str]) -> dict[str, Any]:
    """Convert the values that a value holds, such as levels over time."""
    held = {one.name: getattr(value, one.name) for one in fields(value)}  # type: ignore[arg-type]  # all are dataclasses
    return {name: _shown(one, asked) for name, one in held.items() if isinstance(one, Value)}


def _channel_fields(value: Value) -> list[str]:
    return [name for name in _CHANNELS if isinstance(getattr(value, name, None), tuple)]


def _channels(value: Value) -> Iterator[Channel]:
    for name in _channel_fields(value):
        yield from getattr(value, name)
