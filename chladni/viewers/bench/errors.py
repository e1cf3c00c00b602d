"""What a page says when something fails."""

import logging

from chladni.signals.errors import ChladniError


def told(error: BaseException) -> str:
    """Give one line about an error; a defect of the program is told as one, with its trace in the terminal."""
    if isinstance(error, ChladniError):
        return " ".join(str(error).split())
    # The page says that it happened, the terminal where.
    logging.getLogger(__name__).error("defect of chladni", exc_info=error)
    return f"defect of chladni ({type(error).__name__}): {error}; the terminal shows where"
