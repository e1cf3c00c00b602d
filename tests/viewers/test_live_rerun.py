"""A live source in rerun: everything that came is in the recording, whatever the disk and the viewer do."""

import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun_cli
from rerun.blueprint.components import PlayState

from chladni.signals.live_state import LiveEvent, LiveState
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries
from chladni.spectral.waterfall import waterfall
from chladni.viewers.rerun.live_targets import Painter, RecordingFile, Target
from chladni.viewers.rerun.waiting_states import MOST_BYTES, WaitingStates
from tests.viewers.rrd import Contents

RATE_HZ, START_NS = 1000.0, 1_700_000_000_000_000_000
PLAY_STATE = "TimePanelBlueprint:play_state"
RERUN = Path(rerun_cli.__file__).parent / "rerun"


def states(count: int, *, samples: int = 100) -> list[LiveState]:
    rng = np.random.default_rng(0)
    found = []
    for number in range(count):
        series = TimeSeries.from_arrays(
            {"a": rng.standard_normal(samples), "b": rng.standard_normal(samples)},
            sample_rate_hz=RATE_HZ,
            units="m/s^2",
            start_time_ns=START_NS + round(number * samples / RATE_HZ * 1e9),
        )
        density = PowerSpectralDensity.from_arrays(
            np.arange(65.0), rng.random((2, 65)), names=["a", "b"], units="m/s^2", averages=10
        )
        found.append(
            LiveState(
                title="made",
                start_time_ns=START_NS,
                time_s=(number + 1) * samples / RATE_HZ,
                series=(series,),
                events=(LiveEvent(kind="gap", time_s=0.5, text="one missing"),) if number == 1 else (),
                fresh=number % 5 == 0,
                densities=(density,),
                ended=number == count - 1,
            )
        )
    return found


def test_a_recording_holds_every_sample_and_every_event(tmp_path: Path) -> None:
    shown = states(20)
    target = RecordingFile(tmp_path / "a.rrd")
    with Painter(target) as painter:
        told = [text for state in shown for text in painter.show(state)]
    assert told == []
    contents = Contents(tmp_path / "a.rrd")
    waves = contents.scalars("/waveforms/1/acceleration")
    np.testing.assert_array_equal(waves, np.concatenate([one.series[0].values for one in shown], axis=1).T)
    assert contents.column("/events", "TextLog:text") == [["one missing"]]
    assert "What happened and changed" in contents.view_names()
    # It opens at its end: at its first moment nothing is averaged yet.
    (cursor,) = [row[PLAY_STATE] for row in contents.blueprint if PLAY_STATE in row]
    assert cursor == [PlayState.Following.value]
    subprocess.run([RERUN, "rrd", "verify", tmp_path / "a.rrd"], check=True, capture_output=True)


def test_a_recording_is_bounded_and_both_its_files_are_whole(tmp_path: Path) -> None:
    most = 4_000_000
    target = RecordingFile(tmp_path / "a.rrd", keep_bytes=most)
    with Painter(target) as painter:
        for state in states(60, samples=10_000):
            assert painter.show(state) == ()
    sizes = [path.stat().st_size for path in (target.path, target.earlier)]
    # A turn comes after four states at most, each of a quarter of a megabyte.
    assert sum(sizes) < most + 2 * 1_200_000
    assert sum(sizes) > most / 2
    last = [float(Contents(path).times("/waveforms/1/acceleration", "time")[-1]) / 1e9 for path in tmp_path.iterdir()]
    assert max(last) == pytest.approx(600.0 - 1 / RATE_HZ)


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted as Linux lists them")
def test_a_file_that_is_full_leaves_none_of_its_threads_behind(tmp_path: Path) -> None:
    target = RecordingFile(tmp_path / "a.rrd", keep_bytes=200_000)
    threads = []
    for state in states(40, samples=10_000):
        target.draw([state])
        threads.append(len(list(Path("/proc/self/task").iterdir())))
    target.close()
    # Each state fills a file.
    assert target.earlier.exists()
    assert max(threads[-10:]) <= max(threads[5:15])


def test_a_disk_that_is_full_is_told_and_the_states_go_on() -> None:
    painter = Painter(RecordingFile("/dev/full"))
    told = []
    for state in states(50):
        told += painter.show(state)
        time.sleep(0.01)
    told += painter.close()
    assert told == ["the recording ended: No space left on device; the averages go on without it"]


class Slow(Target):
    """A viewer that draws nothing before it's let."""

    what = "the viewer"

    def __init__(self) -> None:
        self.drawn: list[LiveState] = []
        self.begun, self.let = threading.Event(), threading.Event()

    def prepare(self) -> None:
        pass

    def draw(self, states: Sequence[LiveState]) -> None:
        self.begun.set()
        self.let.wait()
        self.drawn += states

    def close(self) -> None:
        pass


def test_a_slow_viewer_holds_nothing_up_and_what_it_lacks_is_told() -> None:
    slow = Slow()
    painter = Painter(slow)
    shown = states(1) * 200
    told = list(painter.show(shown[0]))
    # On a busy machine its thread may begin late, and would then take all that waits.
    assert slow.begun.wait(60)
    told += [text for state in shown[1:] for text in painter.show(state)]
    assert told == ["the viewer can't follow: pictures are left out of it; the averages go on"]
    slow.let.set()
    while not told[1:]:
        time.sleep(0.001)
        told += painter.show(shown[0])
    lacking = told[1].removeprefix("the viewer follows again; ").removesuffix(" s are missing in it")
    painter.close()
    # A state is a tenth of a second; one more was shown, or several until there was room.
    assert 64 <= len(slow.drawn) < 200
    assert float(lacking) >= 0.1 * (200 - len(slow.drawn))


def test_states_that_wait_are_bounded_in_memory() -> None:
    waiting = WaitingStates()
    # Half of what may wait, each.
    large = states(3, samples=MOST_BYTES // 32)
    assert [waiting.put(state, patience_s=0.0) for state in large] == [True, True, False]
    assert len(waiting.take()) == 2
    assert waiting.put(large[2], patience_s=0.0)
    waiting.end()
    assert [len(waiting.take()) for _ in range(2)] == [1, 0]


def test_of_states_that_wait_only_the_last_holds_its_waterfall() -> None:
    waiting = WaitingStates()
    fall = waterfall(states(1, samples=4000)[0].series[0])
    for state in states(3):
        waiting.put(replace(state, waterfalls=(fall,)), patience_s=0.0)
    assert [one.waterfalls for one in waiting.take()] == [(), (), (fall,)]


class Closed(Slow):
    """A viewer that somebody closed, or that has a defect."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self._error = error

    def draw(self, _states: Sequence[LiveState]) -> None:
        raise self._error


@pytest.mark.parametrize(
    ("error", "why"), [(OSError("it was closed"), "it was closed"), (TypeError("no text"), "TypeError: no text")]
)
def test_a_viewer_that_fails_is_told_once_and_the_averages_go_on(error: Exception, why: str) -> None:
    painter = Painter(Closed(error))
    told = []
    for state in states(20):
        told += painter.show(state)
        time.sleep(0.005)
    assert told + list(painter.close()) == [f"the viewer ended: {why}; the averages go on without it"]
