"""Pages of the virtual instruments and of picking modes; the only room that knows Panel and Bokeh.

Importing it loads neither: they take a second, and they are an extra that may be missing.
"""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chladni.signals.visible import visible
from chladni.viewers.bench.toolkit import load_toolkit

if TYPE_CHECKING:
    from collections.abc import Iterable

    from chladni.models.core.instrument import Instrument
    from chladni.viewers.bench.picked import Picking
    from chladni.viewers.bench.server import BenchServer
    from chladni.viewers.bench.theme import Ground
    from chladni.viewers.bench.tools import Tools


def instrument_panel(
    instrument: "Instrument",
    tools: "Tools",
    *,
    ground: "Ground" = "light",
    log: Path | None = None,
    variants: Path | None = None,
) -> Any:
    """Give the page of an instrument as a Panel object, for a notebook or a dashboard of one's own.

    Parameters
    ----------
    instrument
        What to make a page of.
    tools
        What the page calls, see `chladni.apps.bench.tools`.
    ground
        ``light`` or ``dark``.
    log
        A measured log to hold beside the simulation.
    variants
        A CSV or TOML file of rows, each a variant; it is read once, since a notebook keeps no time.

    Raises
    ------
    SetupError
        When Panel isn't installed.
    """
    load_toolkit()
    from chladni.viewers.bench.instrument_page import InstrumentPage, heading
    from chladni.viewers.bench.page import framed

    page = InstrumentPage(instrument, tools, ground=ground, log=log, variants=variants)
    return framed(page.view(), heading(instrument, ground), ground)


def picking_panel(picking: "Picking", *, ground: "Ground" = "light") -> Any:
    """Give the page of a picking as a Panel object.

    Raises
    ------
    SetupError
        When Panel isn't installed.
    """
    load_toolkit()
    from chladni.viewers.bench.page import framed, picking_heading
    from chladni.viewers.bench.picking_page import PickingPage

    return framed(PickingPage(picking, ground=ground).view(), picking_heading(picking, ground), ground)


def serve_picking(picking: "Picking", *, port: int = 0) -> "BenchServer":
    """Give a server of the page of a picking, bound to this computer; its ``run`` ends when it's kept.

    Raises
    ------
    SetupError
        When Panel isn't installed, or the port can't be had.
    """
    load_toolkit()
    from chladni.viewers.bench.page import picking_maker
    from chladni.viewers.bench.server import BenchServer

    index = _INDEX.format(title=escape(visible(picking.title)))
    server: BenchServer
    server = BenchServer({"modes": picking_maker(picking, lambda: server.stop())}, index=index, port=port)
    return server


_INDEX = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>chladni modes</title><link rel="icon" href="data:,"></head>
<body style="font-family: sans-serif; margin: 3em"><p><a href="/modes">Pick modes of {title}</a></p></body></html>
"""


def serve(
    instruments: "Iterable[Instrument]",
    tools: "Tools",
    *,
    port: int = 0,
    log: Path | None = None,
    variants: Path | None = None,
) -> "BenchServer":
    """Give a server of the pages of these instruments, bound to this computer; its ``run`` serves.

    Raises
    ------
    SetupError
        When Panel isn't installed, or the port can't be had.
    """
    load_toolkit()
    from chladni.viewers.bench.index_page import index_page
    from chladni.viewers.bench.page import page_maker
    from chladni.viewers.bench.server import BenchServer

    shown = list(instruments)
    pages = {one.name: page_maker(one, tools, log=log, variants=variants) for one in shown}
    return BenchServer(pages, index=index_page(shown), port=port)
