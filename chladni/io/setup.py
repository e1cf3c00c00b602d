"""Setup file: where the sensors sit, what they measure, and how unusual messages are to be read."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chladni.io.batch_messages import BatchLayout
from chladni.io.toml_reader import read_toml, tables
from chladni.signals.channel import Channel, Role, Vector, unit_direction
from chladni.signals.errors import SetupError
from chladni.signals.geometry import Geometry, Point
from chladni.signals.unit_labels import quantity_of_name, read_label
from chladni.signals.unit_text import in_unit
from chladni.signals.units import parse_quantity, quantity_by, quotient, si_factor
from chladni.signals.wording import near_matches, shown

if TYPE_CHECKING:
    from chladni.io.setup_file import BatchTable, ChannelTable
    from chladni.io.toml_reader import TomlMistakes

SETUP_FORMAT: Final = "chladni.setup/1"

#: What the electrical output of a sensor is measured in; the unit a sensitivity divides out.
ELECTRICAL: Final = ("V", "A", "C")


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSetup:
    """What a setup file says about one channel; None leaves what the log says.

    Attributes
    ----------
    path
        Message path.
    place
        ``file:line`` of the table, for messages.
    unit
        Unit of the numbers in the log.
    sensitivity
        Electrical output for one SI unit of what is measured, with its SI unit.
    overload
        Largest magnitude the sensor can tell, with its SI unit.
    point, direction, role
        As in `Channel`.
    """

    path: str
    place: str
    unit: str | None = None
    sensitivity: tuple[float, str] | None = None
    overload: tuple[float, str] | None = None
    point: str | None = None
    direction: Vector | None = None
    role: Role | None = None

    def si_unit(self, factor: float, unit: str) -> tuple[float, str]:
        """Factor and SI unit of the channel, from those the log alone would give.

        Raises
        ------
        SetupError
            When a sensitivity is given for a log that isn't in volts, amperes or coulombs, or a unit has several
            meanings and nothing tells which.
        """
        if self.unit is not None:
            factor, unit = self._stated(self.unit, unit)
        if self.sensitivity is None:
            return factor, unit
        if unit == "1":
            # Nothing said: a log that needs a sensitivity is one of voltages.
            unit = "V"
        if unit not in ELECTRICAL:
            raise SetupError(
                f"{self.place}: {self.path} sensitivity: the log is in {unit}, and a sensitivity is for V, A or C; "
                'leave it out, or say unit = "V" if that is what the log holds'
            )
        per_unit, sensitivity_unit = self.sensitivity
        return factor / per_unit, quotient(unit, sensitivity_unit)

    def _stated(self, label: str, unit: str) -> tuple[float, str]:
        """Read a unit as a label: what lb means is settled by the unit of the log, else by the channel's name."""
        try:
            return read_label(label, quantity=quantity_of_name(self.path) if unit == "1" else unit)
        except SetupError as error:
            raise SetupError(f"{self.place}: {self.path} unit: {error}") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """What a setup file says.

    Attributes
    ----------
    path
        The file, for messages.
    geometry
        Points and the lines between them.
    channels
        In the order of the file.
    batches
        Layout of batch messages, by topic.
    """

    path: str = ""
    geometry: Geometry = field(default_factory=Geometry)
    channels: tuple[ChannelSetup, ...] = ()
    batches: Mapping[str, BatchLayout] = field(default_factory=dict)


def refined(channel: Channel, factor: float, setup: ChannelSetup) -> tuple[Channel, float]:
    """Refine a channel, and the factor from its numbers to SI, by what the setup file says of it.

    Raises
    ------
    SetupError
        When sensitivity or range don't fit the channel's unit.
    """
    factor, unit = setup.si_unit(factor, channel.unit)
    overload = channel.overload
    if setup.overload is not None:
        overload, overload_unit = setup.overload
        if overload_unit != unit:
            raise SetupError(
                f"{setup.place}: {setup.path} range: it is {in_unit(overload_unit)}, the channel {in_unit(unit)}; "
                "give the range in the channel's unit, or the channel's unit"
            )
    told = replace(
        channel,
        unit=unit,
        point=setup.point or channel.point,
        direction=setup.direction or channel.direction,
        role=setup.role or channel.role,
        overload=overload,
        # What is stated for this very channel goes before what its type is documented to hold.
        units_possible=() if setup.unit or setup.sensitivity else channel.units_possible,
    )
    return told, factor


def load_setup(path: Path | str) -> Setup:
    """Read a setup file.

    Raises
    ------
    SetupError
        With a line for each mistake: ``file:line: table key: found; rule``.
    """
    from chladni.io.setup_file import SetupFile

    content, document = read_toml(Path(path), SetupFile, kind=SetupError, check=_check_references)
    return Setup(
        path=str(path),
        geometry=Geometry(
            points=tuple(Point(name=point.name, position=point.position) for point in content.point),
            lines=tuple(tuple(line.points) for line in content.line),
        ),
        channels=tuple(
            _channel(table, document.place(("channel", index))) for index, table in enumerate(content.channel)
        ),
        batches={table.topic: batch_layout(table) for table in content.batch},
    )


def _channel(table: "ChannelTable", place: str) -> ChannelSetup:
    return ChannelSetup(
        path=table.path,
        place=place,
        unit=table.unit,
        sensitivity=None if table.sensitivity is None else quantity_by(table.sensitivity, read_label),
        overload=None if table.range is None else quantity_by(table.range, read_label),
        point=table.point,
        direction=None if table.direction is None else unit_direction(table.direction),
        role=table.role,
    )


def batch_layout(table: "BatchTable") -> BatchLayout:
    """Turn a ``[[batch]]`` table into the layout of its messages."""
    inverse = table.rate is not None
    said = table.rate if table.rate is not None else table.dt
    if said is None:
        raise AssertionError("the model asks for rate or dt")
    factor, _ = si_factor(table.rate_unit if inverse else table.dt_unit)
    if isinstance(said, str) and said[:1].isdigit():
        said, factor = parse_quantity(said)[0], 1.0
    return BatchLayout(
        samples=(table.samples,) if isinstance(table.samples, str) else tuple(table.samples),
        period=said,
        period_unit=factor,
        inverse=inverse,
        stamp=table.stamp,
        names=table.names if table.names is None or isinstance(table.names, str) else tuple(table.names),
        order=table.layout,
        count=table.count,
        scale=table.scale,
        unit=table.unit,
        why="as the setup file lays it out",
    )


def _check_references(content: dict[str, Any], mistakes: "TomlMistakes") -> None:
    """Names that must be unique, and names that must be defined."""
    points = dict.fromkeys(str(point.get("name")) for _, point in tables(content, "point"))
    for table, key in (("point", "name"), ("channel", "path"), ("batch", "topic")):
        _check_unique(content, table, key, mistakes)
    for index, line in tables(content, "line"):
        listed = line.get("points")
        for position, name in enumerate(listed if isinstance(listed, list) else ()):
            if isinstance(name, str) and name not in points:
                mistakes.add(("line", index, "points", position), _no_point(name, points))
    for index, channel in tables(content, "channel"):
        name = channel.get("point")
        if isinstance(name, str) and name not in points:
            mistakes.add(("channel", index, "point"), _no_point(name, points))


def _check_unique(content: dict[str, Any], table: str, key: str, mistakes: "TomlMistakes") -> None:
    seen = set()
    for index, one in tables(content, table):
        name = one.get(key)
        if isinstance(name, str) and name in seen:
            told = f"found {shown(name)} a second time; one table [[{table}]] for each {key}"
            mistakes.add((table, index, key), told)
        seen.add(str(name))


def _no_point(name: str, points: Collection[str]) -> str:
    return f"found {shown(name)}, which is no point; {near_matches(name, points)}"
