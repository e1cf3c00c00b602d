"""The circle that one mode draws in the Nyquist plane, with its sweep."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.experimental.resonance_lines import MobilityLines
from chladni.signals.arrays import Complex, Real

STEPS = 30
# A step that changes a half-power bandwidth by less than this share is the last one.
CONVERGED = 1e-9
LARGEST_DAMPING = 0.5
# A misfit of chi-squared numbers over their count exceeds 1 by so many sigma once in a thousand times.
CHANCE_SIGMAS = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NyquistCircle:
    """Circles of all functions around one resonance, with one natural frequency and damping ratio.

    Attributes
    ----------
    frequency_hz, damping_ratio
        Of the mode.
    covariance
        ``[2, 2]`` of frequency_hz and damping_ratio, from the std of the lines and their correlation.
    origin, diameter
        ``[response, reference]`` complex: each circle is origin + diameter/(1 + j x), swept by frequency.
    diameter_std
        ``[response, reference]`` one sigma of the real and of the imaginary part of the diameter, at that pole.
    misfit
        Mean of the squared distances of lines from circles over their variance, 1 for scatter alone.
    excess
        What of `misfit` scatter can't explain, at least 0: systematic, so that more lines don't average it out.
    lines
        Number of lines.
    """

    frequency_hz: float
    damping_ratio: float
    covariance: Real
    origin: Complex
    diameter: Complex
    diameter_std: Real
    misfit: float
    excess: float
    lines: int


def fit_circle(lines: MobilityLines, span: slice, frequency_hz: float, damping_ratio: float) -> NyquistCircle | None:
    """Fit the circles of all functions on a span of lines, from a first guess of frequency and damping.

    Returns
    -------
    NyquistCircle or None
        None when no resonance within the span fits.

    Notes
    -----
    The mobility of one viscously damped mode is D/(1 + j x), x = (f/f_r - f_r/f)/(2 zeta): a circle through the
    origin with diameter D, swept fastest at f_r (Ewins 2000, section 4.3.3). What other modes add is taken as
    constant, which moves the circle's origin. Least squares over lines weighted by their std; diameters and origins
    are linear and solved for within each Gauss-Newton step on frequency and damping (Golub & Pereyra 1973). The
    covariance is that of this estimator for lines whose noise the window has smeared over their neighbours.
    """
    f_hz = lines.frequency_hz[span]
    weights = 1 / lines.std[:, :, span].reshape(-1, f_hz.size)
    values = lines.values[:, :, span].reshape(-1, f_hz.size)
    place = np.array([frequency_hz, damping_ratio])
    for _ in range(STEPS):
        origin, diameter, _ = _linear(f_hz, place, values, weights)
        columns, residual = (
            part.reshape(values.size, -1) for part in _projected(f_hz, place, origin, diameter, values, weights)
        )
        jacobian, missing = (np.concatenate([part.real, part.imag]) for part in (columns, residual))
        step = np.linalg.lstsq(jacobian, missing[:, 0], rcond=None)[0]
        # The damping ratio may not fall through zero on the way.
        share = 1.0 if step[1] > -0.7 * place[1] else -0.7 * place[1] / step[1]
        place = place + share * step
        if not (f_hz[0] <= place[0] <= f_hz[-1] and 0 < place[1] < LARGEST_DAMPING):
            return None
        if abs(step[0]) / (place[0] * place[1]) + abs(step[1]) / place[1] < CONVERGED:
            break
    return _circle(lines, span, place, values, weights)


def _circle(lines: MobilityLines, span: slice, place: Real, values: Complex, weights: Real) -> NyquistCircle:
    """The circles at the pole that was found, and how sure they are when noise hangs together over lines."""
    f_hz, functions = lines.frequency_hz[span], lines.values.shape[:2]
    origin, diameter, inverse = _linear(f_hz, place, values, weights)
    columns, residual = _projected(f_hz, place, origin, diameter, values, weights)
    correlation = lines.correlation(span)
    bread = np.linalg.inv(np.einsum("fla,flb->ab", columns.conj(), columns).real)
    meat = np.einsum("fka,kl,flb->ab", columns.conj(), correlation, columns, optimize=True).real
    # Five lines give every function ten numbers for its four and the two that all share.
    freedom = 2 * values.size - 4 * values.shape[0] - 2
    misfit = float(np.sum(np.abs(residual) ** 2)) / freedom
    spread = np.einsum("fab,bl,fl->fal", inverse, _basis(f_hz, place).conj(), weights)
    diameter_variance = np.einsum("fk,kl,fl->f", spread[:, 1], correlation, spread[:, 1].conj(), optimize=True).real
    return NyquistCircle(
        frequency_hz=float(place[0]),
        damping_ratio=float(place[1]),
        covariance=np.asarray(bread @ meat @ bread, dtype=np.float64),
        origin=origin.reshape(functions),
        diameter=diameter.reshape(functions),
        diameter_std=np.sqrt(diameter_variance).reshape(functions),
        misfit=misfit,
        excess=max(misfit - 1 - CHANCE_SIGMAS * np.sqrt(2 / freedom), 0.0),
        lines=f_hz.size,
    )


def sweep(frequency_hz: Real, natural_hz: float, damping_ratio: float) -> Real:
    """Give x = (f/f_r - f_r/f)/(2 zeta), the tangent of half the angle on the circle.

    Examples
    --------
    >>> sweep(np.array([10.0, 10.1]), 10.0, 0.01).round(3)
    array([0.   , 0.995])
    """
    return np.asarray((frequency_hz / natural_hz - natural_hz / frequency_hz) / (2 * damping_ratio))


def _basis(f_hz: Real, place: Real) -> Complex:
    return np.stack([np.ones(f_hz.size), 1 / (1 + 1j * sweep(f_hz, *place))])


def _linear(f_hz: Real, place: Real, values: Complex, weights: Real) -> tuple[Complex, Complex, Complex]:
    """Origins and diameters at a given pole, and the inverse normal matrix of each function."""
    basis = _basis(f_hz, place)
    normal = np.einsum("al,fl,bl->fab", basis.conj(), weights**2, basis)
    inverse = np.linalg.inv(normal)
    right = np.einsum("al,fl->fa", basis.conj(), weights**2 * values)
    solved = np.einsum("fab,fb->fa", inverse, right)
    return solved[:, 0], solved[:, 1], inverse


def _projected(
    f_hz: Real, place: Real, origin: Complex, diameter: Complex, values: Complex, weights: Real
) -> tuple[Complex, Complex]:
    """Derivatives by frequency and damping, freed of what origins and diameters take up, and residual; weighted."""
    natural, zeta = place
    x = sweep(f_hz, natural, zeta)
    lorentzian = 1 / (1 + 1j * x)
    by_x = -1j * lorentzian**2
    x_by_natural = -(f_hz / natural**2 + 1 / f_hz) / (2 * zeta)
    slopes = np.stack([by_x * x_by_natural, by_x * -x / zeta])
    columns = weights[:, None, :] * diameter[:, None, None] * slopes[None]
    basis = weights[:, None, :] * np.stack([np.ones(f_hz.size), lorentzian])[None]
    # Columns of each function are made orthogonal to its own basis.
    orthogonal = np.linalg.qr(basis.transpose(0, 2, 1))[0]
    columns = columns.transpose(0, 2, 1)
    columns = columns - orthogonal @ (orthogonal.conj().transpose(0, 2, 1) @ columns)
    return columns, weights * (values - origin[:, None] - diameter[:, None] * lorentzian)
