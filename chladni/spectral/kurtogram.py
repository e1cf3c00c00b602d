"""The kurtogram: in which band a signal is most impulsive."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import scipy.fft

from chladni.io.source import Blocks, SeriesLike, blocks_of
from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Names
from chladni.signals.envelope import Kurtogram
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.spectral.accumulator import require_finite
from chladni.spectral.blocks import leading_part
from chladni.spectral.held_samples import HeldSamples
from chladni.spectral.stretches import Runs

# Samples transformed together: bands of a hundredth of the spectrum then have hundreds of samples of envelope each.
SEGMENT = 1 << 16
# The spectrum is halved so often, and cut in thirds between.
LEVELS = 6
# By how much of its width a band's flanks reach over its neighbours, on both sides together.
ROLL_OFF = 0.25
# Samples of a band's envelope, at its own rate, that lean on what is beyond the ends of a segment.
EDGE = 16


def kurtogram(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Kurtogram:
    """Compute the kurtogram of each channel.

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

    Returns
    -------
    Kurtogram
        Spectral kurtosis on the paving of the fast kurtogram: the spectrum in 1, 2, 3, 4, 6, 8, ... 64 bands.

    Raises
    ------
    EstimateError
        When no run of samples that are valid in all channels is long enough, 4096 samples.

    Notes
    -----
    Antoni (2007), Fast computation of the kurtogram, Mech. Syst. Signal Process. 21, 108-124: eq. 8 for the kurtosis,
    section 3.2 for the paving in halves and thirds. There a tree of short filters makes the complex envelopes; here
    each is a part of the spectrum of a long segment, with flanks of a root raised cosine, transformed back at the
    band's own rate. Its scatter for Gaussian noise is 2/sqrt(number of samples).

    Examples
    --------
    >>> found = kurtogram(np.random.default_rng(1).standard_normal(20_000), sample_rate_hz=1e4)
    >>> found.low_hz.size, bool(abs(found.kurtosis[0, 0]) < 3 * found.std[0, 0])
    (220, True)
    """
    source = blocks_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    lead, blocks = leading_part(source, 1)
    first, runs, held = lead[0], Runs(), HeldSamples()
    edges = [np.linspace(0.0, 0.5, number + 1) for number in _numbers()]
    largest = np.zeros(len(first.channels))
    sums = np.zeros((3, len(first.channels), sum(one.size - 1 for one in edges)))
    for block in blocks:
        for begins, piece in runs.pieces(block):
            largest = np.maximum(largest, require_finite(piece, [(0, piece.samples)]))
            if begins:
                sums += _last(held, edges, sums.shape)
                held = HeldSamples()
            held.append(piece.values)
            while held.samples >= 2 * SEGMENT:
                joined = held.joined()
                sums += _moments(joined[:, :SEGMENT].astype(np.float64), edges)
                held.replace(joined[:, SEGMENT:])
    sums += _last(held, edges, sums.shape)
    require_in_range(first.channels, largest)
    if not sums[0].all():
        raise EstimateError(
            f"a kurtogram needs an unbroken run of {_least_samples()} samples, and the longest has {runs.longest}; "
            "measure longer, or name the band"
        )
    squares, fourths = sums[1] / sums[0], sums[2] / sums[0]
    still = squares <= 0
    kurtosis = np.where(still, 0.0, fourths / np.where(still, 1.0, squares) ** 2 - 2)
    rate_hz = first.sample_rate_hz
    return Kurtogram(
        low_hz=np.concatenate([one[:-1] for one in edges]) * rate_hz,
        high_hz=np.concatenate([one[1:] for one in edges]) * rate_hz,
        kurtosis=kurtosis,
        std=2 / np.sqrt(sums[0]),
        channels=first.channels,
    )


def _numbers() -> Iterator[int]:
    """In how many bands the spectrum is cut: 1, 2, 3, 4, 6, 8, ..."""
    yield 1
    for level in range(1, LEVELS + 1):
        yield 2**level
        if level < LEVELS:
            yield 3 * 2 ** (level - 1)


def _least_samples() -> int:
    """As many that the narrowest band's envelope keeps as many samples as are left out at its ends."""
    return 2 * EDGE << (LEVELS + 1)


def _last(held: HeldSamples, edges: list[Real], shape: tuple[int, ...]) -> Real:
    """Moments of what is left at the end of a run; nothing where that is too short for the narrowest band."""
    return _moments(held.joined().astype(np.float64), edges) if held.samples >= _least_samples() else np.zeros(shape)


def _moments(values: Real, edges: list[Real]) -> Real:
    """``[count, square, fourth power; channel, band]`` of the magnitudes of the bands' complex envelopes."""
    spectrum = scipy.fft.rfft(values - values.mean(axis=1, keepdims=True), axis=1)
    parts = [_band(spectrum, values.shape[1], low, high) for one in edges for low, high in pairwise(one)]
    found = [(np.full(len(values), one.shape[1]), one.sum(axis=1), (one**2).sum(axis=1)) for one in parts]
    return np.moveaxis(np.array(found, dtype=np.float64), 0, 2)


def _band(spectrum: Complex, samples: int, low: float, high: float) -> Real:
    """``[channel, sample]`` squared magnitude of the envelope of a band, edges over the sample rate."""
    reach = ROLL_OFF * (high - low) / 2
    lines = np.arange(max(0, round((low - reach) * samples)), min(spectrum.shape[1], round((high + reach) * samples)))
    at = lines / samples
    # Power-complementary flanks: where two bands meet each has half the power. The spectrum's own ends have none.
    rising = np.clip((at - low + reach) / (2 * reach), 0.0, 1.0) if low > 0 else np.ones(at.size)
    falling = np.clip((high + reach - at) / (2 * reach), 0.0, 1.0) if high < 0.5 else np.ones(at.size)
    gain = np.sin(np.pi / 2 * rising) * np.sin(np.pi / 2 * falling)
    # The size of the numbers doesn't matter to their kurtosis, but their squares must stay numbers.
    envelope = scipy.fft.ifft(2 * spectrum[:, lines] * gain, axis=1)[:, EDGE:-EDGE] * (lines.size / samples)
    return np.asarray(envelope.real**2 + envelope.imag**2, dtype=np.float64)
