"""The adapter to rerun, and the only place that imports it.

Importing this package costs half a second, so it's imported where a picture is wanted, not before.
"""

from chladni.viewers.rerun.file import write_rrd
from chladni.viewers.rerun.gap import write_gap_rrd
from chladni.viewers.rerun.web import WebViewer, serve_web
from chladni.viewers.rerun.window import spawn, spawn_gap

__all__ = ["WebViewer", "serve_web", "spawn", "spawn_gap", "write_gap_rrd", "write_rrd"]
