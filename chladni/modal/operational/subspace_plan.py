"""How a record of responses is cut for the subspace method: decimation, lags, orders, references."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from scipy.linalg import qr

from chladni.modal.operational.anti_alias import PASS_BAND
from chladni.signals.channel import find_channels
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import SetupError
from chladni.spectral.peaks import find_peaks
from chladni.spectral.psd import power_spectral_density

Band = tuple[float, float]

# The lags of the Hankel matrix span so many cycles of the lowest peak. Fewer don't separate modes that are a tenth
# apart, more add noise to the modes above.
CYCLES = 4.0
# Samples for a cycle of the highest frequency of interest, after decimation.
SAMPLES_A_CYCLE = 4.0
MAX_ORDER = 60
FEWEST_ROWS = 10
# A record holds the lags so many times at least, for the scatter between blocks.
SPANS_IN_RECORD = 20
# A square Hankel matrix of this side is decomposed in a second or two, a higher one of as many operations too.
MOST_SIDE = 1500
LARGEST_SIDE = 4000
MOST_REFERENCES = 12
# More peaks than this say no more about where the band of interest begins and ends.
MOST_PEAKS = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class SubspacePlan:
    """Choices made for one record.

    Attributes
    ----------
    decimation
        Samples for one step of the lag.
    block_rows
        Lags in the rows and in the columns of the Hankel matrix.
    orders
        Model orders.
    references
        Rows of the channels to correlate with.
    band_hz
        Frequencies at which poles may be modes: inside what was asked for and what the anti-alias filter passes.
    notes
        What was chosen and what it means.
    """

    decimation: int
    block_rows: int
    orders: tuple[int, ...]
    references: tuple[int, ...]
    band_hz: Band
    notes: tuple[str, ...]

    @property
    def lags(self) -> int:
        """Longest lag of the Hankel matrix."""
        return 2 * self.block_rows - 1


def plan_subspace(
    spectra: CrossSpectra,
    sample_rate_hz: float,
    *,
    samples: int,
    block_rows: int | None = None,
    max_order: int | None = None,
    references: Sequence[str] | None = None,
    band_hz: Band | None = None,
) -> SubspacePlan:
    """Choose what the user left open.

    Parameters
    ----------
    spectra
        Of the channels that vary.
    sample_rate_hz, samples
        Rate of the record, and its length or that of its beginning.
    block_rows, max_order, references
        As given; None to choose.
    band_hz
        Frequencies of interest; None for all.

    Raises
    ------
    EstimateError
        When a reference is not among the channels.
    SetupError
        When a number is out of its range.
    """
    low, high = _band(band_hz, sample_rate_hz)
    peaks_hz = _peaks_hz(spectra, low, high)
    decimation = _decimation(sample_rate_hz, high if band_hz else max(peaks_hz, default=high))
    rate_hz = sample_rate_hz / decimation
    rows = _references(spectra, references, (low, high))
    channels = len(spectra.channels)
    longest = max(samples // (2 * SPANS_IN_RECORD * decimation), FEWEST_ROWS)
    order = _order(max_order, channels, len(rows), block_rows or longest)
    notes = []
    if block_rows is None:
        lowest_hz = min(peaks_hz, default=rate_hz / 2 / FEWEST_ROWS)
        block_rows, spanned = _block_rows(rate_hz, lowest_hz, order, channels, len(rows), longest)
        if spanned < CYCLES / 2:
            notes.append(
                f"the lags span {spanned:.1f} cycles of the lowest peak ({lowest_hz:.3g} Hz) only: higher peaks need "
                "the sample rate; identify the low modes on their own, in a band that ends above them"
            )
    side = round(block_rows * _side(channels, len(rows)))
    if side > LARGEST_SIDE:
        raise SetupError(
            f"{block_rows} block rows of {channels} channels and {len(rows)} references make as much work as a "
            f"square matrix of side {side}; {LARGEST_SIDE} is the most, so take fewer block rows or references"
        )
    if decimation > 1:
        notes.append(
            f"correlations are taken every {decimation} samples (at {rate_hz:.4g} Hz), behind an anti-alias filter "
            f"that passes up to {_passed_hz(rate_hz, decimation):.4g} Hz"
        )
    passed = _passed_hz(rate_hz, decimation)
    return SubspacePlan(
        decimation=decimation,
        block_rows=block_rows,
        orders=tuple(range(2, order + 1, 2)) or (order,),
        references=rows,
        band_hz=(low, min(high, passed)),
        notes=tuple(notes),
    )


def _band(band_hz: Band | None, sample_rate_hz: float) -> Band:
    half = sample_rate_hz / 2
    low, high = band_hz or (0.0, half)
    if low >= half:
        raise SetupError(f"band {low:g} to {high:g} Hz begins above half the sample rate, {half:g} Hz")
    return low, min(high, half)


def _peaks_hz(spectra: CrossSpectra, low: float, high: float) -> list[float]:
    peaks = find_peaks(power_spectral_density(spectra), count=MOST_PEAKS)
    return [peak.frequency_hz for peak in peaks if low <= peak.frequency_hz <= high]


def _decimation(sample_rate_hz: float, highest_hz: float) -> int:
    return max(floor(sample_rate_hz / (SAMPLES_A_CYCLE * highest_hz) + 1e-9), 1)


def _passed_hz(rate_hz: float, decimation: int) -> float:
    return rate_hz / 2 * (PASS_BAND if decimation > 1 else 1.0)


def _order(max_order: int | None, channels: int, references: int, most_rows: int) -> int:
    if max_order is not None:
        return max_order
    return max(min(MAX_ORDER, (most_rows - 1) * channels, most_rows * references), 1)


def _block_rows(
    rate_hz: float, lowest_hz: float, order: int, channels: int, references: int, longest: int
) -> tuple[int, float]:
    """Block rows, and the cycles of the lowest peak that the lags then span."""
    wanted = ceil(CYCLES * rate_hz / lowest_hz / 2)
    most = min(max(int(MOST_SIDE / _side(channels, references)), FEWEST_ROWS), longest)
    least = max(FEWEST_ROWS, ceil(order / channels) + 1, ceil(order / references))
    chosen = max(min(wanted, most), least)
    return chosen, 2 * chosen * lowest_hz / rate_hz


def _side(channels: int, references: int) -> float:
    """Side of the square matrix whose decomposition is as much work as that of one block row and column."""
    return float(np.cbrt(channels * references * references))


def _references(spectra: CrossSpectra, names: Sequence[str] | None, band_hz: Band) -> tuple[int, ...]:
    if names is not None:
        return tuple(dict.fromkeys(find_channels(spectra.channels, names, role="reference")))
    count = len(spectra.channels)
    if count <= MOST_REFERENCES:
        return tuple(range(count))
    lines = (spectra.frequency_hz >= band_hz[0]) & (spectra.frequency_hz <= band_hz[1])
    covariance = spectra.density[:, :, lines].sum(axis=2).real
    sigma = np.sqrt(np.maximum(np.diag(covariance), np.finfo(np.float64).tiny))
    # Pivoting takes the channels one after another that the ones before explain least.
    pivots = qr(covariance / np.outer(sigma, sigma), mode="r", pivoting=True)[1]
    return tuple(sorted(int(row) for row in pivots[:MOST_REFERENCES]))
