"""Derivatives of a model's equations to its parameters, by differences of high order inside the possible range."""

from collections.abc import Callable

import numpy as np

from chladni.models.core.parameter import Parameter
from chladni.signals.arrays import Real

# Equations are sums of products and quotients of parameters. With a step of 0.4 % the error of sixth order is
# 36 * 0.004^6 = 1.5e-13 for 1/p and none for products; rounding is 1e-16/0.004.
RELATIVE_STEP = 4e-3
NODES = 7


def relative_derivative(function: Callable[[float], Real], parameter: Parameter) -> Real:
    """Differentiate ``p -> function(p)`` and multiply by p: the change of a function per relative change of p.

    Differences of sixth order on seven equidistant nodes (Fornberg 1988), central ones where the possible range
    allows, else shifted to one side.

    Parameters
    ----------
    function
        Smooth; gives an array of the same shape each time.
    parameter
        Where, and how far it may go.

    Returns
    -------
    Array of the function's shape; zero for a parameter that is 0, which has no relative change.

    Examples
    --------
    >>> cube = Parameter(name="p", value=2.0, low=1.0, high=3.0)
    >>> relative_derivative(lambda p: np.array([p**3]), cube).round(9)
    array([24.])
    """
    value = parameter.value
    nodes, nominal = _nodes(parameter), function(value)
    if value == 0 or nodes is None:
        return np.zeros_like(nominal)
    # The weights sum to zero; less the nominal value, what doesn't depend on the parameter gives zero to the bit.
    terms = [
        weight * (function(value * (1 + node * RELATIVE_STEP)) - nominal)
        for node, weight in zip(nodes, first_derivative_weights(nodes), strict=True)
        if abs(weight) > 1e-12
    ]
    return np.asarray(np.sum(terms, axis=0) / RELATIVE_STEP)


def first_derivative_weights(nodes: Real) -> Real:
    """Weights of function values at distinct `nodes` that sum to the first derivative at 0, exact for polynomials."""
    wanted = np.zeros(nodes.size)
    wanted[1] = 1.0
    return np.asarray(np.linalg.solve(np.vander(nodes, increasing=True).T, wanted))


def _nodes(parameter: Parameter) -> Real | None:
    """Node numbers in steps from the value, as central as the possible range allows; None where it's too narrow."""
    centre = np.arange(NODES, dtype=np.float64) - NODES // 2
    for shift in sorted(range(-(NODES // 2), NODES // 2 + 1), key=abs):
        places = parameter.value * (1 + (centre + shift) * RELATIVE_STEP)
        if places.min() >= parameter.minimum and places.max() <= parameter.maximum:
            return centre + shift
    return None
