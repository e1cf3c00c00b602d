"""The noise of each measured output: its spectrum as an autoregressive model, and where the estimate comes from."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import GRID
from chladni.signals.arrays import Mask, Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NoiseFloor(Value):
    """What no model can get under, output by output.

    The noise of output j is modelled as autoregressive, ``sum_k whitening[j, k] e[n - k] = innovation_rms[j] w[n]``
    with white w of unit variance and ``whitening[j, 0] = 1`` (Ljung, *System Identification*, 2nd ed., section 4.2).

    Attributes
    ----------
    rms
        ``[output]``, in the output's unit.
    whitening
        ``[output, lag]``; a white noise has 1, 0, 0, ...
    innovation_rms
        ``[output]``, in the output's unit: what is left of the noise when its own past is known.
    method
        Where each comes from: ``periods``, ``quiet band``, ``fit residual`` or ``explained residual``.
    std
        ``[output]`` relative standard deviation of `rms`.
    upper_bound
        ``[output]`` whether distortion can be in the estimate too, so that the true floor lies lower.
    """

    rms: Real
    whitening: Real
    innovation_rms: Real
    method: tuple[str, ...]
    std: Real
    upper_bound: Mask

    def __post_init__(self) -> None:
        self._freeze()

    def lowered(self, share: Real) -> "NoiseFloor":
        """Give the floor with ``share [output]`` of its power left; shares above 1 change nothing."""
        factor = np.sqrt(np.minimum(share, 1.0))
        return replace(self, rms=self.rms * factor, innovation_rms=self.innovation_rms * factor)

    def raised(self, rms: Real) -> "NoiseFloor":
        """Give the floor with white noise of ``rms [output]`` where that is more than it was."""
        louder = rms > self.rms
        white = np.zeros_like(self.whitening)
        white[:, 0] = 1.0
        return replace(
            self,
            rms=np.where(louder, rms, self.rms),
            innovation_rms=np.where(louder, rms, self.innovation_rms),
            whitening=np.where(louder[:, None], white, self.whitening),
        )

    def density(self, cycles: Real) -> Real:
        """Give ``[output, line]`` power density at `cycles` a sample, unit^2; over 0..1 its mean is rms^2."""
        lags = np.arange(self.whitening.shape[1])
        response = self.whitening @ np.exp(-2j * np.pi * np.multiply.outer(lags, cycles))
        return np.asarray(self.innovation_rms[:, None] ** 2 / np.abs(response) ** 2, dtype=np.float64)

    def one_sided(self, sample_rate_hz: float) -> Real:
        """Give ``[output, line]`` power density from 0 to half the sample rate, unit^2/Hz; it adds up to rms^2."""
        return 2 / sample_rate_hz * self.density(np.linspace(0.0, 0.5, 4 * GRID + 1))

    def whitened(self, residual: Real) -> Real:
        """Give ``[..., output, sample]`` residuals as white noise of unit variance, were they noise alone."""
        if not np.any(self.whitening[:, 1:]):
            return np.asarray(residual / self.innovation_rms[:, None])
        white = np.empty_like(residual)
        count = residual.shape[-1]
        for place, (own, scale) in enumerate(zip(self.whitening, self.innovation_rms, strict=True)):
            lags = np.trim_zeros(own / scale, "b")
            for index in np.ndindex(residual.shape[:-2]):
                # A short filter costs a convolution a tenth of what it costs a recursive filter.
                white[(*index, place)] = np.convolve(residual[(*index, place)], lags)[:count]
        return white
