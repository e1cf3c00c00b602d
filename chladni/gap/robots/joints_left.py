"""What a fit leaves at each joint, and what that says of it."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import DETAILS, ELSEWHERE, USUAL
from chladni.signals.arrays import Real

#: Share by which the noise of a torque is known.
_DOUBT = 0.3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointsLeft:
    """What a fit leaves at joints, as whitened energy; noise alone leaves `count`.

    Attributes
    ----------
    energy, count
        ``[row]``: left, and expected of noise alone.
    force
        ``[row]``: energy that the joint's own laws and limits of its drive explain: these idealise a part of it. Zero
        without any, infinite for a torque of any shape.
    """

    energy: Real
    count: Real
    force: Real

    @property
    def over_noise(self) -> Real:
        """``[row]``: energy over the noise's."""
        return np.asarray(self.energy / np.maximum(self.count, 1.0))

    @property
    def log_likelihood(self) -> Real:
        """``[row]``: nats, by the evidence of every diagnosis (`Left`).

        What is left beyond the noise is worth few numbers as far as it's the usual detail of the joint's own laws,
        and many beyond. Where one ends the other begins as flat, so that there's one best fit.
        """
        # The square of a real number costs half of a complex line's; of the noise's own level little is told.
        beyond, doubted = self._beyond, _DOUBT * self.count / 2.0
        told = beyond**2 / np.where(beyond > 0, beyond + doubted, 1.0)
        inside = np.minimum(told, self._usual)
        flat = 1.0 + inside / DETAILS
        return np.asarray(-DETAILS * np.log(flat) - ELSEWHERE * np.log1p((told - inside) / (ELSEWHERE * flat)))

    @property
    def weight(self) -> Real:
        """``[row]``: times that a unit of energy costs as much as of noise alone."""
        beyond = self._beyond
        inside = np.minimum(beyond, self._usual)
        return np.asarray(1.0 / (1.0 + inside / DETAILS + (beyond - inside) / ELSEWHERE))

    def of_any_shape(self) -> "JointsLeft":
        """Give the same where a torque of any shape explains as much as it takes."""
        return replace(self, force=np.full_like(self.energy, np.inf))

    @property
    def _beyond(self) -> Real:
        """``[row]``: half the energy beyond the noise's."""
        return np.maximum(self.energy - self.count, 0.0) / 2.0

    @property
    def _usual(self) -> Real:
        """``[row]``: half the energy of the usual details of laws."""
        return USUAL**2 * self.force / 2.0
