"""The first page: all instruments."""

from collections.abc import Iterable
from html import escape

from chladni.models.core.instrument import Instrument
from chladni.viewers.bench.theme import DARK, FONT, LIGHT

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>chladni bench</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">
<style>
:root {{ {light} }}
@media (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}
body {{ margin: 0; background: var(--c-page); color: var(--c-text); font-family: {font}; }}
main {{ max-width: 1000px; margin: 0 auto; padding: 48px 24px; }}
h1 {{ font-size: 30px; font-weight: 600; letter-spacing: -0.01em; margin: 0 0 4px; }}
p {{ color: var(--c-soft); margin: 0 0 28px; font-size: 14px; }}
ul {{ list-style: none; margin: 0; padding: 0; display: grid; gap: 12px;
  grid-template-columns: repeat(auto-fill, minmax(290px, 1fr)); }}
a {{ display: block; height: 100%; box-sizing: border-box; padding: 16px 18px; background: var(--c-card);
  border: 1px solid var(--c-line); border-radius: 8px; color: inherit; text-decoration: none; }}
a:hover {{ border-color: var(--c-accent); }}
a:focus-visible {{ outline: 2px solid var(--c-accent); outline-offset: 2px; }}
b {{ display: block; font-size: 16px; font-weight: 600; margin-bottom: 4px; }}
span {{ color: var(--c-soft); font-size: 13px; line-height: 1.45; }}
</style></head>
<body><main><h1>chladni bench</h1>
<p>Virtual instruments: turn a knob and watch. Only this computer can reach these pages.</p>
<ul>{items}</ul></main></body></html>
"""


def index_page(instruments: Iterable[Instrument]) -> str:
    """Give the page as HTML, without scripts."""
    items = "".join(
        f'<li><a href="/{escape(one.name)}"><b>{escape(one.title)}</b><span>{escape(_about(one))}</span></a></li>'
        for one in instruments
    )
    return _PAGE.format(light=LIGHT.variables(), dark=DARK.variables(), font=FONT, items=items)


def _about(instrument: Instrument) -> str:
    knobs, options = len(instrument.parameters), len(instrument.options)
    parts = [f"{knobs} knob{'s' if knobs != 1 else ''}"]
    if options:
        parts.append(", ".join(option.name.replace("_", " ") for option in instrument.options))
    return "; ".join(parts)
