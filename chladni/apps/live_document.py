"""A live source as the study that viewers and reports draw, and as the document of its command."""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from chladni.apps.documents import Document, finite, frf_document, psd_document
from chladni.apps.levels import LogLevels, levels_document
from chladni.apps.modes_document import modes_document
from chladni.apps.sources import without
from chladni.apps.unit_peaks import unit_peaks
from chladni.io.log_info import some_of
from chladni.modal.shapes.validation import validate
from chladni.signals.live_state import LiveEvent, LiveState
from chladni.signals.study import Study
from chladni.spectral.peaks import find_response_peaks

#: Events that a document holds one by one: the first, and the last; all are counted.
MOST_EVENTS: Final = 1000


def live_study(state: LiveState, findings: Sequence[str] = ()) -> Study:
    """Give a state as the study that viewers and reports draw.

    Parameters
    ----------
    state
        The last one, usually.
    findings
        Sentences to put first.
    """
    still = still_channels(state)
    state = _without(state, still)
    notes = (f"channels that never change are left out: {some_of(sorted(still))}",) if still else ()
    peaks = [peak for density in state.densities for group in unit_peaks(density) for peak in group.peaks]
    modes = state.modes if state.modes is not None and state.modes.frequency_hz.size else None
    return Study(
        title=state.title,
        series=state.series,
        densities=state.densities,
        waterfalls=state.waterfalls,
        response=state.response,
        peaks=tuple(peaks),
        response_peaks=() if state.response is None else find_response_peaks(state.response),
        modes=modes,
        validation=None if modes is None else validate(modes),
        levels=state.levels,
        severities=state.severities,
        geometry=state.geometry,
        findings=(*findings, *notes),
    )


def still_channels(state: LiveState) -> frozenset[str]:
    """Names of the channels that never changed, which pictures leave out; none where all are so."""
    channels = sum(len(one.channels) for one in state.levels)
    return frozenset(state.still) if len(state.still) < channels else frozenset()


def _without(state: LiveState, still: Collection[str]) -> LiveState:
    """Leave channels out of what is drawn: dozens of empty pictures hide the others."""
    response = state.response
    answers = [one.name for one in response.responses if one.name not in still] if response is not None else []
    return replace(
        state,
        series=without(still, state.series),
        densities=without(still, state.densities),
        levels=without(still, state.levels),
        severities=without(still, state.severities),
        waterfalls=without(still, state.waterfalls),
        response=response.select(answers) if response is not None and answers else None,
    )


@dataclass(slots=True, kw_only=True, eq=False)
class EventBook:
    """What happened, in bounded memory: the first and the last events, and how many of each kind there were."""

    first: list[LiveEvent] = field(default_factory=list)
    last: list[LiveEvent] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    samples: Counter[str] = field(default_factory=Counter)

    def add(self, events: Iterable[LiveEvent]) -> None:
        """Note events."""
        for event in events:
            self.counts[event.kind] += 1
            self.samples[event.kind] += event.samples
            if len(self.first) < MOST_EVENTS:
                self.first.append(event)
            else:
                self.last = [*self.last[-MOST_EVENTS + 1 :], event]

    @property
    def events(self) -> tuple[LiveEvent, ...]:
        """The first and the last of them."""
        return (*self.first, *self.last)


def live_document(state: LiveState, book: EventBook) -> Document:
    """Document of ``chladni live``.

    The densities, frequency responses, levels and modes are documents of their own commands.
    """
    averages = {
        name: psd_document(densities) if densities else None
        for name, densities in (
            ("psd", state.densities), ("exponential", state.exponential), ("peak_hold", state.peak_hold),
        )
    }  # fmt: skip
    levels = LogLevels(levels=state.levels, severities=state.severities, notes=())
    modes = state.modes
    return {
        "format": "chladni.live/1",
        "source": state.title,
        "start_time_ns": state.start_time_ns,
        "duration_s": state.time_s,
        **averages,
        "frf": None if state.response is None else frf_document(state.response, find_response_peaks(state.response)),
        "levels": levels_document(levels) if state.levels else None,
        "modes": None if modes is None else modes_document(modes, validate(modes)),
        "tracked": [
            {
                "number": mode.number,
                "frequency_hz": finite(mode.frequency_hz),
                "frequency_std_hz": finite(mode.frequency_std_hz),
                "damping_ratio": finite(mode.damping_ratio),
                "damping_std": finite(mode.damping_std),
                "mac": finite(mode.mac),
                "first_s": mode.first_s,
                "last_s": mode.last_s,
                "looks": mode.looks,
            }
            for mode in state.tracked
        ],
        "events": [
            {"kind": one.kind, "time_s": one.time_s, "text": one.text, "samples": one.samples} for one in book.events
        ],
        "event_counts": dict(book.counts),
        "samples_missing": dict(book.samples),
    }
