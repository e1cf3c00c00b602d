"""Improper equations made proper in time by lags, with what the lags change known for the frequency domain."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilteredEquations(Value):
    """``x' = A x + B w``, ``rows = C x + D w`` with w and rows longer by one for each ideal derivative.

    Attributes
    ----------
    a, b, c, d
        Behind the given columns of `b` and `d` come those that add what the lags take away; behind the given rows of
        `c` and `d` come the signals that are differentiated.
    sources, orders
        ``[ideal derivative]``: which column of w it differentiates, and how often.
    """

    a: Real
    b: Real
    c: Real
    d: Real
    sources: tuple[int, ...]
    orders: tuple[int, ...]


def filtered_derivatives(a: Real, b: Real, c: Real, d: Real, *, filter_time_s: float) -> FilteredEquations:
    """Put ``(s/(T s + 1))^k`` in place of each power ``s^k`` of an input.

    Parameters
    ----------
    a, b, c
        ``[state, state]``, ``[state, column]``, ``[row, state]``.
    d
        ``[power, row, column]``: ``rows = C x + sum_k d[k] w^(k)``.
    filter_time_s
        T.
    """
    # One chain of lags serves all powers of a column; only powers in use get an ideal rest.
    chains = [(int(column), _highest(d[:, :, column])) for column in np.flatnonzero(d[1:].any(axis=(0, 1)))]
    used = [
        (column, order) for column, highest in chains for order in range(1, highest + 1) if d[order, :, column].any()
    ]
    own, lags = a.shape[0], sum(highest for _, highest in chains)
    rows, columns = d.shape[1:]
    c, direct = np.pad(c, ((0, len(used)), (0, lags))), np.pad(d[0], (0, len(used)))
    a, b = np.pad(a, (0, lags)), np.pad(b, ((0, lags), (0, len(used))))
    state = own
    for column, highest in chains:
        # g_0 = w and g_i = (g_(i-1) - q_i)/T with q_i' = g_i, by its share of the states and of w.
        signal, share = np.zeros(own + lags), 1.0
        for order in range(1, highest + 1):
            signal[state] -= 1.0
            signal, share = signal / filter_time_s, share / filter_time_s
            a[state], b[state, column] = signal, share
            c[:rows] += np.outer(d[order, :, column], signal)
            direct[:rows, column] += d[order, :, column] * share
            state += 1
    for number, (column, order) in enumerate(used):
        direct[:rows, columns + number] = d[order, :, column]
        direct[rows + number, column] = 1.0
    return FilteredEquations(
        a=a, b=b, c=c, d=direct, sources=tuple(column for column, _ in used), orders=tuple(order for _, order in used)
    )


def lag_names(sources: Sequence[int], orders: Sequence[int], names: Sequence[str]) -> list[str]:
    """Names of the lags' states, from the names of the columns of w."""
    highest: dict[int, int] = {}
    for source, order in zip(sources, orders, strict=True):
        highest[source] = max(order, highest.get(source, 0))
    return [f"{names[source]}.lag{number + 1}" for source, most in highest.items() for number in range(most)]


def _highest(powers: Real) -> int:
    return int(np.flatnonzero(powers.any(axis=1))[-1])
