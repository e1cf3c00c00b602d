"""Shapes of one mode from several set-ups, brought to one scale by the channels they share."""

from collections.abc import Sequence

import numpy as np

from chladni.modal.operational.response_shapes import ResponseShape
from chladni.modal.shapes.mac import SharedChannel
from chladni.signals.arrays import Complex, Real


def measured_shape(shape: Complex, std: Complex) -> ResponseShape:
    """Free a shape of the error that its scale, largest component 1, has put into all components.

    The component that is 1 has no error by convention; its own went to the others. With errors of one size everywhere
    the variance of a component psi is (1 + abs(psi)^2) times that, which is undone here.
    """
    variance = std.real**2 + std.imag**2
    own = variance / (1 + np.abs(shape) ** 2)
    known = own[own > 0]
    # No error bars at all: equal small errors give equal weights.
    typical = float(np.median(known)) if known.size else float(np.finfo(float).eps)
    own = np.where(own > 0, own, typical)
    return ResponseShape(vector=np.asarray(shape, dtype=np.complex128), covariance=np.diag(own).astype(np.complex128))


def joined(
    so_far: ResponseShape, shape: ResponseShape, shared: Sequence[SharedChannel], scaling: Sequence[SharedChannel]
) -> ResponseShape:
    """Add the channels of another set-up, scaled by weighted least squares on the `scaling` ones.

    With psi the shape so far and u the other, alpha = sum g conj(u) psi / sum g abs(u)^2 over these channels and g
    the inverse variance of psi - alpha u. Shared channels become the mean of both by inverse variance. The covariance
    follows to first order from those of psi and u.

    Parameters
    ----------
    so_far, shape
        ``row_a`` and ``row_b`` of `shared` are theirs.
    shared
        Channels of `shape` that are there already; the others are added at the end, in order.
    scaling
        Those of them that the scale is taken from.
    """
    rows_a, rows_b = [pair.row_a for pair in shared], [pair.row_b for pair in shared]
    from_a, from_b = [pair.row_a for pair in scaling], [pair.row_b for pair in scaling]
    other = shape.vector.copy()
    # Signs of sensors that were turned round; a sign doesn't change a variance, and these errors are independent.
    other[rows_b] *= [pair.sign for pair in shared]
    factor, by_first, by_other = _factor(so_far, shape, other, from_a, from_b)
    old, new = so_far.vector.size, [row for row in range(other.size) if row not in rows_b]
    # Derivatives of the joined shape: columns are the shape so far, then the other one.
    slopes = np.zeros((old + len(new), old + other.size), dtype=np.complex128)
    slopes[:old, :old] = np.eye(old)
    scaled = np.zeros((other.size, slopes.shape[1]), dtype=np.complex128)
    scaled[:, old:] = factor * np.eye(other.size)
    scaled[:, from_a] += np.outer(other, by_first)
    scaled[:, old + np.array(from_b)] += np.outer(other, by_other)
    known = _variances(so_far)[rows_a]
    # Inverse variances: the better of two looks counts more.
    share = known / (known + abs(factor) ** 2 * _variances(shape)[rows_b])
    slopes[rows_a] = (1 - share)[:, None] * slopes[rows_a] + share[:, None] * scaled[rows_b]
    slopes[old:] = scaled[new]
    vector = np.concatenate([so_far.vector, factor * other[new]])
    vector[rows_a] = (1 - share) * so_far.vector[rows_a] + share * factor * other[rows_b]
    covariance = np.zeros((slopes.shape[1], slopes.shape[1]), dtype=np.complex128)
    covariance[:old, :old], covariance[old:, old:] = so_far.covariance, shape.covariance
    return ResponseShape(vector=vector, covariance=slopes @ covariance @ slopes.conj().T)


def _factor(
    so_far: ResponseShape, shape: ResponseShape, other: Complex, rows_a: list[int], rows_b: list[int]
) -> tuple[complex, Complex, Complex]:
    """Scale of the other shape, and its derivatives by either at the shared channels."""
    mine, theirs = so_far.vector[rows_a], other[rows_b]
    # The weights need the factor's size, for which plain least squares is good enough.
    rough = abs(np.vdot(theirs, mine)) / np.vdot(theirs, theirs).real
    weight = 1 / (_variances(so_far)[rows_a] + rough**2 * _variances(shape)[rows_b])
    by_first = weight * theirs.conj() / np.sum(weight * np.abs(theirs) ** 2)
    factor = complex(by_first @ mine)
    return factor, by_first, -factor * by_first


def _variances(shape: ResponseShape) -> Real:
    return np.asarray(np.diagonal(shape.covariance).real, dtype=np.float64)
