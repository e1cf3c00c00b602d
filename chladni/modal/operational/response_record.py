"""One pass over a record of responses: its beginning, its spectra, its correlation functions."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from chladni.modal.operational.correlation import BLOCKS, CorrelationAccumulator, CorrelationFunctions
from chladni.modal.operational.subspace_plan import SubspacePlan
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.accumulator import CrossSpectraAccumulator
from chladni.spectral.blocks import Source, leading_part, samples_known
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.segmentation import Segmentation
from chladni.spectral.stretches import Stretch

# The beginning of a stream that choices are made from: some tens of megabytes.
SAMPLES_TO_PLAN_FROM = 1 << 19
# Fewer give spectra of less than 16 lines.
FEWEST_SAMPLES = 512
# Spectra by default resolve the band asked for this finely, where the record is long enough for so many segments.
LINES_IN_BAND = 400
SEGMENTS = 16
# Blocks for the scatter are this many times longer than the lags, so that neighbours are independent, unless there
# would be too few to tell a scatter.
LAG_SPANS_IN_BLOCK = 10
FEWEST_BLOCKS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseRecord:
    """A series, or a stream whose beginning was looked at.

    Attributes
    ----------
    lead
        Its first blocks, of the channels that vary; all blocks when `whole`.
    blocks
        All blocks, to be read once.
    whole
        Whether there's nothing after the lead.
    constant
        Names of channels that show one value only, and were left out.
    """

    lead: tuple[TimeSeries, ...]
    blocks: Iterator[TimeSeries]
    whole: bool
    constant: tuple[str, ...]

    @property
    def sample_rate_hz(self) -> float:
        """Samples a second."""
        return self.lead[0].sample_rate_hz

    @property
    def samples(self) -> int:
        """Samples of the lead."""
        return sum(block.samples for block in self.lead)


def open_record(source: Source) -> ResponseRecord:
    """Look at the beginning of a source and leave out channels that don't vary.

    Raises
    ------
    EstimateError
        When there is no sample, or no channel varies.
    """
    lead, blocks = leading_part(source, SAMPLES_TO_PLAN_FROM)
    names = [channel.name for channel in lead[0].channels]
    varying = np.zeros(len(names), dtype=np.bool_)
    first: list[float | None] = [None] * len(names)
    for block in lead:
        for row in np.flatnonzero(~varying):
            usable = block.values[row] if block.valid is None else block.values[row][block.valid[row]]
            if usable.size:
                begun = first[row]
                first[row] = float(usable[0]) if begun is None else begun
                varying[row] = bool(np.any(usable != first[row]))
    kept = [name for name, varies in zip(names, varying, strict=True) if varies]
    constant = tuple(name for name, varies in zip(names, varying, strict=True) if not varies)
    if not kept:
        raise EstimateError(f"no channel varies ({', '.join(constant)}): there is no response to find modes in")
    return ResponseRecord(
        lead=tuple(block.select(kept) for block in lead) if constant else lead,
        blocks=(block.select(kept) for block in blocks) if constant else iter(blocks),
        whole=samples_known(source, lead, SAMPLES_TO_PLAN_FROM) is not None,
        constant=constant,
    )


def lead_spectra(record: ResponseRecord, band_hz: tuple[float, float] | None) -> CrossSpectra:
    """Cross-spectra of the lead, fine enough for the band.

    Raises
    ------
    EstimateError
        When the record is too short for spectra in which peaks can be told.
    """
    if record.samples < FEWEST_SAMPLES:
        raise EstimateError(
            f"{record.samples} samples ({record.samples / record.sample_rate_hz:g} s) are too few to tell peaks in "
            f"their spectra; at least {FEWEST_SAMPLES} are needed, and some hundred cycles of the lowest mode"
        )
    spectra = cross_spectra(record.lead)
    if band_hz is None:
        return spectra
    finer_hz = max(band_hz[1] / LINES_IN_BAND, SEGMENTS * record.sample_rate_hz / record.samples)
    spacing_hz = float(spectra.frequency_hz[1] - spectra.frequency_hz[0])
    # Where gaps leave few whole segments, finer lines would leave none.
    if finer_hz >= spacing_hz or spectra.provenance.skipped:
        return spectra
    return cross_spectra(record.lead, resolution_hz=finer_hz)


def read_record(
    record: ResponseRecord, spectra: CrossSpectra, plan: SubspacePlan
) -> tuple[CorrelationFunctions, CrossSpectra]:
    """Read all blocks once: correlation functions by the plan, and the spectra of the whole record.

    Raises
    ------
    EstimateError
        When the record is too short for the plan, or holds samples that are not finite and not marked as invalid.
    """
    channels, rate_hz = record.lead[0].channels, record.sample_rate_hz
    blocks = record.samples // (LAG_SPANS_IN_BLOCK * plan.lags * plan.decimation)
    correlations = CorrelationAccumulator(
        channels,
        rate_hz,
        lags=plan.lags,
        references=plan.references,
        decimation=plan.decimation,
        blocks=min(max(blocks, FEWEST_BLOCKS), BLOCKS),
        samples=record.samples,
    )
    if record.whole:
        for block in record.blocks:
            correlations.update(block)
        return correlations.result(), spectra
    provenance = spectra.provenance
    samples = round(provenance.segment_s * rate_hz)
    hop = samples - round(samples * provenance.overlap)
    average = CrossSpectraAccumulator(channels, rate_hz, Segmentation(samples=samples, hop=max(hop, 1)))
    for block in record.blocks:
        correlations.update(block)
        average.update(block)
    return correlations.result(), average.result()


def first_stretch(record: ResponseRecord) -> TimeSeries:
    """Give the beginning of the record, up to its first break in time, as one series."""
    first = record.lead[0]
    book = Stretch(Segmentation(samples=4, hop=4))
    parts: list[TimeSeries] = []
    for block in record.lead:
        if book.breaks_at(block.start_time_ns, block.sample_rate_hz):
            break
        book.extend(block, [])
        parts.append(block)
    if len(parts) == 1:
        return first
    masks = [np.ones(part.values.shape, np.bool_) if part.valid is None else part.valid for part in parts]
    return replace(
        first,
        values=np.concatenate([part.values for part in parts], axis=1),
        valid=np.concatenate(masks, axis=1),
    )
