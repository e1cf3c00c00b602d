"""What is chosen from the spectra of a record: decimation, lags, orders, references."""

import numpy as np
import pytest

from chladni.modal.operational.anti_alias import power_transfer, reach
from chladni.modal.operational.response_record import first_stretch, lead_spectra, open_record
from chladni.modal.operational.subspace_plan import plan_subspace
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.truth import ambient_record, chain


def resonance(frequencies_hz, rate_hz, seconds, *, channels=3, seed=0):
    """White noise through resonances of 1 % damping, mixed into channels."""
    rng = np.random.default_rng(seed)
    samples = int(rate_hz * seconds)
    lines_hz = np.fft.rfftfreq(samples, 1 / rate_hz)
    sources = []
    for hz in frequencies_hz:
        gain = hz**2 / (hz**2 - lines_hz**2 + 0.02j * hz * lines_hz)
        source = np.fft.irfft(np.fft.rfft(rng.standard_normal(samples)) * gain, samples)
        sources.append(source / source.std())
    values = rng.standard_normal((channels, len(sources))) @ np.array(sources)
    values += 0.01 * rng.standard_normal(values.shape)
    names = tuple(Channel(name=f"/{row}", unit="m/s^2") for row in range(channels))
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=names)


def plan(record, **options):
    return plan_subspace(cross_spectra(record), record.sample_rate_hz, samples=record.samples, **options)


def test_the_lags_span_four_cycles_of_the_lowest_peak():
    chosen = plan(resonance((4.0, 9.0), 50.0, 2000))
    assert chosen.decimation == 1
    assert 2 * chosen.block_rows / 50.0 * 4.0 == pytest.approx(4.0, rel=0.05)
    assert chosen.orders == tuple(range(2, 61, 2))
    assert chosen.lags == 2 * chosen.block_rows - 1


def test_a_record_sampled_faster_than_its_peaks_need_is_decimated():
    chosen = plan(resonance((4.0, 9.0), 500.0, 600))
    # Four samples for a cycle of 9 Hz.
    assert chosen.decimation in (13, 14)
    assert chosen.band_hz[1] == pytest.approx(0.8 * 500 / chosen.decimation / 2)
    assert "anti-alias" in chosen.notes[0]


@pytest.mark.nightly
def test_low_modes_far_below_high_ones_are_told_of():
    record = resonance((0.4, 90.0), 400.0, 3000, channels=12)
    chosen = plan(record)
    assert chosen.block_rows * 12 <= 1500
    assert "identify the low modes on their own" in chosen.notes[0]


@pytest.mark.slow
def test_a_band_finer_than_the_default_lines_gets_finer_ones():
    record = resonance((0.4, 90.0), 400.0, 3000)
    opened = open_record(record)
    fine, coarse = lead_spectra(opened, (0.1, 2.0)), lead_spectra(opened, None)
    assert np.diff(fine.frequency_hz[:2]) < np.diff(coarse.frequency_hz[:2]) / 4
    chosen = plan_subspace(fine, 400.0, samples=record.samples, band_hz=(0.1, 2.0))
    assert chosen.decimation == 50


def test_references_are_those_that_say_most():
    rng = np.random.default_rng(0)
    base = ambient_record(chain(), cycles=300, rng=rng)
    copies = np.concatenate([base.values, np.repeat(base.values[:1], 12, axis=0)])
    copies[5:] += 1e-3 * copies.std() * rng.standard_normal(copies[5:].shape)
    names = tuple(Channel(name=f"/{row}", unit="m/s^2") for row in range(17))
    record = TimeSeries(values=copies, sample_rate_hz=base.sample_rate_hz, channels=names)
    chosen = plan(record, block_rows=10)
    assert len(chosen.references) == 12
    # Twelve copies of the first body can't push out the others.
    assert {1, 2, 3, 4} <= set(chosen.references)


def test_short_records_get_fewer_rows_and_orders():
    chosen = plan(resonance((4.0,), 50.0, 12, channels=1))
    assert chosen.block_rows * 40 <= 600
    assert chosen.orders[-1] <= chosen.block_rows


def test_what_can_not_be_planned_is_told():
    record = resonance((4.0,), 50.0, 200)
    with pytest.raises(EstimateError, match="no reference '/x'; there are: /0, /1, /2"):
        plan(record, references=["/x"])
    with pytest.raises(SetupError, match="above half the sample rate, 25 Hz"):
        plan(record, band_hz=(30.0, 40.0))
    with pytest.raises(SetupError, match="square matrix of side 6000"):
        plan(record, block_rows=2000)


def test_the_first_stretch_ends_at_a_break_in_time():
    record = resonance((4.0,), 50.0, 40)
    one, other = record.window(end_s=20.0), record.window(start_s=20.0)
    assert first_stretch(open_record([one, other])).samples == record.samples
    late = TimeSeries(
        values=other.values,
        sample_rate_hz=50.0,
        channels=other.channels,
        start_time_ns=other.start_time_ns + 10**9,
        valid=np.ones(other.values.shape, dtype=bool),
    )
    assert first_stretch(open_record([one, late])).samples == one.samples


def test_the_filter_passes_its_band_and_nothing_at_the_half_rate():
    transfer = power_transfer(1001, 5)
    np.testing.assert_array_equal(transfer[:801], 1.0)
    assert transfer[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(transfer) <= 1e-12)
    np.testing.assert_array_equal(power_transfer(7, 1), 1.0)
    assert reach(1) == 0
    # What lies beyond its reach is nothing to the products of samples.
    correlation = np.fft.irfft(transfer)
    assert np.abs(correlation[reach(5) // 5 : -(reach(5) // 5)]).max() < 5e-6 * correlation[0]
