"""Figures for print, drawn by matplotlib; functions return `matplotlib.figure.Figure` and touch no backend.

Importing this package costs half a second, so it's imported where a figure is wanted, not before.
"""

from chladni.viewers.figures.album import Album
from chladni.viewers.figures.cepstrum import cepstrum_figures
from chladni.viewers.figures.comparison import comparison_figures
from chladni.viewers.figures.complexity import complexity_figures
from chladni.viewers.figures.envelope import envelope_figures
from chladni.viewers.figures.frf import response_figures
from chladni.viewers.figures.levels import level_figures, severity_figures
from chladni.viewers.figures.mac import cross_mac_figure, mac_figures
from chladni.viewers.figures.mode_shapes import mode_shape_figures
from chladni.viewers.figures.nyquist import nyquist_figures
from chladni.viewers.figures.octaves import octave_figures
from chladni.viewers.figures.psd import density_figures
from chladni.viewers.figures.relative_motion import relative_motion_figures
from chladni.viewers.figures.saving import save_album, save_figures
from chladni.viewers.figures.stabilisation import stabilisation_figures
from chladni.viewers.figures.synthesis import synthesis_figures
from chladni.viewers.figures.waterfall import waterfall_figures
from chladni.viewers.figures.waveforms import waveform_figures

__all__ = [
    "Album",
    "cepstrum_figures",
    "comparison_figures",
    "complexity_figures",
    "cross_mac_figure",
    "density_figures",
    "envelope_figures",
    "level_figures",
    "mac_figures",
    "mode_shape_figures",
    "nyquist_figures",
    "octave_figures",
    "relative_motion_figures",
    "response_figures",
    "save_album",
    "save_figures",
    "severity_figures",
    "stabilisation_figures",
    "synthesis_figures",
    "waterfall_figures",
    "waveform_figures",
]
