"""The first page: all instruments."""

import re
from collections.abc import Iterable
from dataclasses import replace
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
h2 {{ font-size: 17px; font-weight: 600; margin: 36px 0 12px; }}
.many {{ grid-template-columns: repeat(auto-fill, minmax(220px, 1fr)); gap: 8px; }}
.many a {{ padding: 10px 12px; }}
.many b {{ font-size: 14px; margin: 0; }}
span {{ color: var(--c-soft); font-size: 13px; line-height: 1.45; }}
</style></head>
<body><main><h1>chladni bench</h1>
<p>Virtual instruments: turn a knob and watch. Only this computer can reach these pages.</p>
{groups}</main></body></html>
"""


#: From so many on, instruments of one kind (the word before the dash) stand apart, in smaller cards.
MANY = 5


def index_page(instruments: Iterable[Instrument]) -> str:
    """Give the page as HTML, without scripts."""
    kinds: dict[str, list[Instrument]] = {}
    for one in instruments:
        kinds.setdefault(one.name.partition("-")[0], []).append(one)
    # Forty elements would bury six drives.
    single = [one for kind in kinds.values() if len(kind) < MANY for one in kind]
    groups = f"<ul>{''.join(_card(one, _about(one)) for one in single)}</ul>" if single else ""
    for kind, members in kinds.items():
        if len(members) >= MANY:
            groups += (
                f"<h2>{escape(kind.capitalize())}s</h2><ul class=many>{''.join(_small(one) for one in members)}</ul>"
            )
    return _PAGE.format(light=LIGHT.variables(), dark=DARK.variables(), font=FONT, groups=groups)


def _small(instrument: Instrument) -> str:
    # A name, then what it is or its transfer function.
    title, *rest = re.split(r"[,:] ", instrument.title, maxsplit=1)
    return _card(replace(instrument, title=title), *rest)


def _card(instrument: Instrument, words: str = "") -> str:
    return (
        f'<li><a href="/{escape(instrument.name)}"><b>{escape(instrument.title)}</b>'
        f"<span>{escape(words)}</span></a></li>"
    )


def _about(instrument: Instrument) -> str:
    knobs, options = len(instrument.parameters), len(instrument.options)
    parts = [f"{knobs} knob{'s' if knobs != 1 else ''}"]
    if options:
        parts.append(", ".join(option.name.replace("_", " ") for option in instrument.options))
    return "; ".join(parts)
