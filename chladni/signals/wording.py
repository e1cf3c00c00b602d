"""Counts in sentences."""


def counted(number: int, noun: str) -> str:
    """Give a count with its noun, in the plural unless there's one.

    Examples
    --------
    >>> counted(1, "sample"), counted(0, "gap"), counted(3, "message")
    ('1 sample', '0 gaps', '3 messages')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
