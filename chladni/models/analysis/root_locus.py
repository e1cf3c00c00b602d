"""Root loci: how the poles move with a parameter of a model, or with the gain of a loop closed around it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log10

import numpy as np
from scipy.optimize import linear_sum_assignment

from chladni.models.analysis.linear_path import LinearPath, compiled_model, poles_of
from chladni.models.analysis.zeros import zeros
from chladni.models.core.model import Model
from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

GAINS = 61
# From where nothing has moved to where the branches turn to their asymptotes.
GAIN_DECADES = (2.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RootLocus(Value):
    """Roots of the characteristic equation against one number.

    Attributes
    ----------
    name, unit
        Of what is varied.
    values
        ``[value]``.
    roots
        ``[branch, value]`` in rad/s; a branch follows one root as it moves.
    start, end
        Where branches begin (open-loop poles) and end (open-loop zeros); empty for a parameter.
    """

    name: str
    unit: str
    values: Real
    roots: Complex
    start: Complex
    end: Complex

    def __post_init__(self) -> None:
        self._freeze()

    def stable(self) -> Mask:
        """Tell for each value whether every root decays."""
        return np.asarray(np.all(self.roots.real < 0, axis=0))


def gain_root_locus(path: LinearPath, *, gains: Sequence[float] | Real | None = None) -> RootLocus:
    """Follow the poles of a path to one output as negative feedback around it is raised: ``u = k (r - y)``.

    Raises
    ------
    ModelError
        When a gain makes an algebraic loop that has no solution (``1 + k d = 0``), or a dead time acts.
    """
    if path.looped or path.dead_time_s[0]:
        raise ModelError(
            "with dead time there are infinitely many roots; take the dead time out, or read the margins"
        )
    chosen = np.asarray(default_gains(path) if gains is None else gains, dtype=np.float64)
    # u = k (r - c x - d u): the direct way closes an algebraic loop of its own.
    loop = 1 + chosen * path.d[0]
    if np.any(np.abs(loop) < 1e-12):
        raise ModelError(f"the loop gain {-1 / path.d[0]:g} makes an algebraic loop that has no solution")
    closed = path.a - (chosen / loop)[:, None, None] * np.outer(path.b, path.c[0])
    return RootLocus(
        name="loop gain",
        unit=f"({path.source.unit})/({path.outputs[0].unit})",
        values=chosen,
        roots=_branches(np.linalg.eigvals(closed).astype(np.complex128)),
        start=path.poles,
        end=zeros(path),
    )


def parameter_root_locus(model: Model, parameter: str, values: Sequence[float] | Real) -> RootLocus:
    """Follow the poles of a model as one of its parameters changes.

    Raises
    ------
    ModelError
        For an unknown parameter or an impossible value.
    """
    unit = model.parameters.require(parameter).unit
    roots = [poles_of(compiled_model(model.with_values({parameter: float(value)})).a) for value in values]
    if len({len(found) for found in roots}) != 1:
        raise ModelError(f"{parameter}: the number of poles changes with it; choose values on one side")
    empty = np.empty(0, np.complex128)
    return RootLocus(
        name=parameter,
        unit=unit,
        values=np.asarray(values, dtype=np.float64),
        roots=_branches(np.array(roots)),
        start=empty,
        end=empty,
    )


def default_gains(path: LinearPath) -> Real:
    """Loop gains about the one at which the loop's magnitude at the middle of its poles is 1; 0 first, ``[gain]``."""
    moving = np.abs(path.poles[path.poles != 0])
    omega = float(np.exp(np.mean(np.log(moving)))) if moving.size else 1.0
    regular = 1j * omega * np.eye(path.b.size) - path.a + 1e-6 * omega * np.eye(path.b.size)
    size = abs(path.c[0] @ np.linalg.solve(regular, path.b) + path.d[0]) if path.b.size else abs(path.d[0])
    middle = log10(1 / size) if size > 0 else 0.0
    return np.concatenate([[0.0], np.logspace(middle - GAIN_DECADES[0], middle + GAIN_DECADES[1], GAINS - 1)])


def _branches(roots: Complex) -> Complex:
    """``[branch, value]`` from unordered ``[value, root]``: each root goes on to the one it can have moved to."""
    ordered = roots.copy()
    for step in range(1, len(roots) if roots.shape[1] else 0):
        distance = np.abs(ordered[step - 1][:, None] - roots[step][None, :])
        # Greedy choice is right wherever no two roots want the same; only then the assignment is solved.
        nearest = np.argmin(distance, axis=1)
        if len(set(nearest.tolist())) < len(nearest):
            nearest = linear_sum_assignment(distance)[1]
        ordered[step] = roots[step][nearest]
    return ordered.T
