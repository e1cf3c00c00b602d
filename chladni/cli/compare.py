"""Command."""


def compare() -> None:
    """Wait."""
