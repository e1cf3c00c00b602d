"""Figures for print, drawn by matplotlib; functions return `matplotlib.figure.Figure` and touch no backend.

Importing this package costs half a second, so it's imported where a figure is wanted, not before.
"""

from chladni.viewers.figures.album import Album
from chladni.viewers.figures.comparison import comparison_figures
from chladni.viewers.figures.density import density_figures
from chladni.viewers.figures.frequency_response import response_figures
from chladni.viewers.figures.nyquist import nyquist_figures
from chladni.viewers.figures.saving import save_album, save_figures
from chladni.viewers.figures.waterfall import waterfall_figures
from chladni.viewers.figures.waveforms import waveform_figures

__all__ = [
    "Album",
    "comparison_figures",
    "density_figures",
    "nyquist_figures",
    "response_figures",
    "save_album",
    "save_figures",
    "waterfall_figures",
    "waveform_figures",
]
