"""The report of simulated logs against measured ones: one HTML file that needs nothing else."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from chladni.io.atomic import atomic_write
from chladni.viewers import gap_tables as tables
from chladni.viewers.figures.album import Album
from chladni.viewers.gap_evidence import ComparisonEvidence
from chladni.viewers.report.markup import element, escaped, page, table
from chladni.viewers.report.pictures import Pictures

Pages = Sequence[tuple[ComparisonEvidence, Album]]

_CAPTIONS = {
    "signals": "Where the simulation errs most, seconds from the first sample.",
    "errors": "Measured minus simulated, seconds from the first sample.",
    "spectra": "Spectra of the errors and of what was measured.",
    "map": "Density of the gap over band and time; outputs over their RMS.",
}


def write_log_gap_report(
    pages: Pages, path: Path, *, levels: Sequence[str] = (), interactive: bool | None = None
) -> Path:
    """Write the report of one comparison or several as one HTML file, whole or not at all.

    Parameters
    ----------
    pages
        Each comparison with its figures.
    path
        File to write; one that exists is replaced.
    levels
        Sentences on what changes from one to the next.
    interactive
        Whether plots zoom and read out, which takes Bokeh; None for where it's installed. Else they are pictures.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    with atomic_write(path) as file:
        file.write(log_gap_report_html(pages, levels=levels, interactive=interactive).encode())
    return path


def log_gap_report_html(pages: Pages, *, levels: Sequence[str] = (), interactive: bool | None = None) -> str:
    """Give the report as HTML: what is said, figures and tables, and nothing to fetch."""
    pictures = Pictures(*(album for _, album in pages), interactive=interactive)
    title = "; ".join(f"{one.simulated}: the gap to {one.signals.log}" for one, _ in pages)
    body = [element("h1", escaped(title)), _section("What changes with level", _list(levels))]
    for evidence, album in pages:
        body += _comparison(evidence, album, pictures, heading=f"{evidence.signals.log}: " if len(pages) > 1 else "")
    return page(title, "\n".join(body), pictures.scripts())


def _comparison(evidence: ComparisonEvidence, album: Album, pictures: Pictures, *, heading: str) -> Iterator[str]:
    where = evidence.where
    yield _section(f"{heading}Answer", "".join(element("p", escaped(one)) for one in evidence.answer))
    shown = "".join(pictures.figures(album, part, _CAPTIONS[part]) for part in album.sections)
    yield _section(f"{heading}Evidence", shown)
    told = (
        tables.channel_table(where),
        tables.band_table(where),
        tables.regime_table(where),
        tables.time_table(where),
    )
    noise = tables.noise_told(where)
    note = "" if noise is None else element("p", escaped(noise), class_="note")
    yield _section(f"{heading}Where and when it lies", "".join(table(*one) for one in told) + note)
    split = tables.split_table(evidence.distortion, evidence.simulated_distortion)
    yield _section(f"{heading}{tables.distortion_title(evidence.distortion)}", table(*split))
    yield _section(f"{heading}Limits", _list(evidence.remarks))


def _section(heading: str, content: str) -> str:
    return element("section", element("h2", escaped(heading)) + content) if content else ""


def _list(sentences: Sequence[str]) -> str:
    return element("ul", "".join(element("li", escaped(one)) for one in sentences)) if sentences else ""
