"""One sheet with the answer of a diagnosis and its evidence."""

import re
import textwrap
from collections.abc import Callable
from functools import partial
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from chladni.gap.records.diagnosis import Diagnosis, RestoringForce
from chladni.io.atomic import atomic_write
from chladni.viewers.figures.gap_shares import BAR_HEIGHT_IN, draw_shares, share_label, site_bars
from chladni.viewers.figures.gap_signals import LEGEND, draw_errors, windows_told
from chladni.viewers.figures.gap_spectra import draw_spectrum
from chladni.viewers.figures.rendering import rendered
from chladni.viewers.figures.restoring_force import draw_surfaces
from chladni.viewers.figures.sheet import SQUARE_IN, look, plain
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.gap_summary import caveats, summary
from chladni.viewers.gap_tables import site_title, sites_named
from chladni.viewers.robot_summary import robot_sentences

# Of the summary, beside its caveats; the rest is in the report.
SENTENCES, LETTERS = 2, 90
LINE_IN, SIZE = 0.16, 8.5
# What limits the answer, below the pictures.
LIMIT_LETTERS, LIMIT_LINE_IN, LIMIT_SIZE = 110, 0.13, 7.0
Part = tuple[float, Callable[[Figure, SubplotSpec], None]]


def gap_sheet(evidence: GapEvidence, make: Callable[..., Figure] = Figure) -> Figure:
    """Draw the answer as a title over the output that errs most, in time and frequency, the force and the sites."""
    with look():
        parts = _parts(evidence)
        lines = [line for one in _told(evidence.found) for line in _wrapped(one, LETTERS)]
        limits = [line for one in _limits(evidence.found) for line in _wrapped(one, LIMIT_LETTERS)]
        heights = [height for height, _ in parts]
        texts = 0.2 + LINE_IN * len(lines) + LIMIT_LINE_IN * len(limits)
        figure = make(figsize=(SQUARE_IN * 1.25, sum(heights) + texts), layout="constrained")
        figure.suptitle("\n".join(map(plain, lines)), fontsize=SIZE, x=0.02, ha="left")
        if limits:
            figure.supxlabel("\n".join(map(plain, limits)), fontsize=LIMIT_SIZE, x=0.02, ha="left")
        grid = figure.add_gridspec(len(parts), 1, height_ratios=heights)
        for place, (_, draw) in enumerate(parts):
            draw(figure, grid[place])
        return figure


def save_gap_sheet(evidence: GapEvidence, path: Path) -> Path:
    """Write the sheet as PNG, SVG or PDF, by the name's ending.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    content = rendered(gap_sheet(evidence), path.suffix.lower().removeprefix("."))
    with atomic_write(path) as file:
        file.write(content)
    return path


def _told(found: Diagnosis) -> list[str]:
    """The answer, and all without which the sheet would look like more than was found."""
    count = SENTENCES
    if found.machine is not None and found.verdict in ("effect", "parameters"):
        # Each joint has a sentence of its own: the first alone would stand for all.
        count = len(tuple(robot_sentences(found))) + 1
    first = summary(found)[:count]
    return [*first, *(one for one in caveats(found) if one not in first)]


def _limits(found: Diagnosis) -> list[str]:
    return [f"– {one}" for one in (*found.levels, *found.remarks)]


def _wrapped(sentence: str, letters: int) -> list[str]:
    """Lines that break at no space inside a quantity: before its sigma, its unit, or a percent sign."""
    tied = re.sub(r" ± ", "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}", sentence)
    tied = re.sub(r"(?<=\d) (?=[^\s\d(]{1,4}(?:[\s,.)]|$))", "\N{NO-BREAK SPACE}", tied)
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in textwrap.wrap(tied, letters)]


def _parts(evidence: GapEvidence) -> list[Part]:
    found = evidence.found
    bars = site_bars(found)
    # Heights in inches; what isn't there takes none.
    parts: list[Part] = []
    if found.signals is not None:
        parts += [(1.4, lambda figure, place: _errors(figure, place, evidence))]
    if evidence.spectra is not None:
        parts += [(1.4, lambda figure, place: _spectrum(figure, place, evidence))]
    # Where nothing is missing the force is no evidence; the figure of it says what it is.
    forces = [] if found.verdict == "none" else found.restoring_forces
    parts += [(2.6, partial(_force, surface=one)) for one in forces if one.force.size]
    if bars:
        parts += [(0.4 + BAR_HEIGHT_IN * len(bars), lambda figure, place: _sites(figure, place, found))]
    return parts


def _worst(found: Diagnosis) -> int:
    """Row of the output that errs most, over its own RMS."""
    if found.signals is None:
        return 0
    gaps = {one.name: one.gap for one in found.where.channels}
    names = found.signals.output_names
    return max(range(len(names)), key=lambda row: gaps.get(names[row], 0.0))


def _errors(figure: Figure, place: SubplotSpec, evidence: GapEvidence) -> None:
    """Errors where the nominal model errs most: simulated with a good answer hides what was measured."""
    signals, telling_s = evidence.found.signals, evidence.telling_s
    if signals is None or telling_s is None:
        return
    axes, row = figure.add_subplot(place), _worst(evidence.found)
    draw_errors(axes, signals, row, after=evidence.after, span_s=telling_s)
    # On the other side of the legend.
    told = ", ".join(one for one in (signals.output_names[row], windows_told(evidence.found)) if one)
    axes.set_title(plain(told), loc="right", pad=2)
    axes.set_xlabel("Time [s]")
    _legend(axes)


def _spectrum(figure: Figure, place: SubplotSpec, evidence: GapEvidence) -> None:
    signals, spectra = evidence.found.signals, evidence.spectra
    if signals is None or spectra is None:
        return
    axes = figure.add_subplot(place)
    draw_spectrum(axes, signals, spectra, _worst(evidence.found), after=evidence.after)
    axes.set_xlabel("Frequency [Hz]")
    _legend(axes)


def _legend(axes: Axes) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, **LEGEND)


def _force(figure: Figure, place: SubplotSpec, surface: RestoringForce) -> None:
    inner = place.subgridspec(1, 2)
    first = figure.add_subplot(inner[0])
    draw_surfaces(figure, first, figure.add_subplot(inner[1], sharey=first), surface)


def _sites(figure: Figure, place: SubplotSpec, found: Diagnosis) -> None:
    axes = figure.add_subplot(place)
    draw_shares(
        axes,
        site_bars(found),
        named=sites_named(found),
    )
    axes.set_title(site_title(found), loc="left", pad=2)
    axes.set_xlabel(share_label(found))
