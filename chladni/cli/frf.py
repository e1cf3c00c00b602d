"""``chladni frf``: how points relate."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.logs import told_apart
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import angle, fixed, number, unit, with_error
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.peak import Peak


@opens_files
def frf(
    logs: options.Logs,
    *,
    reference: options.References = None,
    response: options.Responses = None,
    estimator: Annotated[
        Literal["H1", "H2", "Hv"],
        typer.Option(
            case_sensitive=False, help="H1: noise on the response; H2: noise on the reference; Hv: on both."
        ),
    ] = "H1",
    averages: options.Averages,
    cut: options.Cut,
    part: options.Part,
    join: options.Join = "auto",
    opener: Opener,
    targets: options.Targets,
    looks: options.Looks,
) -> None:
    """Transfer functions and coherence, with their uncertainty; of several logs over one another."""
    from chladni.apps.documents import frf_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.frf import transfer
    from chladni.signals.shown_units import require_units
    from chladni.signals.study import Study
    from chladni.spectral.peaks import find_response_peaks

    out = targets.output([*logs, opener.setup], looks)
    studies: list[Study] = []
    for title, opened, progress in told_apart(logs, opener, out):
        require_units(opened.channels, cut.unit)
        whole = transfer(
            opened,
            reference,
            response,
            estimator=estimator,
            averaging=averages.averaging(),
            span=part.span(join=join),
            progress=progress,
        )
        (found,) = cut.of([whole])
        told = (*reading_sentences(opened, everything=response is None), *found.provenance.notes)
        peaks = find_response_peaks(found)
        _print_response(out, found, peaks, told)
        studies.append(
            Study(title=title, response=found, response_peaks=peaks, geometry=opened.geometry, findings=told)
        )
    out.csv([study.response for study in studies if study.response is not None])
    out.pictures(*studies, figures=targets.figures, report=targets.report, looks=looks)
    out.documents(frf_document, [(one.title, (one.response, one.response_peaks)) for one in studies])


def _print_response(
    out: Output, found: "FrequencyResponse", peaks: "tuple[Peak, ...]", told: tuple[str, ...]
) -> None:
    _print_account(out, found)
    _print_peaks(out, found, peaks)
    out.lines(told)


def _print_account(out: Output, response: "FrequencyResponse") -> None:
    account = response.provenance
    spacing_hz = float(response.frequency_hz[1] - response.frequency_hz[0])
    if not account.averages:
        held = counted(len(response.responses) * len(response.references), "function")
        first_hz, last_hz = (number(float(one)) for one in response.frequency_hz[[0, -1]])
        out.line(
            f"{held} as in the file, from {first_hz} to {last_hz} Hz, lines {number(spacing_hz)} Hz apart",
            style="bold",
        )
        return
    how = {"periodic": "whole periods", "impact": "hits"}.get(account.averaging, "averages")
    out.line(
        f"{account.estimator}: {account.averages} {how} of {account.segment_s:.6g} s ("
        f"{account.effective_averages:.1f} effective), window {account.window}, lines {number(spacing_hz)} Hz apart",
        style="bold",
    )


def _print_peaks(out: Output, response: "FrequencyResponse", peaks: "tuple[Peak, ...]") -> None:
    from chladni.spectral.peaks import MOST_PEAKS, judged_above_hz

    low_hz = judged_above_hz(response)
    judged = f", above {number(low_hz)} Hz" if low_hz else ""
    if not peaks:
        out.line(f"No peak stands out of the scatter on the excited lines{judged}.")
        return
    functions = [peak.channels for peak in peaks]
    cut = f", {MOST_PEAKS} a function at most" if max(map(functions.count, functions)) == MOST_PEAKS else ""
    # A single reference is the same in every row, and its place is the title.
    alone = len(response.references) == 1
    over = f" over {response.references[0].name}" if alone else ""
    # What tells one function apart is two names.
    table = out.channel_table if alone else out.table
    table(
        f"Peaks of the magnitude{over}, the highest first{cut}{judged}",
        [
            "response" if alone else "response / reference",
            "frequency [Hz]",
            "magnitude",
            "unit",
            "phase [deg]",
            "coherence",
        ],
        [[" / ".join(peak.channels[: 1 if alone else 2]), *_at_peak(response, peak)] for peak in peaks],
    )


def _at_peak(response: "FrequencyResponse", peak: "Peak") -> list[str]:
    import numpy as np

    row, column = response.function(*peak.channels)
    line = int(np.argmin(np.abs(response.frequency_hz - peak.frequency_hz)))
    return [
        with_error(peak.frequency_hz, peak.frequency_std_hz),
        with_error(peak.height, peak.height_std),
        unit(peak.unit),
        angle(float(np.angle(response.values[row, column, line], deg=True))),
        fixed(float(response.coherence[row, line]), places=3),
    ]
