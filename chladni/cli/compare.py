"""``chladni compare``: before and after."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chladni.cli import options
from chladni.cli.logs import log_names
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import NOTHING, number, unit, with_error
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.apps.compare import LogComparison
    from chladni.signals.comparison import LevelChange, PeakChange
    from chladni.signals.mode_change import ModeChange

MOST_ROWS = 25
UNCHANGED = "nothing that scatter doesn't explain"


@opens_files
def compare(
    before: Annotated[
        Path, typer.Argument(metavar="BEFORE", help="An MCAP log, or a data file.", show_default=False)
    ],
    after: Annotated[Path, typer.Argument(metavar="AFTER", help="Another of the same channels.", show_default=False)],
    *,
    channel: options.Channels = None,
    reference: options.References = None,
    resolution: options.Resolution = None,
    modes: Annotated[bool, typer.Option("--modes", help="Identify the modes of both and compare them, too.")] = False,
    operational: Annotated[
        bool, typer.Option("--operational", help="The same from responses alone: the excitation wasn't measured.")
    ] = False,
    opener: Opener,
    json: options.Json = None,
    figures: options.Figures = None,
    report: options.Report = None,
    static: options.Static = False,
) -> None:
    """Levels, spectra, transfer functions and modes of two logs side by side, with what is significant."""
    from chladni.apps.compare import compare_logs
    from chladni.apps.documents import comparison_document

    twice = before.resolve() == after.resolve()
    titles = tuple(f"{before.name}, {when}" for when in ("before", "after")) if twice else log_names([before, after])
    out = Output.of_log([before, after, opener.setup], json=json, figures=figures, report=report, static=static)
    opening = opener.among([before, after])
    with (
        opening(before) as old,
        opening(after) as new,
        out.progress(f"{before.name}, {after.name}") as progress,
    ):
        found = compare_logs(
            old,
            new,
            channels=channel,
            references=reference,
            resolution_hz=resolution,
            modes=modes,
            operational=operational,
            progress=progress,
        )
    for density in found.densities:
        _print_levels(out, density.overall)
        _print_peaks(out, "Peaks of the spectra", density.peaks)
        out.lines(density.notes)
    if found.response is not None:
        _print_peaks(out, "Peaks of the transfer functions", found.response.peaks)
        out.lines(found.response.notes)
    if found.modes is not None:
        _print_modes(out, found.modes)
    out.lines(found.notes)
    _picture(out, found, titles, figures=figures, report=report)
    out.json(comparison_document, found)


def _picture(
    out: Output, found: "LogComparison", titles: tuple[str, ...], *, figures: Path | None, report: Path | None
) -> None:
    """Draw both spectra over one another, and what changed."""
    if figures is None and report is None:
        return
    from dataclasses import replace

    from chladni.signals.study import Study
    from chladni.viewers.figures import Album, comparison_figures

    old, new = (replace(one, title=title) for one, title in zip((found.before, found.after), titles, strict=True))
    album = Album.of_change(old, new, comparison_figures(found.densities, found.response))
    study = Study(title=" and ".join(titles), findings=found.sentences())
    out.album(album, study, figures=figures, report=report)


def _print_levels(out: Output, changes: "Sequence[LevelChange]") -> None:
    out.channel_table(
        "Levels (RMS)",
        ["channel", "before", "after", "unit", "change [dB]", "significant"],
        [
            [
                one.channel,
                with_error(one.before, one.before_std),
                with_error(one.after, one.after_std),
                unit(one.unit),
                with_error(one.change_db, one.change_std_db),
                "yes" if one.significant else "no",
            ]
            for one in changes
        ],
    )


def _print_peaks(out: Output, title: str, changes: "Sequence[PeakChange]") -> None:
    told = [one for one in changes if one.fate != "unchanged"]
    if not told:
        out.line(f"{title}: {UNCHANGED}; {counted(len(changes), 'peak')} stayed.")
        return
    rows: list[list[Any]] = [
        [
            ", ".join(one.channels),
            one.fate,
            number(None if one.before is None else one.before.frequency_hz, digits=5),
            number(None if one.after is None else one.after.frequency_hz, digits=5),
            with_error(one.shift_hz, one.shift_std_hz) if one.fate == "moved" else "-",
        ]
        for one in told[:MOST_ROWS]
    ]
    if len(told) > MOST_ROWS:
        title = f"{title}: {MOST_ROWS} of {len(told)} changes, all of them with --json"
    out.channel_table(title, ["channels", "what", "before [Hz]", "after [Hz]", "shift [Hz]"], rows)


def _print_modes(out: Output, changes: "Sequence[ModeChange]") -> None:
    if not changes:
        out.line("No mode was found in either log.")
        return
    out.table(
        "Modes",
        ["what", "before [Hz]", "after [Hz]", "shift [Hz]", "change of damping ratio [%]", "MAC"],
        [
            [
                one.fate,
                number(one.before_hz, digits=5),
                number(one.after_hz, digits=5),
                _difference(one.shift_hz, one.shift_std_hz),
                _difference(one.damping_change, one.damping_change_std, factor=100),
                number(one.mac, digits=3),
            ]
            for one in changes
        ],
    )


def _difference(value: float | None, std: float | None, *, factor: float = 1.0) -> str:
    return NOTHING if value is None or std is None else with_error(factor * value, factor * std)
