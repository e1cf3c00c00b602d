"""The one door through which a source that isn't finished is opened."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from chladni.io.live.reception import MessageSource, Samples
from chladni.io.setup import Setup, load_setup
from chladni.io.stamps import StampRequest
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.geometry import Geometry

if TYPE_CHECKING:
    from chladni.io.live.instrument import Instrument
    from chladni.io.number_lists import NumberLists

STANDARD_INPUT = "-"
SERVER_SCHEMES = ("ws://", "wss://")
#: An audio device: ``audio:``, or with its name or number behind.
AUDIO_SCHEME = "audio:"


class LiveSamples(Protocol):
    """Blocks of samples as they come, of a source of messages or of an instrument."""

    name: str
    number_lists: "tuple[NumberLists, ...]"

    @property
    def geometry(self) -> Geometry:
        """Points and lines of the setup file."""

    @property
    def silent_channels(self) -> tuple[str, ...]:
        """Channels that give nothing at present."""

    def rate_hz(self, channels: Sequence[Channel], /, *, fitted: bool = True) -> float | None:
        """Rate of a grid, given by its channels, as it's known by now."""

    def receive(self, timeout_s: float, /) -> Samples:
        """Give the blocks that are complete, at the latest after `timeout_s`."""

    def finish(self) -> Samples:
        """Give all that is held, where nobody waits for more."""

    def close(self) -> None:
        """Let go of the source."""


def open_live(
    source: "str | Path | MessageSource | Instrument",
    *,
    channels: Sequence[str] | None = None,
    setup: Setup | Path | str | None = None,
    stamp: StampRequest = "auto",
    sample_rate_hz: float | None = None,
    patience_s: float | None = None,
) -> LiveSamples:
    """Open a source of samples that keep coming.

    Parameters
    ----------
    source
        Path of an MCAP log that a recorder is still writing; ``-``, MCAP on standard input; ``ws://HOST:PORT``, a
        Foxglove WebSocket server; ``audio:`` or ``audio:DEVICE``, a sound card. Or what gives messages or samples.
    channels
        Message paths; None for every channel whose samples are uniform.
    setup
        Setup file, or what `load_setup` made of one.
    stamp, sample_rate_hz
        As for `chladni.open_log`.
    patience_s
        Seconds without anything new after which the source counts as ended; None waits for ever.

    Raises
    ------
    LogError
        When the source can't be opened.
    SetupError
        When the setup file has mistakes.
    """
    from chladni.io.live.instrument import Instrument, LiveInstrument
    from chladni.io.live.live_log import LiveLog

    known = load_setup(setup) if isinstance(setup, Path | str) else setup or Setup()
    if isinstance(source, str) and source.startswith(AUDIO_SCHEME):
        from chladni.io.live.audio import AudioDevice

        source = AudioDevice(source.removeprefix(AUDIO_SCHEME), sample_rate_hz=sample_rate_hz)
    if isinstance(source, Instrument):
        return LiveInstrument(source, channels=channels, setup=known, patience_s=patience_s)
    messages = source if isinstance(source, MessageSource) else _messages(str(source), patience_s)
    return LiveLog(messages, channels=channels, setup=known, stamp=stamp, sample_rate_hz=sample_rate_hz)


def _messages(source: str, patience_s: float | None) -> MessageSource:
    from chladni.io.live.followed_log import FollowedFile, StandardInput

    if patience_s is not None and not 0 < patience_s < float("inf"):
        raise SetupError(f"patience of {patience_s} s must be finite and positive")
    if source == STANDARD_INPUT:
        return StandardInput(patience_s=patience_s)
    if source.startswith(SERVER_SCHEMES):
        from chladni.io.live.foxglove import FoxgloveServer

        return FoxgloveServer(source, patience_s=patience_s)
    if "://" in source:
        raise LogError(f"{source}: no source; give an MCAP log, - for standard input, or a server's ws://HOST:PORT")
    return FollowedFile(source, patience_s=patience_s)
