"""The modes in words: their table, what to know before relying on them, and relative motion."""

from collections.abc import Iterator

import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study
from chladni.viewers.mode_tables import advice, first_of_each, mode_table, motion_table
from chladni.viewers.rerun.findings import escaped, markdown_table
from chladni.viewers.style import Style

PATH = "/modes"
# Of each mode; a report has them all.
MOTIONS_OF_A_MODE = 3
HOW_TO_READ = (
    "**Press play** (space) and the shapes move; each mode has a tab.",
    "On the timeline *phase*, chosen at the bottom, a step is a degree of one period, which repeats itself.",
    "Grey: the structure at rest. Colour: the amplitude of each point.",
)


def draw_mode_text(recording: rr.RecordingStream, study: Study, modes: ModeSet, style: Style) -> rrb.View:
    """Write tables and advice as Markdown and give their view."""
    text = "\n".join(_page(study, modes, style))
    recording.log(PATH, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    return rrb.TextDocumentView(origin=PATH, name="Modes in numbers")


def _page(study: Study, modes: ModeSet, style: Style) -> Iterator[str]:
    found = modes.frequency_hz.size > 0
    if found:
        yield "± is one sigma.\n"
        yield from markdown_table(*mode_table(modes, study.validation))
    else:
        yield "No mode was found."
    told = advice(study, modes)
    if told:
        yield "\n### What to know\n"
        yield from (f"- {escaped(sentence)}" for sentence in told)
    yield from _motions(study, modes, style)
    if found:
        yield "\n### How to look at them\n"
        yield from (f"- {sentence}" for sentence in HOW_TO_READ)


def _motions(study: Study, modes: ModeSet, style: Style) -> Iterator[str]:
    headings, rows = motion_table(study.relative_motion, modes, style)
    if not rows:
        return
    yield "\n### Relative motion between neighbours\n"
    shown = first_of_each(rows, MOTIONS_OF_A_MODE)
    if len(shown) < len(rows):
        yield f"The {MOTIONS_OF_A_MODE} greatest of each mode.\n"
    yield from markdown_table(headings, shown)
