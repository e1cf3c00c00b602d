"""The report's figures: plots that zoom where Bokeh is installed, else pictures; as data inside the page."""

import base64
from collections.abc import Sequence
from importlib.util import find_spec

from chladni.signals.errors import SetupError
from chladni.viewers.figures import Album
from chladni.viewers.figures.sheet import WIDTH_IN
from chladni.viewers.report.markup import element, escaped
from chladni.viewers.screen_colours import with_dark_scheme

_SIGMA = "Shaded: one sigma of the random error."
_BEARING = "Dashed: frequencies of the bearing, and their multiples."
_MASKED = f"{_SIGMA} Lines that nothing excites are left out."


class Pictures:
    """Gives the figures of a page, and what the page must hold for them.

    Parameters
    ----------
    albums
        All of the page's figures.
    interactive
        Whether figures become plots that zoom and read out; None for where Bokeh is installed.
    """

    def __init__(self, *albums: Album, interactive: bool | None = None) -> None:
        self._items = None
        installed = find_spec("bokeh") is not None
        if interactive and not installed:
            raise SetupError("plots that zoom need Bokeh: pip install 'chladni[bench]', or leave interactive out")
        if installed if interactive is None else interactive:
            from chladni.viewers.interactive import PlotItems

            self._items = PlotItems(*albums)

    def scripts(self) -> Sequence[str]:
        """Give the page's scripts; none where there is no plot."""
        if self._items is None or not self._items.count:
            return ()
        from chladni.viewers.interactive import START, library

        return (library(), START)

    def figure(self, album: Album, name: str, caption: str) -> str:
        """Give one figure with its caption."""
        plot = None if self._items is None else self._items.plot(album.figures[name])
        told = element("figcaption", escaped(caption)) if caption else ""
        if plot is not None and self._items is not None:
            item, height, width = plot
            data = f'<script type="application/json">{item}</script>'
            place = element("div", "", id=f"plot-{self._items.count}")
            size = f"min-height: {height}px" + ("" if width is None else f"; max-width: {width}px")
            shown = element("div", place + data, class_="plot", style=size)
            return element("figure", shown + told)
        svg = with_dark_scheme(album.rendered(name, "svg").decode())
        # A picture in an <img> can't run scripts, whatever it holds, and its ids don't clash with those of another.
        address = f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode('ascii')}"
        image = f'<img alt="{escaped(name)}" src="{address}">'
        narrow = float(album.figures[name].get_size_inches()[0]) < WIDTH_IN
        return element("figure", image + told, **({"class_": "square"} if narrow else {}))

    def figures(self, album: Album, section: str, caption: str) -> str:
        """Give the figures of a section under one another; empty when there are none."""
        shown = "".join(self.figure(album, name, caption) for name in album.sections.get(section, {}))
        return element("div", shown, class_="figures") if shown else ""

    def responses(self, album: Album) -> str:
        """Give each magnitude with its Nyquist plot beside it; those of several logs, which have none, alone."""
        if not album.sections.get("nyquist"):
            return self.figures(album, "responses", _MASKED)
        pairs = zip(album.sections.get("responses", {}), album.sections.get("nyquist", {}), strict=True)
        return "".join(
            element(
                "div", self.figure(album, one, _MASKED) + self.figure(album, other, "Excited lines."), class_="pair"
            )
            for one, other in pairs
        )


def sections(pictures: Pictures, album: Album, *, bearing: bool = False) -> dict[str, str]:
    """Give the figures of a study as HTML, by the heading of their section, in the order of the work.

    `bearing` says that envelope spectra have a bearing's frequencies in them.
    """

    def shown(*captioned: tuple[str, str]) -> str:
        return "".join(pictures.figures(album, section, caption) for section, caption in captioned)

    return {
        "What changed": shown(("comparison", "After over before. Dots: lines that scatter doesn't explain.")),
        "Mode shapes": shown(
            ("mode shapes", "Each mode at its furthest."),
            ("complexity", "Components in the complex plane: a mode that moves in one phase is a line."),
        ),
        "Joints that move": shown(("relative motion", "Red: the neighbours that move most against each other.")),
        "Poles and fit": shown(
            ("stabilisation", "Poles of all model orders over the indicator function."),
            ("mac", "Modal assurance criterion: 1 for shapes that these sensors can't tell apart."),
            ("synthesis", "Error: root of the squares that the modes leave over those of the measured function."),
        ),
        "Waveforms": shown(("waveforms", "Long records are drawn by the extremes of each stretch.")),
        "Levels": shown(
            ("levels", "Solid: RMS of each window. Pale: its peak about the mean."),
            ("severities", "RMS of each window; without samples there is none."),
        ),
        "Power spectral densities": shown(("densities", f"One-sided. {_SIGMA}")),
        "Octave bands": shown(("octaves", "Summed from spectral lines.")),
        "Envelope spectra": shown(("envelopes", _BEARING if bearing else "")),
        "Cepstra": shown(("cepstra", "Grey: three sigma of what scatter makes. Dots: what stands out of it.")),
        "Waterfalls": shown(
            (
                "waterfalls",
                "Grey: samples are missing. Colours run over what most of the cells hold; ends hold the rest.",
            )
        ),
        "Frequency responses": pictures.responses(album),
    }
