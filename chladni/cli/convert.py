"""``chladni convert``: files of other programs to MCAP and back."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import count, number

OptionValue = str | float | bool | list[str] | dict[str, str]

Option = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=VALUE", help="Option of the file's reader or writer; may be repeated.", show_default=False
    ),
]


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="mcap, csv, txt, wav, mat, npz, uff or unv.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The same kinds, told by the suffix.")],
    *,
    channel: options.Channels = None,
    start: options.Start = None,
    end: options.End = None,
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Bring all channels to this rate; of a file without times: its rate."),
    ] = None,
    layout: Annotated[
        Literal["messages", "batches"] | None,
        typer.Option(help="Of a log: a message a sample, or blocks of samples.", show_default=False),
    ] = None,
    time: options.Time = None,
    time_unit: options.TimeUnit = None,
    read: Option = None,
    write: Option = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")] = False,
    json: options.Json = None,
) -> None:
    """Convert the files of other programs to MCAP and back.

    For example --time-unit ms --read names=time,force,tip --read units=force:N,tip:g of a csv file, or --write
    binary=false of a universal file.
    """
    from chladni.io.convert import convert as convert_file
    from chladni.signals.wording import counted

    require_places(reads=[source], writes={"OUT": target, "--json": json})
    out = Output(json)
    written = convert_file(
        source,
        target,
        channels=channel,
        start_s=start,
        end_s=end,
        sample_rate_hz=rate,
        layout=layout,
        overwrite=overwrite,
        reading=parse_options(read or (), "--read") | options.reading(time, time_unit),
        writing=parse_options(write or (), "--write"),
    )
    out.line(
        f"wrote {written.target}: {counted(len(written.channels), 'channel')}, samples: {count(written.samples)}, "
        f"{number(written.duration_s, digits=6)} s"
    )
    out.lines((*written.notes, *(f"{name}: not read: {reason}." for name, reason in written.unread), *written.losses))
    out.json(
        {
            "format": "chladni.convert/1",
            "source": str(written.source),
            "target": str(written.target),
            "channels": list(written.channels),
            "samples": written.samples,
            "duration_s": written.duration_s,
            "notes": list(written.notes),
            "losses": list(written.losses),
            "unread": [{"name": name, "reason": reason} for name, reason in written.unread],
        }
    )


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
        return float(text)
    except ValueError:
        return text
