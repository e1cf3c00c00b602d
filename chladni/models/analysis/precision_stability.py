"""The precision-stability field: where the roots lie against the error that stays, as a loop's gain is raised."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.root_locus import RootLocus, gain_root_locus
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrecisionStability(Value):
    """Precision and stability of a loop at each of its gains.

    Attributes
    ----------
    gain
        ``[gain]``, above 0.
    error
        ``[gain]``: with no integrator in the loop, the share of a step that is not followed, 1/(1 + k K); with one,
        the lag behind a ramp in s, 1/(k K_v); with two the lag behind a parabola in s^2, 1/(k K_a).
    follows
        Which of them.
    decay_per_s
        ``[gain]``, of the slowest root; negative when a root grows.
    damping_ratio
        ``[gain]``, the smallest of all roots.
    roots
        ``[branch, gain]`` in rad/s.
    """

    gain: Real
    error: Real
    follows: Literal["step", "ramp", "parabola"]
    decay_per_s: Real
    damping_ratio: Real
    roots: Complex

    def __post_init__(self) -> None:
        self._freeze()


def precision_stability(path: LinearPath, *, locus: RootLocus | None = None) -> PrecisionStability:
    """Set the error that stays against the roots, for negative feedback with each gain around a path to one output.

    Parameters
    ----------
    path
        To one output.
    locus
        Of the same path, from `gain_root_locus`; the default gains when None.

    Raises
    ------
    ModelError
        For more than two integrators, and where `gain_root_locus` does.
    """
    locus = locus or gain_root_locus(path)
    above = locus.values > 0
    gain, roots = locus.values[above], locus.roots[:, above]
    order = path.integrators()
    if order > 2:
        raise ModelError(f"the loop has {order} integrators; the field is defined for two at most")
    constant = error_constant(path)
    with np.errstate(divide="ignore"):
        error = 1 / (1 + gain * constant) if order == 0 else 1 / (gain * constant)
    sizes = np.where(np.abs(roots) > 0, np.abs(roots), 1.0)
    return PrecisionStability(
        gain=gain,
        error=np.asarray(error, dtype=np.float64),
        follows=("step", "ramp", "parabola")[order],
        decay_per_s=-roots.real.max(axis=0, initial=-np.inf),
        damping_ratio=np.asarray((-roots.real / sizes).min(axis=0, initial=1.0)),
        roots=roots,
    )


def error_constant(path: LinearPath) -> float:
    """``lim s^N H(s)`` at s = 0, N the number of integrators: K_p, K_v or K_a (Ogata 2010, section 5-8)."""
    read = path
    for _ in range(path.integrators()):
        further = read.rate()
        if further is None:
            # Beside an integrator the direct way counts for nothing in the limit.
            further = _without_direct(read).rate()
        read = further or read
    if read.integrators():
        raise ModelError("an integrator can't be taken out of the path; its error constant has no closed form here")
    return read.final_value()


def _without_direct(path: LinearPath) -> LinearPath:
    return replace(path, d=np.zeros(1))
