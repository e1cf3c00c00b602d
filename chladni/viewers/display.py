"""Whether a window can be opened here."""

import os
import sys
from typing import Final

from chladni.signals.errors import SetupError

#: Where a window system says that it is there, on what isn't Windows or macOS.
DISPLAYS: Final = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("win32", "darwin") or any(os.environ.get(name) for name in DISPLAYS)


def require_display() -> None:
    """Refuse to open a window where there is no screen, before work is done for it.

    Raises
    ------
    SetupError
        When there is none.
    """
    if not has_display():
        raise SetupError(
            "no window can be opened here: neither DISPLAY nor WAYLAND_DISPLAY is set; write a recording "
            "(--save OUT.rrd), or serve it to a browser (--web)"
        )
