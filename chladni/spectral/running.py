"""Averages that run while samples come: spectra in three kinds of fading, waterfall, levels and severity."""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from math import floor, log2
from typing import Final, Self

from chladni.signals.channel import Channel
from chladni.signals.coherence import Coherence
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.levels import Levels, Severity
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.waterfall import Waterfall
from chladni.spectral.accumulator import AutoSpectraAccumulator, CrossSpectraAccumulator, SegmentAveraging
from chladni.spectral.coherence import coherence
from chladni.spectral.frf import frequency_response
from chladni.spectral.levels import LevelsAccumulator
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.segmentation import LONGEST_DEFAULT_SEGMENT, Segmentation, plan_segmentation
from chladni.spectral.severity import Machine, SeverityAccumulator, is_motion
from chladni.spectral.waterfall import DEFAULT_SEGMENT, WaterfallAccumulator
from chladni.spectral.windows import Window

#: Length of a segment that one doesn't wait for, unless a resolution is asked for.
DEFAULT_SEGMENT_S: Final = 2.0
#: Memory of the pairs of channels of a default segment.
PAIRS_BYTES: Final = 1 << 27
#: Powers that a running waterfall holds, at most; slices at least, and at most: as many as its picture has rows.
WATERFALL_VALUES: Final = 1 << 22
FEWEST_SLICES: Final = 16
MOST_SLICES: Final = 420
#: After a longer silence the waterfall begins anew.
LONGEST_SILENCE_S: Final = 600.0
#: Time constant of exponential averages.
TIME_CONSTANT_S: Final = 10.0


def running_segmentation(
    sample_rate_hz: float,
    *,
    channels: int = 1,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
) -> Segmentation:
    """Choose segments for averages that run.

    Parameters
    ----------
    sample_rate_hz
        Samples a second.
    channels
        How many there are: of many, a longer segment makes more pairs of spectra than a processor's cache holds.
    resolution_hz
        Spacing of the lines; None takes a power of two of 2 s and 8192 samples at most, of 2048 for 64 channels.
    window, overlap
        As for `cross_spectra`.

    Examples
    --------
    >>> [running_segmentation(rate_hz, channels=64).samples for rate_hz in (1000.0, 25600.0)]
    [1024, 2048]
    """
    if resolution_hz is None:
        most = min(LONGEST_DEFAULT_SEGMENT, max(16, int(DEFAULT_SEGMENT_S * sample_rate_hz)))
        # Real and imaginary parts of all pairs of channels, on each line.
        most = min(most, max(256, PAIRS_BYTES // (2 * channels) ** 2 // 4))
        resolution_hz = sample_rate_hz / 2 ** floor(log2(most))
    return plan_segmentation(
        sample_rate_hz, samples_available=None, resolution_hz=resolution_hz, window=window, overlap=overlap
    )


class RunningAverages:
    """Running averages of the channels of one sampling grid; mutable, results are frozen values.

    Parameters
    ----------
    channels, sample_rate_hz
        Of every block.
    segmentation
        Segments and their window; that of the waterfall has at most 2048 samples.
    pairs
        Whether the spectra of channel pairs are averaged, which frequency responses, coherence and modes need.
    fading_pairs_s
        Time constant of exponential averages of the pairs, too; None without.
    bands_hz
        Of the levels; None for all that was sampled.
    time_constant_s
        Of the exponential averages.
    machine
        Class and foundation, for the zone of severity.

    Raises
    ------
    EstimateError
        When the averages would take more than 2 GB, or a band isn't inside the spectrum.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        segmentation: Segmentation,
        *,
        pairs: bool = True,
        fading_pairs_s: float | None = None,
        bands_hz: Sequence[tuple[float, float]] | None = None,
        time_constant_s: float = TIME_CONSTANT_S,
        machine: Machine | None = None,
    ) -> None:
        self.channels = tuple(channels)
        self.sample_rate_hz = sample_rate_hz
        self.segmentation = segmentation
        self.samples = 0
        self._all = _Spectra.of(
            channels,
            sample_rate_hz,
            segmentation,
            pairs=pairs,
            fading_pairs_s=fading_pairs_s,
            time_constant_s=time_constant_s,
        )
        # Of the channels that still give something, while others don't.
        self._living: _Spectra | None = None
        self._levels = LevelsAccumulator(channels, sample_rate_hz, bands_hz=bands_hz)
        self._severity, self.notes = _severity(channels, sample_rate_hz, machine)
        self._waterfall = self._new_waterfall()
        self._end_ns: int | None = None

    def update(self, block: TimeSeries) -> None:
        """Take in the next block.

        Raises
        ------
        EstimateError
            When channels or rate differ, the block starts before the last one ended, or a value is too large to be
            squared; then nothing was changed by it.
        """
        # The first to refuse: nothing of a block that one of them can't take is in any.
        self._all.update(block)
        if self._living is not None:
            self._living.update(block.select(self._living.names))
        self._levels.update(block)
        if self._severity is not None:
            self._severity.update(block)
        if self._end_ns is not None and block.start_time_ns - self._end_ns > LONGEST_SILENCE_S * NS_PER_S:
            self._waterfall = self._new_waterfall()
        self._waterfall.update(block)
        self.samples += block.samples
        self._end_ns = block.start_time_ns + round(block.duration_s * NS_PER_S)

    def leave_out(self, names: Sequence[str]) -> None:
        """Go on without channels that give nothing; none: with all of them.

        Spectra need valid samples of all channels at once. The average of all stays as it is meanwhile, and goes on
        when they are back.
        """
        rest = [channel.name for channel in self.channels if channel.name not in names]
        if not names or not rest:
            self._living = None
        elif self._living is None or self._living.names != rest:
            before = self._living if self._among_living(rest) else None
            self._living = (before or self._all).select(rest)

    def _among_living(self, names: Sequence[str]) -> bool:
        return self._living is not None and set(names) <= set(self._living.names)

    @property
    def _best(self) -> "_Spectra":
        return self._all if self._living is None else self._living

    @property
    def averages(self) -> int:
        """Segments averaged so far."""
        return self._best.powers["linear"].averages

    def densities(
        self, averaging: SegmentAveraging = "linear", *, sample_rate_hz: float | None = None
    ) -> tuple[PowerSpectralDensity, ...]:
        """Give the power spectral densities, of channels that give nothing any more apart from the others.

        Raises
        ------
        EstimateError
            Before the first whole segment.
        """
        self._best.average_held()
        found = power_spectral_density(self._best.powers[averaging].result(sample_rate_hz=sample_rate_hz))
        if self._living is None:
            return (found,)
        names = [channel.name for channel in self.channels if channel.name not in self._living.names]
        self._all.average_held()
        try:
            before = power_spectral_density(self._all.powers[averaging].result(sample_rate_hz=sample_rate_hz))
        except EstimateError:
            return (found,)
        return found, before.select(names)

    def spectra(self, *, sample_rate_hz: float | None = None) -> CrossSpectra:
        """Give the linear average of the cross-spectra of channels that still give something.

        Raises
        ------
        EstimateError
            Before the first whole segment, or when pairs aren't averaged.
        """
        if self._best.pairs is None:
            raise EstimateError("spectra of pairs of channels aren't averaged; ask for them")
        self._best.average_held()
        return self._best.pairs.result(sample_rate_hz=sample_rate_hz)

    def recent_spectra(self) -> CrossSpectra:
        """Give the exponential average of the cross-spectra; errors as for `spectra`."""
        if self._best.fading is None:
            raise EstimateError("spectra of pairs of channels aren't averaged exponentially; ask for them")
        self._best.average_held()
        return self._best.fading.result()

    def response(
        self, references: Sequence[str], *, spectra: CrossSpectra | None = None
    ) -> tuple[FrequencyResponse, Coherence]:
        """Give H1 and coherence of all other channels to the references, of `spectra` where they are made already."""
        found = self.spectra() if spectra is None else spectra
        return frequency_response(found, references=references), coherence(found, references=references)

    def waterfall(self, *, sample_rate_hz: float | None = None) -> Waterfall:
        """Give the waterfall; `EstimateError` before the first whole segment."""
        return self._waterfall.result(sample_rate_hz=sample_rate_hz)

    def levels(self) -> Levels:
        """Give the levels so far."""
        # A copy is finished, not this one: more blocks follow.
        return deepcopy(self._levels).result()

    def severity(self) -> Severity | None:
        """Give the severity so far; None where nothing can be judged."""
        return None if self._severity is None else deepcopy(self._severity).result()

    def _new_waterfall(self) -> WaterfallAccumulator:
        plan = self.segmentation
        if plan.samples > DEFAULT_SEGMENT:
            plan = plan_segmentation(
                self.sample_rate_hz,
                samples_available=None,
                resolution_hz=self.sample_rate_hz / DEFAULT_SEGMENT,
                window=plan.window,
                overlap=plan.overlap,
            )
        slices = WATERFALL_VALUES // (len(self.channels) * (plan.samples // 2 + 1))
        slices = min(MOST_SLICES, max(FEWEST_SLICES, slices))
        return WaterfallAccumulator(
            self.channels, self.sample_rate_hz, plan, max_slices=slices, reserved_slices=slices
        )


@dataclass(slots=True, kw_only=True, eq=False)
class _Spectra:
    """Averages of the same segments: powers in each kind of averaging, and pairs of channels."""

    powers: dict[SegmentAveraging, AutoSpectraAccumulator]
    pairs: CrossSpectraAccumulator | None
    fading: CrossSpectraAccumulator | None

    @classmethod
    def of(
        cls,
        channels: Sequence[Channel],
        rate_hz: float,
        plan: Segmentation,
        *,
        pairs: bool,
        fading_pairs_s: float | None,
        time_constant_s: float,
    ) -> Self:
        constants: dict[SegmentAveraging, float | None] = {
            "linear": None,
            "exponential": time_constant_s,
            "peak-hold": None,
        }
        return cls(
            powers={
                kind: AutoSpectraAccumulator(channels, rate_hz, plan, averaging=kind, time_constant_s=constant_s)
                for kind, constant_s in constants.items()
            },
            pairs=CrossSpectraAccumulator(channels, rate_hz, plan) if pairs else None,
            fading=None
            if fading_pairs_s is None
            else CrossSpectraAccumulator(
                channels, rate_hz, plan, averaging="exponential", time_constant_s=fading_pairs_s
            ),
        )

    def __post_init__(self) -> None:
        # A segment is transformed once, whatever it is averaged for.
        lead, *others = self.powers.values()
        lead.accompany(*others, *(pairs for pairs in (self.pairs, self.fading) if pairs is not None))

    @property
    def _lead(self) -> AutoSpectraAccumulator:
        return self.powers["linear"]

    @property
    def names(self) -> list[str]:
        return [channel.name for channel in self._lead.channels]

    def update(self, block: TimeSeries) -> None:
        self._lead.update(block)

    def average_held(self) -> None:
        """Average what waits for its batch to fill, which would be transformed again at each look."""
        self._lead.average_held()

    def select(self, names: Sequence[str]) -> "_Spectra":
        return _Spectra(
            powers={kind: one.select(names) for kind, one in self.powers.items()},
            pairs=None if self.pairs is None else self.pairs.select(names),
            fading=None if self.fading is None else self.fading.select(names),
        )


def _severity(
    channels: Sequence[Channel], sample_rate_hz: float, machine: Machine | None
) -> tuple[SeverityAccumulator | None, tuple[str, ...]]:
    if not any(is_motion(channel) for channel in channels):
        return None, ()
    try:
        return SeverityAccumulator(channels, sample_rate_hz, machine=machine), ()
    except EstimateError as error:
        return None, (f"no severity: {error}",)
