"""HTML: the page around everything, and elements whose text is escaped by whoever makes it."""

import base64
import hashlib
import html
from collections.abc import Iterable, Sequence
from string import Template

from chladni import __version__
from chladni.signals.visible import visible

# No request leaves the page: pictures are data, and styles are inline. Of scripts those alone run that are told by
# their own sums, where a page has any.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; form-action 'none'; base-uri 'none'"

_STYLE = """
:root { color-scheme: light dark; --ink: #1a1d21; --soft: #5b6570; --line: #d9dee3;
  --ground: #ffffff; --band: #f5f7f9; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ea; --soft: #9aa4ae; --line: #343a41; --ground: #14171a; --band: #1c2024; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.5rem 4rem; max-width: 91rem; color: var(--ink); background: var(--ground);
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 1rem; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .7rem; padding-bottom: .3rem; border-bottom: 1px solid var(--line); }
p, ul { max-width: 72rem; }
ul { margin: 0; padding-left: 1.2rem; }
li { margin: .2rem 0; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; }
.scroll + ul { margin-top: .6rem; }
.scroll + .scroll { margin-top: 1rem; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .9rem .3rem .5rem; text-align: left; vertical-align: top;
  border-bottom: 1px solid var(--line); }
th { color: var(--soft); font-weight: 600; white-space: nowrap; }
tbody tr:nth-child(even) { background: var(--band); }
td.number { text-align: right; white-space: nowrap; }
th.number { text-align: right; }
.note { margin: .5rem 0 .8rem; color: var(--soft); font-size: .85rem; }
td { overflow-wrap: break-word; }
.figures { display: grid; grid-template-columns: minmax(0, 1fr); gap: 1rem; align-items: start; }
figure { margin: 0 0 1rem; padding: .6rem; border: 1px solid var(--line); border-radius: 6px; min-width: 0; }
.figures figure { margin: 0; }
figure img { display: block; width: 100%; height: auto; }
figure.square img { max-width: 40rem; }
figcaption { color: var(--soft); font-size: .8rem; padding-top: .3rem; }
figure + .scroll, .figures + .scroll, .pair + .scroll, .scroll + .figures, .scroll + figure, .figures + .figures,
.figures + figure, .figures + .pair { margin-top: 1rem; }
.plot { overflow-x: auto; overflow-y: hidden; }
@media (min-width: 64rem) {
  .pair { display: grid; grid-template-columns: minmax(0, 1fr) 26.5rem; gap: 1rem; align-items: start; }
}
code { font: .92em ui-monospace, "DejaVu Sans Mono", Consolas, monospace; }
details { margin: .6rem 0; }
summary { color: var(--soft); cursor: pointer; }
footer { margin-top: 3rem; color: var(--soft); font-size: .8rem; }
@media print {
  :root { --ink: #000000; --soft: #444444; --line: #bbbbbb; --ground: #ffffff; --band: #ffffff; color-scheme: light; }
  body { max-width: none; padding: 0; font-size: 10pt; }
  figure, tr { break-inside: avoid; }
  h2 { break-after: avoid; }
  .scroll { overflow: visible; }
}
"""

PAGE = Template(
    f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="$policy">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="referrer" content="no-referrer">
<title>$title</title>
<style>{_STYLE}</style>
</head>
<body>
$body
<footer>Made by chladni {__version__}.</footer>
$scripts</body>
</html>
"""
)


def page(title: str, body: str, scripts: Sequence[str] = ()) -> str:
    """Give a whole page; `scripts` are the page's own, and no others will run.

    Parameters
    ----------
    title
        Any text; it's escaped here.
    body
        HTML.
    scripts
        Texts of scripts, which hold nothing that came from a log.
    """
    sums = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(one.encode()).digest()).decode()}'" for one in scripts)
    return PAGE.substitute(
        title=escaped(title),
        body=body,
        policy=f"{POLICY}; script-src {sums}" if sums else POLICY,
        scripts="".join(f"<script>{one}</script>\n" for one in scripts),
    )


def escaped(text: str) -> str:
    """Make any text safe inside an element or a quoted attribute; what can't be seen is shown as an escape.

    Examples
    --------
    >>> escaped('<script> & "quotes"')
    '&lt;script&gt; &amp; &quot;quotes&quot;'
    """
    # Quotes too, so that the same function serves attributes.
    return html.escape(visible(text))


def element(name: str, content: str, **attributes: str) -> str:
    """Give an element around `content`, which is HTML; the values of attributes are escaped here.

    Examples
    --------
    >>> element("td", "1", title='"')
    '<td title="&quot;">1</td>'
    """
    given = "".join(f' {key.rstrip("_")}="{escaped(value)}"' for key, value in attributes.items())
    return f"<{name}{given}>{content}</{name}>"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Iterable[int] = ()) -> str:
    """Give a table of texts, which are escaped here; columns whose places are in `numbers` are set right.

    Returns
    -------
    str
        Empty when there are no rows.
    """
    right = set(numbers)

    def line(kind: str, texts: Sequence[str]) -> str:
        cells = (
            element(kind, escaped(text), **({"class_": "number"} if place in right else {}))
            for place, text in enumerate(texts)
        )
        return element("tr", "".join(cells))

    body = "".join(line("td", row) for row in rows)
    if not body:
        return ""
    return element(
        "div", element("table", element("thead", line("th", headings)) + element("tbody", body)), class_="scroll"
    )
