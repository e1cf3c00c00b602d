"""How much of each output no linear system gives: even and odd distortion, told from noise by a periodic input."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from chladni.gap.calibration import BLOCK, FEWEST, LINES_A_TERM, LOCAL_TERMS
from chladni.gap.comparison.linear_approximation import moving_inputs, period_spectra
from chladni.gap.comparison.local_rational import POLES, output_error
from chladni.gap.comparison.periodicity import periods_of
from chladni.gap.records.diagnosis import DistortionShare
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value
from chladni.spectral.excitation import DYNAMIC_RANGE, excited_lines


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Distortion(Value):
    """What a periodic input tells about nonlinearity.

    Attributes
    ----------
    shares
        Output by output, adding up to 1. Empty when even and odd can't be told apart.
    output_names
        Names of the rows below.
    linear, nonlinear, noise
        ``[output]`` shares of the power: what a linear system gives, distortion of any kind, and what doesn't repeat.
    remarks
        What the excitation doesn't allow to be told.
    """

    shares: tuple[DistortionShare, ...]
    output_names: tuple[str, ...]
    linear: Real
    nonlinear: Real
    noise: Real
    remarks: tuple[str, ...]

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def told(self) -> tuple[DistortionShare, ...]:
        """`shares`; where even and odd can't be told apart, the split without them."""
        if self.shares:
            return self.shares
        return tuple(
            DistortionShare(
                output=name, linear=float(linear), even=None, odd=None, noise=float(noise), nonlinear=float(nonlinear)
            )
            for name, linear, nonlinear, noise in zip(
                self.output_names, self.linear, self.nonlinear, self.noise, strict=True
            )
        )


def distortion_of(measurement: Measurement) -> Distortion | None:
    """Split the power of each output into linear, even, odd and noise.

    A nonlinearity of even degree answers a periodic input that has odd lines only with even lines; one of odd degree
    with odd lines. Noise is what differs between periods. On excited lines the odd distortion is read from the odd
    lines nearby that aren't excited (detection lines; Pintelon & Schoukens, *System Identification*, 2nd ed.,
    section 4.3), and where there are none from how rough the frequency response is from line to line. When even
    lines are excited too, even and odd distortion fall on the same lines and only their sum is given.

    Returns
    -------
    Distortion or None
        None when the input isn't periodic, has fewer than two steady periods, or several inputs move at once.
    """
    names = moving_inputs(measurement)
    spectra = period_spectra(measurement)
    if spectra is None or len(names) != 1 or measurement.period_samples is None:
        return None
    power = spectra.density[spectra.index(names[0]), spectra.index(names[0])].real
    # Of a sine all other lines are rounding errors, which repeat too.
    excited = excited_lines(spectra, names)[0] & (power > DYNAMIC_RANGE * power.max())
    if not np.any(excited):
        return None
    odd_only = not np.any(excited[::2])
    steady = _steady(measurement.outputs, measurement)
    u = _spectra(_steady(measurement.inputs[[measurement.input_names.index(names[0])]], measurement).mean(axis=1))[0]
    splits = [_split(u, periods, excited, odd_only=odd_only) for periods in steady]
    return _told(splits, measurement.output_names, odd_only=odd_only)


def distortion_where_told(measurement: Measurement) -> Distortion | None:
    """Give `distortion_of`; None, too, where the record is too short for its spectra."""
    try:
        return distortion_of(measurement)
    except EstimateError:
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Split:
    """Powers of one output; `known` is whether the distortion on excited lines could be told."""

    linear: float
    even: float
    odd: float
    noise: float
    known: bool

    def share(self, power: float) -> float:
        """Power over that of the whole output, without its mean."""
        total = self.linear + self.even + self.odd + self.noise
        return power / total if total > 0 else 0.0


def _steady(signals: Real, measurement: Measurement) -> Real:
    """``[signal, period, sample]`` after the transient periods."""
    return periods_of(signals, measurement.period_samples or 1)[:, measurement.transient_periods :]


def _spectra(signals: Real) -> Complex:
    """``[..., line]`` of ``[..., sample]``; the square of a line is its power, 0 Hz left out."""
    samples = signals.shape[-1]
    lines = fft.rfft(signals, axis=-1) * (np.sqrt(2) / samples)
    lines[..., 0] = 0.0
    if samples % 2 == 0:
        lines[..., -1] /= np.sqrt(2)
    return np.asarray(lines)


def _split(u: Complex, periods: Real, excited: Mask, *, odd_only: bool) -> _Split:
    """Split one output ``[period, sample]``; with `odd_only` its even lines are no detection lines for odd ones."""
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
    return _Split(
        linear=answered - on_excited,
        even=max(even, 0.0),
        odd=max(beside, 0.0) + on_excited,
        noise=float(scatter.sum()),
        known=told is not None,
    )


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


def _told(splits: list[_Split], names: tuple[str, ...], *, odd_only: bool) -> Distortion:
    remarks = []
    if not odd_only:
        remarks.append(
            "even lines are excited too, so even and odd distortion can't be told apart inside the band; excite odd "
            "lines only"
        )
    if not all(split.known for split in splits):
        remarks.append("too few lines are excited to tell distortion on them from the linear response")
    shares = [
        DistortionShare(
            output=name,
            linear=split.share(split.linear),
            even=split.share(split.even),
            odd=split.share(split.odd),
            noise=split.share(split.noise),
            nonlinear=split.share(split.even + split.odd),
        )
        for name, split in zip(names, splits, strict=True)
    ]
    return Distortion(
        shares=tuple(shares) if odd_only else (),
        output_names=names,
        linear=np.array([one.linear for one in shares]),
        nonlinear=np.array([one.nonlinear for one in shares]),
        noise=np.array([one.noise for one in shares]),
        remarks=tuple(remarks),
    )
