"""A linear filter that a signal passes: what lags, mounts and couplings do, in state space."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearFilter(Value):
    """``z' = A z + b v``, ``w = c z + d v``: v goes in, w comes out, z starts at rest.

    Attributes
    ----------
    a, b, c
        ``[state, state]``, ``[state]``, ``[state]``.
    d
        What passes at once.
    states
        Short names.

    Examples
    --------
    >>> half = gain(0.5)
    >>> half(np.array([2.0, 4.0]), 10.0)
    array([1., 2.])
    """

    a: Real
    b: Real
    c: Real
    d: float
    states: tuple[str, ...]

    def __post_init__(self) -> None:
        self._freeze()

    def __call__(self, samples: Real, sample_rate_hz: float) -> Real:
        """Filter samples; exact for the signal that joins them by straight lines."""
        # A plain gain, exact and for nothing.
        if not self.states:
            return np.asarray(self.d * samples, dtype=np.float64)
        # scipy.signal takes most of a second to import, and few ever filter samples.
        from scipy.signal import lsim

        way = (self.a, self.b[:, None], self.c[None, :], np.array([[self.d]]))
        _, filtered, _ = lsim(way, samples, np.arange(samples.size) / sample_rate_hz)
        return np.asarray(filtered, dtype=np.float64)


def gain(factor: float) -> LinearFilter:
    """Give the filter that multiplies."""
    return LinearFilter(a=np.zeros((0, 0)), b=np.zeros(0), c=np.zeros(0), d=factor, states=())


def first_order(time_constant_s: float) -> LinearFilter:
    """Give ``1/(tau s + 1)``."""
    rate = 1 / time_constant_s
    return LinearFilter(a=np.array([[-rate]]), b=np.array([rate]), c=np.ones(1), d=0.0, states=("value",))


def second_order(natural_frequency_rad_s: float, damping_ratio: float) -> LinearFilter:
    """Give ``omega^2/(s^2 + 2 zeta omega s + omega^2)``."""
    omega = natural_frequency_rad_s
    # The second state is the rate over omega, so that both are of one size, however high the frequency.
    return LinearFilter(
        a=omega * np.array([[0.0, 1.0], [-1.0, -2 * damping_ratio]]),
        b=omega * np.array([0.0, 1.0]),
        c=np.array([1.0, 0.0]),
        d=0.0,
        states=("value", "rate"),
    )


def high_pass(corner_rad_s: float) -> LinearFilter:
    """Give ``s/(s + omega_c)``."""
    return LinearFilter(
        a=np.array([[-corner_rad_s]]), b=np.array([corner_rad_s]), c=-np.ones(1), d=1.0, states=("mean",)
    )


def two_stage_high_pass(natural_frequency_rad_s: float, damping_ratio: float) -> LinearFilter:
    """Give ``s^2/(s^2 + 2 zeta omega s + omega^2)``: one less `second_order` and its rate."""
    low = second_order(natural_frequency_rad_s, damping_ratio)
    return replace(low, c=np.array([-1.0, -2 * damping_ratio]), d=1.0, states=("mean", "drift"))
