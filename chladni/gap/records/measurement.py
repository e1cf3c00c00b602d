"""What a log holds of a model's inputs and outputs."""

from dataclasses import dataclass
from math import isfinite

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import largest_magnitudes, out_of_range
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measurement(Value):
    """Inputs and outputs of a model as one log holds them, on one clock, whole: no sample is missing.

    All numbers can be squared twice (`chladni.signals.number_range`): whatever is estimated from them is a number.

    Attributes
    ----------
    log
        Name of the log, for people.
    sample_rate_hz
        Samples a second.
    inputs
        ``[input, sample]``, in the order of the model's inputs, SI; zero for an input that has no channel.
    outputs
        ``[output, sample]``, in the order of the names in `output_names`, SI.
    input_names, output_names
        Names in the model. Outputs that the log doesn't hold are left out.
    output_units
        SI unit of each output.
    period_samples
        Length of a period when every input is periodic, else None.
    transient_periods
        How many periods at the start the response hasn't settled in; 0 when there's no period.
    """

    log: str
    sample_rate_hz: float
    inputs: Real
    outputs: Real
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    output_units: tuple[str, ...]
    period_samples: int | None = None
    transient_periods: int = 0

    def __post_init__(self) -> None:
        samples = self.outputs.shape[-1]
        require_shape("inputs", self.inputs, (len(self.input_names), samples), "the model's inputs")
        require_shape("outputs", self.outputs, (len(self.output_names), samples), "the measured outputs")
        _require_in_range(self.log, self.input_names, self.inputs)
        _require_in_range(self.log, self.output_names, self.outputs)
        self._freeze()

    @property
    def samples(self) -> int:
        """Samples of each signal."""
        return int(self.outputs.shape[1])

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.samples / self.sample_rate_hz


def _require_in_range(log: str, names: tuple[str, ...], signals: Real) -> None:
    for name, largest in zip(names, largest_magnitudes(signals).tolist(), strict=True):
        fault = out_of_range(largest) if isfinite(largest) else "holds values that aren't finite; leave it out"
        if fault is not None:
            raise EstimateError(f"{log}: {name!r} {fault}")


@dataclass(frozen=True, slots=True, kw_only=True)
class LogUse:
    """How much of a log was used, and what was lost of it.

    Attributes
    ----------
    log
        Name, for people.
    used_s, recorded_s
        Length of what the diagnosis saw, and of what the log holds in the part that was asked for, seconds.
    sample_rate_hz
        Samples a second.
    losses
        Sentences on damage and stretches that were dropped; they stand among the remarks, too.
    warnings
        Sentences that come before any answer, which means little with them; likewise.
    """

    log: str
    used_s: float
    recorded_s: float
    sample_rate_hz: float
    losses: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
