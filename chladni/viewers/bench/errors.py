"""What a page says when something fails."""

import logging
import traceback

from chladni.signals.errors import ChladniError
from chladni.signals.visible import visible_lines


def told(error: BaseException) -> str:
    """Give one line about an error; a defect of the program is told as one, with its trace in the terminal."""
    if isinstance(error, ChladniError):
        return " ".join(str(error).split())
    # The page says that it happened, the terminal where.
    trace = visible_lines("".join(traceback.format_exception(error)))
    logging.getLogger(__name__).error("defect of chladni\n%s", trace)
    return f"defect of chladni ({type(error).__name__}): {error}; the terminal shows where"
