"""The page of findings: what was found, in words and tables."""

import re
from collections.abc import Iterator, Sequence

import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.peak import Peak
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.signals.visible import visible
from chladni.signals.wording import counted, with_sigma
from chladni.viewers.mode_tables import Row, mode_table
from chladni.viewers.style import Style

PATH = "/findings"
HOW_TO_READ = (
    "Frequency plots are drawn on a time axis: **1 ms is 1 Hz**, so 100 ms reads 100 Hz and 1 s reads 1 kHz.",
    "Click or drag in a waveform: the spectrum of that moment is drawn beside the waterfall.",
    "Click or drag in a frequency response: the deflection shape and the dots in the Nyquist plot follow.",
    "For frequency alone, choose the timeline *frequency* at the bottom.",
)


def draw_findings(recording: rr.RecordingStream, study: Study, style: Style) -> rrb.View:
    """Write the findings as Markdown and give their view."""
    text = "\n".join(_page(study, style))
    recording.log(PATH, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    return rrb.TextDocumentView(origin=PATH, name="Findings")


def escaped(text: str) -> str:
    r"""Make a text that came from a log inert in Markdown: no emphasis, no links, no images to fetch.

    Examples
    --------
    >>> escaped("![x](http://a/b.png)")
    '\\!\\[x\\]\\(http\\:\\/\\/a\\/b.png\\)'
    """
    # A line break would end the table or the list that the text stands in.
    # Every ASCII punctuation mark may be escaped in Markdown, so none needs to be judged.
    return re.sub(r"([!-,/:-@\[-`{-~])", r"\\\1", visible(text))


def _page(study: Study, style: Style) -> Iterator[str]:
    yield f"# {escaped(study.title)}\n"
    yield from (f"- {escaped(finding)}" for finding in study.findings)
    yield from _modes(study)
    yield from _peaks("Peaks of the spectra", study.peaks, style, channels="channels")
    yield from _peaks("Peaks of the frequency responses", study.response_peaks, style, channels="response, reference")
    yield from _method(study)
    yield "\n## How to read the plots\n"
    yield from (f"- {sentence}" for sentence in HOW_TO_READ)


def _modes(study: Study) -> Iterator[str]:
    if study.modes is None or not study.modes.frequency_hz.size:
        return
    yield "\n## Modes\n"
    yield from markdown_table(*mode_table(study.modes, study.validation))


def markdown_table(headings: Row, rows: Sequence[Row]) -> Iterator[str]:
    """Give the lines of a table of texts, which are made inert here."""
    yield f"| {' | '.join(headings)} |"
    yield "|---" * len(headings) + "|"
    yield from (f"| {' | '.join(escaped(text) for text in row)} |" for row in rows)


def _peaks(title: str, peaks: Sequence[Peak], style: Style, *, channels: str) -> Iterator[str]:
    if not peaks:
        return
    yield f"\n## {title}\n"
    yield f"| Hz | height | unit | {channels} |"
    yield "|---|---|---|---|"
    for peak in peaks:
        frequency = with_sigma(peak.frequency_hz, peak.frequency_std_hz)
        height = with_sigma(peak.height, peak.height_std)
        names = ", ".join(escaped(style.labels.get(name, name)) for name in peak.channels)
        yield f"| {frequency} | {height} | {escaped(printed_unit(peak.unit))} | {names} |"


def _method(study: Study) -> Iterator[str]:
    accounts = [density.provenance for density in study.densities]
    accounts += [] if study.response is None else [study.response.provenance]
    if accounts:
        yield "\n## Method\n"
    for account in accounts:
        yield (
            f"- {escaped(account.estimator)}: window {escaped(account.window)}, segments of {account.segment_s:g} s,"
            f" overlap {account.overlap:.0%}, {counted(account.averages, 'average')}"
            f" ({account.effective_averages:.3g} effective), {counted(account.skipped, 'segment')} left out"
        )
        yield from (f"  - {escaped(note)}" for note in account.notes)
