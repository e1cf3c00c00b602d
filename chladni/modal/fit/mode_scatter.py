"""How a mode scatters: apart for each response by noise, and for all of them together by leakage."""

from dataclasses import dataclass

from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeScatter:
    """Factors that turn the scatter computed for independent lines of known variance into that of one mode.

    Attributes
    ----------
    pole
        ``[2, 2]`` covariance of Re and Im of the pole, in (rad/s)^2.
    shared
        On what poles and participation add to ratios of components, which no common error moves.
    shares
        ``[response]`` on the own scatter of each response's shape.
    common
        ``[response, 2]`` variance of Re and Im of component over largest by errors that all responses have in common.
    amplitude
        On the variance of the scale: participation and modal mass.
    """

    pole: Real
    shared: float
    shares: Real
    common: Real
    amplitude: float
