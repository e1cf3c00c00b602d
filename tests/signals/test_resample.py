"""Resampling to any rate and offset, against sines whose samples are known everywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import resample_poly

from chladni.signals.errors import EstimateError
from chladni.signals.join import join
from chladni.signals.resample import resample
from chladni.signals.time_series import TimeSeries
from tests.signals.made_sines import START_NS, one, sine, truth

RATIOS = [(1000.0, 700.0), (1000.0, 999.7), (1000.0, 3333.3), (51_200.0, 100.0), (100.0, 200.0), (610.35, 1000 / 3)]
FRACTIONS = (0.0, 0.01, 0.3, 0.61, 0.8, 0.93, 1.0)


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
