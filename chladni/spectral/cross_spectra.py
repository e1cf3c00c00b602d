"""Averaged spectra of a series or a stream of blocks."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from chladni.io.source import Blocks, SeriesLike, blocks_of
from chladni.signals.channel import Channel, Names, as_names
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.linear_algebra import in_one_thread
from chladni.spectral.accumulator import (
    CrossSpectraAccumulator,
    SegmentAveraging,
    SpectraAccumulator,
)
from chladni.spectral.blocks import Source, leading_part, samples_known, sum_up
from chladni.spectral.products import SpectraT
from chladni.spectral.segmentation import SAMPLES_TO_CHOOSE_FROM, Detrend, Segmentation, plan_segmentation
from chladni.spectral.stretches import run_lengths
from chladni.spectral.windows import Window


@in_one_thread()
def cross_spectra(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    detrend: Detrend = "constant",
    averaging: SegmentAveraging = "linear",
    time_constant_s: float | None = None,
) -> CrossSpectra:
    """Average the cross-spectra of all channel pairs after Welch.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, an array ``[channel, sample]``, or
        consecutive blocks of a series.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
    resolution_hz
        Spacing of the lines; None chooses, see `plan_segmentation`.
    window
        Name, or tuple of name and parameters, as in `scipy.signal.get_window`.
    overlap
        Share of a segment that the next one repeats, 0 <= overlap < 1.
    detrend
        ``none``, ``constant`` or ``linear``, removed from each segment.
    averaging, time_constant_s
        See `SpectraAccumulator`.

    Returns
    -------
    CrossSpectra
        One-sided densities, G_ij = 2/(f_s sum w^2) mean(conj(X_i) X_j) (Welch 1967; Bendat & Piersol 2010,
        section 11.5).

    Raises
    ------
    EstimateError
        When there is no sample, or no whole segment of valid ones.
    SetupError
        When an option is out of its range, or the resolution needs a longer record.

    Examples
    --------
    >>> import numpy as np
    >>> sine = np.sqrt(2) * np.sin(2 * np.pi * 50 * np.arange(8000) / 1000)
    >>> spectra = cross_spectra(sine, sample_rate_hz=1000.0, resolution_hz=1.0)
    >>> float(round(spectra.density[0, 0, 50].real * spectra.bandwidth_hz, 12))  # RMS^2 of the sine
    1.0
    """
    return segment_average(
        partial(CrossSpectraAccumulator, averaging=averaging, time_constant_s=time_constant_s),
        blocks_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s),
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        detrend=detrend,
    )


def spectra_of(
    source: CrossSpectra | SeriesLike | Blocks, *, channels: Names | None = None, **averaging: Any
) -> CrossSpectra:
    """Give cross-spectra as they are, and average those of all else a caller has; options as for `cross_spectra`."""
    if isinstance(source, CrossSpectra):
        return source
    # Each once: a response may be a reference, too.
    return cross_spectra(
        source, channels=None if channels is None else dict.fromkeys(as_names(channels)), **averaging
    )


def segment_average(
    make: Callable[[Sequence[Channel], float, Segmentation], SpectraAccumulator[SpectraT]],
    source: Source,
    *,
    resolution_hz: float | None,
    window: Window,
    overlap: float,
    detrend: Detrend,
) -> SpectraT:
    """Average what accumulators of one kind take of segments; the rest is as in `cross_spectra`."""
    # The default segment hangs on the length of the record, which a stream doesn't tell; the lead tells enough of it.
    lead, blocks = leading_part(source, SAMPLES_TO_CHOOSE_FROM)
    first = lead[0]
    plan = plan_segmentation(
        first.sample_rate_hz,
        samples_available=samples_known(source, lead, SAMPLES_TO_CHOOSE_FROM),
        runs=run_lengths(lead),
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        detrend=detrend,
    )
    accumulator = make(first.channels, first.sample_rate_hz, plan)
    sum_up(blocks, accumulator)
    return accumulator.result()
