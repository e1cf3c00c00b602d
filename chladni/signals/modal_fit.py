"""Frequency responses synthesised from modes, and how far they are from the measured ones."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.value import Value, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalFit(Value):
    """Synthesis of the functions that the modes were identified from.

    Attributes
    ----------
    frequency_hz
        ``[line]`` the lines that were fitted.
    synthesised
        ``[response, reference, line]`` complex, in the form and unit of the measured functions.
    lower_residual, upper_residual
        ``[response, reference]`` complex: what modes below and above the band leave, as receptance
        lower/(j omega)^2 + upper (Maia & Silva 1997, section 4.3).
    error
        Root of the summed squares of (measured - synthesised) over that of measured, over all functions and lines.
    function_error
        ``[response, reference]`` the same of each function.
    bands_hz
        ``[band, 2]`` low and high end of each band, one around each mode, without gaps between.
    band_error
        ``[band]`` the same over all functions in each band.
    poles_hz
        ``[pole]`` frequencies of all poles in the synthesis, rising: those of the modes, and of others that were
        found and weren't asked for.
    """

    frequency_hz: Real
    synthesised: NDArray[np.complexfloating]
    lower_residual: NDArray[np.complexfloating]
    upper_residual: NDArray[np.complexfloating]
    error: float
    function_error: Real
    bands_hz: Real
    band_error: Real
    poles_hz: Real

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        functions = self.function_error.shape
        require_shape("synthesised", self.synthesised, (*functions, self.frequency_hz.size), "functions x lines")
        for name in ("lower_residual", "upper_residual"):
            require_shape(name, getattr(self, name), functions, "responses x references")
        require_shape("bands_hz", self.bands_hz, (self.band_error.size, 2), "bands x (low, high)")
        self._freeze()

    def others(self, modes: int) -> int:
        """Give how many poles are in the synthesis besides so many modes."""
        return max(int(self.poles_hz.size) - modes, 0)
