"""A diagnosis as an answer and compact tables for people."""

from typing import TYPE_CHECKING

from chladni.cli.output import Output
from chladni.cli.words import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.apps.gap_by_level import GapByLevel
    from chladni.apps.gap_comparison import GapComparison
    from chladni.gap.records.diagnosis import Diagnosis, Where
    from chladni.gap.records.measurement import LogUse
    from chladni.viewers.gap_tables import Table

# Bands and regimes with less of the gap than this don't tell where it lies.
LEAST_SHARE = 0.05
# Rows of a table of sites or regimes, as many as one reads.
MOST_ROWS = 6
SITES = "What an unknown force, error or change at one site can explain"
IN_REPORT = "the report and the JSON document"
# The report of a comparison is asked for less often.
IN_DOCUMENT = "the JSON document (--json FILE)"


def print_diagnosis(out: Output, found: "Diagnosis") -> None:
    """Print the answer and what it rests on, where the gap lies, what was weighed and tuned, what to measure next."""
    from chladni.viewers import gap_tables as tables
    from chladni.viewers.gap_summary import naive_sentence, summary

    # What makes an answer mean little is read before it, or not at all.
    # What is the model's, each of several logs says.
    warnings = dict.fromkeys(warning for one in found.used for warning in one.warnings)
    for warning in warnings:
        out.line(f"Warning: {warning}", style="yellow")
    first, *rest = summary(found)
    out.line(first, style="bold")
    for sentence in rest:
        out.line(sentence)
    _print_use(out, found.used)
    out.line()
    _print_where(
        out,
        tables.where_told(found),
        "Error before anything is tuned, whole log",
        of="" if found.left is None else ", of what the best parameters leave",
        sites=tables.site_title(found, SITES),
    )
    _print(
        out, f"{tables.distortion_title(found.distortion)}, as shares of each output", tables.distortion_table(found)
    )
    _print(out, "Parameters of the causes", tables.cause_table(found))
    _print(out, "What was weighed", tables.ranking_table(found))
    if (naive := naive_sentence(found)) is not None:
        out.line(naive)
        out.line()
    _print(out, "Parameters that moved, or that this log doesn't determine", tables.parameter_table(found))
    if found.next_measurement is not None:
        out.line("Measure next", style="bold")
        out.line(found.next_measurement)
    told = {*warnings, *(loss for one in found.used for loss in one.losses)}
    out.lines((*found.levels, *(remark for remark in found.remarks if remark not in told)))


def print_comparison(out: Output, found: "GapComparison") -> None:
    """Print where, when and while what two logs disagree."""
    from chladni.apps.gap_comparison import answer
    from chladni.viewers.gap_tables import distortion_title, split_table

    first, *rest = answer(found)
    out.line(first, style="bold")
    for sentence in rest:
        out.line(sentence)
    out.line()
    # Nothing is ever tuned here.
    _print_where(out, found.where, "Error of the simulation", all_in=IN_DOCUMENT)
    _print(
        out,
        f"{distortion_title(found.distortion)}, as shares of each output",
        split_table(found.distortion, found.simulated_distortion),
        all_in=IN_DOCUMENT,
    )
    out.lines(found.remarks)


def print_by_level(out: Output, found: "GapByLevel") -> None:
    """Print every comparison, and last what changes from one to the next."""
    for one in found.comparisons:
        print_comparison(out, one)
        out.line()
    out.line("What changes with level", style="bold")
    out.lines(found.sentences() or ("nothing that these logs tell",))


def _print_use(out: Output, used: "Sequence[LogUse]") -> None:
    """Right below the answer, since an answer from half a log reads like one from a whole."""
    from chladni.viewers.gap_summary import used_length

    for one in used:
        out.line(f"Used: {used_length(one)} of {one.log}, at {number(one.sample_rate_hz)} Hz.")
        out.lines(one.losses)


def _print_where(
    out: Output, where: "Where", error: str, *, of: str = "", all_in: str = IN_REPORT, sites: str = SITES
) -> None:
    from chladni.viewers import gap_tables as tables

    _print(
        out,
        f"{error}, over the RMS of each output",
        tables.channel_table(where),
        all_in=all_in,
        note=tables.noise_told(where),
    )
    for title, table in (
        (f"Where in frequency{of}", tables.band_table(where, least=LEAST_SHARE)),
        (sites, tables.site_table(where)),
        (f"While{of}", tables.regime_table(where, least=LEAST_SHARE)),
        (f"When{of}", tables.time_table(where, least=LEAST_SHARE)),
    ):
        _print(out, title, table, all_in=all_in)


def _print(out: Output, title: str, table: "Table", *, all_in: str = IN_REPORT, note: str | None = None) -> None:
    headings, rows = table
    # A heading over nothing asks what is missing.
    if not rows:
        return
    out.table(title, headings, rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        out.line(f"and {len(rows) - MOST_ROWS} more; all are in {all_in}")
    if note is not None:
        out.line(note)
    out.line()
