"""Joining of series on one grid, against truth in closed form; commands held between their samples."""

import numpy as np
import pytest

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.join import is_staircase, join, join_resampled
from chladni.signals.time_series import TimeSeries
from tests.signals.made_sines import START_NS, sine, truth


def test_joining_keeps_the_slowest_as_it_is() -> None:
    slow = sine(1.5, 100.0, 2000, name="slow")
    fast = sine(1.5, 1024.0, 19_000, start_ns=START_NS + 12_345_678, name="fast")
    result = join_resampled([fast, slow])
    both = result.series
    assert both.sample_rate_hz == 100.0
    assert [channel.name for channel in both.channels] == ["fast", "slow"]
    assert both.valid is None
    number = round((both.start_time_ns - START_NS) * 100 / 1e9)
    np.testing.assert_array_equal(both.values[1], slow.values[0, number : number + both.samples])
    np.testing.assert_allclose(both.values[0], truth(1.5, both), atol=result.error)
    assert result.usable_hz == 40.0
    assert both.samples > 1800
    np.testing.assert_array_equal(join([fast, slow]).values, both.values)


def test_joining_to_a_stated_rate_and_span() -> None:
    parts = [sine(3.0, 100.0, 2000, name="slow"), sine(3.0, 1024.0, 20_000, name="fast")]
    result = join_resampled(parts, sample_rate_hz=250.0, start_time_ns=START_NS + 10**9, samples=1000)
    assert result.series.values.shape == (2, 1000)
    assert result.series.start_time_ns == START_NS + 10**9
    np.testing.assert_allclose(result.series.values, np.tile(truth(3.0, result.series), (2, 1)), atol=result.error)


def test_joining_carries_gaps() -> None:
    slow = sine(1.0, 100.0, 1000, name="slow")
    valid = np.ones((1, 1000), dtype=bool)
    valid[0, 400:420] = False
    holed = TimeSeries(
        values=slow.values, sample_rate_hz=100.0, start_time_ns=START_NS, channels=slow.channels, valid=valid
    )
    both = join([holed, sine(1.0, 1000.0, 10_000, name="fast")])
    assert both.valid is not None
    assert np.count_nonzero(~both.valid[0]) == 20
    assert both.valid[1].all()


def test_joining_one_series_copies_it() -> None:
    source = sine(1.0, 100.0, 50)
    np.testing.assert_array_equal(join([source]).values, source.values)


def staircase(levels: Real, rate_hz: float, *, name: str, held: bool = False) -> TimeSeries:
    return TimeSeries(
        values=levels[None],
        sample_rate_hz=rate_hz,
        start_time_ns=START_NS,
        channels=(Channel(name=name, held=held),),
    )


def test_a_command_by_its_type_is_held_on_the_grid_of_the_states() -> None:
    # Any numbers, no staircase: only the type tells.
    levels = np.random.default_rng(1).standard_normal(500)
    states = sine(3.0, 250.0, 2500, name="state")
    result = join_resampled([staircase(levels, 50.0, name="command", held=True), states])
    both = result.series
    assert both.sample_rate_hz == 250.0
    assert [channel.name for channel in both.channels] == ["command", "state"]
    # Five states to a command: each of its values five times, from its own time on.
    np.testing.assert_array_equal(both.values[0], np.repeat(levels, 5)[: both.samples])
    np.testing.assert_array_equal(both.values[1], states.values[0])
    assert result.held == {"command": "its message type is a command"}


def test_the_last_value_is_held_for_its_own_length_and_no_longer() -> None:
    result = join_resampled([staircase(np.arange(4.0), 10.0, name="a", held=True), sine(1.0, 100.0, 400, name="b")])
    np.testing.assert_array_equal(result.series.values[0], np.repeat(np.arange(4.0), 10))


def test_a_missing_value_is_held_as_missing() -> None:
    levels = np.arange(100.0)
    levels[40] = np.nan
    result = join([staircase(levels, 10.0, name="a", held=True), sine(1.0, 50.0, 500, name="b")])
    assert result.valid is not None
    np.testing.assert_array_equal(np.flatnonzero(~result.valid[0]), np.arange(200, 205))
    assert result.valid[1].all()


def test_a_staircase_is_told_by_its_samples_and_the_method_overrides_it() -> None:
    levels = np.repeat(np.random.default_rng(2).standard_normal(100), 10)
    parts = [staircase(levels, 50.0, name="setpoint"), sine(1.0, 200.0, 4000, name="state")]
    found = join_resampled(parts)
    assert found.held == {"setpoint": "its samples are a staircase"}
    np.testing.assert_array_equal(found.series.values[0], np.repeat(levels, 4)[: found.series.samples])
    smooth = join_resampled(parts, method="band-limited")
    assert smooth.held == {}
    assert smooth.series.sample_rate_hz == 50.0


def test_holding_as_asked_for_takes_the_fastest_grid() -> None:
    slow = sine(1.0, 40.0, 400, name="slow")
    result = join_resampled([slow, sine(1.0, 100.0, 1000, name="fast")], method="hold")
    assert result.series.sample_rate_hz == 100.0
    np.testing.assert_array_equal(result.series.values[0, :5], slow.values[0, [0, 0, 0, 1, 1]])
    assert set(result.held) == {"slow", "fast"}


def test_holding_keeps_the_delay_of_half_a_sample_that_a_held_input_has() -> None:
    # Zero-order hold: sinc(f T) exp(-j pi f T) over the samples' own spectrum.
    rate_hz, frequency_hz = 50.0, 2.0
    source = sine(frequency_hz, rate_hz, 1000, name="a")
    held = join([source, sine(1.0, 1000.0, 20_000, name="b")], method="hold").select(["a"])
    turning = np.exp(-2j * np.pi * frequency_hz * held.times_s())
    own = np.exp(-2j * np.pi * frequency_hz * source.times_s())
    ratio = (turning @ held.values[0] / held.samples) / (own @ source.values[0] / source.samples)
    # Steps of 1 ms begin at the grid point, so that the hold's middle lies half a step early.
    expected = np.sinc(frequency_hz / rate_hz) * np.exp(-1j * np.pi * frequency_hz * (1 / rate_hz - 1e-3))
    assert ratio == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (np.repeat([0.0, 1.0], 50), True),
        (np.tile(np.repeat([0.0, 1.0], 7), 20), True),
        (np.zeros(100), False),
        (np.arange(100.0), False),
        # Coarse digits of a slow motion: each level follows its neighbour.
        (np.round(30 * np.sin(np.arange(5000) / 400)), False),
        (np.random.default_rng(3).standard_normal(1000), False),
        (np.array([]), False),
    ],
)
def test_what_is_a_staircase(values: Real, told: bool) -> None:
    assert is_staircase(values) is told
