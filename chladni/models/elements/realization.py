"""State space of a transfer function."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.elements.transfer_function import TransferFunction
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Realization(Value):
    """``x' = A x + b u``, ``y = c x + q[0] u + q[1] u' + q[2] u'' ...``.

    Attributes
    ----------
    a, b, c
        ``[state, state]``, ``[state]``, ``[state]``.
    q
        ``[power]``: the polynomial part in ascending powers of s; one number when the function is proper.
    """

    a: Real
    b: Real
    c: Real
    q: Real

    def __post_init__(self) -> None:
        self._freeze()


# While one knob of a scheme turns, all other blocks stay what they are.
@lru_cache(maxsize=1024)
def realize(transfer: TransferFunction) -> Realization:
    """Give the controllable canonical form of num/den; the dead time is left out.

    s is counted in units of the geometric mean of the poles, which keeps the entries of one size whatever the time
    constants are (Kailath, Linear Systems, 1980, section 2.1, after scaling).

    Raises
    ------
    ModelError
        When the coefficients lie so far apart that the form's entries overflow.
    """
    with np.errstate(all="ignore"):
        form = _companion(transfer)
    if not all(np.all(np.isfinite(part)) for part in (form.a, form.b, form.c, form.q)):
        raise ModelError(
            "the coefficients of a transfer function lie too far apart for floating point numbers: "
            f"num {list(transfer.num)!r:.100}, den {list(transfer.den)!r:.100}"
        )
    return form


def _companion(transfer: TransferFunction) -> Realization:
    quotient, rest = transfer.polynomial_and_rest()
    order = transfer.order
    ascending = np.asarray(transfer.den)[::-1]
    unit = _frequency_unit(ascending)
    scale = unit ** np.arange(order + 1.0)
    monic = ascending * scale / (ascending[-1] * scale[-1])
    a = np.eye(order, k=1)
    c = np.zeros(order)
    if order:
        a[-1] = -monic[:-1]
        above = rest[::-1][:order]
        c[: above.size] = above * scale[: above.size] / (ascending[-1] * scale[-1])
    b = np.zeros(order)
    # A slice, since a constant has no last state.
    b[-1:] = unit
    return Realization(a=unit * a, b=b, c=c, q=quotient[::-1].copy())


def state_space(
    transfer: TransferFunction,
    *,
    filter_time_s: float | None = None,
    entry: Terminal | None = None,
    exit_: Terminal | None = None,
) -> StateSpace:
    """Give ``x' = A x + B u, y = C x + D u`` of one transfer function.

    Parameters
    ----------
    transfer
        Without dead time: no finite number of states holds one.
    filter_time_s
        Time constant in seconds of the lags that make an improper function proper, one for each power of s too many.
    entry, exit_
        Names of input and output; ``input`` and ``output`` by default.

    Raises
    ------
    ModelError
        For a dead time, and for an improper function without `filter_time_s`.
    """
    if transfer.delay_s:
        raise ModelError(
            f"a dead time of {transfer.delay_s:g} s has no state space; compile a scheme with it instead"
        )
    if not transfer.proper and filter_time_s is None:
        raise ModelError(
            f"num is of order {len(transfer.num) - 1}, den of order {transfer.order}: it differentiates and has no "
            "state space; give filter_time_s"
        )
    realization = realize(transfer if filter_time_s is None else transfer.filtered(filter_time_s))
    return StateSpace(
        a=realization.a,
        b=realization.b[:, None],
        c=realization.c[None, :],
        d=realization.q[:1, None],
        inputs=(entry or Terminal(name="input", unit="1"),),
        outputs=(exit_ or Terminal(name="output", unit="1"),),
        states=tuple(f"x{number}" for number in range(1, realization.b.size + 1)),
    )


def _frequency_unit(ascending: Real) -> float:
    """Geometric mean of the poles that aren't zero, in rad/s; 1 when there are none."""
    # Poles at zero have no size to take part in a mean.
    lowest = int(np.flatnonzero(ascending)[0])
    span = ascending.size - 1 - lowest
    return float(abs(ascending[lowest] / ascending[-1]) ** (1 / span)) if span else 1.0
