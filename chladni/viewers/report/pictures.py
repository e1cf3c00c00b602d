"""The report's figures, as data inside the page."""

import base64

from chladni.viewers.figures import Album
from chladni.viewers.report.markup import element, escaped

_SIGMA = "Shaded: one sigma of the random error."


def pictures(album: Album) -> dict[str, str]:
    """Give the figures as HTML, by the heading of their section; sections without figures are left out."""
    # Each magnitude beside its Nyquist plot.
    pairs = zip(album.sections["responses"], album.sections["nyquist"], strict=True)
    sections = {
        "Frequency responses": (
            [name for pair in pairs for name in pair],
            f"{_SIGMA} Lines that nothing excites are left out.",
        ),
        "Power spectral densities": (album.sections["densities"], f"One-sided. {_SIGMA}"),
        "Waterfalls": (album.sections["waterfalls"], "Grey: samples are missing."),
        "Waveforms": (album.sections["waveforms"], "Long records are drawn by the extremes of each stretch."),
    }
    return {
        heading: element("div", "".join(_picture(album, name, caption) for name in names), class_="figures")
        for heading, (names, caption) in sections.items()
        if names
    }


def _picture(album: Album, name: str, caption: str) -> str:
    # A picture in an <img> can't run scripts, whatever it holds, and its ids don't clash with those of another.
    data = base64.b64encode(album.rendered(name, "svg")).decode("ascii")
    image = f'<img alt="{escaped(name)}" src="data:image/svg+xml;base64,{data}">'
    return element("figure", image + element("figcaption", escaped(caption)))
