"""How parameters of elements are declared: the few shapes that come again and again."""

from chladni.models.core.parameter import Parameter

# Times and physical constants must be above zero, else the element loses its order; and far enough above it that
# products of a few of them are numbers still. Nothing built is faster or smaller.
_SHORTEST_S = 1e-15
_SMALLEST = 1e-30


def gain(value: float = 1.0, *, unit: str = "1", meaning: str = "gain") -> Parameter:
    """Give a gain of either sign."""
    return Parameter(name="gain", value=value, unit=unit, low=0.1, high=10.0, symbol="K", meaning=meaning)


def time(name: str, value: float, symbol: str, meaning: str, *, may_vanish: bool = False) -> Parameter:
    """Give a time constant in seconds, from a hundredth of the default to ten times that."""
    return Parameter(
        name=name,
        value=value,
        unit="s",
        low=0.0 if may_vanish else value / 100,
        high=value * 10,
        minimum=0.0 if may_vanish else _SHORTEST_S,
        symbol=symbol,
        meaning=meaning,
    )


def damping_ratio(value: float, name: str = "damping_ratio", symbol: str = "ζ") -> Parameter:
    """Give a damping ratio, 0 (an undamped oscillation) and above 1 included."""
    return Parameter(
        name=name, value=value, low=0.0, high=2.0, minimum=0.0, symbol=symbol, meaning="damping ratio of the pair"
    )


def ratio(value: float, symbol: str, meaning: str) -> Parameter:
    """Give a ratio of two time constants, at least 1."""
    return Parameter(name="ratio", value=value, low=1.0, high=20.0, minimum=1.0, symbol=symbol, meaning=meaning)


def constant(
    name: str, value: float, unit: str, symbol: str, meaning: str, *, shown_unit: str = "", may_vanish: bool = False
) -> Parameter:
    """Give a physical constant such as a resistance or a mass, a decade to each side."""
    return Parameter(
        name=name,
        value=value,
        unit=unit,
        low=0.0 if may_vanish else value / 10,
        high=value * 10,
        minimum=0.0 if may_vanish else _SMALLEST,
        symbol=symbol,
        shown_unit=shown_unit,
        meaning=meaning,
    )
