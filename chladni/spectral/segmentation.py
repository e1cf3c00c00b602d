"""How a record is cut into segments: from seconds and hertz to sample counts."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, isfinite, log2
from typing import Literal

from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.wording import counted, rounded_up
from chladni.spectral.windows import Window

Detrend = Literal["none", "constant", "linear"]
DETRENDS = ("none", "constant", "linear")

# The default segment: no longer than the lines of a common analyser, short enough for a random error below 20 %.
LONGEST_DEFAULT_SEGMENT = 8192
DEFAULT_DIVISIONS = 16
SAMPLES_TO_CHOOSE_FROM = DEFAULT_DIVISIONS * LONGEST_DEFAULT_SEGMENT
# Below it there is no line between 0 Hz and Nyquist that a window leaves alone.
SHORTEST_SEGMENT = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Segmentation:
    """Segments of a record in samples.

    Attributes
    ----------
    samples
        Length of one segment.
    hop
        Samples from the start of one segment to the start of the next, 1 to `samples`.
    window
        Window applied to each segment.
    detrend
        What is removed from each segment first: ``none``, its mean (``constant``) or its straight line (``linear``).

    Examples
    --------
    >>> Segmentation(samples=1024, hop=512).overlap
    0.5
    """

    samples: int
    hop: int
    window: Window = "hann"
    detrend: Detrend = "constant"

    def __post_init__(self) -> None:
        if self.samples < SHORTEST_SEGMENT:
            raise SetupError(
                f"a segment of {counted(self.samples, 'sample')} is too short; at least {SHORTEST_SEGMENT} are "
                "needed, so ask for a finer resolution"
            )
        if not 1 <= self.hop <= self.samples:
            raise SetupError(f"hop {self.hop} must be from 1 to the segment's {counted(self.samples, 'sample')}")
        if self.detrend not in DETRENDS:
            raise SetupError(f"detrend {self.detrend!r} is none of {', '.join(DETRENDS)}")

    @property
    def overlap(self) -> float:
        """Share of a segment that the next one repeats."""
        return 1 - self.hop / self.samples

    def count(self, samples: int) -> int:
        """Whole segments in a stretch of `samples`."""
        return 0 if samples < self.samples else (samples - self.samples) // self.hop + 1

    def length_of(self, segments: int) -> int:
        """Samples that `segments` consecutive segments cover."""
        return (segments - 1) * self.hop + self.samples


def plan_segmentation(
    sample_rate_hz: float,
    *,
    samples_available: int | None,
    runs: Sequence[int] = (),
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    detrend: Detrend = "constant",
) -> Segmentation:
    """Choose segments for a wanted resolution, or sensible ones for the record.

    Parameters
    ----------
    sample_rate_hz
        Samples a second.
    samples_available
        Length of the record; None for a stream of at least `SAMPLES_TO_CHOOSE_FROM`, where more changes nothing.
    runs
        Lengths of its unbroken runs of samples, where it has gaps or its clock was set.
    resolution_hz
        Spacing of the spectral lines, rate over segment length. Met exactly when the rate is a multiple of it, else
        to half a sample. None chooses a power of two of at most 8192 samples and a 16th of the record, so that at
        least 31 half-overlapping segments are averaged (fewer only when less than 64 samples are there). Where the
        runs hold no 16 of such segments, it is halved until they do.
    window, overlap, detrend
        See `Segmentation`; ``0 <= overlap < 1``.

    Raises
    ------
    EstimateError
        When the record is too short for an averaged spectrum.
    SetupError
        When an argument is out of its range, or the resolution needs a longer record.

    Examples
    --------
    >>> plan_segmentation(1000.0, samples_available=60_000, resolution_hz=0.5).samples
    2000
    >>> plan_segmentation(1000.0, samples_available=60_000).samples
    2048
    """
    if not 0 <= overlap < 1:
        raise SetupError(f"overlap {overlap} must be at least 0 and below 1")
    if resolution_hz is None:
        samples = _default_samples(samples_available)
        while runs and samples > SHORTEST_SEGMENT and _segments_in(runs, samples, overlap) < DEFAULT_DIVISIONS:
            samples //= 2
    else:
        samples = _samples_for(resolution_hz, sample_rate_hz, samples_available)
    return Segmentation(samples=samples, hop=_hop(samples, overlap), window=window, detrend=detrend)


def _hop(samples: int, overlap: float) -> int:
    # The small allowance keeps 0.7 * 10 = 7.000000000000001 or 6.999999999999999 from moving the hop by a sample.
    return max(1, samples - floor(samples * overlap + 1e-9))


def _segments_in(runs: Sequence[int], samples: int, overlap: float) -> int:
    plan = Segmentation(samples=samples, hop=_hop(samples, overlap))
    return sum(plan.count(run) for run in runs)


def _default_samples(samples_available: int | None) -> int:
    if samples_available is None:
        return LONGEST_DEFAULT_SEGMENT
    # A power of two gives lines that other programs have too, for comparison line by line.
    longest = min(samples_available // DEFAULT_DIVISIONS, LONGEST_DEFAULT_SEGMENT)
    if longest < SHORTEST_SEGMENT:
        if samples_available < 2 * SHORTEST_SEGMENT:
            raise EstimateError(
                f"a record of {counted(samples_available, 'sample')} is too short for an averaged spectrum; "
                "take a longer one"
            )
        return SHORTEST_SEGMENT
    return int(2 ** floor(log2(longest)))


def require_resolution(resolution_hz: float, sample_rate_hz: float) -> None:
    """Raise `SetupError` for a distance of lines that no spectrum of this sample rate has."""
    if not (isfinite(resolution_hz) and 0 < resolution_hz <= sample_rate_hz / SHORTEST_SEGMENT):
        raise SetupError(
            f"resolution {resolution_hz} Hz must be above 0 and at most {sample_rate_hz / SHORTEST_SEGMENT:g} Hz, "
            f"a quarter of the sample rate {sample_rate_hz:g} Hz"
        )


def _samples_for(resolution_hz: float, sample_rate_hz: float, samples_available: int | None) -> int:
    require_resolution(resolution_hz, sample_rate_hz)
    # What was asked for comes before a length that transforms fast: the transform takes any length.
    samples = round(sample_rate_hz / resolution_hz)
    if samples_available is not None and samples_available < samples:
        needed_s, there_s = samples / sample_rate_hz, samples_available / sample_rate_hz
        raise SetupError(
            f"resolution {resolution_hz:g} Hz needs segments of {needed_s:g} s, but the record is {there_s:g} s "
            f"long; ask for {rounded_up(1 / there_s)} Hz or coarser"
        )
    return samples
