"""Residuals of a free run as white noise, on the samples that a fit may see, and what they cost."""

from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import ZERO
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError


@dataclass(frozen=True, slots=True)
class Residual:
    """Whitened residual of one free run: ``white [output, training sample]``, and its mean square ``power [output]``.

    ``offsets [output]`` are constants that were taken out, in the output's unit.
    """

    white: Real
    power: Real
    offsets: Real


class Whitening:
    """Whitens signals over the whole record, then keeps the training samples and takes constants out.

    Each output may have an unknown constant, an offset, which no dynamic model explains.
    """

    def __init__(self, noise: NoiseFloor, training: Mask, *, offsets: bool) -> None:
        if not training.any():
            raise EstimateError("no sample is left to fit on; give at least some as training")
        self._noise, self.training = noise, training
        self._places = np.flatnonzero(training)
        self.samples = int(self._places.size)
        self._whole = bool(training.all())
        self._offsets = offsets
        self._constant = self._kept(self.whitened(np.ones((noise.rms.size, training.size))))
        self._size = np.maximum(np.sum(self._constant**2, axis=1), ZERO)

    def whitened(self, signals: Real) -> Real:
        """``[..., output, sample]`` divided by the noise, its colour taken out."""
        return self._noise.whitened(signals)

    def seen(self, signals: Real) -> Real:
        """``[..., output, training sample]``: whitened."""
        return self._kept(self.whitened(signals))

    def constants(self) -> Real:
        """``[constant, output, training sample]``: what an offset of each output adds; none without offsets."""
        count = len(self._constant) if self._offsets else 0
        columns = np.zeros((count, *self._constant.shape))
        places = np.arange(count)
        columns[places, places] = self._constant[places]
        return columns

    def residual(self, missed: Real) -> Residual:
        """Judge ``[output, sample]`` of measured minus simulated."""
        white = self._kept(self.whitened(missed))
        offsets = np.einsum("os,os->o", white, self._constant) / self._size * self._offsets
        white = white - offsets[:, None] * self._constant
        # A run that is leaving the numbers costs more than any other; that is all a fit has to know.
        with np.errstate(over="ignore"):
            power = np.mean(white**2, axis=1)
        return Residual(white=white, power=power, offsets=offsets)

    def _kept(self, white: Real) -> Real:
        return white if self._whole else np.take(white, self._places, axis=-1)


def likelihood_cost(power: Real, samples: int) -> float:
    """Negative log-likelihood of whitened residuals whose true variance is unknown, but at least 1.

    ``sum_j N/2 (v_j if v_j < 1 else 1 + ln v_j)``: the variance of each output is taken as what makes it most likely.
    An unmodelled effect then weighs on the parameters as noise of its size would, not as a hundred sigma.
    """
    return float(0.5 * samples * np.sum(np.where(power < 1.0, power, 1.0 + np.log(np.maximum(power, 1.0)))))


def weights(power: Real) -> Real:
    """``[output]`` weight of squared residuals: slope of `likelihood_cost` over ``N v_j/2``."""
    return np.asarray(1.0 / np.maximum(power, 1.0))
