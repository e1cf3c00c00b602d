"""``chladni frf``: how points relate."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_drawn
from chladni.cli.words import number, unit, with_error
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.peak import Peak


@opens_files
def frf(
    log: options.Log,
    *,
    reference: options.References = None,
    response: options.Responses = None,
    estimator: Annotated[
        Literal["H1", "H2", "Hv"],
        typer.Option(help="H1: noise on the response; H2: noise on the reference; Hv: on both."),
    ] = "H1",
    resolution: options.Resolution = None,
    window: options.Window = None,
    overlap: options.Overlap = None,
    fmax: options.Fmax = None,
    start: options.Start = None,
    end: options.End = None,
    join: options.Join = "auto",
    opener: Opener,
    json: options.Json = None,
    csv: options.Csv = None,
    figures: options.Figures = None,
    report: options.Report = None,
    db: options.Decibels = False,
    log_frequency: options.LogFrequency = False,
) -> None:
    """Transfer functions and coherence, with their uncertainty."""
    from chladni.apps.documents import frf_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.sources import Span
    from chladni.apps.spectra import Averaging, transfer
    from chladni.signals.study import Study
    from chladni.spectral.bands import up_to
    from chladni.spectral.peaks import find_response_peaks

    out = Output.of_log([log, opener.setup], json=json, csv=csv, figures=figures, report=report)
    require_drawn({"--db": db, "--log-frequency": log_frequency}, [figures, report])
    with opener(log) as opened, out.progress(log.name) as progress:
        found = transfer(
            opened,
            reference,
            response,
            estimator=estimator,
            averaging=Averaging(resolution_hz=resolution, window=window, overlap=overlap),
            span=Span(start_s=start, end_s=end, join=join),
            progress=progress,
        )
        told = reading_sentences(opened, everything=response is None)
        geometry = opened.geometry
    found = up_to(found, fmax)
    peaks = find_response_peaks(found)
    _print_account(out, found)
    _print_peaks(out, found, peaks)
    findings = told + found.provenance.notes
    out.lines(findings)
    study = Study(title=log.name, response=found, response_peaks=peaks, geometry=geometry, findings=findings)
    out.csv([found])
    out.pictures(study, figures=figures, report=report, decibels=db, log_frequency=log_frequency)
    out.json(frf_document(found, peaks))


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
        f"{np.angle(response.values[row, column, line], deg=True):.0f}",
        number(float(response.coherence[row, line]), digits=3),
    ]
