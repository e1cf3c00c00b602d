"""How much of each output no linear system gives: even and odd distortion, told from noise by a periodic input."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from chladni.gap.calibration import BLOCK, FEWEST, LINES_A_TERM, LOCAL_TERMS
from chladni.gap.comparison.linear_approximation import excited_alone
from chladni.gap.comparison.local_rational import POLES, output_error
from chladni.gap.comparison.periodicity import steady_periods
from chladni.gap.records.diagnosis import DistortionShare
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.signals.errors import EstimateError


@dataclass(frozen=True, slots=True, kw_only=True)
class Distortion:
    """What a periodic input tells about nonlinearity, output by output, and what it doesn't allow to be told."""

    shares: tuple[DistortionShare, ...]
    remarks: tuple[str, ...]


def distortion_of(measurement: Measurement) -> Distortion | None:
    """Split the power of each output into linear, even, odd and noise.

    A nonlinearity of even degree answers a periodic input that has odd lines only with even lines; one of odd degree
    with odd lines. Noise is what differs between periods. On excited lines the odd distortion is read from the odd
    lines nearby that aren't excited (detection lines; Pintelon & Schoukens, *System Identification*, 2nd ed., section
    4.3), and where there are none from how rough the frequency response is from line to line. When even lines are
    excited too, even and odd distortion fall on the same lines and only their sum is given. There's None when the
    input isn't periodic, has fewer than two steady periods, or several inputs move at once.
    """
    found = excited_alone(measurement)
    if found is None or not np.any(found[1]):
        return None
    name, excited = found
    odd_only = not np.any(excited[::2])
    steady = steady_periods(measurement.outputs, measurement)
    row = [measurement.input_names.index(name)]
    u = _spectra(steady_periods(measurement.inputs[row], measurement).mean(axis=1))[0]
    splits = [
        _split(output, u, periods, excited, odd_only=odd_only)
        for output, periods in zip(measurement.output_names, steady, strict=True)
    ]
    remarks = []
    if not odd_only:
        remarks.append(
            "even lines are excited too, so even and odd distortion can't be told apart inside the band; excite odd "
            "lines only"
        )
    if not all(known for _, known in splits):
        remarks.append("too few lines are excited to tell distortion on them from the linear response")
    return Distortion(shares=tuple(share for share, _ in splits), remarks=tuple(remarks))


def distortion_where_told(measurement: Measurement) -> Distortion | None:
    """Give `distortion_of`; None, too, where the record is too short for its spectra."""
    try:
        return distortion_of(measurement)
    except EstimateError:
        return None


def _spectra(signals: Real) -> Complex:
    """``[..., line]`` of ``[..., sample]``; the square of a line is its power, 0 Hz left out."""
    samples = signals.shape[-1]
    lines = fft.rfft(signals, axis=-1) * (np.sqrt(2) / samples)
    lines[..., 0] = 0.0
    if samples % 2 == 0:
        lines[..., -1] /= np.sqrt(2)
    return np.asarray(lines)


def _split(output: str, u: Complex, periods: Real, excited: Mask, *, odd_only: bool) -> tuple[DistortionShare, bool]:
    """Split one output ``[period, sample]``; also whether the distortion on excited lines could be told.

    With `odd_only` its even lines are no detection lines for odd ones.
    """
    count = len(periods)
    spectra = _spectra(periods)
    y = spectra.mean(axis=0)
    scatter = np.sum(np.abs(spectra - y) ** 2, axis=0) / (count - 1)
    # The mean of the periods carries its share of the noise too.
    repeated = np.abs(y) ** 2 - scatter / count
    line = np.arange(u.size)
    # Sums first, clipped later: noise makes single lines negative, and clipping those would add up.
    even = float(repeated[~excited & (line % 2 == 0)].sum())
    beside = float(repeated[~excited & (line % 2 == 1)].sum())
    told = _detected(repeated, excited, step=2 if odd_only else 1)
    if told is None:
        told = _roughness(u[excited], y[excited], scatter[excited] / count, line[excited])
    answered = max(float(repeated[excited].sum()), 0.0)
    # Distortion can't be more than what is there.
    on_excited = min(max(told or 0.0, 0.0), answered)
    linear, noise = answered - on_excited, float(scatter.sum())
    even, odd = max(even, 0.0), max(beside, 0.0) + on_excited
    whole = linear + even + odd + noise
    share = [power / whole if whole > 0 else 0.0 for power in (linear, even, odd, noise, even + odd)]
    split = DistortionShare(
        output=output,
        linear=share[0],
        even=share[1] if odd_only else None,
        odd=share[2] if odd_only else None,
        noise=share[3],
        nonlinear=share[4],
    )
    return split, told is not None


def _detected(repeated: Real, excited: Mask, *, step: int) -> float | None:
    """Power on the excited lines as their nearest detection lines have it; None with few of those."""
    lines = np.flatnonzero(excited)
    # Outside of the band the machine answers differently; those lines say nothing of the excited ones.
    inside = np.arange(lines[0], lines[-1] + 1, step)
    detection = inside[~excited[inside]]
    if detection.size < FEWEST:
        return None
    near = min(BLOCK, detection.size)
    first = np.clip(np.searchsorted(detection, lines) - near // 2, 0, detection.size - near)
    sums = np.concatenate([[0.0], np.cumsum(repeated[detection])])
    return float(np.sum(sums[first + near] - sums[first]) / near)


def _roughness(u: Complex, y: Complex, noise: Real, line: Index) -> float | None:
    """Power by which the response to neighbouring excited lines scatters about a smooth one; None with few lines."""
    size = LINES_A_TERM * (LOCAL_TERMS + POLES)
    blocks = u.size // size
    if blocks < 1:
        return None
    # The last block reaches back over the one before, so that no line is left out.
    first = np.minimum(np.arange(blocks + (u.size % size > 0)) * size, u.size - size)
    index = first[:, None] + np.arange(size)
    places = line[index].astype(np.float64)
    # Odd lines and combs aren't neighbours; the polynomials go over their true places.
    centre, half = (places[:, -1:] + places[:, :1]) / 2, (places[:, -1:] - places[:, :1]) / 2
    left = output_error(u[index][:, :, None], y[index], (places - centre) / half)
    power = np.mean(np.abs(left) ** 2) * size / (size - LOCAL_TERMS - POLES) - noise.mean()
    return float(power * u.size)
