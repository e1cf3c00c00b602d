"""Plots of the reports that zoom and read out, drawn by Bokeh after the figures of matplotlib.

This package alone, and the bench's pages, import Bokeh; it's imported where Bokeh is known to be installed.
"""

from chladni.viewers.interactive.items import PlotItems
from chladni.viewers.interactive.scripts import START, library

__all__ = ["START", "PlotItems", "library"]
