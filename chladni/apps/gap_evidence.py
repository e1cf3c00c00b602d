"""What the pictures of a diagnosis need: spectra of the errors, and where the nominal model errs most."""

from itertools import pairwise

import numpy as np

from chladni.apps.psd import psd
from chladni.gap.records.diagnosis import Diagnosis, GapSignals
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.viewers.gap_evidence import GapEvidence, GapSpectra

# Cycles of the gap's typical frequency that can be told apart in a picture, and the fewest samples that make one.
CYCLES, FEWEST_SAMPLES = 12.0, 60
# Of windows: the error begins anew in each, and several of them show how it grows.
WINDOWS = 6
# Finer than spectra for the eye: a gap often sits in the flank of one resonance.
SEGMENTS, SHORTEST_SEGMENT, MOST_LINES = 8, 16, 4096
NAMES = ("measured", "before", "after")


def gap_evidence(found: Diagnosis) -> GapEvidence:
    """Prepare the pictures of a diagnosis."""
    signals = found.signals
    if signals is None:
        return GapEvidence(found=found)
    spectra = spectra_of(signals)
    return GapEvidence(found=found, spectra=spectra, telling_s=telling_stretch(signals, spectra))


def spectra_of(signals: GapSignals) -> GapSpectra | None:
    """Give spectra of what was measured and of the errors; None when there are too few samples."""
    outputs, samples = signals.measured.shape
    # Too short a log for a spectrum is no reason to show nothing of it.
    if samples < SEGMENTS * SHORTEST_SEGMENT:
        return None
    stacked = np.vstack([signals.measured, signals.measured - signals.before, signals.measured - signals.after])
    channels = tuple(
        Channel(name=f"{what} {row}", unit=unit) for what in NAMES for row, unit in enumerate(signals.output_units)
    )
    # A model that diverges leaves samples that are no numbers; segments that hold some are left out. Those that held
    # the jump from one window to the next would show its leakage in place of the error.
    finite = np.isfinite(stacked)
    finite[:, list(signals.window_starts[1:])] = False
    series = TimeSeries(
        values=stacked,
        sample_rate_hz=signals.sample_rate_hz,
        channels=channels,
        valid=None if finite.all() else finite,
    )
    resolution_hz = max(SEGMENTS / series.duration_s, signals.sample_rate_hz / (2 * MOST_LINES), _window_hz(signals))
    try:
        density = psd(series, window="hann", resolution_hz=resolution_hz)
    except EstimateError:
        # No segment is whole, as of a model that diverges again and again.
        return None
    measured, before, after = density.values.reshape(len(NAMES), outputs, -1)
    return GapSpectra(
        frequency_hz=density.frequency_hz,
        measured=measured,
        before=before,
        after=after,
        noise=_noise(signals, density.frequency_hz),
    )


def _noise(signals: GapSignals, frequency_hz: Real) -> Real:
    """``[output, line]``: the estimated noise at the lines of the other spectra."""
    lines_hz = np.linspace(0.0, signals.sample_rate_hz / 2, signals.noise_density.shape[1])
    return np.array([np.interp(frequency_hz, lines_hz, row) for row in signals.noise_density])


def _window_hz(signals: GapSignals) -> float:
    """Resolution at which a segment fits between two jumps, 0 where there are none."""
    edges = (*signals.window_starts, signals.measured.shape[1])
    shortest = min((stop - start for start, stop in pairwise(edges)), default=0)
    # One sample of each window is the jump.
    return signals.sample_rate_hz / max(shortest - 1, SHORTEST_SEGMENT) if shortest else 0.0


def telling_stretch(signals: GapSignals, spectra: GapSpectra | None) -> tuple[float, float]:
    """Give start and end where the error that was found to have a cause is largest, all outputs by their own RMS."""
    rms = np.sqrt(np.mean(signals.measured**2, axis=1, keepdims=True))
    errors = np.nan_to_num((signals.measured - signals.before) / np.where(rms > 0, rms, 1.0), posinf=0.0, neginf=0.0)
    samples = errors.shape[1]
    wanted = samples if spectra is None else round(CYCLES / _typical_hz(spectra) * signals.sample_rate_hz)
    if signals.window_starts:
        wanted = min(wanted, WINDOWS * samples // len(signals.window_starts))
    length = min(max(wanted, FEWEST_SAMPLES), samples)
    # Sums over every stretch of that length at once, as differences of the running sum.
    total = np.concatenate([[0.0], np.cumsum(np.sum(errors**2, axis=0))])
    first = int(np.argmax(total[length:] - total[:-length]))
    start_s = float(signals.seconds[first])
    return start_s, start_s + length / signals.sample_rate_hz


def _typical_hz(spectra: GapSpectra) -> float:
    """Mean frequency of the gap, weighted by power; of what was measured where there is no gap at all."""
    for powers in (spectra.before, spectra.measured):
        power = powers / np.maximum(powers.sum(axis=1, keepdims=True), np.finfo(float).tiny)
        if power.sum() > 0:
            mean_hz = float((power.mean(axis=0) * spectra.frequency_hz).sum() / power.mean(axis=0).sum())
            return max(mean_hz, float(spectra.frequency_hz[1]))
    return float(spectra.frequency_hz[1])
