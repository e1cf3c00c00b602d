"""Frequency response functions between channels, each with its uncertainty."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import (
    UNKNOWN,
    Channel,
    Names,
    Units,
    find_channel,
    find_channels,
    made_channels,
    numbered,
)
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.signals.units import quotient
from chladni.signals.value import Value, over_frequency, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrequencyResponse(Value):
    """Response over reference, H = Y/X, with the convention e^{+j omega t}: a delay tau has the phase -omega tau.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    values
        ``[response, reference, frequency]`` complex, in response unit / reference unit.
    std
        ``[response, reference, frequency]``, one sigma of the magnitude, same unit (infinite where the data give
        no bound).
    coherence
        ``[response, frequency]``, 0 to 1: ordinary with one reference, multiple with several.
    excited
        ``[frequency]`` boolean; False on lines that the references don't excite, where `values` is only noise.
    responses, references
        One channel for each row and column.
    provenance
        How it was made.
    """

    AXES: ClassVar = {
        "values": ("responses", "references", "frequency_hz"),
        "std": ("responses", "references", "frequency_hz"),
        "coherence": ("responses", "frequency_hz"),
        "excited": ("frequency_hz",),
    }
    ROWS: ClassVar = "frequency_hz"

    frequency_hz: Real
    values: NDArray[np.complexfloating]
    std: Real
    coherence: Real
    excited: Mask
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        lines = self.frequency_hz.size
        expected = (len(self.responses), len(self.references), lines)
        require_shape("values", self.values, expected, "responses x references x frequencies")
        require_shape("std", self.std, expected, "responses x references x frequencies")
        require_shape("coherence", self.coherence, (len(self.responses), lines), "responses x frequencies")
        require_shape("excited", self.excited, (lines,), "frequencies")
        self._freeze()

    @classmethod
    def from_arrays(
        cls,
        frequency_hz: ArrayLike,
        values: ArrayLike,
        *,
        responses: Names | None = None,
        references: Names | None = None,
        response_units: Units = UNKNOWN,
        reference_units: Units = UNKNOWN,
        coherence: ArrayLike | None = None,
        std: ArrayLike | None = None,
    ) -> Self:
        """Make frequency responses of numbers in memory.

        Parameters
        ----------
        frequency_hz
            ``[frequency]``, strictly rising.
        values
            ``[response, reference, frequency]``; ``[response, frequency]`` of one reference; ``[frequency]`` of one
            response, too. NaN where nothing was measured.
        responses, references
            Names; ``response1``, ``reference1``, ... by default.
        response_units, reference_units
            One of all, one of each, or by name; values are converted to SI. ``1``, the default, isn't known.
        coherence
            ``[response, frequency]``; NaN, unknown, by default.
        std
            One sigma of the magnitude in the unit of `values`, and of their shape; infinite, unknown, by default.

        Raises
        ------
        EstimateError
            When shapes, names and units don't fit together.
        SetupError
            When a unit isn't known.

        Examples
        --------
        >>> line_hz = np.arange(1.0, 4.0)
        >>> one = FrequencyResponse.from_arrays(line_hz, [1, 2, 3j], response_units="g", reference_units="N")
        >>> one.unit(0, 0), complex(one.values[0, 0, 0])
        ('(m/s^2)/N', (9.80665+0j))
        """
        axis, table = over_frequency(frequency_hz, values, np.complex128)
        table = table[:, np.newaxis] if table.ndim < 3 else table
        if table.ndim != 3:
            raise EstimateError(f"values have shape {table.shape}, but must be [response, reference, frequency]")
        outputs, up = made_channels(numbered("response", table.shape[0], responses), response_units)
        inputs, down = made_channels(numbered("reference", table.shape[1], references), reference_units)
        factor = (np.array(up)[:, np.newaxis] / np.array(down))[:, :, np.newaxis]
        unknown = np.full(table.shape, np.inf)
        scatter = unknown if std is None else np.reshape(np.asarray(std, dtype=np.float64), table.shape)
        flat = (table.shape[0], axis.size)
        return cls(
            frequency_hz=axis,
            values=table * factor,
            std=scatter * factor,
            coherence=np.full(flat, np.nan)
            if coherence is None
            else np.reshape(np.asarray(coherence, dtype=np.float64), flat),
            excited=np.asarray(np.isfinite(table).all(axis=(0, 1))),
            responses=outputs,
            references=tuple(replace(channel, role="reference") for channel in inputs),
            provenance=Provenance(estimator="as given"),
        )

    def unit(self, response: int, reference: int) -> str:
        """Unit of one function, such as ``(m/s^2)/N``."""
        return quotient(self.responses[response].unit, self.references[reference].unit)

    def unit_at(self, field: str, place: tuple[int, ...]) -> str:
        """Give the unit of a function."""
        return self.unit(*place) if field in ("values", "std") else ""

    def select(self, responses: Names) -> Self:
        """Give the functions of the named responses, in the order asked for."""
        rows = find_channels(self.responses, responses, role="response")
        return replace(
            self,
            values=self.values[rows],
            std=self.std[rows],
            coherence=self.coherence[rows],
            responses=tuple(self.responses[row] for row in rows),
        )

    def function(self, response: str, reference: str) -> tuple[int, int]:
        """Indices of the function between two named channels; `EstimateError` when it isn't there."""
        return (
            find_channel(self.responses, response, role="response"),
            find_channel(self.references, reference, role="reference"),
        )
