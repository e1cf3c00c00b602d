"""Tolerances of parameters, as a file gives them."""

from collections.abc import Mapping
from dataclasses import replace

from chladni.models.core.parameter import Parameters


def with_tolerances(parameters: Parameters, default: float | None, by_name: Mapping[str, float]) -> Parameters:
    """Give the parameters with other tolerances; those that nothing is said about keep theirs.

    Parameters
    ----------
    default
        For all that `by_name` doesn't hold; None to leave them.
    by_name
        One sigma over the value.
    """
    return Parameters(
        tuple(
            replace(one, tolerance=by_name.get(one.name, one.tolerance if default is None else default))
            for one in parameters.values()
        )
    )
