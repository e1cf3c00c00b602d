"""The report's page and file."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from chladni.io.atomic import atomic_write
from chladni.signals.study import Study
from chladni.viewers.figures import Album
from chladni.viewers.finding_groups import FindingGroup, told_findings
from chladni.viewers.report.markup import element, escaped, page
from chladni.viewers.report.modes import modes_section, relative_motion_section
from chladni.viewers.report.pictures import Pictures, sections
from chladni.viewers.report.tables import channel_table, method_table, peak_table
from chladni.viewers.style import Style


def write_report(
    study: Study, path: str | os.PathLike[str], *, album: Album | None = None, interactive: bool | None = None
) -> Path:
    """Write the report of a study as one HTML file, whole or not at all.

    Parameters
    ----------
    study
        What to report.
    path
        File to write; one that exists is replaced.
    album
        The study's figures when they are drawn already.
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
        file.write(report_html(study, album=album, interactive=interactive).encode())
    return target


def report_html(study: Study, *, album: Album | None = None, interactive: bool | None = None) -> str:
    """Give the report of a study as HTML: findings, figures and tables, and nothing to fetch.

    Everything that came from the log is escaped. The page's own policy forbids requests, and every script but the
    library of the plots and what starts it; without plots, all.
    """
    album = album or Album.of(study)
    pictures = Pictures(album, interactive=interactive)
    body = "\n".join(_body(study, sections(pictures, album, bearing=any(one.faults for one in study.envelopes))))
    return page(study.title, body, pictures.scripts())


def _body(study: Study, shown: Mapping[str, str]) -> Iterator[str]:
    style = Style.of(study)
    yield element("h1", escaped(study.title))
    if study.findings:
        yield _section("Findings", _findings(study, style))
    yield from _modes(study, style)
    # Numbers stand under the curves that they are read from.
    tables = {
        "Frequency responses": (study.response_peaks, "Response, reference"),
        "Power spectral densities": (study.peaks, "Channels, strongest first"),
    }
    for heading, figures in shown.items():
        peaks, channels = tables.get(heading, ((), ""))
        yield _section(heading, figures + peak_table(peaks, style, channels=channels))
    yield _section("Channels", channel_table(study, style))
    yield _section("Method", method_table(study))


def _findings(study: Study, style: Style) -> str:
    told = told_findings(study.findings, style.labels)
    shown = "".join(_finding(group) for group in told.groups)
    names = f"Paths below begin with {told.prefix}. " if told.prefix else ""
    listed = "Short names are those of the table of channels." if style.labels else ""
    note = element("p", escaped(f"{names}{listed}".strip()), class_="note") if names or listed else ""
    return note + element("ul", shown)


def _finding(group: FindingGroup) -> str:
    if not group.subject:
        return "".join(element("li", escaped(one)) for one in group.findings)
    if len(group.findings) == 1:
        # A sentence as any other: a name that can't be told from words stands in it, too.
        return element("li", escaped(f"{group.subject}: {group.findings[0]}"))
    own = "".join(element("li", escaped(one)) for one in group.findings)
    return element("li", element("code", escaped(group.subject)) + element("ul", own))


def _modes(study: Study, style: Style) -> Iterator[str]:
    if study.modes is None:
        return
    yield _section("Modes", modes_section(study, study.modes))
    yield _section("Relative motion between neighbours", relative_motion_section(study, study.modes, style))


def _section(heading: str, content: str) -> str:
    return element("section", element("h2", heading) + content) if content else ""
