"""A channel: one measured quantity at one place in one direction."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import frexp, inf, isfinite, ldexp, sqrt
from typing import Final, Literal, Self

from chladni.signals.channel_labels import short_names
from chladni.signals.channel_names import is_pattern, places_of, require_one, unknown
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.units import si_factor
from chladni.signals.wording import counted, shown

Role = Literal["response", "reference"]
#: One channel's name, or several.
Names = str | Iterable[str]
#: One unit of all channels, one of each, or by their names.
Units = str | Sequence[str] | Mapping[str, str]
UNKNOWN: Final = "1"
"""Unit of a channel of which nothing is said."""
Vector = tuple[float, float, float]

AXES: dict[str, Vector] = {
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """What a row of samples is.

    Attributes
    ----------
    name
        Message path, such as ``/imu/wrist.linear_acceleration.x``.
    unit
        Unit of the samples, SI: ``m/s^2``, ``N``, ``V``; ``1`` when the log says nothing.
    point
        Measurement point in the setup's geometry, or None.
    direction
        Unit vector in which the sensor counts positive, or None.
    role
        ``reference`` for an excitation, ``response`` otherwise.
    overload
        Largest magnitude, in `unit`, that the sensor can tell; None when unknown.
    units_possible
        SI units that the message's type leaves open while `unit` is ``1``, such as ``m`` and ``rad`` of a joint's
        position; empty when anything is possible.
    held
        Whether the quantity is known to keep its value between samples, as a command does.
    label
        Short name by which its log's other channels are told from it; empty when nothing is known of a log. It is
        a way to say the name, and so makes no channel another one.
    """

    name: str
    unit: str = UNKNOWN
    point: str | None = None
    direction: Vector | None = None
    role: Role = "response"
    overload: float | None = None
    units_possible: tuple[str, ...] = ()
    held: bool = False
    label: str = field(default="", compare=False, repr=False)

    def with_name(self, name: str) -> Self:
        """Give the same channel under another name; its label stays where only something is put before the name."""
        return replace(self, name=name, label=self.label if name.endswith(self.name) else "")


def labelled(channels: Iterable[Channel]) -> tuple[Channel, ...]:
    """Give all channels of a log the labels that tell each from all others."""
    channels = tuple(channels)
    labels = short_names(channel.name for channel in channels)
    return tuple(replace(channel, label=labels[channel.name]) for channel in channels)


def labels_of(channels: Iterable[Channel]) -> dict[str, str]:
    """Give labels, all different, of the channels that a table or a picture shows, by their names.

    They are those that the channels have in their log, so that a label that is read anywhere names the channel in
    any command. What is of no log, or of several that agree in a label, gets the shortest label that tells it apart.

    Examples
    --------
    >>> arm = labelled([Channel(name="/imu/arm.accel.x"), Channel(name="/imu/arm.gyro.x")])
    >>> labels_of(arm[:1]), labels_of([Channel(name="/imu/arm.accel.x")])
    ({'/imu/arm.accel.x': 'arm.accel.x'}, {'/imu/arm.accel.x': 'arm.x'})
    """
    known = {channel.name: channel.label for channel in channels}
    others = short_names(name for name, label in known.items() if not label)
    found = {name: label or others[name] for name, label in known.items()}
    return found if len(set(found.values())) == len(found) else short_names(found)


def as_names(names: Names) -> tuple[str, ...]:
    """Give one name or several as several.

    Examples
    --------
    >>> as_names("/imu.x"), as_names(["/imu.x", "/imu.y"])
    (('/imu.x',), ('/imu.x', '/imu.y'))
    """
    return (names,) if isinstance(names, str) else tuple(names)


def find_channel(channels: Sequence[Channel], name: str, *, role: str = "channel") -> int:
    """Row of the one channel that a word names, see `places_of`; `EstimateError` when it names none or several."""
    names = [channel.name for channel in channels]
    return require_one(name, _found(name, channels, role), names, role=role)


def find_channels(channels: Sequence[Channel], names: Names, *, role: str = "channel") -> list[int]:
    """Rows of the channels that words name, see `places_of`, in one look at all of them.

    A channel that a pattern names, too, comes once.

    Raises
    ------
    EstimateError
        When a word names none, or an ending several.
    """
    rows = {channel.name: row for row, channel in reversed(list(enumerate(channels)))}
    words = as_names(names)
    found = [row for word in words for row in ([rows[word]] if word in rows else _found(word, channels, role))]
    return list(dict.fromkeys(found)) if any(map(is_pattern, words)) else found


def channel_names(channels: Sequence[Channel], names: Names, *, role: str = "channel") -> tuple[str, ...]:
    """Names of the channels that words name, as `find_channels` finds them."""
    return tuple(channels[row].name for row in find_channels(channels, names, role=role))


def _found(word: str, channels: Sequence[Channel], role: str) -> tuple[int, ...]:
    known = [channel.name for channel in channels]
    labels = [channel.label for channel in channels]
    # Of several logs' channels some may have one label.
    if word not in known and word and labels.count(word) == 1:
        return (labels.index(word),)
    if places := places_of(word, known, role=role):
        return places
    raise EstimateError(unknown(word, known, role=role))


def require_channels(channels: Sequence[Channel]) -> None:
    """Raise `EstimateError` when there is no channel to make an estimate of."""
    if not channels:
        raise EstimateError("the series holds no channel; select one at least")


def numbered(prefix: str, count: int, names: Names | None = None) -> tuple[str, ...]:
    """Give names for so many channels: those given, else ``ch1``, ``ch2``, ... of the prefix ``ch``.

    Raises
    ------
    EstimateError
        When names are given, but not so many.
    """
    if names is None:
        return tuple(f"{prefix}{number}" for number in range(1, count + 1))
    given = as_names(names)
    if len(given) != count:
        raise EstimateError(f"{counted(len(given), 'name')} for {counted(count, 'channel')}; name each channel")
    return given


def made_channels(
    names: Sequence[str], units: Units, *, references: Names = ()
) -> tuple[tuple[Channel, ...], tuple[float, ...]]:
    """Make channels of names and units, and give the factor that turns the numbers of each into SI.

    Raises
    ------
    EstimateError
        When there isn't a unit for each name, or one is given for a name that isn't there.
    SetupError
        When a unit isn't known.

    Examples
    --------
    >>> (channel,), factors = made_channels(["a"], "g")
    >>> channel.unit, factors
    ('m/s^2', (9.80665,))
    """
    marked = as_names(references)
    for what, named in (("reference", marked), ("unit of", units if isinstance(units, Mapping) else ())):
        if strangers := sorted(set(named).difference(names)):
            raise EstimateError(f"{what} {', '.join(strangers)}: no such channel; channels: {', '.join(names)}")
    scaled = [si_factor(unit) for unit in _units_of(names, units)]
    channels = tuple(
        Channel(name=name, unit=unit, role="reference" if name in marked else "response")
        for name, (_, unit) in zip(names, scaled, strict=True)
    )
    return channels, tuple(factor for factor, _ in scaled)


def _units_of(names: Sequence[str], units: Units) -> Sequence[str]:
    if isinstance(units, str):
        return [units] * len(names)
    if isinstance(units, Mapping):
        return [units.get(name, UNKNOWN) for name in names]
    if len(units) != len(names):
        raise EstimateError(f"{counted(len(units), 'unit')} for {counted(len(names), 'channel')}; give one for each")
    return units


def unit_direction(direction: str | Iterable[float]) -> Vector:
    """Turn ``"+x"`` ... ``"-z"`` or any non-zero vector into a unit vector.

    Examples
    --------
    >>> unit_direction("-y")
    (0.0, -1.0, 0.0)
    >>> unit_direction([0, 3, 4])
    (0.0, 0.6, 0.8)
    """
    if isinstance(direction, str):
        if direction not in AXES:
            raise SetupError(f"direction {shown(direction)} is none of {', '.join(AXES)}; or give a vector")
        return AXES[direction]
    try:
        components = [float(component) for component in direction]
    except OverflowError:
        components = [inf]
    largest = max(map(abs, components), default=0.0)
    if len(components) != 3 or not all(map(isfinite, components)) or largest == 0:
        raise SetupError(f"direction {shown(components)} must be three finite numbers, not all zero")
    # Squares of large numbers overflow, and those of small ones vanish; a power of two takes no digit.
    x, y, z = (ldexp(component, -frexp(largest)[1]) for component in components)
    length = sqrt(x**2 + y**2 + z**2)
    return (x / length, y / length, z / length)
