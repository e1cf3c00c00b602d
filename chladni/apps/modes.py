"""Natural modes of a log, a series or frequency responses, in one call."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from chladni.apps.excitation import excitation_names, stored_functions
from chladni.apps.frf import transfer
from chladni.apps.modal_channels import motions_of_one_unit, responses_alone
from chladni.apps.sources import Progress, Span, Watched, no_progress
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.io.source import SeriesLike, log_or_series, response_of
from chladni.modal.checks.roving import over_hit_points
from chladni.modal.experimental.bands import join_bands
from chladni.modal.experimental.circle_fit import CircleFit
from chladni.modal.experimental.half_power import HalfPower
from chladni.modal.experimental.line_spacing import longest_modal_segment_s
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.modal.operational.efdd import EnhancedFrequencyDomainDecomposition
from chladni.modal.operational.fdd import FrequencyDomainDecomposition
from chladni.modal.operational.harmonics import (
    LONGEST_SEGMENT_SHARE,
    SHORTEST_SEGMENT,
    machine_harmonics,
    without_machines,
)
from chladni.modal.operational.subspace import CovarianceDrivenSubspace
from chladni.signals.channel import Names, as_names
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet
from chladni.signals.renamed import renamed
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_text import in_unit
from chladni.signals.wording import counted
from chladni.spectral.adaptive import adaptive_cross_spectra
from chladni.spectral.blocks import leading_part
from chladni.spectral.excitation import HAMMER_RANGE
from chladni.spectral.forms import MOTION_ORDER
from chladni.spectral.stretches import valid_runs

Band = tuple[float, float]
FromResponses = CovarianceDrivenSubspace | FrequencyDomainDecomposition | EnhancedFrequencyDomainDecomposition
FromFunctions = PolyReferenceLeastSquares | CircleFit | HalfPower
Method = FromFunctions | FromResponses

# Machines are looked for in the beginning of a stream, in one piece.
SAMPLES_FOR_MACHINES = 1 << 20
# A hammer drives modes as far as its force stays within 20 dB (ISO 7626-5); beyond, side lobes of its pulse still
# make coherent peaks, of which only who asks for them knows what they are worth.
HAMMER_DRIVES = 1e-2
ALONE = ", or ask for modes from responses alone (--operational)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Which modes to look for: in these bands (all lines if none), so many at most, or near these frequencies."""

    bands_hz: tuple[Band, ...] = ()
    count: int | None = None
    frequencies_hz: tuple[float, ...] | None = None

    @classmethod
    def of(
        cls, *, bands_hz: Sequence[Band] | None, count: int | None, frequencies_hz: Sequence[float] | None
    ) -> Self:
        """Give the request for options that may be missing or empty."""
        return cls(
            bands_hz=tuple(bands_hz or ()),
            count=count,
            frequencies_hz=tuple(frequencies_hz) if frequencies_hz else None,
        )


@renamed(reference="references", channels="responses")
@in_one_thread()
def identify_modes(
    source: SeriesLike | FrequencyResponse | CrossSpectra,
    *,
    references: Names | None = None,
    responses: Names | None = None,
    operational: bool = False,
    method: Method | None = None,
    band_hz: Band | Sequence[Band] | None = None,
    count: int | None = None,
    frequencies_hz: Sequence[float] | None = None,
    resolution_hz: float | None = None,
    sample_rate_hz: float | None = None,
    frequency_hz: ArrayLike | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> ModeSet:
    """Identify natural frequencies, damping ratios and modal vectors, each with its uncertainty.

    Parameters
    ----------
    source
        A log, the path to one, a series or an array ``[channel, sample]``, whose frequency responses are estimated
        first (or, with `operational`, whose responses alone are used); frequency responses, or an array of them
        ``[response, reference, frequency]``; or averaged cross-spectra of responses. Of a universal file without time
        records the frequency responses are taken that it holds, else its modes.
    references
        Channel of the excitation, or several; None takes those whose role is reference, else the first force.
    responses
        Channels of the motions; None takes all motions of the most common unit on one sampling grid.
    operational
        Whether to use responses alone, excited by wind, traffic, the machine's own work.
    method
        `PolyReferenceLeastSquares` (the default for frequency responses), `CircleFit`, `HalfPower`;
        `CovarianceDrivenSubspace` (the default for responses alone), `FrequencyDomainDecomposition`,
        `EnhancedFrequencyDomainDecomposition` (the default for cross-spectra).
    band_hz
        Only modes between these frequencies; several bands are fitted one by one and joined. None takes all lines
        that are excited; of a hammer test those where the force is less than 20 dB down.
    count
        At most so many modes, the most certain ones. When the data hold fewer, a note says why.
    frequencies_hz
        The modes nearest to these frequencies, instead of an automatic choice.
    resolution_hz
        Distance of the lines of the frequency responses (of the cross-spectra for frequency domain decomposition).
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    frequency_hz
        ``[frequency]``: makes of the array frequency responses over these lines.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.

    Returns
    -------
    ModeSet
        Empty when there is no mode; its notes say why. Shapes are over the responses, or, by reciprocity, over the
        references where there are fewer responses than forces, as of a hammer that roved (see `over_hit_points`).

    Raises
    ------
    LogError
        When there is no such channel, or the channels named have different sampling grids.
    EstimateError
        When the source, the method and the options don't go together, or there is too little to identify from.

    Examples
    --------
    >>> with open_log("arm.mcap") as log:  # doctest: +SKIP
    ...     modes = identify_modes(log, references="/shaker.wrench.force.x", band_hz=(10, 400))
    """
    wanted = Wanted.of(bands_hz=_bands(band_hz), count=count, frequencies_hz=frequencies_hz)
    span, averaging = Span(start_s=start_s, end_s=end_s), Averaging(resolution_hz=resolution_hz)
    if isinstance(source, CrossSpectra):
        return modes_of_spectra(source, method=method, wanted=wanted)
    if isinstance(source, FrequencyResponse) or frequency_hz is not None:
        given = response_of(source, frequency_hz=frequency_hz)
        return modes_of_response(over_hit_points(given), method=method, wanted=wanted)
    source = log_or_series(source, sample_rate_hz=sample_rate_hz)
    named = None if responses is None else as_names(responses)
    if isinstance(source, Log) and not source.channels and source.functions is None and source.modes is not None:
        return source.modes
    if operational or isinstance(method, FromResponses):
        return modes_of_responses(
            source, channels=named, method=method, wanted=wanted, averaging=averaging, span=span
        )
    return functions_and_modes(
        source, references, named, method=method, wanted=wanted, averaging=averaging, span=span
    )[1]


def modes_of_response(response: FrequencyResponse, *, method: Method | None, wanted: Wanted) -> ModeSet:
    """Identify modes from frequency responses, band by band when several bands are wanted."""
    chosen = PolyReferenceLeastSquares() if method is None else method
    if not isinstance(chosen, FromFunctions):
        raise EstimateError(f"{type(chosen).__name__} works on responses alone, not on frequency responses")
    if len(wanted.bands_hz) > 1:
        return join_bands([modes_of_response(response, method=chosen, wanted=one) for one in _band_by_band(wanted)])
    band = wanted.bands_hz[0] if wanted.bands_hz else None
    found = chosen.identify(response, band_hz=band, count=wanted.count, frequencies_hz=wanted.frequencies_hz)
    return replace(found, provenance=found.provenance.with_notes(*_held_still(response)))


def _held_still(response: FrequencyResponse) -> tuple[str, ...]:
    """Say of which structure the modes are when the reference is a motion, and not a force."""
    motions = [channel.name for channel in response.references if channel.unit in MOTION_ORDER]
    if not motions:
        return ()
    told = f"{some_of(motions)} is a motion, not a force: these are modes of the structure held still there"
    remedy = "those of the structure as it stands need a force as reference, or responses alone"
    return (f"{told}, as on a shaking table; {remedy}",)


def modes_of_spectra(spectra: CrossSpectra, *, method: Method | None, wanted: Wanted) -> ModeSet:
    """Identify modes from averaged cross-spectra of responses, band by band when several bands are wanted."""
    chosen = EnhancedFrequencyDomainDecomposition() if method is None else method
    if not isinstance(chosen, FrequencyDomainDecomposition | EnhancedFrequencyDomainDecomposition):
        raise EstimateError(f"{type(chosen).__name__} doesn't work on cross-spectra; give it the series or the log")
    if len(wanted.bands_hz) > 1:
        return join_bands([modes_of_spectra(spectra, method=chosen, wanted=one) for one in _band_by_band(wanted)])
    band = wanted.bands_hz[0] if wanted.bands_hz else None
    return chosen.identify(spectra, band_hz=band, count=wanted.count, frequencies_hz=wanted.frequencies_hz)


def modes_of_responses(
    source: Log | TimeSeries,
    *,
    channels: Sequence[str] | None,
    method: Method | None,
    wanted: Wanted,
    averaging: Averaging,
    span: Span,
    progress: Progress = no_progress,
) -> ModeSet:
    """Identify modes from responses alone."""
    chosen = CovarianceDrivenSubspace() if method is None else method
    if not isinstance(chosen, FromResponses):
        raise EstimateError(f"{type(chosen).__name__} needs frequency responses; name the channel of the excitation")
    samples, notes = responses_alone(source, channels, span, progress=progress)
    found = _from_samples(samples, chosen, wanted, averaging)
    return replace(found, provenance=found.provenance.with_notes(*notes))


def functions_and_modes(
    source: Log | TimeSeries,
    reference: Names | None,
    channels: Sequence[str] | None,
    *,
    method: Method | None,
    wanted: Wanted,
    averaging: Averaging,
    span: Span,
    progress: Progress = no_progress,
) -> tuple[FrequencyResponse, ModeSet]:
    """Estimate frequency responses of motions in one unit, and identify their modes.

    Unless bands or frequencies are wanted, a hammer excites no further than it drives modes. Unless the resolution
    is chosen, two are tried: lines as for the eye, and finer ones, which part narrow modes but lie deeper in noise.
    Those that more modes rise from are taken, the finer ones if it's the same.

    Raises
    ------
    EstimateError
        When no excitation is named and none can be told.
    """
    return measured_functions(
        source, reference, channels, wanted=wanted, averaging=averaging, span=span, progress=progress
    ).modes(method=method, wanted=wanted)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredFunctions:
    """Frequency responses that modes are identified from.

    Attributes
    ----------
    coarse
        On lines as for the eye.
    fine
        On finer lines, which part narrow modes but lie deeper in noise; None where the lines were chosen.
    """

    coarse: FrequencyResponse
    fine: FrequencyResponse | None = None

    def modes(self, *, method: Method | None, wanted: Wanted) -> tuple[FrequencyResponse, ModeSet]:
        """Identify modes from both, and give those that more rise from, with their functions; the finer if equal."""
        again = modes_of_response(self.coarse, method=method, wanted=wanted)
        if self.fine is None:
            return self.coarse, again
        modes = modes_of_response(self.fine, method=method, wanted=wanted)
        hidden = again.frequency_hz.size - modes.frequency_hz.size
        if hidden <= 0:
            return self.fine, modes
        apart = [f"{one.frequency_hz[1] - one.frequency_hz[0]:.3g} Hz apart" for one in (self.fine, self.coarse)]
        told = (
            f"on lines {apart[0]} noise hides {counted(hidden, 'mode')}; the modes are from lines {apart[1]}. "
            "To see more of them, name every excitation or take a longer record"
        )
        return self.coarse, replace(again, provenance=again.provenance.with_notes(told))


def measured_functions(
    source: Log | TimeSeries,
    reference: Names | None,
    channels: Sequence[str] | None,
    *,
    wanted: Wanted,
    averaging: Averaging,
    span: Span,
    progress: Progress = no_progress,
) -> MeasuredFunctions:
    """Estimate the functions that `functions_and_modes` identifies modes from."""
    named = None if reference is None else as_names(reference)
    stored = stored_functions(source, named, channels)
    if stored is not None:
        held = transfer(source, named, channels, estimator="H1", averaging=averaging, span=span)
        return MeasuredFunctions(coarse=over_hit_points(_of_one_form(held)))
    references = excitation_names(source, span, otherwise=ALONE) if named is None else named
    coarse = _functions(source, references, channels, wanted, averaging, span, progress)
    finer = _modal_averaging(coarse, averaging)
    if finer == averaging:
        return MeasuredFunctions(coarse=coarse)
    return MeasuredFunctions(
        coarse=coarse, fine=_functions(source, references, channels, wanted, finer, span, no_progress)
    )


def _of_one_form(response: FrequencyResponse) -> FrequencyResponse:
    """Leave out responses that are no motion, or another than most, where there are such as are."""
    orders = Counter(MOTION_ORDER[channel.unit] for channel in response.responses if channel.unit in MOTION_ORDER)
    if not orders:
        return response
    (order, _), *_ = orders.most_common()
    chosen = [channel for channel in response.responses if MOTION_ORDER.get(channel.unit) == order]
    others = [f"{one.name} {in_unit(one.unit)}" for one in response.responses if one not in chosen]
    if not others:
        return response
    told = f"modal vectors are of the responses {in_unit(chosen[0].unit)}; left out: {some_of(others)}"
    kept = response.select([channel.name for channel in chosen])
    return replace(kept, provenance=kept.provenance.with_notes(told))


def _functions(
    source: Log | TimeSeries,
    references: Sequence[str],
    channels: Sequence[str] | None,
    wanted: Wanted,
    averaging: Averaging,
    span: Span,
    progress: Progress,
) -> FrequencyResponse:
    anywhere = not wanted.bands_hz and wanted.frequencies_hz is None
    response = transfer(
        source,
        references,
        channels,
        estimator="H1",
        averaging=averaging,
        span=span,
        hammer_range=HAMMER_DRIVES if anywhere else HAMMER_RANGE,
        progress=progress,
    )
    names, notes = motions_of_one_unit(response.responses, named=channels is not None)
    chosen = response.select(names)
    told = _end_of_hammer(chosen) if anywhere else ()
    return over_hit_points(replace(chosen, provenance=chosen.provenance.with_notes(*notes, *told)))


def _end_of_hammer(response: FrequencyResponse) -> tuple[str, ...]:
    """Say where a hammer stops driving modes, when lines are left beyond."""
    if response.provenance.averaging != "impact" or not response.excited.any() or response.excited[-1]:
        return ()
    last_hz = response.frequency_hz[response.excited][-1]
    told = f"the force of the hits is 20 dB down above {last_hz:.4g} Hz: no mode is looked for there"
    return (f"{told}; give a band to look further",)


def _modal_averaging(response: FrequencyResponse, averaging: Averaging) -> Averaging:
    """Trade averages for lines, unless the user or the excitation has chosen.

    A fit averages over lines itself, but can't part modes that the window has smeared into one.
    """
    longest_s = longest_modal_segment_s(response)
    if averaging != Averaging() or longest_s <= response.provenance.segment_s:
        return averaging
    return replace(averaging, resolution_hz=1 / longest_s)


def _from_samples(
    samples: TimeSeries | Watched, method: FromResponses, wanted: Wanted, averaging: Averaging
) -> ModeSet:
    if isinstance(method, CovarianceDrivenSubspace):
        if len(wanted.bands_hz) > 1:
            raise EstimateError("responses alone are identified in one band; give the band that holds them all")
        if averaging.resolution_hz is not None:
            raise EstimateError(
                f"a resolution of {averaging.resolution_hz:g} Hz says nothing to the subspace method, which has no "
                "lines; leave it out, or choose frequency domain decomposition"
            )
        band = wanted.bands_hz[0] if wanted.bands_hz else None
        return method.identify(samples, band_hz=band, count=wanted.count, frequencies_hz=wanted.frequencies_hz)
    lead, blocks = leading_part(samples, SAMPLES_FOR_MACHINES)
    spectra = adaptive_cross_spectra(
        samples if isinstance(samples, TimeSeries) else blocks,
        resolution_hz=averaging.resolution_hz,
        window=averaging.window,
        overlap=averaging.overlap,
    )
    line_hz = float(spectra.frequency_hz[1] - spectra.frequency_hz[0])
    found = modes_of_spectra(spectra, method=method, wanted=wanted)
    return without_machines(found, _machines(lead[0]), line_hz=line_hz)


def _machines(series: TimeSeries) -> tuple[MachineHarmonic, ...]:
    longest = max((end - begin for begin, end in valid_runs(series)), default=0)
    # Kurtosis needs a stretch of its own; in a shorter one nothing can be told.
    return machine_harmonics(series) if longest >= LONGEST_SEGMENT_SHARE * SHORTEST_SEGMENT else ()


def _bands(band_hz: Band | Sequence[Band] | None) -> tuple[Band, ...]:
    """Give one band or several as several."""
    if band_hz is None:
        return ()
    edges = np.asarray(band_hz, dtype=np.float64)
    if edges.ndim not in (1, 2) or edges.shape[-1] != 2:
        raise EstimateError(f"band_hz {band_hz} must be (low, high) or several such pairs")
    return tuple((float(low), float(high)) for low, high in np.atleast_2d(edges))


def _band_by_band(wanted: Wanted) -> list[Wanted]:
    return [replace(wanted, bands_hz=(band,)) for band in wanted.bands_hz]
