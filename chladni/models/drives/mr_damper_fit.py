"""Coefficients of a magnetorheological damper from measured strokes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.drives.mr_coefficients import MrCoefficients
from chladni.models.drives.mr_fit_layout import MrLayout, layout_of
from chladni.models.drives.mr_record import MrRecord
from chladni.models.integrator.known_motion import force_along_motion
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.renamed import renamed

# Where a trial's force grows beyond all numbers it counts as this many times the measured RMS.
_BEYOND = 1e3
_ITERATIONS = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class MrError:
    """How far the simulated force is from a measured one.

    Attributes
    ----------
    name, current_a
        Of the record.
    of_rms_force
        RMS error over RMS force.
    of_peak_to_peak
        RMS error over the force's peak to peak.
    """

    name: str
    current_a: float
    of_rms_force: float
    of_peak_to_peak: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MrFit:
    """Result of `fit_mr_damper`.

    Attributes
    ----------
    coefficients
        With the origin that was told.
    order
        Of the polynomials in current.
    errors
        One for each record, on all of its samples.
    at_bounds
        Numbers that ended at the edge of what's allowed: these records don't determine them.
    starts
        RMS error over RMS force, all records pooled, that each start ended with; close values mean that the
        minimum was found more than once.
    notes
        Of the records.
    """

    coefficients: MrCoefficients
    order: int
    errors: tuple[MrError, ...]
    at_bounds: tuple[str, ...]
    starts: tuple[float, ...]
    notes: tuple[str, ...]


@renamed(rate_hz="sample_rate_hz")
def fit_mr_damper(
    records: Sequence[MrRecord],
    *,
    order: int | None = None,
    asymmetry: bool = False,
    lowest_k1: float | None = 0.0,
    starts: int = 3,
    seed: int = 0,
    sample_rate_hz: float = 100.0,
    origin: str = "",
) -> MrFit:
    """Fit the modified Bouc-Wen law (equation 5) to measured strokes, all at once.

    Least squares of simulated minus measured force along the measured motion, from rest, each record scaled by its
    RMS force; trust-region reflective method (Branch, Coleman, Li 1999, SciPy's ``trf``) from several starts. The
    polynomials are fitted in Bernstein form with positive coefficients, so that they're positive between the
    currents too. delta is the inverse of a yield displacement and ``beta + gamma = delta``, which makes
    abs(z) <= 1 and alpha the force of the loop: the law has one number too many otherwise.

    Parameters
    ----------
    records
        One or more, at any currents.
    order
        Of the polynomials in current; None for the highest that the currents determine, at most 3.
    asymmetry
        Whether to fit compression, rest and extension apart, see
        `chladni.models.drives.mr_coefficients.MrAsymmetry`.
    lowest_k1
        N/m. 0 keeps a joint with nothing but the damper from running away; None lets k1 be negative.
    starts
        How many starts; the first is a rule of thumb, the others scatter around it.
    seed
        Of that scatter.
    sample_rate_hz
        Samples a second, at least, that the fit looks at; the errors told are of all samples.
    origin
        Kept with the coefficients.

    Raises
    ------
    EstimateError
        When the currents don't determine the order, or 0 A is missing where the current is to be followed.
    """
    order = _order(records, order)
    layout = layout_of(records, order=order, asymmetry=asymmetry, lowest_k1=lowest_k1)
    # The law is slow beside the rate of a log: half the samples tell as much in half the time.
    thinned = [record.thinned(sample_rate_hz) for record in records]
    found = [_from_start(layout, thinned, start) for start in _starts(layout, thinned, starts, seed)]
    # The lowest of several: nothing says that least squares of a hysteresis has one minimum.
    best = min(found, key=lambda each: each[1])[0]
    coefficients = layout.coefficients(best, origin)
    return MrFit(
        coefficients=coefficients,
        order=order,
        errors=tuple(mr_error(coefficients, record) for record in records),
        at_bounds=layout.at_bounds(best),
        starts=tuple(error for _, error in found),
        notes=tuple(f"{record.name}: {note}" for record in records for note in record.notes),
    )


def mr_force(coefficients: MrCoefficients, record: MrRecord) -> Real:
    """Force ``[sample]`` that the damper would have shown along the record's motion, from rest."""
    law = coefficients.law(record.current_a)
    return force_along_motion(law, record.displacement, record.velocity, record.times_s)


def mr_error(coefficients: MrCoefficients, record: MrRecord) -> MrError:
    """How far the damper is from a record, on all of its samples."""
    rms = float(np.sqrt(np.mean((mr_force(coefficients, record) - record.force) ** 2)))
    return MrError(
        name=record.name,
        current_a=record.current_a,
        of_rms_force=rms / record.rms_force,
        of_peak_to_peak=rms / float(np.ptp(record.force)),
    )


def _order(records: Sequence[MrRecord], order: int | None) -> int:
    if not records:
        raise EstimateError("no record to fit; give at least one")
    currents = sorted({record.current_a for record in records})
    highest = min(3, len(currents) - 1)
    told = ", ".join(f"{current:g}" for current in currents)
    if order is None:
        order = highest
    if not 0 <= order <= highest:
        raise EstimateError(
            f"order {order}: {len(currents)} currents ({told} A) determine polynomials up to order {highest}; "
            "measure at more currents or lower the order"
        )
    # Off the coil the damper is another device: everything that current adds is counted from there.
    if order > 0 and currents[0] != 0.0:
        raise EstimateError(f"currents {told} A: without a record at 0 A the constant of each polynomial is a guess")
    return order


def _starts(layout: MrLayout, records: Sequence[MrRecord], count: int, seed: int) -> list[Real]:
    rng = np.random.default_rng(seed)
    first = layout.start
    if layout.asymmetry:
        # What the plain law finds is close to what the extended one finds; its own numbers start at zero.
        plain = _from_start(layout.without_asymmetry(), records, first[: layout.plain])[0]
        first = np.concatenate([plain, first[layout.plain :]])
    scattered = [first + layout.scatter * rng.standard_normal(first.size) for _ in range(max(0, count - 1))]
    return [layout.inside(start) for start in [first, *scattered]]


def _from_start(layout: MrLayout, records: Sequence[MrRecord], start: Real) -> tuple[Real, float]:
    """Vector of least squares, and the pooled error there."""
    from scipy.optimize import least_squares

    # Differences, not sensitivities: fixed steps make the force smooth in the vector.
    def residual(vector: Real) -> Real:
        coefficients = layout.coefficients(vector, "")
        return np.concatenate([_scaled_error(coefficients, record) for record in records])

    solved = least_squares(
        residual,
        layout.inside(start),
        bounds=(layout.low, layout.high),
        x_scale=layout.scale,
        max_nfev=_ITERATIONS,
    )
    return np.asarray(solved.x, dtype=np.float64), float(np.sqrt(2.0 * solved.cost / len(records)))


def _scaled_error(coefficients: MrCoefficients, record: MrRecord) -> Real:
    error = (mr_force(coefficients, record) - record.force) / record.rms_force
    # Least squares needs finite numbers, large enough to turn back from.
    bounded = np.clip(np.nan_to_num(error, nan=_BEYOND), -_BEYOND, _BEYOND)
    return np.asarray(bounded / np.sqrt(error.size), dtype=np.float64)
