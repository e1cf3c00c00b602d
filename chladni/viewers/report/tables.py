"""The report's tables."""

from collections.abc import Iterator, Sequence

from chladni.signals.channel import Channel
from chladni.signals.peak import Peak
from chladni.signals.provenance import Provenance
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.signals.wording import with_sigma
from chladni.viewers.report.markup import element, escaped, table
from chladni.viewers.style import Style, drawn_channels


def peak_table(peaks: Sequence[Peak], style: Style, *, channels: str) -> str:
    """Tabulate peaks with one sigma, the last column under the heading `channels`; empty when there are none."""
    rows = [
        (
            with_sigma(peak.frequency_hz, peak.frequency_std_hz),
            with_sigma(peak.height, peak.height_std),
            printed_unit(peak.unit),
            ", ".join(style.labels.get(name, name) for name in peak.channels),
        )
        for peak in peaks
    ]
    return table(("Frequency [Hz]", "Height", "Unit", channels), rows, numbers=(0, 1))


def channel_table(study: Study, style: Style) -> str:
    """Tabulate the channels: label in the figures, full name, unit, role, place, rate and length."""
    headings = ("Label", "Channel", "Unit", "Role", "Point", "Direction", "Rate [Hz]", "Length [s]")
    rows = list(_channel_rows(study, style))
    # What is known of no channel, such as its place without a setup, has no column.
    known = [place for place in range(len(headings)) if any(row[place] for row in rows)]
    numbers = [number for number, place in enumerate(known) if place in {6, 7}]
    shown = [[row[place] for place in known] for row in rows]
    return table([headings[place] for place in known], shown, numbers=numbers)


def _channel_rows(study: Study, style: Style) -> Iterator[tuple[str, ...]]:
    seen: set[str] = set()
    for series in study.series:
        for channel in series.channels:
            seen.add(channel.name)
            yield (*_place(channel, style), f"{series.sample_rate_hz:.6g}", f"{series.duration_s:.6g}")
    for channel in drawn_channels(study):
        # Spectra and modes may be shown without their waveforms; their channels are listed all the same.
        if channel.name not in seen:
            seen.add(channel.name)
            yield (*_place(channel, style), "", "")


def _place(channel: Channel, style: Style) -> tuple[str, ...]:
    direction = "" if channel.direction is None else ", ".join(f"{part:g}" for part in channel.direction)
    unit = printed_unit(channel.unit)
    return style.labels[channel.name], channel.name, unit, channel.role, channel.point or "", direction


def method_table(study: Study) -> str:
    """Tabulate how each estimate was made, with the advice that goes with it."""
    # Series of different rates are often averaged alike; one line says it for all.
    accounts = list(dict.fromkeys(density.provenance for density in study.densities))
    accounts += [] if study.response is None else [study.response.provenance]
    headings = (
        "Estimate",
        "Window",
        "Segment [s]",
        "Overlap",
        "Averaging",
        "Segments",
        "Effective",
        "Left out",
        "Detrend",
    )
    shown = table(headings, [_account(account) for account in accounts], numbers=(2, 3, 5, 6, 7))
    # What stands among the findings is told once.
    notes = dict.fromkeys(note for account in accounts for note in account.notes if note not in study.findings)
    advice = "".join(element("li", escaped(note)) for note in notes)
    return shown + (element("ul", advice) if advice else "")


def _account(account: Provenance) -> tuple[str, ...]:
    return (
        account.estimator,
        account.window,
        f"{account.segment_s:g}",
        f"{account.overlap:.0%}",
        account.averaging,
        f"{account.averages}",
        f"{account.effective_averages:.4g}",
        f"{account.skipped}",
        account.detrend,
    )
