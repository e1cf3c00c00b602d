"""A sound card as an instrument."""

import queue
from typing import Any, Final

import numpy as np

from chladni.io.live.instrument import Instrument, Taken
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError

#: Blocks of the card that wait for the reader.
WAITING: Final = 256


class AudioDevice(Instrument):
    """An input of a sound card, full scale 1.

    Parameters
    ----------
    device
        Its name or number, as ``python -m sounddevice`` lists them; empty for the usual one.
    sample_rate_hz
        None takes the card's usual one.
    channels
        How many inputs; None takes all.

    Raises
    ------
    SetupError
        When the package for sound isn't installed.
    LogError
        When there is no such device.
    """

    def __init__(self, device: str = "", *, sample_rate_hz: float | None = None, channels: int | None = None) -> None:
        self._sound = _sounddevice()
        chosen: Any = int(device) if device.isdigit() else device or None
        try:
            known = self._sound.query_devices(chosen, "input")
        except (ValueError, self._sound.PortAudioError) as error:
            raise LogError(f"audio:{device}: {error}; 'python -m sounddevice' lists the devices") from error
        self.name = str(known["name"])
        self.sample_rate_hz = float(sample_rate_hz or known["default_samplerate"])
        count = int(channels or known["max_input_channels"])
        self.channels = tuple(Channel(name=f"in{number + 1}", unit="1") for number in range(count))
        self._device = chosen
        self._blocks: queue.Queue[Taken] = queue.Queue(WAITING)
        self._first = 0
        self._stream: Any = None

    def start(self) -> None:
        """Open the card."""
        try:
            self._stream = self._sound.InputStream(
                device=self._device,
                samplerate=self.sample_rate_hz,
                channels=len(self.channels),
                dtype="float32",
                latency="low",
                callback=self._take,
            )
            self._stream.start()
        except (ValueError, self._sound.PortAudioError) as error:
            raise LogError(f"{self.name}: can't be opened: {error}") from error

    def read(self, timeout_s: float) -> Taken | None:
        """Give the next block."""
        try:
            return self._blocks.get(timeout=timeout_s)
        except queue.Empty:
            if self._stream is not None and not self._stream.active:
                return None
            return Taken(first=self._first, values=np.zeros((len(self.channels), 0), np.float32))

    def stop(self) -> None:
        """Close the card."""
        if self._stream is not None:
            self._stream.close()

    def _take(self, samples: Any, frames: int, _time: Any, status: Any) -> None:
        """Take a block from the card's own thread; what it lost leaves a gap, of one block for want of its length."""
        if status.input_overflow:
            self._first += frames
        block = Taken(first=self._first, values=np.ascontiguousarray(samples.T))
        self._first += frames
        try:
            self._blocks.put_nowait(block)
        except queue.Full:
            # Its numbers are left out, which tells.
            return


def _sounddevice() -> Any:
    try:
        import sounddevice
    except (ImportError, OSError) as error:
        raise SetupError(
            f"audio needs the extra [audio], pip install 'chladni[audio]', and PortAudio on the system ({error})"
        ) from error
    return sounddevice
