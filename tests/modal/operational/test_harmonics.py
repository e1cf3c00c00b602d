import numpy as np
import pytest

from chladni.modal.operational.harmonics import machine_harmonics
from chladni.signals.errors import EstimateError
from tests.modal.operational.test_narrow_band_kurtosis import series_of
from tests.modal.truth import ModalTruth, ambient_record, chain

TWO_MODES = ModalTruth(
    frequency_hz=np.array([10.0, 17.0]),
    damping_ratio=np.array([0.01, 0.01]),
    shapes=np.array([[1.0, 0.6], [-0.5, 1.0]]),
)


def with_sines(series, *sines_hz, level_db):
    """Each sine with an RMS of that many dB over the RMS of each channel, in another phase on each."""
    time_s, rms = series.times_s(), np.std(series.values, axis=1, keepdims=True)
    phases = np.arange(len(series.channels))[:, None]
    values = np.array(series.values)
    for sine_hz in sines_hz:
        values += np.sqrt(2) * 10 ** (level_db / 20) * rms * np.sin(2 * np.pi * sine_hz * time_s + phases)
    return series_of(*values, rate_hz=series.sample_rate_hz)


def ambient(seed, *, truth=TWO_MODES, cycles=6000):
    return ambient_record(truth, cycles=cycles, rng=np.random.default_rng(seed), noise=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.01, 0.003])
@pytest.mark.parametrize("cycles", [300, pytest.param(1500, marks=pytest.mark.nightly)])
def test_modes_driven_by_noise_are_no_harmonics(damping, cycles):
    truth = chain(damping=damping)
    flagged = sum(bool(machine_harmonics(ambient(seed, truth=truth, cycles=cycles))) for seed in range(8))
    # A hundredth of the records may; two of eight would happen once in four hundred times.
    assert flagged <= 1


@pytest.mark.parametrize("level_db", [0, -10, -20])
@pytest.mark.parametrize("sine_hz", [4.3, 13.1, 25.0])
def test_a_sine_apart_from_modes_is_found(level_db, sine_hz):
    found = machine_harmonics(with_sines(ambient(1), sine_hz, level_db=level_db))
    assert len(found) == 1
    # A twentieth of a line of the record of 600 s.
    assert found[0].frequency_hz == pytest.approx(sine_hz, abs=0.05 / 600)
    assert "kurtosis" in found[0].reason
    assert "damping near zero" in found[0].reason


@pytest.mark.parametrize(
    ("level_db", "away_hz"),
    # The first mode's half-power bandwidth is 0.2 Hz.
    [(0, 0.0), (0, 0.05), (-10, 0.4), (-20, 1.0)],
)
def test_a_sine_next_to_a_mode_is_found_and_the_mode_is_not_taken_for_it(level_db, away_hz):
    found = machine_harmonics(with_sines(ambient(2), 10.0 + away_hz, level_db=level_db))
    assert [harmonic.frequency_hz for harmonic in found] == pytest.approx([10.0 + away_hz], abs=0.5 / 600)


def test_a_machine_whose_speed_wanders_is_found_by_its_kurtosis():
    series = ambient(3)
    time_s = series.times_s()
    rng = np.random.default_rng(4)
    # A random walk of the phase: a line 0.1 Hz wide, 60 times the resolution of the record.
    phase = np.cumsum(rng.standard_normal(time_s.size)) * np.sqrt(2 * np.pi * 0.1 / series.sample_rate_hz)
    machine = np.sqrt(2) * np.std(series.values) * np.sin(2 * np.pi * 25.0 * time_s + phase)
    found = machine_harmonics(series_of(*(series.values + machine), rate_hz=series.sample_rate_hz))
    assert len(found) == 1
    assert found[0].frequency_hz == pytest.approx(25.0, abs=0.3)
    assert "kurtosis" in found[0].reason
    assert "damping near zero" not in found[0].reason


def test_multiples_of_a_speed_are_named_together():
    found = machine_harmonics(with_sines(ambient(5), 6.25, 12.5, 18.75, 23.0, level_db=-10))
    assert [harmonic.frequency_hz for harmonic in found] == pytest.approx([6.25, 12.5, 18.75, 23.0], abs=0.05 / 600)
    assert ["times" in harmonic.reason for harmonic in found] == [False, True, True, False]
    assert found[2].reason.endswith("; 3 times 6.25 Hz")


def test_only_candidates_and_the_band_are_looked_at():
    series = with_sines(ambient(6), 12.5, 25.0, level_db=0)
    assert len(machine_harmonics(series)) == 2
    assert machine_harmonics(series, candidates_hz=[10.0, 17.0]) == ()
    assert len(machine_harmonics(series, candidates_hz=[10.0, 24.999])) == 1
    assert [round(line.frequency_hz, 2) for line in machine_harmonics(series, band_hz=(20.0, 30.0))] == [25.0]


def test_a_record_too_short_for_its_frequency_tells_nothing():
    # A mode with 0.1 % damping at 0.5 Hz rings longer than this record: so does a sine.
    time_s = np.arange(6000) / 100
    slow = series_of(np.sin(2 * np.pi * 0.5 * time_s) + np.random.default_rng(7).standard_normal(6000))
    assert machine_harmonics(slow) == ()
    assert len(machine_harmonics(slow, least_damping=0.1)) == 1


def test_stretches_with_invalid_samples_are_left_out():
    series = with_sines(ambient(8), 25.0, level_db=-10)
    valid = np.ones(series.values.shape, dtype=bool)
    valid[:, 20_000:20_100] = False
    holed = series_of(*np.where(valid, series.values, np.nan), rate_hz=series.sample_rate_hz, valid=valid)
    assert [harmonic.frequency_hz for harmonic in machine_harmonics(holed)] == pytest.approx([25.0], abs=1e-3)


def test_a_dead_channel_hides_nothing_and_adds_nothing():
    series = with_sines(ambient(9), 25.0, level_db=-10)
    dead = series_of(np.zeros(series.samples), *series.values, rate_hz=series.sample_rate_hz)
    assert [harmonic.frequency_hz for harmonic in machine_harmonics(dead)] == pytest.approx([25.0], abs=1e-4)
    assert machine_harmonics(series_of(np.zeros(10_000))) == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"false_alarm": 0.0}, "false_alarm is 0.0"),
        ({"least_damping": 1.0}, "least_damping is 1.0"),
        ({"band_hz": (5.0, 2.0)}, "band_hz is"),
    ],
)
def test_arguments_out_of_range_are_refused(options, message):
    with pytest.raises(EstimateError, match=message):
        machine_harmonics(series_of(np.zeros(10_000)), **options)


def test_short_or_unsound_records_are_refused():
    with pytest.raises(EstimateError, match="511 valid samples in a row are too few to tell sines from modes"):
        machine_harmonics(series_of(np.zeros(511)))
    values = np.zeros(10_000)
    values[77] = np.nan
    with pytest.raises(EstimateError, match="channel 'a0' is nan"):
        machine_harmonics(series_of(values))


def test_the_building_under_wind_has_no_machines(shared_data):
    from chladni.io.log import open_log

    log = open_log(shared_data / "palisaden.mcap")
    series = log.read([channel.name for channel in log.channels])
    near = [harmonic.frequency_hz for harmonic in machine_harmonics(series)]
    # Its three modes are no machines.
    assert not [line for line in near if np.min(np.abs(line - np.array([1.88, 2.42, 2.69]))) < 0.1]
