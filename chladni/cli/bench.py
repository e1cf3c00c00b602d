"""``chladni bench``: the virtual instruments in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output


@opens_files
def bench(
    instrument: Annotated[
        str | None,
        typer.Argument(
            metavar="INSTRUMENT", help="Open this instrument, or this model file; all are listed if not given."
        ),
    ] = None,
    *,
    port: Annotated[int, typer.Option(metavar="N", help="Port to serve at; 0 takes a free one.")] = 0,
    log: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="Log or data file to hold beside the simulation.", show_default=False),
    ] = None,
    opener: Opener,
    variants: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="CSV or TOML file of rows, each a variant; watched for new rows.", show_default=False
        ),
    ] = None,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = True,
) -> None:
    """Turn the knobs of simulated drives, dampers and structures, and watch what happens."""
    from chladni.apps.bench import open_bench
    from chladni.apps.model_sources import named_instrument
    from chladni.models.instruments.catalogue import INSTRUMENTS
    from chladni.signals.errors import SetupError

    chosen = None if instrument is None else named_instrument(instrument)
    if variants is not None and instrument is None:
        raise SetupError("--variants holds rows of one instrument's parameters; name it: chladni bench INSTRUMENT")
    if variants is not None and chosen is not None:
        from chladni.models.files.variants_file import read_variants

        # Told here, in the terminal; what goes wrong in the file later is told on the page.
        read_variants(variants, chosen.parameters, chosen.options)
    # The others' pages stay a click away, unless the file of rows is of this one's parameters.
    others = INSTRUMENTS if variants is None else {}
    named = {} if chosen is None else {chosen.name: chosen}
    server = open_bench({**named, **others, **named}.values(), port=port, log=log, reading=opener.options(),
                        variants=variants)  # fmt: skip
    address = server.address + ("" if chosen is None else chosen.name)
    out = Output()

    def tell() -> None:
        out.line(address)
        out.line("Only this computer can reach this address; Ctrl-C ends.")
        if open_page:
            import webbrowser

            webbrowser.open(address)

    server.run(tell)
