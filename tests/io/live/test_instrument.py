"""An instrument behind the small protocol: what it took is averaged, and what was lost leaves its place free."""

import queue
import time

import numpy as np
import pytest

from chladni.apps.live import live
from chladni.apps.psd import psd
from chladni.io.live.instrument import Instrument, LiveInstrument, Taken
from chladni.io.live.reception import Samples
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries

RATE_HZ = 1000.0
CHANNELS = (Channel(name="in1", unit="V"), Channel(name="in2", unit="V"))


class Made(Instrument):
    """Gives these blocks, and fails or ends behind them."""

    name = "made"
    channels = CHANNELS
    sample_rate_hz = RATE_HZ

    def __init__(self, blocks: list[Taken], *, fails: bool = False, pause_s: float = 0.0) -> None:
        self._blocks = queue.SimpleQueue()
        for block in blocks:
            self._blocks.put(block)
        self._fails, self._pause_s = fails, pause_s
        self.started = self.stopped = False

    def start(self) -> None:
        self.started = True

    def read(self, _timeout_s: float) -> Taken | None:
        time.sleep(self._pause_s)
        if not self._blocks.empty():
            return self._blocks.get()
        if self._fails:
            raise OSError("unplugged")
        return None

    def stop(self) -> None:
        self.stopped = True


NOISE = np.random.default_rng(0).standard_normal((2, 20_000))


def cut(samples: int = 20_000, length: int = 256) -> list[Taken]:
    return [Taken(first=n, values=NOISE[:, n : min(n + length, samples)]) for n in range(0, samples, length)]


def test_averages_are_those_of_the_samples_that_were_taken() -> None:
    instrument = Made(cut(4000))
    *_, last = live(instrument, resolution_hz=2.0, modes_every_s=0)
    reference = psd(TimeSeries(values=NOISE[:, :4000], sample_rate_hz=RATE_HZ, channels=CHANNELS), resolution_hz=2.0)
    np.testing.assert_allclose(last.densities[0].values, reference.values, rtol=1e-12)
    assert instrument.started
    assert instrument.stopped


@pytest.mark.parametrize("late_s", [0.0, 0.2], ids=["one by one", "all at once"])
def test_samples_that_the_instrument_lost_are_a_gap(late_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks, receive = cut(4000), LiveInstrument.receive

    def later(self: LiveInstrument, timeout_s: float) -> Samples:
        time.sleep(late_s)
        return receive(self, timeout_s)

    monkeypatch.setattr(LiveInstrument, "receive", later)
    states = list(live(Made(blocks[:8] + blocks[10:]), resolution_hz=2.0, modes_every_s=0))
    gaps = [event for state in states for event in state.events if event.kind == "gap"]
    assert [event.samples for event in gaps] == [512]
    assert gaps[0].time_s == pytest.approx(10 * 0.256)


def test_what_this_computer_cant_take_is_skipped_and_counted() -> None:
    source = LiveInstrument(Made(cut()), waiting_s=5.0)
    time.sleep(0.5)
    got = source.receive(0.0)
    source.close()
    taken = sum(block.samples for block in got.blocks)
    (skipped,) = [one for one in got.told if one.kind == "skipped"]
    assert taken + skipped.samples == 20_000
    assert taken <= 5000


def test_an_instrument_that_fails_is_told_with_its_reason_and_ends() -> None:
    *_, last = live(Made(cut(4000), fails=True), resolution_hz=2.0, modes_every_s=0)
    assert [event.text for event in last.events] == ["made: the instrument failed: unplugged"]
    assert last.ended
    assert last.densities


def test_a_channel_that_isnt_there_is_refused() -> None:
    with pytest.raises(Exception, match="in9"):
        LiveInstrument(Made([]), channels=["in9"])


def test_audio_without_a_card_is_one_line() -> None:
    from chladni.io.live.audio import AudioDevice

    try:
        import sounddevice
    except (ImportError, OSError):
        sounddevice = None
    if sounddevice is not None and len(sounddevice.query_devices()):
        pytest.skip("this computer has a sound card")
    with pytest.raises((LogError, Exception), match="audio"):
        AudioDevice("no such card")
