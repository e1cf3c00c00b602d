"""A figure as bytes, the same bytes every time."""

import io

import matplotlib as mpl
from matplotlib.figure import Figure

from chladni.viewers.figures.sheet import look

DOTS_PER_INCH = 300


def rendered(figure: Figure, kind: str) -> bytes:
    """Give a figure as ``png``, ``svg`` or ``pdf``; without dates and random names, so that files can be compared."""
    content = io.BytesIO()
    stamps: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None, "ModDate": None}}
    with look():
        mpl.rcParams["svg.hashsalt"] = "chladni"
        figure.savefig(content, format=kind, dpi=DOTS_PER_INCH, metadata=stamps.get(kind))
    # Half the time goes into the arrangement, which is the same for every format.
    figure.set_layout_engine("none")
    return content.getvalue()
