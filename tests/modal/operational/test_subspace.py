"""Modes from responses alone: chains of known modes, noise, machines, a measured building, and bad records."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import chladni
from chladni.modal.operational.subspace import CovarianceDrivenSubspace
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.time_series import TimeSeries
from tests.modal.truth import ambient_record, chain, close_modes, mac, noise_record

TRUTH = chain()


def chain_record(seed, *, cycles=2000, noise=0.01):
    return ambient_record(TRUTH, cycles=cycles, rng=np.random.default_rng([11, seed]), noise=noise)


def identify(source, **options):
    return CovarianceDrivenSubspace().identify(source, **options)


def series(values, rate_hz=100.0, **options):
    channels = tuple(Channel(name=f"/a{row}", unit="m/s^2") for row in range(len(values)))
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=channels, **options)


@pytest.fixture(scope="module", name="modes")
def _modes():
    return identify(chain_record(0))


def test_a_chain_shows_its_five_modes_and_no_other(modes):
    assert modes.frequency_hz.size == 5
    # Four sigma for each of ten numbers.
    assert np.all(np.abs(modes.frequency_hz - TRUTH.frequency_hz) < 4 * modes.frequency_std_hz)
    assert np.all(np.abs(modes.damping_ratio - 0.01) < 4 * modes.damping_std)
    assert all(mac(*pair) > 0.99 for pair in zip(modes.shapes, TRUTH.shapes, strict=True))


def test_what_comes_with_the_modes(modes):
    largest = np.argmax(np.abs(modes.shapes), axis=1)
    rows = np.arange(5)
    np.testing.assert_array_equal(modes.shapes[rows, largest], 1.0)
    np.testing.assert_array_equal(modes.shape_std[rows, largest], 0.0)
    assert modes.participation is None
    assert modes.scale is None
    assert any("unscaled" in note for note in modes.provenance.notes)
    assert "SSI-cov" in modes.provenance.estimator
    assert np.all(modes.spread.orders >= 9)
    np.testing.assert_allclose(modes.spread.frequency_hz, TRUTH.frequency_hz, rtol=0.01)
    # No error bar promises more than a record of that length can hold.
    assert np.all(modes.damping_std / 0.01 > 0.8 / np.sqrt(2 * np.pi * 0.01 * 2000 * TRUTH.frequency_hz))


def test_the_diagram_holds_all_poles_and_says_which_were_taken(modes):
    diagram = modes.stabilisation
    assert diagram.order.max() == 60
    for mode in range(5):
        taken = diagram.frequency_hz[diagram.mode == mode]
        assert taken.size == modes.spread.orders[mode]
        np.testing.assert_allclose(taken, TRUTH.frequency_hz[mode], rtol=0.03)
    peak = diagram.indicator_hz[np.argmax(diagram.indicator[0])]
    assert np.min(np.abs(TRUTH.frequency_hz / peak - 1)) < 0.02
    assert diagram.indicator_unit == "(m/s^2)^2/Hz"


@pytest.mark.nightly
def test_intervals_cover_as_they_say():
    runs, hits, asked = 8, np.zeros(3, int), np.zeros(3, int)
    for run in range(runs):
        found = identify(chain_record(100 + run, cycles=1500))
        assert found.frequency_hz.size == 5
        inside_frequency = np.abs(found.frequency_hz - TRUTH.frequency_hz) < 1.96 * found.frequency_std_hz
        inside_damping = np.abs(found.damping_ratio - 0.01) < 1.96 * found.damping_std
        largest = np.argmax(np.abs(found.shapes), axis=1)
        true = TRUTH.shapes / TRUTH.shapes[np.arange(5), largest][:, None]
        free = np.arange(5) != largest[:, None]
        off = (found.shapes - true)[free]
        inside_shape = np.concatenate(
            [
                np.abs(off.real) < 1.96 * found.shape_std[free].real,
                np.abs(off.imag) < 1.96 * found.shape_std[free].imag,
            ]
        )
        for row, inside in enumerate((inside_frequency, inside_damping, inside_shape)):
            hits[row] += inside.sum()
            asked[row] += inside.size
    # Lowest and highest count that a coverage of 92 to 98 % gives with a chance of one in ten thousand; components of
    # one shape hang together, so that four of them count as one.
    effective = asked // np.array([1, 1, 4])
    low, high = binom.ppf(1e-4, effective, 0.92) / effective, binom.ppf(1 - 1e-4, effective, 0.98) / effective
    assert np.all(hits / asked >= low)
    assert np.all(hits / asked <= high)


@pytest.mark.parametrize(("channels", "samples"), [(1, 8000), (2, 20_000), (4, 4000), (9, 20_000)])
def test_noise_has_no_modes(channels, samples):
    for seed in range(2):
        record = noise_record(samples, rng=np.random.default_rng([5, seed]), references=1, responses=channels - 1)
        found = identify(record)
        assert not found.frequency_hz.size
        assert "no mode" in found.provenance.notes[0]
        assert found.shapes.shape == (0, channels)
        assert np.all(found.stabilisation.mode == -1)


def test_noise_as_strong_as_the_responses_hides_no_mode():
    found = identify(chain_record(1, cycles=5000, noise=1.0))
    assert found.frequency_hz.size == 5
    assert np.all(np.abs(found.frequency_hz - TRUTH.frequency_hz) < 4 * found.frequency_std_hz)


def test_modes_closer_than_their_width_stay_apart():
    truth = close_modes(apart=0.01)
    record = ambient_record(truth, cycles=20_000, rng=np.random.default_rng(2), noise=0.01)
    found = identify(record)
    assert found.frequency_hz.size == 2
    np.testing.assert_allclose(found.frequency_hz, truth.frequency_hz, atol=4 * found.frequency_std_hz.max())
    assert all(mac(*pair) > 0.95 for pair in zip(found.shapes, truth.shapes, strict=True))


def test_a_stream_gives_what_the_series_gives(modes):
    record = chain_record(0)
    step = 20_011
    blocks = (
        record.window(start_s=first / record.sample_rate_hz, end_s=(first + step) / record.sample_rate_hz)
        for first in range(0, record.samples, step)
    )
    streamed = identify(blocks)
    # Windows round to a sample, stamps to a nanosecond; the samples are the same.
    np.testing.assert_allclose(streamed.frequency_hz, modes.frequency_hz, rtol=1e-9)
    np.testing.assert_allclose(streamed.damping_std, modes.damping_std, rtol=1e-6)
    np.testing.assert_allclose(streamed.shapes, modes.shapes, atol=1e-7)


def test_a_stream_longer_than_its_beginning_is_read_to_its_end(monkeypatch):
    record = chain_record(3)
    monkeypatch.setattr("chladni.modal.operational.response_record.SAMPLES_TO_PLAN_FROM", 30_000)
    blocks = [record.window(start_s=first, end_s=first + 100.0) for first in range(0, 2000, 100)]
    streamed, whole = identify(iter(blocks)), identify(record)
    assert streamed.frequency_hz.size == 5
    # The plan is made from the beginning; the record that is averaged is the same.
    np.testing.assert_allclose(streamed.frequency_hz, whole.frequency_hz, atol=3 * whole.frequency_std_hz.max())
    np.testing.assert_allclose(streamed.frequency_std_hz, whole.frequency_std_hz, rtol=0.6)
    assert streamed.stabilisation.indicator_hz.size > 100


def test_lines_of_machines_are_no_modes():
    record = chain_record(4, cycles=1000)
    hum_hz = 5.2
    time_s = record.times_s()
    hum = np.std(record.values) * np.sin(2 * np.pi * hum_hz * time_s) * np.array([1, 0.5, -0.3, 0.7, 0.2])[:, None]
    found = identify(replace(record, values=record.values + hum))
    assert [line.frequency_hz for line in found.harmonics] == [pytest.approx(hum_hz, rel=1e-3)]
    assert np.all(np.abs(found.frequency_hz - hum_hz) > 0.1)
    np.testing.assert_allclose(found.frequency_hz, TRUTH.frequency_hz, rtol=0.01)
    forced = identify(replace(record, values=record.values + hum), frequencies_hz=[hum_hz, 1.0])
    assert any("rather than a mode" in note or "5.2 Hz" in note for note in forced.provenance.notes)


def test_a_band_limits_the_modes_and_decimates():
    found = identify(chain_record(5), band_hz=(0.5, 3.5))
    np.testing.assert_allclose(found.frequency_hz, TRUTH.frequency_hz[:2], rtol=0.01)
    assert any("correlations are taken every 3 samples" in note for note in found.provenance.notes)
    assert np.all(np.abs(found.frequency_hz - TRUTH.frequency_hz[:2]) < 4 * found.frequency_std_hz)


def test_a_count_keeps_the_strongest_and_says_what_is_missing():
    few = identify(chain_record(0, cycles=600), count=2)
    assert few.frequency_hz.size == 2
    many = identify(chain_record(0, cycles=600), count=9)
    assert many.frequency_hz.size == 5
    assert any("9 modes asked for, but the record holds no more than 5" in note for note in many.provenance.notes)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))])
def test_a_count_changes_none_of_the_modes_that_it_keeps(seed):
    record = chain_record(seed, cycles=600)
    whole, few = identify(record), identify(record, count=2)
    same = [int(np.argmin(np.abs(whole.frequency_hz - own_hz))) for own_hz in few.frequency_hz]
    np.testing.assert_array_equal(few.frequency_hz, whole.frequency_hz[same])
    np.testing.assert_array_equal(few.damping_ratio, whole.damping_ratio[same])


def test_a_user_names_the_frequencies():
    found = identify(chain_record(0, cycles=600), frequencies_hz=[4.6, 1.0, 3.7])
    np.testing.assert_allclose(found.frequency_hz, TRUTH.frequency_hz[[0, 2]], rtol=0.01)
    assert any("3.7 Hz" in note for note in found.provenance.notes)


def test_a_noise_pole_taken_as_asked_is_told():
    record = noise_record(8000, rng=np.random.default_rng(0), references=1, responses=3)
    found = identify(record, frequencies_hz=[20.0])
    assert found.frequency_hz.size == 0 or any("told from noise" in note for note in found.provenance.notes)


def test_one_channel_works_with_a_word():
    record = chain_record(6)
    found = identify(record.select([record.channels[0].name]))
    near = [np.min(np.abs(found.frequency_hz - hz)) < 0.03 for hz in TRUTH.frequency_hz]
    assert sum(near) >= 3
    np.testing.assert_array_equal(found.shapes, 1.0)
    assert any("one channel only" in note for note in found.provenance.notes)


def test_a_channel_that_does_not_vary_is_left_out_and_named():
    record = chain_record(0, cycles=500)
    values = record.values.copy()
    values[2] = 9.81
    found = identify(replace(record, values=values))
    assert [channel.name for channel in found.channels] == [c.name for c in record.channels if c.name != "/mass2.z"]
    assert any("/mass2.z" in note for note in found.provenance.notes)
    with pytest.raises(EstimateError, match="no channel varies"):
        identify(series(np.ones((2, 5000))))


def test_gaps_are_left_out():
    record = chain_record(0)
    valid = np.ones(record.values.shape, dtype=bool)
    valid[3, 50_000:50_900] = False
    found = identify(replace(record, values=np.where(valid, record.values, np.nan), valid=valid))
    assert found.frequency_hz.size == 5
    assert np.all(np.abs(found.frequency_hz - TRUTH.frequency_hz) < 4 * found.frequency_std_hz)


def test_references_are_channels_by_name():
    record = chain_record(7, cycles=800)
    method = CovarianceDrivenSubspace(references=["/mass0.z", "/mass4.z"])
    found = method.identify(record)
    np.testing.assert_allclose(found.frequency_hz, TRUTH.frequency_hz, rtol=0.01)
    assert found.shapes.shape == (5, 5)
    with pytest.raises(EstimateError, match=r"no reference '/wing'; there are: /mass0\.z"):
        CovarianceDrivenSubspace(references=["/wing"]).identify(record)


def test_of_many_channels_twelve_are_references():
    record = chain_record(8, cycles=600)
    mixed = np.random.default_rng(0).standard_normal((14, 5)) @ record.values
    many = series(mixed + 0.01 * np.random.default_rng(1).standard_normal(mixed.shape), record.sample_rate_hz)
    found = CovarianceDrivenSubspace(block_rows=20).identify(many)
    np.testing.assert_allclose(found.frequency_hz, TRUTH.frequency_hz, rtol=0.01)
    assert found.shapes.shape == (5, 14)


def test_channels_of_two_units_need_no_scaling_by_hand():
    record = chain_record(0, cycles=600)
    turned = replace(record.channels[1], unit="rad/s^2")
    mixed = replace(
        record,
        values=record.values * np.array([1, 1e-4, 1, 1, 1])[:, None],
        channels=(record.channels[0], turned, *record.channels[2:]),
    )
    found = identify(mixed)
    np.testing.assert_allclose(found.frequency_hz, identify(record).frequency_hz, rtol=1e-6)
    assert found.stabilisation.indicator_unit == "1"
    bare = replace(record, channels=tuple(replace(one, unit="1") for one in record.channels))
    assert identify(bare).stabilisation.indicator_unit == "1/Hz"


def test_impossible_requests_are_told():
    record = chain_record(0, cycles=300)
    with pytest.raises(SetupError, match="block_rows 1"):
        CovarianceDrivenSubspace(block_rows=1)
    with pytest.raises(SetupError, match="max_order 1"):
        CovarianceDrivenSubspace(max_order=1)
    with pytest.raises(SetupError, match="max_order 500 must be from 1 to"):
        CovarianceDrivenSubspace(block_rows=10, max_order=500).identify(record)
    with pytest.raises(SetupError, match="exclude each other"):
        identify(record, count=2, frequencies_hz=[1.0])
    with pytest.raises(SetupError, match="begins above half the sample rate"):
        identify(record, band_hz=(40.0, 60.0))
    with pytest.raises(EstimateError, match=r"too few for correlations over .* take a longer record or fewer block"):
        CovarianceDrivenSubspace(block_rows=200).identify(record.window(end_s=40.0))
    with pytest.raises(EstimateError, match="at least 512 are needed, and some hundred cycles of the lowest mode"):
        identify(record.window(end_s=5.0))
    with pytest.raises(SetupError, match="square matrix of side 5000"):
        CovarianceDrivenSubspace(block_rows=1000).identify(record)
    broken = record.values.copy()
    broken[1, 5] = np.inf
    with pytest.raises(EstimateError, match=r"/mass1\.z"):
        identify(replace(record, values=broken))


def test_few_block_rows_limit_the_order():
    found = CovarianceDrivenSubspace(block_rows=10).identify(chain_record(0, cycles=800))
    assert found.stabilisation.order.max() <= 45
    assert found.frequency_hz.size == 5


@pytest.mark.nightly
@pytest.mark.slow
def test_the_building_shows_its_published_modes(shared_data):
    log = chladni.open_log(shared_data / "palisaden.mcap")
    (record,) = log.read_groups(None)
    found = identify(record)
    published_hz = np.array([1.88202, 2.42170, 2.68704])
    low = found.frequency_hz < 4
    assert np.count_nonzero(low) == 3
    np.testing.assert_allclose(found.frequency_hz[low], published_hz, rtol=0.003)
    np.testing.assert_allclose(found.damping_ratio[low], [0.0157, 0.0150, 0.0153], atol=0.003)
    # Not better than the record's length allows, and as the scatter of ten-minute segments says.
    std_mhz = 1e3 * found.frequency_std_hz[low]
    assert np.all(std_mhz >= [0.93 * 0.95, 1.03 * 0.95, 1.10 * 0.95])
    ratio = std_mhz / [1.2, 2.2, 1.8]
    assert np.all((ratio >= 0.7) & (ratio <= 2))
    # The first two bending modes and torsion, their like at 5.9 to 7.4 Hz; above are lines of machines.
    assert np.all(found.frequency_hz < 8)
    assert np.all(found.damping_ratio > 0)
    machine_hz = np.array([line.frequency_hz for line in found.harmonics])
    for hz in (13.25, 19.54, 20.46):
        assert np.min(np.abs(machine_hz - hz)) < 0.02
