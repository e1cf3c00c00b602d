"""What a log's survey says in sentences: each once, for all topics or channels it's true of."""

from collections.abc import Iterable, Iterator, Sequence

from chladni.io.catalog import Catalog
from chladni.io.channel_source import UNKNOWN_UNIT
from chladni.io.clock.clock_verdict import breaks_sentence
from chladni.io.log_info import some_of, unread_sentences
from chladni.io.loss import Loss
from chladni.io.placement import Placement
from chladni.io.sample_monitor import SampleMonitor
from chladni.signals.channel import Channel
from chladni.signals.sensor_quality import SensorFault, moments
from chladni.signals.wording import counted, shown

MOST_LOSSES_TOLD = 3


def log_findings(
    content: Catalog,
    monitors: Sequence[SampleMonitor],
    placements: Sequence[Placement],
    damage: Sequence[Loss],
    odd: Sequence[str],
) -> Iterator[str]:
    """Say what is wrong with a log, the worst first.

    Parameters
    ----------
    content
        What the log holds.
    monitors, placements
        Of each stream: what its samples and its stamps showed.
    damage
        What was lost.
    odd
        What is odd about messages that were read.
    """
    if damage:
        yield damage_finding(damage)
    yield from odd
    yield from _publisher_findings(content)
    yield from together(_stamp_findings(placements))
    yield from together(finding for placement in placements for finding in _clock_findings(placement))
    yield from together(finding for monitor in monitors for finding in _missing_samples(monitor))
    yield from fault_findings([fault for monitor in monitors for fault in monitor.faults.values()])
    yield from _content_findings(content)


def fault_findings(faults: Sequence[SensorFault]) -> Iterator[str]:
    """Say what is wrong with sensors, by what their samples show."""
    yield from _faults_together([fault for fault in faults if fault.kind != "dead"])
    yield from together(_constant([fault for fault in faults if fault.kind == "dead"]))


def together(findings: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Join subjects that share a sentence; sentences in the order they first come."""
    subjects: dict[str, list[str]] = {}
    for subject, sentence in findings:
        subjects.setdefault(sentence, []).append(subject)
    yield from (f"{some_of(names)}: {sentence}" for sentence, names in subjects.items())


def damage_finding(damage: Sequence[Loss]) -> str:
    """Say in one sentence how much was lost, and the first few reasons."""
    known = sum(one.lost_messages or 0 for one in damage)
    lost = counted(known, "message")
    if any(one.lost_messages is None for one in damage):
        lost = f"at least {lost}" if known else "an unknown number of messages"
    reasons = "; ".join(one.what for one in damage[:MOST_LOSSES_TOLD])
    more = f"; and {len(damage) - MOST_LOSSES_TOLD} more" if len(damage) > MOST_LOSSES_TOLD else ""
    return f"damage in {counted(len(damage), 'place')}, {lost} lost: {reasons}{more}"


# --- of topics ---------------------------------------------------------------------------------------------------


def _publisher_findings(content: Catalog) -> Iterator[str]:
    for topic, names in content.publishers.items():
        yield f"{topic}: {len(names)} publish here at once; each has channels of its own: {some_of(names)}"
    for topic, names in content.in_turn.items():
        yield f"{topic}: {len(names)} MCAP channels send in turn and are read as one; each alone: {some_of(names)}"


def _stamp_findings(placements: Sequence[Placement]) -> Iterator[tuple[str, str]]:
    """Which topics don't simply go by their own stamps, and why."""
    for placement in placements:
        choice = placement.stream.choice
        if placement.time_base.samples and (choice.kind != "header" or choice.shift_ns):
            kind = "own stamps are" if choice.kind == "header" else f"{choice.kind} time is"
            yield placement.stream.label, f"{kind} used: {choice.reason}"


def _clock_findings(placement: Placement) -> Iterator[tuple[str, str]]:
    base, label = placement.time_base, placement.stream.label
    if not base.samples:
        yield label, "no usable messages"
        return
    if placement.stored_late:
        yield (
            label,
            f"{counted(placement.stored_late, 'message')} stored behind later ones, read in the order of time",
        )
    if base.verdict != "regular" or base.gap_count or base.wander_s * base.rate_hz > 1:
        yield label, base.advice
    if len(base.breaks_s):
        yield label, breaks_sentence(base)
    if base.duplicates:
        yield label, f"{counted(base.duplicates, 'message')} with the stamp of another"
    if placement.left_out:
        yield label, f"{counted(placement.left_out, 'sample')} left out: an earlier one has the place on the grid"
    if base.out_of_order:
        yield label, f"{counted(base.out_of_order, 'message')} came after later ones, and were put in order"


# --- of channels -------------------------------------------------------------------------------------------------


def _missing_samples(monitor: SampleMonitor) -> Iterator[tuple[str, str]]:
    for channel, count in zip(monitor.gathering.stream.channels, monitor.missing.tolist(), strict=False):
        if count:
            yield channel.name, missing_sentence(count, monitor.samples)


def missing_sentence(count: int, samples: int) -> str:
    """Say how many samples of a channel are no numbers."""
    if count == samples:
        return "not one sample is a number (all are NaN); nobody fills this field"
    return f"{count} of {counted(samples, 'sample')} not a number; they count as missing"


def _faults_together(faults: Sequence[SensorFault]) -> Iterator[str]:
    """Join channels with the same fault, however often each has it."""
    groups: dict[tuple[str, str, str], list[SensorFault]] = {}
    for fault in faults:
        groups.setdefault((fault.kind, fault.what, fault.remedy), []).append(fault)
    for (kind, what, remedy), group in groups.items():
        if len(group) == 1:
            yield group[0].sentence
            continue
        low, high = min(fault.count for fault in group), max(fault.count for fault in group)
        often = counted(low, "sample") if low == high else f"{low} to {counted(high, 'sample')}"
        when = moments(min(fault.first_s for fault in group), max(fault.last_s for fault in group))
        told = what if kind == "coarse" else f"{what} in {often} each {when}"
        yield f"{some_of([fault.channel for fault in group])}: {told}; {remedy}"


def _constant(dead: Sequence[SensorFault]) -> Iterator[tuple[str, str]]:
    if len(dead) == 1:
        yield dead[0].channel, f"{dead[0].what}; {dead[0].remedy}"
        return
    # Messages have fields that many sensors don't fill, and settings that stay: one sentence for all of them.
    for fault in dead:
        if fault.what.startswith("is 0 "):
            yield fault.channel, "0 throughout; sensors that aren't connected, or fields that nobody fills"
        else:
            yield fault.channel, "constant; settings, fields that aren't measured, or dead sensors"


# --- of the log --------------------------------------------------------------------------------------------------


def _content_findings(content: Catalog) -> Iterator[str]:
    # Text beside signals is no trouble; where there is nothing else it is what the log holds.
    yield from unread_sentences(one for one in content.unread if not (one.complete and content.channels))
    labelled: dict[str, list[str]] = {}
    for source in content.channels:
        if source.unread_unit:
            labelled.setdefault(source.unread_unit, []).append(source.channel.name)
    if labelled:
        told = some_of([f"{shown(label)} of {some_of(names)}" for label, names in labelled.items()])
        yield f"units that can't be read: {told}; a setup file can give them"
    yield from unit_findings([source.channel for source in content.channels if not source.unread_unit])


def unit_findings(channels: Sequence[Channel]) -> Iterator[str]:
    """Say which channels have no unit."""
    unknown = [channel.name for channel in channels if channel.unit == UNKNOWN_UNIT]
    if unknown:
        yield f"the log gives no unit for {some_of(unknown)}; a setup file can"
