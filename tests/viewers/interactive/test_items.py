"""Plots as JSON."""

import pytest

pytest.importorskip("bokeh", reason="needs the extra [bench]")

from bokeh.document import Document
from bokeh.io.doc import patch_curdoc
from matplotlib.figure import Figure

from chladni.viewers.interactive.items import PlotItems


def test_a_document_that_a_server_ended_spoils_no_plot() -> None:
    figure = Figure()
    figure.add_subplot().plot([0.0, 1.0], [1.0, 2.0])
    ended = Document()
    ended.callbacks.destroy()
    with patch_curdoc(ended):
        text, _, _ = PlotItems().plot(figure) or ("", 0, None)
    assert '"plot-1"' in text
