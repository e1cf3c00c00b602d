"""The report's figures, as data inside the page."""

import base64

from chladni.viewers.figures import Album
from chladni.viewers.report.markup import element, escaped

_SIGMA = "Shaded: one sigma of the random error."


def pictures(album: Album) -> dict[str, str]:
    """Give the figures as HTML, by the heading of their section; sections without figures are left out."""
    return {
        heading: element(
            "div", "".join(picture(album, name, caption) for name, caption in captioned), class_="figures"
        )
        for heading, captioned in _sections(album).items()
        if captioned
    }


def _sections(album: Album) -> dict[str, list[tuple[str, str]]]:
    """Names of figures with their captions, by heading."""

    def captioned(section: str, caption: str) -> list[tuple[str, str]]:
        return [(name, caption) for name in album.sections[section]]

    # Each magnitude beside its Nyquist plot.
    pairs = zip(album.sections["responses"], album.sections["nyquist"], strict=True)
    masked = f"{_SIGMA} Lines that nothing excites are left out."
    return {
        "Mode shapes": captioned("mode shapes", "Each mode at its furthest.")
        + captioned("complexity", "Components in the complex plane: a mode that moves in one phase is a line."),
        "Joints that move": captioned("relative motion", "Red: the neighbours that move most against each other."),
        "Poles and fit": captioned("stabilisation", "Poles of all model orders over the indicator function.")
        + captioned("mac", "Modal assurance criterion: 1 for shapes that these sensors can't tell apart.")
        + captioned(
            "synthesis", "Error: root of the squares that the modes leave over those of the measured function."
        ),
        "Frequency responses": [(name, masked) for pair in pairs for name in pair],
        "Levels": captioned("levels", "Solid: RMS of each window. Pale: its peak about the mean."),
        "Octave bands": captioned("octaves", "Summed from spectral lines."),
        "Envelope spectra": captioned("envelopes", "Dashed: frequencies of the bearing, and their multiples."),
        "Cepstra": captioned("cepstra", "Grey: three sigma of what scatter makes. Dots: what stands out of it."),
        "Power spectral densities": captioned("densities", f"One-sided. {_SIGMA}"),
        "Waterfalls": captioned("waterfalls", "Grey: samples are missing."),
        "Waveforms": captioned("waveforms", "Long records are drawn by the extremes of each stretch."),
    }


def picture(album: Album, name: str, caption: str) -> str:
    """Give one figure with its caption."""
    # A picture in an <img> can't run scripts, whatever it holds, and its ids don't clash with those of another.
    data = base64.b64encode(album.rendered(name, "svg")).decode("ascii")
    image = f'<img alt="{escaped(name)}" src="data:image/svg+xml;base64,{data}">'
    return element("figure", image + element("figcaption", escaped(caption)))
