"""The answer of a diagnosis as a page of text."""

from collections.abc import Iterator

import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import Diagnosis
from chladni.viewers import gap_tables as tables
from chladni.viewers.gap_summary import naive_sentence, summary
from chladni.viewers.rerun.findings import escaped, markdown_table

PATH = "/answer"
# The page of the structure shows all.
SITES = 6


def draw_answer(recording: rr.RecordingStream, found: Diagnosis) -> rrb.View:
    """Write the answer with its tables as Markdown and give its view."""
    text = "\n".join(_page(found))
    recording.log(PATH, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    return rrb.TextDocumentView(origin=PATH, name="Answer")


def _page(found: Diagnosis) -> Iterator[str]:
    # Every text is made inert: names and remarks come from files.
    first, *rest = summary(found)
    yield f"# {escaped(found.model)}\n"
    yield f"**{escaped(first)}**\n"
    yield from (f"{escaped(sentence)}\n" for sentence in rest)
    if found.next_measurement is not None:
        yield f"**Measure next:** {escaped(found.next_measurement)}\n"
    yield from _table("Causes", tables.cause_table(found))
    yield from _table("What was weighed", tables.ranking_table(found))
    if (naive := naive_sentence(found)) is not None:
        yield f"\n{escaped(naive)}"
    yield from _table("Where it lies", tables.channel_table(found.where))
    yield from _table(tables.site_title(found), tables.site_table(found.where, count=SITES))
    yield from _table("Parameters that moved, or that this log doesn't determine", tables.parameter_table(found))
    remarks = (*found.levels, *found.remarks)
    if remarks:
        yield "\n## Limits\n"
        yield from (f"- {escaped(remark)}" for remark in remarks)


def _table(title: str, table: tables.Table) -> Iterator[str]:
    headings, rows = table
    if rows:
        yield f"\n## {title}\n"
        yield from markdown_table(tuple(headings), [tuple(row) for row in rows])
