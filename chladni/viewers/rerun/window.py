"""A study shown in the viewer's own window."""

from collections.abc import Callable
from functools import partial
from subprocess import Popen

import rerun as rr

from chladni.signals.study import Study
from chladni.viewers.display import require_display
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.rerun.drawing import draw
from chladni.viewers.rerun.gap import draw_gap
from chladni.viewers.rerun.process import free_port, send, start

SETTLE_S = 1.0
# Windows outlive the call; a Popen that is forgotten while its process runs is a ResourceWarning.
_open_windows: list[Popen[bytes]] = []


def spawn(study: Study) -> None:
    """Open the rerun viewer and show a study in it; the viewer stays open when Python ends.

    Raises
    ------
    SetupError
        When the viewer doesn't start, as on a computer without a display.
    """
    _open(partial(draw, study=study))


def spawn_gap(evidence: GapEvidence) -> None:
    """Open the rerun viewer and show a diagnosis in it; else as `spawn`."""
    _open(partial(draw_gap, evidence=evidence))


def _open(drawn: Callable[[rr.RecordingStream], None]) -> None:
    require_display()
    port = free_port()
    _open_windows.append(start(["--port", str(port)], ports=[port], detached=True, settle_s=SETTLE_S))
    send(drawn, port)
