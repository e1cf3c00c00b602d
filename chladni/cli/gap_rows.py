"""A diagnosis as an answer and compact tables for people."""

from typing import TYPE_CHECKING

from chladni.cli.output import Output

if TYPE_CHECKING:
    from chladni.apps.gap_comparison import GapComparison
    from chladni.gap.records.diagnosis import Diagnosis, Where
    from chladni.viewers.gap_tables import Table

# Bands and regimes with less of the gap than this don't tell where it lies.
LEAST_SHARE = 0.05
# Rows of a table of sites or regimes, as many as one reads.
MOST_ROWS = 6


def print_diagnosis(out: Output, found: "Diagnosis") -> None:
    """Print the answer, where the gap lies, what was weighed, what was tuned, and what to measure next."""
    from chladni.viewers import gap_tables as tables
    from chladni.viewers.gap_summary import naive_sentence, summary

    first, *rest = summary(found)
    out.line(first, style="bold")
    for sentence in rest:
        out.line(sentence)
    out.line()
    _print_where(out, found.where)
    _print(out, "Linear, even, odd and noise, as shares of each output", tables.distortion_table(found))
    _print(out, "Parameters of the causes", tables.cause_table(found))
    _print(out, "What was weighed", tables.ranking_table(found))
    if (naive := naive_sentence(found)) is not None:
        out.line(naive)
        out.line()
    _print(out, "Parameters that moved, or that this log doesn't determine", tables.parameter_table(found))
    if found.next_measurement is not None:
        out.line("Measure next", style="bold")
        out.line(found.next_measurement)
    out.lines((*found.levels, *found.remarks))


def print_comparison(out: Output, found: "GapComparison") -> None:
    """Print where two logs disagree."""
    from chladni.viewers.engineering import percent

    out.line(
        f"{found.simulated} is {percent(found.gap)} from {found.measured}, noise {percent(found.noise)}.",
        style="bold",
    )
    if found.inputs:
        out.line(f"The same in both, taken for inputs: {', '.join(found.inputs)}.")
    out.line()
    _print_where(out, found.where)
    out.lines(found.remarks)


def _print_where(out: Output, where: "Where") -> None:
    from chladni.viewers import gap_tables as tables

    _print(out, "Error before anything is tuned, over the RMS of each output", tables.channel_table(where))
    _print(out, "Where in frequency", tables.band_table(where, least=LEAST_SHARE))
    _print(out, "What an unknown force, error or change at one site can explain", tables.site_table(where))
    _print(out, "While", tables.regime_table(where, least=LEAST_SHARE))


def _print(out: Output, title: str, table: "Table") -> None:
    headings, rows = table
    # A heading over nothing asks what is missing.
    if not rows:
        return
    out.table(title, headings, rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        out.line(f"and {len(rows) - MOST_ROWS} more; all are in the report and the JSON document")
    out.line()
