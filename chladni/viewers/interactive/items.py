"""Plots as the JSON that a page holds."""

import json
from typing import Any

from bokeh.core.types import ID
from bokeh.document import Document
from bokeh.embed import json_item
from bokeh.io.doc import patch_curdoc
from matplotlib.figure import Figure

from chladni.viewers.figures.album import Album
from chladni.viewers.interactive.artists import UntranslatableError
from chladni.viewers.interactive.plots import translated

# Of all images of a page, and of one.
CELLS_OF_A_PAGE, CELLS, FEWEST_CELLS = 900_000, 150_000, 8_000


class PlotItems:
    """Makes the plots of a page, numbered in their order, and knows the room that there is for images."""

    def __init__(self, *albums: Album) -> None:
        images = sum(len(axes.images) for album in albums for one in album.figures.values() for axes in one.axes)
        self._cells = min(CELLS, max(FEWEST_CELLS, CELLS_OF_A_PAGE // max(images, 1)))
        self.count = 0

    def plot(self, figure: Figure) -> tuple[str, int, int | None] | None:
        """Give a plot's JSON, its height in pixels, and its width where it doesn't fill the page.

        None for a figure that holds what these plots can't show.
        """
        try:
            made = translated(figure, cells=self._cells)
        except UntranslatableError:
            return None
        self.count += 1
        # Bokeh asks the current document for its callbacks; one that a server ended has none.
        own = Document()
        with patch_curdoc(own):
            item: dict[str, Any] = dict(json_item(made.grid, ID(f"plot-{self.count}")))
        _Renamed(f"p{self.count}-").rename(item)
        # Inside a script nothing may look like its end.
        text = json.dumps(item, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
        return text, made.height, made.width


class _Renamed:
    """Gives models names by their place, since Bokeh counts on from plot to plot: a report is the same every time."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._names: dict[str, str] = {}

    def rename(self, item: Any) -> None:
        if isinstance(item, list | tuple):
            for one in item:
                self.rename(one)
        elif isinstance(item, dict):
            for key, value in item.items():
                # Data and texts are never under this key: maps are lists of pairs.
                if key in ("id", "root_id") and isinstance(value, str):
                    # One part may stand in two places.
                    if not value.startswith(self._prefix):
                        item[key] = self._names.setdefault(value, f"{self._prefix}{len(self._names)}")
                else:
                    self.rename(value)
