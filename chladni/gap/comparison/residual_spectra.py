"""Spectra of residuals in blocks of lines: densities, and what of one output the others don't share."""

from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import FEWEST, RIDGE
from chladni.signals.arrays import Complex, Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResidualSpectra:
    """Spectra of what isn't explained, in blocks of neighbouring lines.

    Attributes
    ----------
    residual
        ``[block, line, output]``, scaled so that the sum of its squares over lines is the power density, in cycles
        a sample: the mean density over 0..1/2 is the mean square.
    freedom
        ``[block, output]`` complex degrees of freedom of each residual.
    edges
        ``[block + 1]`` cycles a sample.
    """

    residual: Complex
    freedom: Real
    edges: Real

    def densities(self) -> Real:
        """``[output, block]`` power density."""
        return np.asarray(np.sum(np.abs(self.residual) ** 2, axis=1).T)

    def incoherent_densities(self) -> Real:
        """``[output, block]`` power density of what the other outputs don't share.

        With S the cross-spectral matrix of the residuals, 1/[S^-1]_jj is what is left of output j after regression
        on all others (Bendat & Piersol 2010, section 7.3). Noise of the sensors is their own; a force that nobody
        modelled reaches all of them, so it goes. For S = L L^H + N with N diagonal, 1/[S^-1]_jj >= N_jj: it bounds
        the sensor's noise from above. Of nu degrees of freedom the regression takes one for each other output.
        """
        products = np.einsum("bli,blj->bij", self.residual, self.residual.conj())
        power = np.einsum("bii->bi", products).real
        outputs = power.shape[1]
        left = self.freedom - (outputs - 1)
        if outputs == 1 or not np.all(power > 0) or np.any(left < FEWEST):
            return self.densities()
        # Outputs differ in size by orders of magnitude; with unit power each, inversion loses nothing.
        scale = np.sqrt(power)
        # Loaded, since residuals without noise can be one signal to the last digit.
        scaled = products / (scale[:, :, None] * scale[:, None, :]) + RIDGE * np.eye(outputs)
        own = power / np.einsum("bii->bi", np.linalg.inv(scaled)).real
        return np.asarray((own * self.freedom / left).T)
