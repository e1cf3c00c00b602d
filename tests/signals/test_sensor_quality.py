"""Sensor faults: each is noticed when put in, none where there is none."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.sensor_quality import SensorFault, sensor_quality
from chladni.signals.time_series import TimeSeries

RATE_HZ = 1000.0
SAMPLES = 100_000


def faults_of(
    values: NDArray[np.floating],
    *,
    unit: str = "m/s^2",
    overload: float | None = None,
    valid: Mask | None = None,
    role: str = "response",
) -> tuple[SensorFault, ...]:
    channel = Channel(name="/imu.x", unit=unit, overload=overload, role=role)  # type: ignore[arg-type]
    mask = None if valid is None else valid[None]
    return sensor_quality(
        TimeSeries(values=np.atleast_2d(values), sample_rate_hz=RATE_HZ, channels=(channel,), valid=mask)
    )


def only(faults: tuple[SensorFault, ...]) -> SensorFault:
    assert len(faults) == 1, [fault.sentence for fault in faults]
    return faults[0]


def seconds() -> Real:
    return np.arange(SAMPLES) / RATE_HZ


def noise(seed: int = 1, samples: int = SAMPLES) -> Real:
    return np.random.default_rng(seed).normal(size=samples)


def smooth(seed: int = 1) -> Real:
    filtered: Real = lfilter(*butter(2, 0.1), noise(seed))
    return filtered / np.std(filtered)


def impacts(width: int) -> Real:
    signal = 1e-3 * noise(2)
    for start in range(1000, SAMPLES - 100, 9000):
        signal[start : start + width] += np.sin(np.pi * (np.arange(width) + 0.5) / width)
    return signal


def ringing(background: float) -> Real:
    decay = np.exp(-np.arange(9000) / 300) * np.sin(2 * np.pi * 0.31 * np.arange(9000))
    signal = background * noise(3)
    for start in range(1000, SAMPLES - 9000, 9000):
        signal[start : start + 9000] += decay
    return signal


def multisine(crest_lines: int, seed: int) -> Real:
    lines = np.zeros(4097, dtype=complex)
    lines[1:crest_lines] = np.exp(2j * np.pi * np.random.default_rng(seed).random(crest_lines - 1))
    return np.tile(np.fft.irfft(lines), 12)


def bursts_of_noise(quiet: float) -> Real:
    on = (np.arange(SAMPLES) // 5000) % 2 == 1
    return np.where(on, 1.0, quiet) * noise(4)


SOUND = {
    "noise": noise(),
    "single precision": noise().astype(np.float32),
    "uniform noise": np.random.default_rng(5).uniform(-1, 1, SAMPLES),
    "heavy tails": np.random.default_rng(6).standard_t(5, SAMPLES),
    "coloured noise": smooth(),
    "quantised noise": np.round(noise() * 20) / 20,
    "quantised coloured noise": np.round(smooth() * 100) / 100,
    "quantised growing noise": np.round(200 * noise() * np.linspace(0, 1, SAMPLES)),
    "quantised bursts": np.round(50 * bursts_of_noise(0.04)),
    "quantised ringing": np.round(2000 * ringing(1e-3)),
    "growing noise": noise() * np.linspace(0, 1, SAMPLES),
    "decaying noise": noise() * np.exp(-seconds() / 10),
    "bursts out of silence": bursts_of_noise(0.0),
    "bursts out of noise": bursts_of_noise(0.04),
    "offset": noise() * 1e-3 + 9.81,
    "sine": np.sin(2 * np.pi * 3.3 * seconds()),
    "sine on the sampling grid": np.sin(2 * np.pi * 10 * seconds()),
    "sine of eight samples": np.sin(2 * np.pi * 125 * seconds()),
    "twelve-bit sine": np.round(2000 * np.sin(2 * np.pi * 3.3 * seconds())),
    "slow eight-bit sine": np.round(100 * np.sin(2 * np.pi * 0.1 * seconds())),
    "sweep": np.sin(2 * np.pi * (seconds() + 2 * seconds() ** 2)),
    "square": np.sign(np.sin(2 * np.pi * 3.3 * seconds())),
    "triangle": np.abs((3.3 * seconds()) % 1 - 0.5),
    "binary noise": np.sign(noise()),
    "pulses of a command": np.repeat(np.random.default_rng(7).random(500) > 0.8, 200) * 5.0,
    "staircase": np.repeat(np.random.default_rng(8).integers(0, 30, 100), 1000).astype(float),
    "multisine": multisine(4000, 9),
    "few lines": multisine(6, 10),
    "wide impacts": impacts(40),
    "narrow impacts": impacts(8),
    "ringing": ringing(1e-3),
    "ringing in silence": ringing(0.0),
}


@pytest.mark.parametrize("name", SOUND)
def test_what_is_sound_is_left_alone(name: str) -> None:
    assert faults_of(SOUND[name]) == ()


@given(seed=st.integers(0, 2**32 - 1), step=st.sampled_from([0.0, 1e-3, 0.1]), pole=st.floats(0.0, 0.99))
def test_no_false_alarm_on_any_noise(seed: int, step: float, pole: float) -> None:
    coloured = lfilter([1.0], [1.0, -pole], noise(seed, 20_000))
    assert faults_of(np.round(coloured / step) * step if step else coloured) == ()


def test_no_false_alarm_in_ten_million_samples() -> None:
    assert faults_of(noise(11, 10_000_000).astype(np.float32)) == ()


@pytest.mark.parametrize(
    ("source", "level"),
    [("sine", 0.5), ("sine", 0.99), ("coloured noise", 0.5), ("coloured noise", 0.9), ("sweep", 0.5), ("sweep", 0.9)],
)
def test_a_clipped_signal_is_noticed_and_its_samples_counted(source: str, level: float) -> None:
    limit = level * SOUND[source].max()
    clipped = np.clip(SOUND[source], -limit, limit)
    fault = only(faults_of(clipped))
    there = np.flatnonzero(np.abs(clipped) == limit)
    assert fault.kind == "clipped"
    # Both ends are told apart: one that is touched but briefly isn't counted.
    assert fault.count == there.size or (source == "coloured noise" and fault.count >= 0.4 * there.size)
    assert fault.first_s >= there[0] / RATE_HZ
    assert fault.channel == "/imu.x"
    assert "larger range" in fault.sentence


def test_clipping_on_one_side() -> None:
    clipped = np.minimum(SOUND["sine"], 0.8)
    fault = only(faults_of(clipped))
    assert fault.count == np.count_nonzero(clipped == 0.8)


def test_only_the_end_that_is_cut_off_is_named() -> None:
    fault = only(faults_of(np.minimum(SOUND["sine"], 0.8)))
    assert fault.sentence.startswith(
        f"/imu.x: is cut off at 0.8 m/s^2 in {fault.count} samples between {fault.first_s:.4g} and "
        f"{fault.last_s:.4g} s; use a larger range, "
    )
    ranged = only(faults_of(np.minimum(SOUND["sine"], 0.8), overload=0.8))
    assert ranged.what == "reaches its range of 0.8 m/s^2"


@pytest.mark.parametrize("samples", [3, 100, 50_000, 99_900])
@pytest.mark.parametrize("step", [0.0, 1 / 128])
@pytest.mark.parametrize("level", [-16.0, 16.0])
def test_a_sensor_at_its_rail_from_the_first_sample_on(samples: int, step: float, level: float) -> None:
    values = noise() if step == 0 else np.round(noise() / step) * step
    values[:samples] = level
    fault = only(faults_of(values))
    assert (fault.kind, fault.count) == ("clipped", samples)
    assert (fault.first_s, fault.last_s) == (0.0, (samples - 1) / RATE_HZ)
    assert f"in {samples} samples between 0 and {(samples - 1) / RATE_HZ:.4g} s" in fault.sentence
    # The same at the end of the record.
    ended = only(faults_of(values[::-1]))
    assert (ended.kind, ended.count) == ("clipped", samples)
    assert ended.first_s == (SAMPLES - samples) / RATE_HZ
    assert ended.last_s == (SAMPLES - 1) / RATE_HZ


def test_a_sensor_that_comes_back_from_its_rail() -> None:
    # An amplifier recovers from an overload in half a second, with the vibration on top.
    recovering = np.minimum(16.0, 40 * np.exp(-2 * seconds()) + noise())
    fault = only(faults_of(recovering))
    there = np.flatnonzero(recovering == 16.0)
    assert (fault.count, fault.first_s, fault.last_s) == (there.size, 0.0, there[-1] / RATE_HZ)


def test_what_begins_at_rest_is_not_at_its_rail() -> None:
    time_s, rest_s = seconds(), 20.0
    after = np.clip(time_s - rest_s, 0, None)
    share = np.clip(after / 60, 0, 1)
    made = {
        "a swing let go": np.cos(2 * np.pi * 0.5 * after),
        "a point to point motion": 10 * share**3 - 15 * share**4 + 6 * share**5 - 1,
        "a ramp from rest": after - 1.0,
        "a speed that runs out": np.exp(-0.1 * after),
        "a step of a command": np.where(after > 0, -1.0, 1.0),
        "a fall": 3000 - 9.81 * np.minimum(after, 20) ** 2 / 2,
    }
    for name, values in made.items():
        assert faults_of(values) == (), name


def test_a_record_at_its_named_range_throughout_is_clipped_not_dead() -> None:
    fault = only(faults_of(np.full(1000, 5.0), unit="V", overload=5.0))
    assert (fault.kind, fault.count) == ("clipped", 1000)
    assert only(faults_of(np.full(1000, 5.0), unit="V")).kind == "dead"


def test_one_sample_is_told_in_the_singular() -> None:
    values = noise()
    values[5000] += 80.0
    assert "leaps away and back in 1 sample at 5 s;" in only(faults_of(values)).sentence


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_quantity_of_one_sign_that_rests_at_zero_is_not_clipped(sign: float) -> None:
    # A pump that is switched off: its speed leaps to zero, and there is no speed below.
    speed = 1800 + 20 * noise(15, 20_000)
    speed[(np.arange(20_000) % 1000) < 60] = 0.0
    assert faults_of(sign * speed) == ()


def test_three_equal_samples_at_an_end_are_chance_where_every_fourth_repeats() -> None:
    # A controller is read faster than it measures.
    rng = np.random.default_rng(16)
    level = np.round(50 + 5 * np.sin(np.arange(3000) / 100) + 0.5 * rng.normal(size=3000), 1)
    level = np.repeat(level, 1 + (rng.random(3000) < 1 / 3))
    low = level.argmin()
    level[low - 1 : low + 5] = level[low] + np.array([0.6, 0.5, -0.1, -0.1, -0.1, 0.6])
    assert faults_of(level) == ()
    for place in range(500, 2500, 100):
        level[place : place + 3] = level[low] - 5.0
    assert faults_of(level)[0].kind == "clipped"


def test_three_overloaded_samples_of_one_hit_are_enough() -> None:
    hit = impacts(40)
    hit[1018:1021] = 20.0
    fault = only(faults_of(hit, unit="N"))
    assert (fault.kind, fault.count, fault.first_s) == ("clipped", 3, 1.018)


def test_a_known_range_finds_clipping_without_a_plateau() -> None:
    fault = only(faults_of(noise(), overload=3.0))
    assert fault.kind == "clipped"
    assert fault.count == np.count_nonzero(np.abs(noise()) >= 0.999 * 3.0)
    assert faults_of(noise(), overload=30.0) == ()


def test_a_motion_that_rests_at_its_end_is_not_clipped() -> None:
    # Minimum-jerk travel there and back with a rest of the same length at either end.
    phase = np.clip((np.arange(SAMPLES) % 2000) / 1000, 0, 1)
    travel = 10 * phase**3 - 15 * phase**4 + 6 * phase**5
    there = (np.arange(SAMPLES) // 2000) % 2 == 0
    assert faults_of(np.where(there, travel, 1 - travel)) == ()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros(500), "is 0 throughout"),
        (np.full(500, 3.3), "is 3.3 m/s^2 throughout"),
        (9.81 + 1e-3 * (noise(12, 500) > 0), "last digit"),
    ],
)
def test_a_dead_sensor(values: Real, words: str) -> None:
    fault = only(faults_of(values))
    assert (fault.kind, fault.count, fault.first_s) == ("dead", 500, 0.0)
    assert words in fault.sentence


def test_the_range_tells_that_a_digit_around_zero_is_dead() -> None:
    toggling = 1e-3 * (noise(13, 500) > 0)
    assert faults_of(toggling) == ()
    assert only(faults_of(toggling, overload=500.0)).kind == "dead"


@pytest.mark.parametrize("held", ["zero", "last value"])
def test_dropouts_in_a_moving_signal(held: str) -> None:
    values = 3 + smooth() + 0.05 * noise(14)
    for start, length in ((3000, 50), (70_000, 20)):
        values[start : start + length] = 0.0 if held == "zero" else values[start - 1]
    fault = only(faults_of(values))
    assert fault.kind == "dropouts"
    assert fault.count == 70 + (0 if held == "zero" else 2), "a held value began with a true sample"
    assert fault.first_s == (3.0 if held == "zero" else 2.999)
    assert "transmission" in fault.sentence


def test_one_message_that_is_lost_is_noticed_where_no_value_repeats() -> None:
    values = noise(15)
    values[500:503] = values[499]
    assert only(faults_of(values)).count == 4


def test_a_few_equal_samples_are_chance_where_every_tenth_repeats() -> None:
    values = np.round(3 * noise(16))
    values[500:503] = values[499]
    assert faults_of(values) == ()


@pytest.mark.parametrize("width", [1, 2, 3])
def test_spikes(width: int) -> None:
    values = noise()
    for start in (5000, 60_000, 90_000):
        values[start : start + width] += 80.0
    values[70_000 : 70_000 + width] -= 200.0
    fault = only(faults_of(values))
    assert fault.kind == "spikes"
    assert fault.count == 4 * width
    assert fault.first_s == 5.0
    assert "connectors" in fault.sentence


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_faults_are_the_same_up_to_the_largest_number(dtype: type) -> None:
    signal = noise().astype(dtype)
    for place in range(5000, SAMPLES, 9000):
        signal[place] = 40 * (-1) ** (place // 1000)
        signal[place + 3000 : place + 3012] = 0
    # A power of two changes no digit; leaps of 80 are then beyond the largest number.
    scale = 2.0 ** (np.finfo(dtype).maxexp - 6)
    kinds = [(fault.kind, fault.count) for fault in faults_of(signal)]
    assert [kind for kind, _ in kinds] == ["dropouts", "spikes"]
    assert [(fault.kind, fault.count) for fault in faults_of(signal * dtype(scale))] == kinds


def test_what_is_wider_than_three_samples_is_no_spike() -> None:
    values = noise()
    values[5000:5004] += 80.0
    assert faults_of(values) == ()


@pytest.mark.parametrize(("unit", "role"), [("N", "response"), ("V", "reference")])
def test_a_short_hit_on_the_hammer_is_no_spike(unit: str, role: str) -> None:
    assert only(faults_of(impacts(2))).kind == "spikes"
    assert faults_of(impacts(2), unit=unit, role=role) == ()


def test_not_a_number() -> None:
    values = noise()
    values[[50, 700, 9000]] = np.nan, np.inf, -np.inf
    fault = only(faults_of(values))
    assert (fault.kind, fault.count, fault.first_s) == ("not-a-number", 3, 0.05)


def test_missing_samples_are_no_fault_but_infinity_is() -> None:
    values, valid = noise(), np.ones(SAMPLES, dtype=bool)
    valid[1000:2000] = False
    values[1000:2000] = np.nan
    assert faults_of(values, valid=valid) == ()
    values[1500] = np.inf
    assert only(faults_of(values, valid=valid)).count == 1
    values[1500], values[3000] = np.nan, np.nan
    fault = only(faults_of(values, valid=valid))
    assert (fault.kind, fault.count, fault.first_s) == ("not-a-number", 1, 3.0)


def test_times_count_missing_samples_too() -> None:
    values, valid = noise(), np.ones(SAMPLES, dtype=bool)
    valid[1000:2000] = False
    values[1000:2000] = np.nan
    values[5000] += 90.0
    assert only(faults_of(values, valid=valid)).first_s == 5.0


def test_coarse_steps() -> None:
    fault = only(faults_of(np.round(0.8 * smooth())))
    assert fault.kind == "coarse"
    assert "steps of 1 m/s^2" in fault.sentence


@pytest.mark.parametrize("samples", [0, 1, 2, 15])
def test_too_few_samples_say_nothing(samples: int) -> None:
    assert faults_of(np.zeros((1, samples))) == ()


def test_a_channel_without_unit_is_told_in_bare_numbers() -> None:
    assert "steps of 1;" in only(faults_of(np.round(0.8 * smooth()), unit="1")).sentence
    assert "at -0.5 and 0.5 in " in only(faults_of(SOUND["sine"].clip(-0.5, 0.5), unit="1")).sentence


def test_faults_come_by_channel() -> None:
    values = np.stack((noise(), np.zeros(SAMPLES), SOUND["sine"].clip(-0.5, 0.5)))
    channels = tuple(Channel(name=name) for name in "abc")
    found = sensor_quality(TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels))
    assert [(fault.channel, fault.kind) for fault in found] == [("b", "dead"), ("c", "clipped")]


def test_measured_logs(shared_data: Path) -> None:
    from chladni.io.log import open_log

    hammer = only(sensor_quality(open_log(shared_data / "hammer.mcap").read()))
    assert (hammer.kind, hammer.count) == ("clipped", 3)
    assert hammer.first_s < 1.0, "the overloaded record is the first"
    for name in ("palisaden", "silverbox", "emps", "mr_1A"):
        for series in open_log(shared_data / f"{name}.mcap").read_groups():
            assert sensor_quality(series) == ()
    measuring = ["/shaker.wrench.force.z", "/wing_rail.accel.linear.z", "/payload_rail.accel.linear.z"]
    assert sensor_quality(open_log(shared_data / "f16_level7.mcap").read(measuring)) == ()
