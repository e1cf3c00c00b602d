"""Resampling to any rate and offset, against sines whose samples are known everywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import resample_poly

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.resampling import is_staircase, join, join_resampled, resample
from chladni.signals.time_series import TimeSeries

RATIOS = [(1000.0, 700.0), (1000.0, 999.7), (1000.0, 3333.3), (51_200.0, 100.0), (100.0, 200.0), (610.35, 1000 / 3)]
START_NS = 1_700_000_000_000_000_000
FRACTIONS = (0.0, 0.01, 0.3, 0.61, 0.8, 0.93, 1.0)


def one(values: NDArray[np.floating], rate_hz: float, *, start_ns: int = START_NS, name: str = "a") -> TimeSeries:
    return TimeSeries(
        values=np.atleast_2d(values), sample_rate_hz=rate_hz, start_time_ns=start_ns, channels=(Channel(name=name),)
    )


def sine(
    frequency_hz: float, rate_hz: float, samples: int, *, start_ns: int = START_NS, name: str = "a"
) -> TimeSeries:
    times = np.arange(samples) / rate_hz + (start_ns - START_NS) * 1e-9
    return one(np.cos(2 * np.pi * frequency_hz * times + 0.3), rate_hz, start_ns=start_ns, name=name)


def truth(frequency_hz: float, series: TimeSeries) -> Real:
    times = series.times_s() + (series.start_time_ns - START_NS) * 1e-9
    return np.cos(2 * np.pi * frequency_hz * times + 0.3)


@pytest.mark.parametrize(("old_hz", "new_hz"), RATIOS)
def test_sines_in_the_usable_band_err_no_more_than_stated(old_hz: float, new_hz: float) -> None:
    samples = int(old_hz / min(old_hz, new_hz) * 300)
    usable_hz = 0.4 * min(old_hz, new_hz)
    for fraction in FRACTIONS:
        result = resample(sine(fraction * usable_hz, old_hz, samples), sample_rate_hz=new_hz)
        error = np.abs(result.series.values[0] - truth(fraction * usable_hz, result.series)).max()
        # A nanosecond of rounded start time turns the phase by that much.
        assert error <= result.error + 2 * np.pi * fraction * usable_hz * 0.5e-9
        assert result.usable_hz == pytest.approx(usable_hz)
        assert result.error < 3e-5
        assert result.series.valid is None
        assert result.series.sample_rate_hz == new_hz
        assert result.series.samples > 0.6 * 300 * new_hz / min(old_hz, new_hz)


@pytest.mark.parametrize("offset_ns", [1_000, 123_457, 499_999, 999_999])
def test_a_fractional_offset_at_the_same_rate(offset_ns: int) -> None:
    source = sine(380.0, 1000.0, 400)
    result = resample(source, sample_rate_hz=1000.0, start_time_ns=START_NS + 50_000_000 + offset_ns, samples=300)
    assert np.abs(result.series.values[0] - truth(380.0, result.series)).max() <= result.error


@pytest.mark.parametrize("frequency_share", [0.6001, 0.7, 0.83, 1.0, 1.31])
def test_what_would_alias_into_the_usable_band_is_attenuated_as_stated(frequency_share: float) -> None:
    result = resample(sine(frequency_share * 100.0, 1000.0, 4000), sample_rate_hz=100.0)
    assert result.attenuation_db == 100.0
    assert np.abs(result.series.values).max() <= 1.3e-5, "100 dB, and a third for images that add up"


def test_a_band_limited_signal_agrees_with_scipy() -> None:
    rng = np.random.default_rng(1)
    times = np.arange(3000) / 1000
    tones = sum(
        np.cos(2 * np.pi * f * times + p) for f, p in zip(rng.uniform(1, 180, 9), rng.uniform(0, 6, 9), strict=True)
    )
    ours = resample(one(tones, 1000.0), sample_rate_hz=500.0, start_time_ns=START_NS, samples=1500).series
    theirs = resample_poly(tones, 1, 2, window=("kaiser", 12.0))
    inside = slice(200, 1300)
    # Both are approximations: ours by 9 tones of 2e-5 each, scipy's by its default length.
    np.testing.assert_allclose(ours.values[0, inside], theirs[inside], atol=9 * 2e-3)


def test_edges_are_marked_and_not_invented() -> None:
    source = sine(10.0, 1000.0, 400)
    result = resample(source, sample_rate_hz=900.0, start_time_ns=START_NS - 100_000_000, samples=600)
    valid = result.series.valid
    assert valid is not None
    assert np.isnan(result.series.values[~valid]).all()
    times_ns = result.series.times_ns()[valid[0]]
    reach_ns = 20_000_000
    assert times_ns[0] == pytest.approx(START_NS + reach_ns, abs=reach_ns)
    assert times_ns[0] >= START_NS
    assert times_ns[-1] <= START_NS + 399_000_000
    assert np.count_nonzero(valid) > 300
    error = np.abs(result.series.values - truth(10.0, result.series))[valid]
    assert error.max() <= result.error


@pytest.mark.parametrize("marked", ["valid", "nan", "inf"])
def test_what_touches_a_missing_sample_is_missing(marked: str) -> None:
    source = sine(10.0, 1000.0, 1000)
    values, valid = source.values.copy(), np.ones((1, 1000), dtype=bool)
    valid[0, 500:510] = False
    values[0, 500:510] = {"valid": 1e9, "nan": np.nan, "inf": np.inf}[marked]
    holed = TimeSeries(
        values=values,
        sample_rate_hz=1000.0,
        start_time_ns=START_NS,
        channels=source.channels,
        valid=valid if marked == "valid" else None,
    )
    result = resample(holed, sample_rate_hz=800.0)
    assert result.series.valid is not None
    gone_s = (result.series.times_ns()[~result.series.valid[0]] - START_NS) * 1e-9
    assert gone_s[0] > 0.470
    assert gone_s[-1] < 0.540
    assert gone_s[0] < 0.499
    assert gone_s[-1] > 0.510
    good = result.series.valid
    assert np.abs(result.series.values - truth(10.0, result.series))[good].max() <= result.error


def test_the_same_grid_is_a_copy() -> None:
    source = sine(123.0, 1000.0, 100)
    result = resample(source, sample_rate_hz=1000.0)
    np.testing.assert_array_equal(result.series.values, source.values)
    assert result.error == 0.0
    moved = resample(source, sample_rate_hz=1000.0, start_time_ns=START_NS - 10_000_000, samples=50).series
    np.testing.assert_array_equal(moved.values[0, 10:], source.values[0, :40])
    assert moved.valid is not None
    assert np.flatnonzero(~moved.valid[0]).tolist() == list(range(10))


def test_single_precision_is_kept() -> None:
    source = one(np.ones(500, dtype=np.float32), 1000.0)
    assert resample(source, sample_rate_hz=700.0).series.values.dtype == np.float32


@given(
    old_hz=st.floats(10.0, 5000.0),
    ratio=st.floats(0.2, 5.0),
    fraction=st.floats(0.0, 1.0),
    shift_ns=st.integers(0, 10**8),
)
def test_any_ratio_errs_no_more_than_stated(old_hz: float, ratio: float, fraction: float, shift_ns: int) -> None:
    frequency_hz = fraction * 0.4 * old_hz * min(1.0, ratio)
    source = sine(frequency_hz, old_hz, 400, start_ns=START_NS + shift_ns)
    result = resample(source, sample_rate_hz=old_hz * ratio)
    error = np.abs(result.series.values[0] - truth(frequency_hz, result.series)).max()
    # The phase in the truth itself is rounded: times of 0.1 s in double precision, starts in nanoseconds.
    assert error <= result.error + 2 * np.pi * frequency_hz * 1e-9


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


def test_what_cant_be_resampled_is_refused() -> None:
    source = sine(1.0, 100.0, 50)
    for rate_hz in (0.0, -5.0, np.nan, np.inf):
        with pytest.raises(EstimateError, match="finite and positive"):
            resample(source, sample_rate_hz=rate_hz)
        with pytest.raises(EstimateError, match="finite and positive"):
            join([source], sample_rate_hz=rate_hz)
    with pytest.raises(EstimateError, match="50 samples at 100 Hz are too few for 7 Hz"):
        resample(source, sample_rate_hz=7.0)
    with pytest.raises(EstimateError, match="no series"):
        join([])
    with pytest.raises(EstimateError, match="share no time"):
        join([source, sine(1.0, 100.0, 50, start_ns=START_NS + 10**12, name="b")])
    with pytest.raises(EstimateError, match="unique"):
        join([source, source])


# --- held channels -----------------------------------------------------------------------------------------------


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
