"""The page of a study: what changed over its logs, what left its band, and the pictures of it; one HTML file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chladni.io.atomic import atomic_write
from chladni.signals.trend import Trend, no_change_sentence
from chladni.signals.unit_text import printed_unit
from chladni.signals.wording import with_sigma
from chladni.viewers.figures.album import Album
from chladni.viewers.figures.trends import trend_figures
from chladni.viewers.report.markup import element, escaped, table
from chladni.viewers.report.markup import page as whole_page
from chladni.viewers.report.pictures import Pictures

_CAPTION: Final = (
    "Points with a bar: each log with one sigma, what covariates explain taken off. Pale points: as measured. "
    "Line: the level. Shaded: the logs between which a change lies (95 %)."
)
Table = tuple[Sequence[str], Sequence[Sequence[str]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrendPage:
    """What a page tells.

    Attributes
    ----------
    title
        Of the page.
    trends
        What was followed.
    changes
        Sentences on what changed.
    tables
        By their heading, each with its column headings and rows; those without rows are left out.
    notes
        What to know.
    """

    title: str
    trends: Sequence[Trend]
    changes: Sequence[str]
    tables: dict[str, Table]
    notes: Sequence[str] = ()


def write_trend_report(page: TrendPage, path: Path) -> Path:
    """Write the page, whole or not at all.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    with atomic_write(path) as file:
        file.write(trend_report_html(page).encode())
    return path


def trend_report_html(page: TrendPage) -> str:
    """Give the page as HTML: nothing to fetch."""
    album = Album(trend_figures(page.trends))
    pictures = Pictures(album)
    body = [element("h1", escaped(page.title))]
    changes = page.changes or [no_change_sentence(page.trends)]
    body.append(_section("What changed", _list(changes)))
    body += [_section(heading, table(*content)) for heading, content in page.tables.items() if content[1]]
    body += [_section(heading, pictures.figures(album, heading, _CAPTION)) for heading in album.sections]
    body.append(_section("All that was followed", table(*_overview(page.trends))))
    body.append(_section("Remarks", _list(page.notes)))
    return whole_page(page.title, "\n".join(filter(None, body)), pictures.scripts())


def _overview(trends: Sequence[Trend]) -> Table:
    rows = []
    for one in trends:
        last = with_sigma(float(one.values[-1]), float(one.std[-1]))
        slopes = "; ".join(
            f"{effect.channel}: {with_sigma(effect.slope, effect.slope_std)} "
            + printed_unit(effect.unit).removeprefix("1 ")
            for effect in one.covariates
        )
        row = (
            one.kind,
            one.name,
            printed_unit(one.unit),
            str(len(one.logs)),
            last,
            f"{one.scatter:.2g}",
            str(len(one.changes)),
            slopes,
        )
        rows.append(row)
    return ("Kind", "Which", "Unit", "Logs", "Last value", "Scatter", "Changes", "Covariates"), rows


def _section(heading: str, content: str) -> str:
    return element("section", element("h2", escaped(heading)) + content) if content else ""


def _list(sentences: Sequence[str]) -> str:
    return element("ul", "".join(element("li", escaped(one)) for one in sentences)) if sentences else ""
