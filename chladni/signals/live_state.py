"""What is known of a log that is still being written, at one moment."""

from dataclasses import dataclass, field
from typing import Literal

from chladni.signals.coherence import Coherence
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry
from chladni.signals.levels import Levels, Severity
from chladni.signals.mode_set import ModeSet
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries
from chladni.signals.waterfall import Waterfall

EventKind = Literal[
    "source", "topic", "gap", "clock", "late", "silent", "back", "skipped",
    "line", "level", "sensor", "mode", "torque", "note",
]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedMode:
    """One mode over time.

    Attributes
    ----------
    number
        Counted from 1 in the order in which modes were first seen.
    frequency_hz, frequency_std_hz, damping_ratio, damping_std
        At the last look that saw it.
    mac
        Agreement of its shape there with the shape it is compared with.
    first_s, last_s
        When it was first and last seen, seconds from the start.
    looks
        How often it was seen.
    missed
        Looks since it was last seen.
    """

    number: int
    frequency_hz: float
    frequency_std_hz: float
    damping_ratio: float
    damping_std: float
    mac: float
    first_s: float
    last_s: float
    looks: int
    missed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveEvent:
    """Something that happened, or changed beyond scatter.

    Attributes
    ----------
    kind
        What it is about: the ``source``, a ``topic``, a ``gap``, a ``clock``, ``late`` messages, a topic that is
        ``silent`` or ``back``, samples ``skipped``; a ``line``, a ``level``, a ``sensor``, a ``mode``, a ``torque``;
        a ``note`` on the averages.
    time_s
        When, in seconds from the first sample.
    text
        A sentence.
    samples
        How many samples are missing or were skipped.
    """

    kind: EventKind
    time_s: float
    text: str
    samples: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveState:
    """Averages and events, up to the newest sample.

    Attributes
    ----------
    title
        Name of the source.
    start_time_ns, time_s
        First sample, nanoseconds since the Unix epoch; seconds from it to the end of the newest one.
    series
        Samples that are new since the state before, a block or more for each sampling grid.
    events
        What is new since the state before.
    fresh
        Whether the averages were renewed for this state; else they are those of an earlier one.
    densities, exponential, peak_hold
        Power spectral densities, one entry a sampling grid: averaged over all, fading, and the largest.
    response, coherence
        H1 and coherence to the references; None without references.
    waterfalls, levels, severities
        One entry a sampling grid.
    still
        Names of the channels whose samples have all had one value.
    modes
        From responses alone, of the average over all; None before the first look.
    tracked
        Modes of the present, as followed over time.
    recent
        Shapes of these modes at the last look; None before.
    ended
        Whether this is the last state.
    """

    title: str
    start_time_ns: int = 0
    time_s: float = 0.0
    series: tuple[TimeSeries, ...] = ()
    events: tuple[LiveEvent, ...] = ()
    fresh: bool = False
    densities: tuple[PowerSpectralDensity, ...] = ()
    exponential: tuple[PowerSpectralDensity, ...] = ()
    peak_hold: tuple[PowerSpectralDensity, ...] = ()
    response: FrequencyResponse | None = None
    coherence: Coherence | None = None
    waterfalls: tuple[Waterfall, ...] = ()
    levels: tuple[Levels, ...] = ()
    severities: tuple[Severity, ...] = ()
    still: tuple[str, ...] = ()
    modes: ModeSet | None = None
    tracked: tuple[TrackedMode, ...] = ()
    recent: ModeSet | None = None
    geometry: Geometry = field(default_factory=Geometry)
    ended: bool = False
