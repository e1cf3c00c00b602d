"""A whole page around an instrument or a picking: heading, look, life of the session."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bokeh.io import curdoc
from bokeh.themes import Theme as ChartTheme
from jinja2 import Template

from chladni.models.core.instrument import Instrument
from chladni.signals.visible import visible
from chladni.viewers.bench.instrument_page import InstrumentPage, heading
from chladni.viewers.bench.parts import column, html, pn
from chladni.viewers.bench.picked import Picking
from chladni.viewers.bench.picking_page import PickingPage
from chladni.viewers.bench.theme import FONT, Ground, theme
from chladni.viewers.bench.tile import TICK_JS
from chladni.viewers.bench.tools import Tools
from chladni.viewers.bench.words import escape

_FRAME_CSS = """
:host {
  VARIABLES
  background: var(--c-page); color: var(--c-text); font-family: FONT; font-size: 13px;
  padding: 10px 12px; box-sizing: border-box; height: max(100vh, 600px) !important;
  min-height: 0 !important;
}
"""
_HEAD_CSS = """
.head { display: flex; gap: 16px; align-items: baseline; color: var(--c-soft); }
.head h1 { font-size: 17px; font-weight: 600; color: var(--c-text); margin: 0; }
.head .grow { flex: 1; }
"""
#: The page around its parts; what is told of a point under the cursor stands outside of them. Panel's own page has
#: scripts inside, which the server's policy for content forbids.
_PAGE = Template(
    """<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>{{ heading }}</title><link rel="icon" href="data:,">
<style>html, body { display: flow-root; box-sizing: border-box; height: 100%; margin: 0; padding: 0; }
:root { {{ colours | safe }} }
.bk-Tooltip { background: var(--c-card); color: var(--c-text); border-color: var(--c-line);
  --tooltip-arrow-color: var(--c-line); --tooltip-arrow-inner-color: var(--c-card); }</style>
{{ bokeh_css | safe }}
{% for address in addresses(bokeh_js) %}
<script src="{{ address }}"></script>
{% endfor %}
</head>
<body>
{% for root in doc.roots %}
<div id="{{ root.elementid }}" data-root-id="{{ root.id }}" style="display: contents;"></div>
{% endfor %}
<script type="application/json" id="chladni">{{ [doc.to_json()] | tojson }}</script>
<script src="/start.js"></script>
</body>
</html>
""",
    autoescape=True,
)
#: Style comes after the first layout, and a message later: text grows, and charts shrink beside it. Bokeh's parts
#: then note the new sizes of the parts in them, but lay out anew only where their own has changed too.
_LAYOUT_JS = """
let parts = Bokeh.Models.Row.prototype.default_view.prototype;
while (!Object.hasOwn(parts, "layoutable_views")) { parts = Object.getPrototypeOf(parts); }
const any_part = Object.getPrototypeOf(parts);
parts.update_bbox = function () {
  // All of them, whatever the first says.
  const changed = [...this.layoutable_views.map((part) => part.update_bbox()), any_part.update_bbox.call(this)];
  if (this.layout != null) { this.layout.visible = this.is_displayed; }
  return changed.includes(true);
};
"""
#: That policy forbids functions made of text too: here is that of the ticks. In a notebook Bokeh makes it.
START_JS = (
    "Bokeh.Models.CustomJSTickFormatter.prototype.doFormat = (all) => all.map((tick, index, ticks) => {"
    f"{TICK_JS}}});\n{_LAYOUT_JS}"
    # Bokeh's colours are the server's: a dark screen is sent to the dark page, unless the address says.
    "const asked = new URL(location.href);\n"
    'if (!asked.searchParams.has("theme") && matchMedia("(prefers-color-scheme: dark)").matches) {\n'
    '  asked.searchParams.set("theme", "dark");\n'
    "  location.replace(asked);\n"
    "} else {\n"
    '  Bokeh.embed.embed_items("{}", JSON.parse(document.getElementById("chladni").textContent));\n'
    "}\n"
)


def page_maker(
    instrument: Instrument, tools: Tools, *, log: Path | None = None, variants: Path | None = None
) -> Callable[[], Any]:
    """Give the function that makes a page for each visitor."""

    def make() -> Any:
        document, ground = dressed(instrument.title)
        page = InstrumentPage(instrument, tools, document=document, ground=ground, log=log, variants=variants)
        # Threads and private files end with the page.
        document.on_session_destroyed(lambda _context: page.close())
        return framed(page.view(), heading(instrument, ground), ground)

    return make


def picking_maker(picking: Picking, keep: Callable[[], None]) -> Callable[[], Any]:
    """Give the function that makes the page of a picking for each visitor; `keep` is called when it's kept."""

    def make() -> Any:
        document, ground = dressed(f"Modes of {picking.title}")
        page = PickingPage(picking, document=document, ground=ground, keep=keep)
        document.on_session_destroyed(lambda _context: page.close())
        return framed(page.view(), picking_heading(picking, ground), ground)

    return make


def picking_heading(picking: Picking, ground: Ground) -> str:
    """Give the line above a picking: name, other ground, and who can reach it."""
    other = theme(ground).other
    return (
        f'<div class="head"><h1>Modes of {escape(picking.title)}</h1><span class="grow"></span>'
        f'<span>only this computer can reach this page</span><a href="?theme={other}">{other}</a></div>'
    )


def dressed(title: str) -> tuple[Any, Ground]:
    """Give the document of the page that is being made, with look and title, and the ground that was asked for."""
    document = curdoc()
    # In the address, so that a reload and a bookmark keep it.
    ground = wanted_ground(pn.state.session_args.get("theme", []))
    # Inside the page's function: the look belongs to this document, not to the program.
    document.theme = ChartTheme(json=theme(ground).of_charts())
    document.template = _PAGE
    document.template_variables.update(
        heading=f"{visible(title)} · chladni", addresses=script_addresses, colours=theme(ground).variables()
    )
    return document, ground


def script_addresses(tags: str) -> list[str]:
    """Give the addresses in Panel's script tags, without the loader of modules: it makes scripts of text."""
    return [address for address in re.findall(r'src="([^"]+)"', tags) if "es-module-shims" not in address]


def wanted_ground(words: list[bytes]) -> Ground:
    """Ground that the address asks for; light unless it says dark."""
    return "dark" if words[:1] == [b"dark"] else "light"


def framed(view: Any, head: str, ground: Ground) -> Any:
    """Put heading and look around the parts of a page."""
    # On the outermost part and not on the document: in a notebook the rest isn't ours.
    look = _FRAME_CSS.replace("VARIABLES", theme(ground).variables()).replace("FONT", FONT)
    return column(html(head, _HEAD_CSS, margin=(0, 0, 8, 0)), view, sizing_mode="stretch_both", stylesheets=[look])
