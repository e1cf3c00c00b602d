"""Units: interim algebra, to be replaced by the registry."""


def quotient(numerator: str, denominator: str) -> str:
    """Unit of a/b."""
    return f"({numerator})/{denominator}"


def power_density_unit(unit: str) -> str:
    """Unit of a PSD."""
    return f"({unit})^2/Hz"
