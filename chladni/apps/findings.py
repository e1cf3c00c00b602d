"""What was found in a log, in sentences."""

from collections.abc import Sequence

from chladni.apps.unit_peaks import UnitPeaks
from chladni.io.log import Log
from chladni.io.log_info import LogInfo, some_of, unread_sentences
from chladni.io.loss import Loss
from chladni.signals.errors import LogError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.peak import Peak
from chladni.signals.unit_text import with_unit
from chladni.signals.wording import counted

MOST_PEAKS_TOLD = 5


def damage_sentences(losses: Sequence[Loss]) -> tuple[str, ...]:
    """Say what was lost, where, and how much."""
    return tuple(_damage_sentence(loss) for loss in losses)


def require_channels(log: Log, name: str) -> None:
    """Raise `LogError` when a log, known to people by `name`, has no channel; it says what there is instead."""
    if log.channels:
        return
    if log.functions is not None or log.modes is not None:
        # The file's own error says what it holds, and what shows it.
        log.grids()
    # The damage is known when all has been read, and nothing is left to read that would take long.
    log.info()
    told = " ".join((*damage_sentences(log.damage), *log.notes, *unread_sentences(log.unread)))
    raise LogError(
        f"{name}: holds no channel that can be read; {told or 'record at least one message with a number in it'}"
    )


def _damage_sentence(loss: Loss) -> str:
    where = "" if loss.offset is None else f" at byte {loss.offset} ({loss.record})"
    lost = "an unknown number of messages" if loss.lost_messages is None else counted(loss.lost_messages, "message")
    return f"Damage{where}: {loss.what}; {lost} lost."


def reading_sentences(log: Log, *, everything: bool = True) -> tuple[str, ...]:
    """Say what is to be known of what has been read of a log.

    Parameters
    ----------
    log
        After reading.
    everything
        Whether all channels were asked for, so that topics that can't be read are left out of it.

    Returns
    -------
    tuple of str
        What was lost, what is odd, what was left out.
    """
    left_out = [one for one in log.unread if everything and not one.complete]
    return (*damage_sentences(log.damage), *log.notes, *unread_sentences(left_out))


def soundness_sentences(info: LogInfo) -> tuple[str, ...]:
    """Say whether the log is sound: its length, damage, and every trouble of its clocks and sensors."""
    rates = sorted({one["rate_hz"] for one in info.to_json()["channels"] if one["rate_hz"]}, reverse=True)
    told = some_of([f"{rate:.6g} Hz" for rate in rates])
    summary = f"{info.duration_s:.6g} s, {counted(len(info.channels), 'channel')}" + (f" at {told}" if told else "")
    if (functions := info.functions) is not None:
        held = counted(len(functions.responses) * len(functions.references), "frequency response")
        summary = f"{summary}, {held}" if info.channels else held
    return (f"{summary}. {'No trouble found.' if not info.findings else ''}".rstrip(), *info.findings)


def peak_sentence(found: UnitPeaks) -> str:
    """Say which frequencies are in the channels of one unit."""
    if not found.peaks:
        return f"No peak stands out of the scatter in {some_of(found.channels)}."
    told = [
        f"{peak.frequency_hz:.5g} Hz ({some_of(peak.channels, count=1)})" for peak in found.peaks[:MOST_PEAKS_TOLD]
    ]
    where = "" if found.unit == "1" else f" in {found.unit}"
    return f"Strongest frequencies{where}: {', '.join(told)}."


def response_sentences(response: FrequencyResponse, peaks: Sequence[Peak]) -> tuple[str, ...]:
    """Say where the transfer functions peak."""
    reference = some_of([one.name for one in response.references])
    if not peaks:
        return (f"No transfer function from {reference} has a peak on its excited lines.",)
    told = [
        f"{peak.frequency_hz:.5g} Hz ({peak.channels[0]}, {with_unit(f'{peak.height:.3g}', peak.unit)})"
        for peak in peaks[:MOST_PEAKS_TOLD]
    ]
    return (f"Highest peaks over {reference}: {', '.join(told)}.",)
