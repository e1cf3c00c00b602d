"""What spectra of a log have in common: how they are averaged, of which grid, without channels that stand still."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from chladni.apps.sources import Progress, Span, Watched, on_one_grid, watched_grids
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries
from chladni.spectral.adaptive import adaptive_auto_spectra, adaptive_cross_spectra
from chladni.spectral.blocks import Source
from chladni.spectral.products import PAIRS
from chladni.spectral.segmentation import SHORTEST_SEGMENT
from chladni.spectral.windows import Window

SpectraT = TypeVar("SpectraT", CrossSpectra, PowerSpectralDensity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Averaging:
    """How to average; None leaves the choice to the excitation, see `adaptive_cross_spectra`."""

    resolution_hz: float | None = None
    window: Window | None = None
    overlap: float | None = None

    def powers(self, source: Source) -> AutoSpectra:
        """Average the auto-spectrum of each of the source's channels so."""
        return adaptive_auto_spectra(
            source, resolution_hz=self.resolution_hz, window=self.window, overlap=self.overlap
        )

    def spectra(self, source: Source, references: Sequence[str] | None) -> CrossSpectra:
        """Average the source's cross-spectra so."""
        return adaptive_cross_spectra(
            source,
            references=references,
            resolution_hz=self.resolution_hz,
            window=self.window,
            overlap=self.overlap,
        )


def require_moving(watched: Watched, references: Sequence[str]) -> None:
    """Raise `EstimateError` when a reference never changes: all lines would be masked, and nobody told why."""
    dead = [name for name in references if name in watched.constant()]
    if dead:
        raise EstimateError(f"{some_of(dead)} never changes, so it excites nothing; name another reference")


def of_series(series: TimeSeries, names: Sequence[str] | None, span: Span) -> TimeSeries:
    """Give the named channels of a series, and the span of them."""
    chosen = series if names is None else series.select(list(names))
    if span == Span():
        return chosen
    return chosen.window(start_s=span.start_s, end_s=span.end_s)


def grid_of(
    log: Log, references: Sequence[str], names: Sequence[str] | None, span: Span, progress: Progress
) -> Watched:
    """Find the stream that holds the references, and the responses when they were named."""
    wanted = set(references if names is None else log.names(names))
    for grid in watched_grids(log, names, span, progress=progress):
        if wanted <= set(grid.names):
            # Known before a sample of a large log is read.
            PAIRS.require_fitting(len(grid.names), SHORTEST_SEGMENT)
            return grid
    return on_one_grid(log, sorted(wanted), span, progress=progress)


def without_constant(spectra: SpectraT, watched: Watched, *, keep: Sequence[str]) -> SpectraT:
    """Leave out channels that never changed: their spectra are zero, and a table of zeros hides the rest."""
    constant = dict.fromkeys(name for name in watched.constant() if name not in keep)
    if not constant:
        return spectra
    moving = [channel.name for channel in spectra.channels if channel.name not in constant]
    if not moving:
        raise EstimateError("no channel changes, so there is nothing to make a spectrum of")
    note = f"channels that never change are left out: {some_of(list(constant))}"
    chosen = spectra.select(moving)
    return replace(chosen, provenance=chosen.provenance.with_notes(note))
