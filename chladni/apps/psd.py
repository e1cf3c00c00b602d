"""Power spectral densities of a log or a series, in one call."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.apps.sources import Progress, Span, Watched, no_progress, watched_grids
from chladni.apps.spectra import Averaging, of_series, without_constant
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.io.source import SeriesLike, log_or_series
from chladni.signals.channel import Names, as_names
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import rounded_up
from chladni.spectral.bands import band_rms, total_rms
from chladni.spectral.peaks import judged_above_hz
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.response_advice import longest_segment_s
from chladni.spectral.windows import Window

# A tenth of the variance is half a decibel: less than that is lost at the ends of any record.
MISSING_TOLD = 0.1


def psd(
    source: SeriesLike,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    resolution_hz: float | None = None,
    window: Window | None = None,
    overlap: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> PowerSpectralDensity:
    """Estimate averaged power spectral densities.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, or an array ``[channel, sample]``.
    channels
        Message paths or names; None for all that share one sampling grid. Channels of a log that never change are
        left out, with a note.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    resolution_hz
        Distance of the lines; None chooses by the length of the record.
    window
        As in `scipy.signal.get_window`. None takes whole periods without window where the excitation is periodic,
        else Hann.
    overlap
        Share of a segment that the next one repeats, 0 <= overlap < 1; None for 0.5.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.

    Returns
    -------
    PowerSpectralDensity
        ``.values[channel, frequency]`` in unit^2/Hz.

    Raises
    ------
    LogError
        When there is no such channel, or the channels have different sampling grids.
    EstimateError
        When there is too little to average.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).standard_normal(2**16)
    >>> density = psd(noise, sample_rate_hz=2.0)  # white noise of variance 1 up to 1 Hz: density 1
    >>> bool(abs(density.values.mean() - 1) < 0.02)
    True
    """
    source = log_or_series(source, sample_rate_hz=sample_rate_hz)
    names = None if channels is None else as_names(channels)
    averaging = Averaging(resolution_hz=resolution_hz, window=window, overlap=overlap)
    span = Span(start_s=start_s, end_s=end_s)
    if isinstance(source, TimeSeries):
        return _density(of_series(source, names, span), averaging)
    grids = list(watched_grids(source, names, span))
    if len(grids) > 1:
        # The log's own error names the grids and the remedies.
        source.read(names, start_s=start_s, end_s=end_s)
    return _density(grids[0], averaging)


def densities(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    averaging: Averaging | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> tuple[PowerSpectralDensity, ...]:
    """Estimate the densities of a log's channels, one value for each sampling grid.

    Grids on which nothing moves, or that are too short to average, are left out; a note on the first value says so.

    Raises
    ------
    EstimateError
        When no grid gives a spectrum.
    """
    found: list[PowerSpectralDensity] = []
    left_out: list[str] = []
    for grid in watched_grids(log, channels, span or Span(), progress=progress):
        try:
            found.append(_density(grid, averaging or Averaging()))
        except EstimateError as error:
            left_out.append(f"{some_of(grid.names)}: {error}")
    if not found:
        raise EstimateError(f"{log.path.name}: no spectrum could be made: {'; '.join(left_out)}")
    noted = replace(found[0], provenance=found[0].provenance.with_notes(*left_out))
    return (noted, *found[1:])


def _density(source: TimeSeries | Watched, averaging: Averaging) -> PowerSpectralDensity:
    density = power_spectral_density(averaging.powers(source))
    if isinstance(source, Watched):
        density = without_constant(density, source, keep=())
        # Segments that were skipped hold variance, too, and that is told.
        whole = [0.0 if density.provenance.skipped else source.variance(one.name) for one in density.channels]
    else:
        whole = [0.0] * len(density.channels)
    return replace(density, provenance=density.provenance.with_notes(*_slow_variance(density, whole)))


def _slow_variance(density: PowerSpectralDensity, whole: Sequence[float]) -> tuple[str, ...]:
    """Say so when much of a signal is slower than what peaks are looked for in: it may be drift, or a tone.

    ``whole[channel]`` is the variance of the samples, 0 where that isn't known.
    """
    low_hz = judged_above_hz(density)
    # Whole periods and hits leave nothing out.
    if not low_hz:
        return ()
    judged = np.square(band_rms(density, bands_hz=[(low_hz, float(density.frequency_hz[-1]))]).rms[:, 0])
    total = np.maximum(np.square(total_rms(density).rms[:, 0]), np.asarray(whole))
    share = 1 - judged / np.maximum(total, np.finfo(float).tiny)
    slow = [channel.name for channel, one in zip(density.channels, share, strict=True) if one > MISSING_TOLD]
    if not slow:
        return ()
    note = (
        f"{some_of(slow)}: up to {share.max():.0%} of the variance is slower than {low_hz:.3g} Hz, or at the ends of "
        "the record. Below that a trend leaks and no peak is looked for. If it isn't drift, "
        f"{_finest(density.provenance)}"
    )
    return (note,)


def _finest(account: Provenance) -> str:
    """Ask for the finest lines that the record allows, or for a longer record."""
    longest_s = longest_segment_s(account)
    if longest_s <= account.segment_s:
        return "measure longer"
    return f"ask for a resolution of {rounded_up(1 / longest_s, digits=2)} Hz"
