"""A figure as bytes, the same bytes every time."""

import io
from typing import Any

import matplotlib as mpl
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.figure import Figure

from chladni.viewers.figures.sheet import look

DOTS_PER_INCH = 300
# Dates and names of programs would make each file differ from the last; zlib's third of nine levels takes a third
# of the time of its usual sixth, for files a tenth larger.
_OPTIONS: dict[str, dict[str, Any]] = {
    "png": {"pil_kwargs": {"compress_level": 3}},
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None, "ModDate": None}},
}


def rendered(figure: Figure, kind: str, *, dots_per_inch: int = DOTS_PER_INCH) -> bytes:
    """Give a figure as ``png``, ``svg`` or ``pdf``; without dates and random names, so that files can be compared."""
    content = io.BytesIO()
    with look():
        mpl.rcParams["svg.hashsalt"] = "chladni"
        figure.dpi = dots_per_inch
        _arrange(figure)
        # Not savefig: it draws a figure that has a layout engine twice, the first time to arrange it.
        canvas: Any = get_registered_canvas_class(kind)(figure)
        getattr(canvas, f"print_{kind}")(content, **_OPTIONS[kind])
    return content.getvalue()


def _arrange(figure: Figure) -> None:
    """Arrange the axes on the sheet once; the arrangement is the same for every format and takes as long as one."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
