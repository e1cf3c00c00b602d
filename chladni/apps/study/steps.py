"""The steps of a recipe: each gives the document that the command of its name gives for one log."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from chladni.apps.documents import Document, frf_document, psd_document
from chladni.apps.frf import transfer
from chladni.apps.gap_document import gap_document
from chladni.apps.levels import levels_document, measure_levels
from chladni.apps.modal_study import modal_study
from chladni.apps.modes import Wanted
from chladni.apps.modes_document import modes_document
from chladni.apps.psd import densities
from chladni.apps.sources import Share, Span
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.spectral.bands import within
from chladni.spectral.peaks import find_response_peaks

if TYPE_CHECKING:
    from chladni.io.study.recipe_file import FrfTable, GapTable, LevelsTable, ModesTable, PsdTable
    from chladni.models.core.model import Model
    from chladni.robots.robot import Robot


#: Steps that are sums over a log, so that several workers may share it.
DIVIDED: Final = ("psd", "frf", "levels")


def info_document(log: Log, _: object, __: object = None) -> Document:
    """Give what ``chladni info`` gives."""
    return log.info().to_json()


def densities_document(log: Log, asked: "PsdTable", __: object = None, share: Share | None = None) -> Document:
    """Give what ``chladni psd`` gives, of sums that are shared where there is a share."""
    averaging = Averaging(resolution_hz=asked.resolution_hz, window=asked.window, overlap=asked.overlap)
    span = Span(start_s=asked.start_s, end_s=asked.end_s, share=share)
    found = densities(log, channels=asked.channels, averaging=averaging, span=span)
    return psd_document(tuple(within(one, highest_hz=asked.highest_hz) for one in found))


def responses_document(log: Log, asked: "FrfTable", __: object = None, share: Share | None = None) -> Document:
    """Give what ``chladni frf`` gives, of sums that are shared where there is a share."""
    found = transfer(
        log,
        asked.references,
        asked.responses,
        estimator=asked.estimator,
        averaging=Averaging(resolution_hz=asked.resolution_hz, window=asked.window, overlap=asked.overlap),
        span=Span(start_s=asked.start_s, end_s=asked.end_s, join=asked.join, share=share),
    )
    found = within(found, highest_hz=asked.highest_hz)
    return frf_document(found, find_response_peaks(found))


def mode_set_document(log: Log, asked: "ModesTable", __: object = None) -> Document:
    """Give what ``chladni modes`` gives."""
    bands = None if asked.band_hz is None else [asked.band_hz]
    found = modal_study(
        log,
        references=asked.references,
        operational=asked.operational,
        channels=asked.channels,
        method=asked.method,
        wanted=Wanted.of(bands_hz=bands, count=asked.count, frequencies_hz=asked.frequencies_hz),
        resolution_hz=asked.resolution_hz,
        span=Span(start_s=asked.start_s, end_s=asked.end_s, join=asked.join),
    )
    return modes_document(found.modes, found.validation, found.study.relative_motion, found.transmissibility)


def log_levels_document(log: Log, asked: "LevelsTable", __: object = None, share: Share | None = None) -> Document:
    """Give what ``chladni levels`` gives, of sums that are shared where there is a share."""
    found = measure_levels(
        log,
        channels=asked.channels,
        bands_hz=asked.bands_hz,
        running_s=asked.running_s,
        machine=asked.machine,
        slow=asked.slow,
        span=Span(start_s=asked.start_s, end_s=asked.end_s, share=share),
    )
    return levels_document(found)


def diagnosis_document(log: Log, asked: "GapTable", model: "Model | Robot | None") -> Document:
    """Give what ``chladni gap`` gives."""
    # Here, because it compiles what it simulates with, which other recipes don't pay for.
    from chladni.apps.diagnose import diagnose_gap

    if model is None:
        raise AssertionError("a recipe with [gap] has its model")
    found = diagnose_gap(
        model,
        [log],
        leave_out=asked.leave_out,
        seed=asked.seed,
        start_s=asked.start_s,
        end_s=asked.end_s,
        join=asked.join,
        state=asked.state,
        command=asked.command,
    )
    return gap_document(found)


#: By the name of their table in a recipe.
DOCUMENTS: Final[Mapping[str, Callable[..., Document]]] = {
    "info": info_document,
    "psd": densities_document,
    "frf": responses_document,
    "modes": mode_set_document,
    "levels": log_levels_document,
    "gap": diagnosis_document,
}
