"""How a command opens the files that it reads: options that all of them share, as one value."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, is_dataclass
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from chladni.signals.text_reading import real_number

if TYPE_CHECKING:
    from chladni.io.log import Log

OptionValue = str | float | bool | list[str] | dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Opener:
    """Opens logs and data files as the options of a command say; what wasn't given is left to the file."""

    setup: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Setup file: points, directions, units, sensitivities.", show_default=False
        ),
    ] = None
    stamp: Annotated[
        Literal["auto", "header", "publish", "log"],
        typer.Option(help="Of an MCAP log, the time of a sample: its own stamp, when published, when logged."),
    ] = "auto"
    rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ", help="True rate of the samples, where the file doesn't say it.", show_default=False
        ),
    ] = None
    time: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Of a data file, the column of times; none: none is.", show_default=False),
    ] = None
    time_unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT",
            help="What its times count: s, ms, us, ns, min, h, days, excel or datenum.",
            show_default=False,
        ),
    ] = None
    read: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Of a data file, an option of its reader, such as units=force:N; may be repeated.",
            show_default=False,
        ),
    ] = None

    def __call__(self, path: Path) -> "Log":
        """Open a log or a data file."""
        from chladni.io.log import open_log

        return open_log(path, **self.options())

    def among(self, paths: Sequence[Path]) -> "Callable[[Path], Log]":
        """Give what opens each of several files; where logs stand beside data files, by the options for its kind."""
        from chladni.io.files.formats import MCAP, file_kind
        from chladni.io.log import open_log

        if len({file_kind(path) == MCAP for path in paths}) < 2:
            return self
        given = self.options()
        of_messages = {name: value for name, value in given.items() if name in ("setup", "stamp", "sample_rate_hz")}
        of_rows = {name: value for name, value in given.items() if name != "stamp"}
        return lambda path: open_log(path, **(of_messages if file_kind(path) == MCAP else of_rows))

    def options(self) -> dict[str, Any]:
        """Give what was said, by the names that `chladni.io.log.open` has for it."""
        said = {
            "setup": self.setup,
            "stamp": None if self.stamp == "auto" else self.stamp,
            "sample_rate_hz": self.rate,
            "time": self.time,
            "time_unit": self.time_unit,
        }
        given = {name: value for name, value in said.items() if value is not None}
        return parse_options(self.read or (), "--read") | given


def opens_files(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of its groups (`Opener`, and those of `chladni.cli.options`), in their place.

    The argument that stands for a group gets it filled. An option that the command has itself goes to both.
    """
    own = signature(command).parameters
    groups: dict[str, Any] = {name: one.annotation for name, one in own.items() if is_dataclass(one.annotation)}
    shared = {name: signature(group).parameters for name, group in groups.items()}

    @wraps(command)
    def with_options(*given: Any, **named: Any) -> None:
        bound = whole.bind(*given, **named)
        bound.apply_defaults()
        filled = {
            name: group(**{option: bound.arguments[option] for option in shared[name]})
            for name, group in groups.items()
        }
        command(**{name: bound.arguments[name] for name in own if name not in groups}, **filled)

    parameters = [
        one
        for name, outer in own.items()
        for one in (shared[name].values() if name in groups else [outer])
        if one is outer or one.name not in own
    ]
    # Typer reads options off both.
    whole = signature(command).replace(parameters=parameters)
    with_options.__dict__["__signature__"] = whole
    with_options.__annotations__ = {one.name: one.annotation for one in parameters}
    return with_options


def parse_options(texts: Sequence[str], flag: str) -> dict[str, OptionValue]:
    """Read ``name=value`` pairs; values that look like numbers or truth values are those.

    ``names`` is a list with commas, ``units`` one of ``column:unit``.

    Examples
    --------
    >>> parse_options(["time_unit=ms", "binary=false"], "--read")
    {'time_unit': 'ms', 'binary': False}
    >>> parse_options(["names=t,force", "units=force:N"], "--read")
    {'names': ['t', 'force'], 'units': {'force': 'N'}}
    """
    pairs: dict[str, OptionValue] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.isidentifier():
            raise typer.BadParameter(f"{flag} {text!r} is not of the form NAME=VALUE")
        pairs[name] = _LISTS.get(name, _value)(value)
    return pairs


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _units(text: str) -> dict[str, str]:
    # A column's name may hold a colon, a unit doesn't.
    pairs = [entry.rpartition(":") for entry in _names(text)]
    if any(not column or not unit for column, _, unit in pairs):
        raise typer.BadParameter(f"units {text!r} are not of the form COLUMN:UNIT,COLUMN:UNIT")
    return {column: unit for column, _, unit in pairs}


_LISTS: dict[str, Callable[[str], OptionValue]] = {"names": _names, "units": _units}


def _value(text: str) -> str | float | bool:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return real_number(text)
    except ValueError:
        return text
