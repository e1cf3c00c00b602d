"""What rises beyond scatter is told; what doesn't, isn't."""

from collections.abc import Sequence

import numpy as np
import pytest

from chladni.signals.time_series import TimeSeries
from chladni.spectral.change_watch import ChangeWatch, SignalChange
from chladni.spectral.running import running_segmentation
from tests.spectral.made_signals import blocks, noise, series

RATE_HZ = 500.0
SECONDS = 120


def watched(whole: TimeSeries) -> Sequence[SignalChange]:
    watch = ChangeWatch(whole.channels, whole.sample_rate_hz, running_segmentation(whole.sample_rate_hz))
    return [change for block in blocks(whole, [100] * (whole.samples // 100)) for change in watch.update(block)]


def moments() -> np.ndarray:
    return np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ


@pytest.mark.parametrize("seed", range(3))
def test_noise_that_stays_as_it_is_tells_nothing(seed: int) -> None:
    assert watched(series(noise(3, moments().size, seed=seed), rate_hz=RATE_HZ)) == []


def test_a_line_that_comes_up_is_told_once_at_its_frequency() -> None:
    values = noise(2, moments().size)
    values[1] += np.where(moments() > 60, 0.7 * np.sin(2 * np.pi * 81.0 * moments()), 0.0)
    lines = [change for change in watched(series(values, rate_hz=RATE_HZ)) if change.kind == "line"]
    assert len(lines) == 1
    assert lines[0].channel == "b"
    assert "81.0" in lines[0].text or "81 Hz" in lines[0].text or "80.9" in lines[0].text
    # Two windows after it came, and no more.
    assert 60 < lines[0].time_ns / 1e9 < 85


def test_a_level_that_rises_is_told_with_both_values() -> None:
    values = noise(2, moments().size) * np.where(moments() > 60, 2.0, 1.0)
    levels = [change for change in watched(series(values, rate_hz=RATE_HZ)) if change.kind == "level"]
    assert {change.channel for change in levels} == {"a", "b"}
    # One sigma of a window's level is 0.2 dB.
    assert all(abs(float(change.text.split("rose by ")[1].split()[0]) - 6.0) < 0.8 for change in levels)


def test_what_always_swings_is_no_change() -> None:
    """A machine whose level swings by a factor of three from window to window is usual as it is."""
    swing = 1.0 + np.repeat(np.random.default_rng(5).random(SECONDS // 4), int(4 * RATE_HZ)) * 2
    assert [one for one in watched(series(noise(2, swing.size) * swing, rate_hz=RATE_HZ)) if one.kind == "line"] == []


def test_a_sensor_that_dies_is_told_and_its_return_too() -> None:
    values = noise(2, moments().size)
    values[0, (moments() > 30) & (moments() < 50)] = 0.25
    told = [change for change in watched(series(values, rate_hz=RATE_HZ)) if change.kind == "sensor"]
    assert [change.channel for change in told] == ["a", "a"]
    assert 30.5 < told[0].time_ns / 1e9 < 32.5
    assert "one value only" in told[0].text
    assert "moves again" in told[1].text


def test_a_setpoint_that_rests_for_seconds_is_no_dead_sensor() -> None:
    steps = np.repeat(np.random.default_rng(2).standard_normal(SECONDS // 3), int(3 * RATE_HZ))
    values = np.stack([steps, noise(1, steps.size)[0]])
    assert [change for change in watched(series(values, rate_hz=RATE_HZ)) if change.kind == "sensor"] == []


@pytest.mark.filterwarnings("error")
def test_lines_on_which_nothing_ever_showed_tell_nothing() -> None:
    # Two values in turn: at rest between its lines, to the last bit.
    values = np.tile([1.0, -1.0], (2, moments().size // 2))
    assert watched(series(values, rate_hz=RATE_HZ)) == []
