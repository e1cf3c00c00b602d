"""``chladni convert``: files of other programs to MCAP and back."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files, parse_options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import count, number

if TYPE_CHECKING:
    from chladni.io.convert import Conversion


@opens_files
def convert(
    source: Annotated[
        Path, typer.Argument(metavar="IN", help="An MCAP log, or a data file of any kind that is read.")
    ],
    target: Annotated[
        Path,
        typer.Argument(metavar="OUT", help="Its suffix tells the kind: mcap, csv, txt, wav, mat, npz, uff, unv."),
    ],
    *,
    channel: options.Channels = None,
    start: options.Start = None,
    end: options.End = None,
    resample: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Bring all channels to this rate.", show_default=False),
    ] = None,
    join: options.Join = "auto",
    layout: Annotated[
        Literal["messages", "batches"] | None,
        typer.Option(help="Of a log: a message a sample, or blocks of samples.", show_default=False),
    ] = None,
    opener: Opener,
    write: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="An option of the writer; may be repeated.", show_default=False),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")] = False,
    json: options.Json = None,
) -> None:
    """Convert data files to MCAP and back.

    For example --read time_unit=ms --read names=time,force,tip --read units=force:N,tip:g of a csv file, or --write
    binary=false of a universal file.
    """
    from chladni.io.convert import convert as convert_file
    from chladni.io.log_info import unread_sentences
    from chladni.signals.wording import counted

    require_places(reads=[source, opener.setup], writes={"OUT": target, "--json": json})
    out = Output(json)
    written = convert_file(
        source,
        target,
        channels=channel,
        start_s=start,
        end_s=end,
        resample_hz=resample,
        join=join,
        layout=layout,
        overwrite=overwrite,
        reading=opener.options(),
        writing=parse_options(write or (), "--write"),
    )
    out.line(
        f"wrote {written.target}: {counted(len(written.channels), 'channel')}, samples: {count(written.samples)}, "
        f"{number(written.duration_s, digits=6)} s"
    )
    out.lines((*written.notes, *unread_sentences(one for one in written.unread if not one.complete), *written.losses))
    out.json(_document, written)


def _document(written: "Conversion") -> dict[str, Any]:
    return {
        "format": "chladni.convert/1",
        "source": str(written.source),
        "target": str(written.target),
        "channels": list(written.channels),
        "samples": written.samples,
        "duration_s": written.duration_s,
        "notes": list(written.notes),
        "losses": list(written.losses),
        "unread": [one.to_json() for one in written.unread],
    }
