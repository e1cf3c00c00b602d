"""The report of a diagnosis: one HTML file that needs nothing else."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from chladni.gap.records.diagnosis import Diagnosis
from chladni.io.atomic import atomic_write
from chladni.viewers import gap_tables as tables
from chladni.viewers.effect_words import cause_law
from chladni.viewers.figures.album import Album
from chladni.viewers.figures.gap import gap_album
from chladni.viewers.figures.gap_signals import windows_told
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.gap_summary import naive_sentence, summary, used_length
from chladni.viewers.report.markup import element, escaped, page, table
from chladni.viewers.report.pictures import Pictures

# More than in a terminal: the page can be scrolled.
RANKED = 12


def write_gap_report(
    evidence: GapEvidence,
    path: str | os.PathLike[str],
    *,
    album: Album | None = None,
    interactive: bool | None = None,
) -> Path:
    """Write the report of a diagnosis as one HTML file, whole or not at all.

    Parameters
    ----------
    evidence
        What to report.
    path
        File to write; one that exists is replaced.
    album
        The figures, when they are drawn already.
    interactive
        Whether plots zoom and read out, which takes Bokeh; None for where it's installed. Else they are pictures.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    target = Path(path)
    with atomic_write(target) as file:
        file.write(gap_report_html(evidence, album=album, interactive=interactive).encode())
    return target


def gap_report_html(evidence: GapEvidence, *, album: Album | None = None, interactive: bool | None = None) -> str:
    """Give the report as HTML: the answer, its evidence in figures and tables, and nothing to fetch."""
    title = f"{evidence.found.model}: the gap to {', '.join(evidence.found.logs)}"
    album = album or gap_album(evidence)
    pictures = Pictures(album, interactive=interactive)
    body = "\n".join(_body(title, evidence.found, _Shown(pictures, album, _captions(evidence.found))))
    return page(title, body, pictures.scripts())


@dataclass(frozen=True, slots=True)
class _Shown:
    """The figures of a page, and what is said of those of each section."""

    pictures: Pictures
    album: Album
    captions: Mapping[str, str]

    def of(self, *sections: str) -> str:
        """Give the figures of some sections as HTML."""
        return "".join(self.pictures.figures(self.album, one, self.captions[one]) for one in sections)


def _body(title: str, found: Diagnosis, shown: _Shown) -> Iterator[str]:
    yield element("h1", escaped(title))
    yield _logs(found)
    # One picture shows the difference at once.
    yield _section("Torque that is missing", shown.of("residuals"))
    yield _section("Answer", _answer(found))
    yield _section("Errors, before and after", shown.of("errors"))
    yield _section("Force that is missing" if found.verdict != "none" else "Force recovered", shown.of("force"))
    yield _section("Causes", _causes(found))
    yield _section("Friction", shown.of("friction", "positions"))
    yield _section("Spectra of the errors", shown.of("spectra"))
    yield _section("Motion", shown.of("motion"))
    # With one sensor no site can be told from another, and bands and regimes are read as easily in tables.
    drawn = bool(tables.places_of(found.where) and shown.album.sections.get("shares"))
    places = ("shares", "map") if drawn else ("map",)
    yield _section(
        "Where it lies",
        _where(found, drawn=drawn) + shown.of(*places) + _left(found) + _noise(found),
    )
    yield _section(
        "What was weighed", _tables((tables.ranking_table(found, count=RANKED), (2, 3, 4))) + _naive(found)
    )
    yield _section(
        "Parameters that moved, or that this log doesn't determine",
        _tables((tables.parameter_table(found), (1, 2, 3))),
    )
    yield _section(tables.distortion_title(found.distortion), _tables((tables.distortion_table(found), (1, 2, 3, 4))))
    yield _section("Measured and simulated", shown.of("signals"))
    yield _section("Limits", _list((*found.levels, *found.remarks, *_held_out(found))))


def _logs(found: Diagnosis) -> str:
    """How much of each log was used, and which of several the pictures are of."""
    signals = found.signals
    told = [f"{one.log}: {used_length(one)} at {one.sample_rate_hz:.6g} Hz" for one in found.used]
    if len(told) > 1:
        shown = [] if signals is None else [f"pictures are of {signals.log}"]
        told = [f"{len(told)} logs", *told, *shown]
    # Diagnoses that weren't made from files don't tell how much of them was used.
    if not told and signals is not None:
        length_s = signals.measured.shape[1] / signals.sample_rate_hz
        told = [f"{signals.log}: {length_s:.4g} s at {signals.sample_rate_hz:.6g} Hz"]
    return element("p", escaped("; ".join(told)), class_="note") if told else ""


def _where(found: Diagnosis, *, drawn: bool) -> str:
    where = tables.where_told(found)
    channels = (tables.channel_table(where), (1, 2))
    shares = (
        (tables.site_table(where), (1,)),
        (tables.band_table(where), (1, 2)),
        (tables.regime_table(where), (2, 3)),
    )
    times = (tables.time_table(where), (1,))
    # The picture of shares has the numbers of the others.
    return _tables(channels, times) if drawn else _tables(channels, *shares, times)


def _left(found: Diagnosis) -> str:
    if found.left is None:
        return ""
    told = "The gap of each output is that before anything is tuned; shares are of what the best parameters leave."
    return element("p", told, class_="note")


def _noise(found: Diagnosis) -> str:
    told = tables.noise_told(found.where)
    return "" if told is None else element("p", escaped(told), class_="note")


def _section(heading: str, content: str) -> str:
    return element("section", element("h2", escaped(heading)) + content) if content else ""


def _answer(found: Diagnosis) -> str:
    first, *rest = summary(found)
    told = element("p", element("strong", escaped(first))) + "".join(element("p", escaped(one)) for one in rest)
    if found.next_measurement is None:
        return told
    return told + element("p", element("strong", "Measure next: ") + escaped(found.next_measurement))


def _causes(found: Diagnosis) -> str:
    # Effects of somebody's own have no law here; joints that rub alike share one.
    # A robot's laws are those of docs/robots.md, without the details that models need.
    causes = found.causes if found.machine is None else ()
    laws = dict.fromkeys(law for law in map(cause_law, causes) if law)
    return _tables((tables.cause_table(found), (3,))) + _list(tuple(laws))


def _naive(found: Diagnosis) -> str:
    told = naive_sentence(found)
    return "" if told is None else element("p", escaped(told), class_="note")


def _held_out(found: Diagnosis) -> tuple[str, ...]:
    stretches = found.gap.held_out
    if not stretches:
        return ()
    seconds = sum(one.end_s - one.start_s for one in stretches)
    return (f"The closing was measured on {seconds:.4g} s that no fit saw, in {len(stretches)} of its stretches.",)


def _tables(*several: tuple[tables.Table, Sequence[int]]) -> str:
    """Tables with the places of their columns of numbers."""
    return "".join(table(headings, rows, numbers=numbers) for (headings, rows), numbers in several)


def _captions(found: Diagnosis) -> Mapping[str, str]:
    """What each figure shows; where nothing is named, no law is drawn and no site coloured."""
    windows = windows_told(found)
    each = f" Simulated over {windows}, each from an estimated state." if windows else ""
    named = found.verdict in ("effect", "parameters")
    after = "after with what was found" if named else "with the best parameters"
    sites = tables.sites_named(found)
    drawn = any(one.law_force is not None for one in found.restoring_forces)
    coloured = any(one.name in sites for one in found.where.sites)
    return {
        "residuals": (
            f"What the drives give less what the motion needs, before and {after}; with each joint's share of it."
        ),
        "friction": (
            "Friction of the joints over their speed: everything else that was found is taken out. Dashed: as "
            "described. Blue: as found. Each dot is a sample, coloured by the load of its joint."
        ),
        "positions": "What is missing beside friction, over the position: ripple, springs and stops show here.",
        "motion": f"Simulated positions less measured ones, before and {after}, in runs from the log's poses.",
        "signals": (
            f"Where the model errs most: measured, simulated before, and {after}.{each}"
            if found.machine is None
            else f"Torques of the drives, and what the motion needs: as described, and {after}."
        ),
        "errors": f"What is left of the whole log, before and {after}.",
        "spectra": "Spectra of the errors and of what was measured." + (" Mean over the windows." if windows else ""),
        "map": f"Density of the gap over band and time, before and {after}; outputs over their RMS.",
        "force": (
            "Force that the model lacks" if found.verdict != "none" else "Noise and what tuning moved as a force"
        )
        + ", recovered without assuming a law"
        + ("; dots, and the thin line: the law that was named." if drawn else "."),
        "shares": ("In colour: the site that was named." if coloured else "")
        or ("Of what the best parameters leave." if found.left is not None else "Shares of the gap."),
    }


def _list(sentences: Sequence[str]) -> str:
    return element("ul", "".join(element("li", escaped(one)) for one in sentences)) if sentences else ""
