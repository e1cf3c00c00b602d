"""A study shown in the viewer's own window."""

from functools import partial
from subprocess import Popen

from chladni.signals.study import Study
from chladni.viewers.rerun.drawing import draw
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
    port = free_port()
    _open_windows.append(start(["--port", str(port)], ports=[port], detached=True, settle_s=SETTLE_S))
    send(partial(draw, study=study), port)
