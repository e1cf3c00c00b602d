"""The report's page and file."""

import os
from collections.abc import Iterator
from pathlib import Path

from chladni.io.atomic import atomic_write
from chladni.signals.study import Study
from chladni.viewers.figures import Album
from chladni.viewers.report.markup import PAGE, element, escaped
from chladni.viewers.report.modes import modes_section, relative_motion_section
from chladni.viewers.report.pictures import pictures
from chladni.viewers.report.tables import channel_table, method_table, peak_table
from chladni.viewers.style import Style


def write_report(study: Study, path: str | os.PathLike[str], *, album: Album | None = None) -> Path:
    """Write the report of a study as one HTML file, whole or not at all.

    Parameters
    ----------
    study
        What to report.
    path
        File to write; one that exists is replaced.
    album
        The study's figures when they are drawn already.

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
        file.write(report_html(study, album=album).encode())
    return target


def report_html(study: Study, *, album: Album | None = None) -> str:
    """Give the report of a study as HTML: findings, tables and figures, no script and nothing to fetch.

    Everything that came from the log is escaped, and the page's own policy forbids scripts and requests.
    """
    return PAGE.substitute(title=escaped(study.title), body="\n".join(_body(study, album or Album.of(study))))


def _body(study: Study, album: Album) -> Iterator[str]:
    style = Style.of(study)
    yield element("h1", escaped(study.title))
    if study.findings:
        yield _section("Findings", element("ul", "".join(element("li", escaped(text)) for text in study.findings)))
    yield from _modes(study, style)
    yield _section(
        "Peaks of the frequency responses", peak_table(study.response_peaks, style, channels="Response, reference")
    )
    yield _section("Peaks of the spectra", peak_table(study.peaks, style, channels="Channels, strongest first"))
    for heading, shown in pictures(album).items():
        yield _section(heading, shown)
    yield _section("Channels", channel_table(study, style))
    yield _section("Method", method_table(study))


def _modes(study: Study, style: Style) -> Iterator[str]:
    if study.modes is None:
        return
    yield _section("Modes", modes_section(study, study.modes))
    yield _section("Relative motion between neighbours", relative_motion_section(study, study.modes, style))


def _section(heading: str, content: str) -> str:
    return element("section", element("h2", heading) + content) if content else ""
