"""Even or odd, and of which motion: what a nonlinearity puts beside the band that is excited."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import fft

from chladni.gap.calibration import FAR, FEWEST, NOTICED, SMOOTH
from chladni.gap.comparison.linear_approximation import excited_alone
from chladni.gap.comparison.local_rational import unreached
from chladni.gap.comparison.periodicity import steady_periods
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.spectral.forms import MOTION_ORDER

#: What the basis answers with is taken for smooth over so many lines: a straight line over them.
_LINES = 2 * SMOOTH


@dataclass(frozen=True, slots=True, kw_only=True)
class ProductsOutside:
    """What explains the power above the excited band best.

    Attributes
    ----------
    motion
        Names of one output, or of two between which the motion is.
    even, odd
        Shares of that power, over all outputs, that even functions of the motion explain beyond odd ones, and odd
        ones beyond even ones. In a finite record each imitates the other a little.
    both
        Share that they explain together.
    """

    motion: tuple[str, ...]
    even: float
    odd: float
    both: float

    def sentence(self) -> str:
        """Say it."""
        where = f"between {self.motion[0]} and {self.motion[1]}" if len(self.motion) > 1 else f"of {self.motion[0]}"
        kinds = [kind for kind, share in (("odd", self.odd), ("even", self.even)) if share >= NOTICED]
        return (
            f"{max(self.both, 0.0):.0%} of the distortion above the excited band follows the motion {where}: "
            f"{max(self.odd, 0.0):.0%} only by odd functions of it, {max(self.even, 0.0):.0%} only by even ones "
            f"({' and '.join(kinds) or 'neither'} told from chance)"
        )


def products_outside(measurement: Measurement) -> ProductsOutside | None:
    """Tell even from odd distortion where all lines of a band are excited.

    Above the band a linear machine is still; all power there was made by a nonlinearity. To a force f(d) of a motion
    d the outputs answer linearly, Y(k) = H(k) F(k) with a smooth H. Of every output and every difference of two the
    displacement d is taken as measured on the excited lines. Even functions of it (abs(d), d^2, abs(d) beyond a dead
    zone) and odd ones (the same with the sign of d, d^3, the sign of the velocity) are fitted to Y, each with an H
    that is straight over 62 lines, and the motion that explains most is given. There's None without a period or with
    several inputs, where the band leaves no room below half the sample rate, or where noise is all there is.
    """
    found = excited_alone(measurement)
    index = None if found is None else _blocks(found[1])
    if found is None or index is None:
        return None
    excited, period = found[1], int(measurement.period_samples or 1)
    periods = fft.rfft(steady_periods(measurement.outputs, measurement), axis=2)
    mean = periods.mean(axis=1)
    noise = np.mean(np.abs(periods - mean[:, None]) ** 2, axis=1) / (periods.shape[1] - 1)
    loud = (np.abs(mean[:, index]) ** 2).mean(axis=2) > FAR * noise[:, index].mean(axis=2)
    if np.sum(np.all(loud, axis=0)) < FEWEST:
        return None
    index = index[np.all(loud, axis=0)]
    motions = _motions(measurement, mean, excited, period)
    explained = [_explained(name, motion, mean, index) for name, motion in motions]
    return max(explained, key=lambda one: one.both, default=None)


def _blocks(excited: Mask) -> Index | None:
    """``[block, line]`` indices of the lines above the band; None where there are few."""
    highest = int(np.flatnonzero(excited)[-1]) if np.any(excited) else 0
    first = highest + 1
    # Sums of three excited frequencies reach three times as far as the band.
    last = min(excited.size - 1, 3 * highest)
    count = (last - first) // _LINES
    if highest == 0 or count < FEWEST:
        return None
    return (first + np.arange(count * _LINES)).reshape(count, _LINES)


def _motions(
    measurement: Measurement, mean: Complex, excited: Mask, period: int
) -> Iterator[tuple[tuple[str, ...], tuple[Real, Real]]]:
    """Displacement and velocity ``[sample]`` of outputs and of differences of two, of unit RMS."""
    # In radians a period; scaled to unit RMS later, so that the rate doesn't matter.
    omega = 2 * np.pi * np.arange(excited.size)
    names, units = measurement.output_names, measurement.output_units
    # Distortion within the band is in it too, but small there against the response.
    inside = np.where(excited, mean, 0.0)
    candidates: list[tuple[tuple[str, ...], Complex, str]]
    candidates = [((name,), row, unit) for name, row, unit in zip(names, inside, units, strict=True)]
    for one, other in combinations(range(len(names)), 2):
        if units[one] == units[other]:
            candidates.append(((names[one], names[other]), inside[other] - inside[one], units[one]))
    for name, row, unit in candidates:
        order = MOTION_ORDER.get(unit, 0)
        spectrum = np.divide(row, (1j * omega) ** order, out=np.zeros_like(row), where=excited)
        displacement, velocity = (fft.irfft(one, period) for one in (spectrum, 1j * omega * spectrum))
        if displacement.std() > 0:
            yield name, (displacement / displacement.std(), velocity / velocity.std())


def _explained(name: tuple[str, ...], motion: tuple[Real, Real], mean: Complex, index: Index) -> ProductsOutside:
    d, s = motion
    even, odd = (fft.rfft(one, axis=1) for one in (even_functions(d), odd_functions(d, s)))
    targets = mean[:, index].transpose(1, 2, 0)
    shares = [_share(basis[:, index], targets) for basis in (even, odd, np.concatenate([even, odd]))]
    # Beyond chance, a share may come out below zero; the other's own part would then exceed the whole.
    alone_even, alone_odd, both = (max(share, 0.0) for share in shares)
    return ProductsOutside(motion=name, even=both - alone_odd, odd=both - alone_even, both=both)


def _share(basis: Complex, targets: Complex) -> float:
    """Share of the power of ``[block, line, output]`` that ``[function, block, line]`` explain beyond chance."""
    powers = np.linspace(-1, 1, _LINES)[:, None] ** np.arange(2)
    terms = basis.transpose(1, 2, 0)[:, :, :, None] * powers[:, None, :]
    regressors = terms.reshape(*terms.shape[:2], -1)
    # Output by output, so that a loud one doesn't speak for all; random functions explain their number over
    # _LINES.
    left = np.sum(np.abs(unreached(regressors, targets)) ** 2, axis=(0, 1))
    whole = np.sum(np.abs(targets) ** 2, axis=(0, 1))
    return float(1 - np.mean(left / whole) * _LINES / (_LINES - regressors.shape[2]))


def even_functions(displacement: Real) -> Real:
    """``[function, ..., sample]`` of a displacement ``[..., sample]`` of about unit RMS: abs(d), d^2, dead zones."""
    size = np.abs(displacement)
    return np.array([size, displacement**2, *(np.maximum(size - zone, 0.0) for zone in (1.0, 2.0))])


def odd_functions(displacement: Real, velocity: Real) -> Real:
    """``[function, ..., sample]``: d abs(d), d^3, dead zones with the sign of d, and the sign of the velocity."""
    size, side = np.abs(displacement), np.sign(displacement)
    beyond = [side * np.maximum(size - zone, 0.0) for zone in (1.0, 2.0)]
    return np.array([displacement * size, displacement**3, *beyond, np.sign(velocity)])
