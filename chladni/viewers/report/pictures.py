"""The report's figures, as data inside the page."""

import base64

from matplotlib.figure import Figure

from chladni.signals.study import Study
from chladni.viewers.figures import (
    density_figures,
    nyquist_figures,
    response_figures,
    waterfall_figures,
    waveform_figures,
)
from chladni.viewers.figures.rendering import rendered
from chladni.viewers.report.markup import element, escaped

_SIGMA = "Shaded: one sigma of the random error."


def pictures(study: Study) -> dict[str, str]:
    """Give the figures as HTML, by the heading of their section; sections without figures are left out."""
    responses, planes = response_figures(study), nyquist_figures(study)
    # Each magnitude beside its Nyquist plot.
    pairs = [item for pair in zip(responses.items(), planes.items(), strict=True) for item in pair]
    sections = {
        "Frequency responses": (dict(pairs), f"{_SIGMA} Lines that nothing excites are left out."),
        "Power spectral densities": (density_figures(study), f"One-sided. {_SIGMA}"),
        "Waterfalls": (waterfall_figures(study), "Grey: samples are missing."),
        "Waveforms": (waveform_figures(study), "Long records are drawn by the extremes of each stretch."),
    }
    return {
        heading: element("div", "".join(_picture(*item, caption) for item in figures.items()), class_="figures")
        for heading, (figures, caption) in sections.items()
        if figures
    }


def _picture(name: str, figure: Figure, caption: str) -> str:
    # A picture in an <img> can't run scripts, whatever it holds, and its ids don't clash with those of another.
    data = base64.b64encode(rendered(figure, "svg")).decode("ascii")
    image = f'<img alt="{escaped(name)}" src="data:image/svg+xml;base64,{data}">'
    return element("figure", image + element("figcaption", escaped(caption)))
