"""Colours of a report's pictures on a light page, and those that take their places on a dark one."""

import re

from chladni.viewers.style import ON_DARK, ON_LIGHT, STATUS_ON_DARK, STATUS_ON_LIGHT, Colour

#: Words, numbers of axes, grid: those of the page's own style.
INK, SOFT, FAINT = "#1a1d21", "#5b6570", "#e3e7eb"
# Paper itself, through which a dark page shows.
WHITE = "#ffffff"


def _hex(colour: Colour) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


#: Colours on a light page, with those on a dark one; any other grey is turned over there.
DARK: dict[str, str] = {
    **{_hex(one): _hex(other) for one, other in zip(STATUS_ON_LIGHT, STATUS_ON_DARK, strict=True)},
    **{_hex(one): _hex(other) for one, other in zip(ON_LIGHT, ON_DARK, strict=True)},
    INK: "#e4e7ea",
    SOFT: "#9aa4ae",
    FAINT: "#2b3138",
}

_HEX = re.compile(r"#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})")
# Parts of a colour that differ by less are a grey to the eye.
GREY = 24


def on_dark(colour: str) -> str:
    """Give the colour that takes a light page's place on a dark one; what is neither known nor grey stays.

    Examples
    --------
    >>> on_dark("#0072b2"), on_dark("#000000"), on_dark("#ff0000")
    ('#56b4e9', '#f9f9f9', '#ff0000')
    """
    if colour in DARK:
        return DARK[colour]
    parts = [int(part, 16) for part in _HEX.fullmatch(colour).groups()]  # type: ignore[union-attr]
    if max(parts) - min(parts) > GREY:
        return colour
    return "#" + "".join(f"{round(40 + 0.82 * (255 - part)):02x}" for part in parts)


def with_dark_scheme(svg: str) -> str:
    """Let a picture of matplotlib's follow the scheme of the reader's screen."""
    rules = ["svg { fill: #e4e7ea; }"]
    for colour in sorted({found.group(0) for found in _HEX.finditer(svg)}):
        dark = "none" if colour == WHITE else on_dark(colour)
        if dark != colour:
            rules += [f'[style*="{kind}: {colour}"] {{ {kind}: {dark} !important; }}' for kind in ("fill", "stroke")]
    style = f"<style>@media screen and (prefers-color-scheme: dark) {{ {' '.join(rules)} }}</style>"
    # Behind the opening tag, which matplotlib writes once.
    head, tag, rest = svg.partition("<defs>")
    return f"{head}{style}{tag}{rest}"
