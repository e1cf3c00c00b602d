"""Poly-reference least-squares complex frequency estimator in the z domain (pLSCF, known as PolyMAX)."""

import numpy as np

from chladni.modal.experimental.companion import denominators, participation, stable_roots
from chladni.modal.experimental.line_weights import WeightedLines, Weighting, weighted_lines
from chladni.modal.experimental.reduced_normal_equations import reduced_normal_matrix
from chladni.modal.experimental.unit_circle import UnitCircle, unit_circle
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse

# Companion matrices up to this size are tried at every order; beyond, every second order keeps the chart as useful
# at half the time.
EVERY_ORDER = 250
# Decay rates, in lines, whose sign isn't sure: noise lets a resonance that is much narrower than a line grow by so
# much, where surplus poles grow by lines.
UNDECIDED = 0.05


def polyreference_poles(
    response: FrequencyResponse,
    *,
    max_order: int = 60,
    min_order: int = 1,
    order_step: int | None = None,
    band_hz: tuple[float, float] | None = None,
    weighting: Weighting = "std",
) -> PoleTable:
    """Find the stable poles of denominators of rising order, with their participation factors.

    Parameters
    ----------
    response
        Frequency responses of any form, one or more references; excited, finite lines within the band are used,
        which may leave gaps. The form measured is the form fitted: its noise is the flattest, and the factors of
        j omega between the forms are smooth in a band and go into the numerators.
    max_order
        Highest order of the denominator, 1 or more. Coefficients are complex and the band takes nine tenths of the
        circle, so order k gives k poles for each reference, all at positive frequencies: as many pairs as 2 k real
        coefficients give. Lowered, with a note, when the lines are too few.
    min_order, order_step
        Orders from `min_order` to `max_order`, in steps counted down from `max_order`. Without a step: 1, or 2
        when ``max_order`` times the references exceeds 250.
    band_hz
        Lowest and highest frequency of the lines used; by default all.
    weighting
        ``std``, ``uniform`` or ``relative``, see `chladni.modal.experimental.line_weights.weighted_lines`.

    Returns
    -------
    PoleTable
        By order, then frequency; vectors are participation factors ``[pole, reference]`` whose largest component
        is real. Poles lie within the band, give or take one line, above half a line from 0 Hz.

    Raises
    ------
    EstimateError
        When an order, the band or the weighting is impossible, or the lines are too few for `min_order`.

    Notes
    -----
    Guillaume, Verboven, Vanlanduit, Van der Auweraer and Peeters (2003), *A poly-reference implementation of the
    least-squares complex frequency-domain estimator*, IMAC XXI; Peeters et al. (2004), *The PolyMAX frequency-domain
    method*, Shock and Vibration 11. The lowest coefficient is the identity, so that poles that only fit noise come
    out unstable (Cauberghe et al. 2005); one that grows by less than a line can tell is taken for a decaying one.
    Numerators are of `max_order` at every order of the denominator.
    """
    if not 1 <= min_order <= max_order or (order_step is not None and order_step < 1):
        raise EstimateError(
            f"orders from {min_order} to {max_order} in steps of {order_step}: ask for 1 <= min_order <= max_order "
            f"and a step of 1 or more"
        )
    lines = weighted_lines(response, band_hz=band_hz, weighting=weighting)
    highest = min(max_order, _highest_order(lines))
    if highest < min_order:
        raise EstimateError(
            f"{lines.frequency_hz.size} lines carry polynomials up to order {highest}, min_order is {min_order}: "
            f"widen the band or lower min_order"
        )
    notes = lines.notes
    if highest < max_order:
        notes += (f"orders above {highest} left out: {lines.frequency_hz.size} lines don't determine them",)
    references = lines.reference_scale.size
    step = order_step or (1 if highest * references <= EVERY_ORDER else 2)
    orders = range(min_order + (highest - min_order) % step, highest + 1, step)
    try:
        return _pole_table(lines, unit_circle(lines.frequency_hz), orders, notes)
    except np.linalg.LinAlgError:
        raise EstimateError(
            f"the lines don't determine polynomials of order {highest}: lower max_order or widen the band"
        ) from None


def _highest_order(lines: WeightedLines) -> int:
    """Numerators take at most a quarter of the lines, and twice as many equations as unknowns are left for A."""
    responses, references = lines.values.shape[:2]
    count: int = lines.frequency_hz.size
    # More of either would let them follow single lines, and leakage of windows with them.
    by_equations: int = responses * (count - 1) // (responses + 2 * references)
    return min(count // 4, by_equations)


def _pole_table(lines: WeightedLines, circle: UnitCircle, orders: range, notes: tuple[str, ...]) -> PoleTable:
    references = lines.reference_scale.size
    matrix = reduced_normal_matrix(lines, circle, orders[-1])
    counts, poles, vectors = [], [], []
    for coefficients in denominators(matrix, references, orders):
        roots = stable_roots(coefficients, beyond=2 * np.pi * UNDECIDED / circle.length)
        pole = circle.pole(roots)
        pole = -np.abs(pole.real) + 1j * pole.imag
        kept = _in_band(pole, lines.frequency_hz, circle.step_hz)
        # Roots outside the band belong to the gap of the circle and to modes that the lines don't show.
        kept = kept[np.argsort(pole[kept].imag)]
        counts.append(kept.size)
        poles.append(pole[kept])
        vectors.append(participation(coefficients, roots[kept]))
    return PoleTable(
        orders=np.array(orders, dtype=np.int64),
        order=np.repeat(np.array(orders, dtype=np.int64), counts),
        pole=np.concatenate(poles),
        vector=_unit(np.concatenate(vectors) * lines.reference_scale),
        notes=notes,
    )


def _in_band(pole: Complex, frequency_hz: Real, step_hz: float) -> Index:
    # A pole nearer to 0 Hz than half a line decays within the record or doesn't oscillate: no line could tell.
    damped_hz = pole.imag / (2 * np.pi)
    low_hz = max(frequency_hz[0] - step_hz, step_hz / 2)
    return np.flatnonzero((pole.real < 0) & (damped_hz >= low_hz) & (damped_hz <= frequency_hz[-1] + step_hz))


def _unit(vectors: Complex) -> Complex:
    """Length 1, largest component real and positive."""
    if not vectors.size:
        return vectors
    largest = np.take_along_axis(vectors, np.argmax(np.abs(vectors), axis=1)[:, None], axis=1)
    turned = vectors * (np.abs(largest) / largest)
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))
