import numpy as np
import pytest

from chladni.models.excitations.excitation import Excitation
from chladni.models.excitations.impact import Impact
from chladni.models.excitations.multisine import Multisine
from chladni.models.excitations.random_noise import RandomNoise
from chladni.models.excitations.recorded import Recorded
from chladni.models.excitations.step import Step
from chladni.models.excitations.swept_sine import SweptSine
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, ModelError
from chladni.signals.time_series import TimeSeries

RATE_HZ = 1000.0


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def series(values: np.ndarray, *, valid: np.ndarray | None = None) -> TimeSeries:
    return TimeSeries(
        values=values[None],
        sample_rate_hz=RATE_HZ,
        channels=(Channel(name="/f.wrench.force.x", unit="N"),),
        valid=valid,
    )


def ten_zeros() -> Recorded:
    return Recorded(series=series(np.zeros(10)), channel="/f.wrench.force.x")


EVERY: tuple[Excitation, ...] = (
    RandomNoise(rms=2.0, band_hz=(5.0, 200.0)),
    Multisine(rms=2.0, period_s=0.5),
    SweptSine(start_hz=1.0, end_hz=100.0),
    Step(size=3.0, at_s=0.1),
    Impact(peak=50.0, width_s=0.005),
    Recorded(series=series(np.arange(3000.0)), channel="/f.wrench.force.x"),
)


@pytest.mark.parametrize("excitation", EVERY, ids=lambda excitation: type(excitation).__name__)
@pytest.mark.parametrize("count", [1500, 1501])
def test_every_excitation_gives_as_many_samples_as_asked_and_the_same_for_the_same_seed(
    excitation: Excitation, count: int
) -> None:
    first, second = (excitation.samples(count, RATE_HZ, rng()) for _ in range(2))
    assert first.shape == (count,)
    assert first.dtype == np.float64
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("count", [4096, 4097])
def test_noise_has_its_rms_and_nothing_outside_its_band(count: int) -> None:
    noise = RandomNoise(rms=3.0, band_hz=(50.0, 120.0)).samples(count, RATE_HZ, rng())
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(3.0, rel=1e-12)
    frequency_hz = np.fft.rfftfreq(count, 1 / RATE_HZ)
    outside = (frequency_hz < 49.9) | (frequency_hz > 120.1)
    spectrum = np.abs(np.fft.rfft(noise))
    assert spectrum[outside].max() < 1e-10 * spectrum.max()
    # Gaussian: the fourth moment is three times the squared second, with a deviation of sqrt(24/n) for n free values.
    free = 2 * np.count_nonzero(~outside)
    assert np.mean(noise**4) / 81.0 == pytest.approx(3.0, abs=5 * np.sqrt(24 / free))


def test_a_multisine_repeats_and_excites_only_its_odd_lines_but_one_in_four() -> None:
    excitation = Multisine(rms=1.5, period_s=1.0, band_hz=(10.0, 100.0))
    x = excitation.samples(3000, RATE_HZ, rng())
    np.testing.assert_array_equal(x[:1000], x[1000:2000])
    assert np.sqrt(np.mean(x[:1000] ** 2)) == pytest.approx(1.5, rel=1e-12)
    amplitude = np.abs(np.fft.rfft(x[:1000]))
    excited = np.flatnonzero(amplitude > 1e-9 * amplitude.max())
    np.testing.assert_array_equal(excited, excitation.excited_lines(RATE_HZ, rng()))
    np.testing.assert_allclose(amplitude[excited], amplitude.max(), rtol=1e-9)
    odd = np.arange(11, 100, 2)
    assert set(excited) <= set(odd)
    left_out = np.setdiff1d(odd, excited)
    groups = odd.size // 4
    # One in each group of four neighbours.
    np.testing.assert_array_equal((np.searchsorted(odd, left_out)) // 4, np.arange(groups))


@pytest.mark.parametrize(("lines", "expected"), [("full", np.arange(10, 101)), ("odd", np.arange(11, 100, 2))])
def test_other_choices_of_lines(lines: str, expected: np.ndarray) -> None:
    excitation = Multisine(period_s=1.0, band_hz=(10.0, 100.0), lines=lines)  # type: ignore[arg-type]  # both are words of it
    np.testing.assert_array_equal(excitation.excited_lines(RATE_HZ, rng()), expected)


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_a_sweep_begins_at_zero_and_crosses_zero_as_often_as_its_frequencies_say(law: str) -> None:
    sweep = SweptSine(amplitude=2.0, start_hz=5.0, end_hz=45.0, law=law)  # type: ignore[arg-type]  # both are words of it
    x = sweep.samples(20_000, RATE_HZ, rng())
    assert abs(x[0]) < 1e-12
    assert x[1] > 0
    assert np.abs(x).max() == pytest.approx(2.0, rel=1e-2)
    mean_hz = 25.0 if law == "linear" else 40.0 / np.log(9.0)
    # Two crossings a cycle, and the first zero itself isn't crossed.
    assert np.count_nonzero(np.diff(np.signbit(x[1:]))) == pytest.approx(2 * mean_hz * 20.0, abs=2)


def test_a_step_begins_at_the_sample_of_its_time() -> None:
    x = Step(size=-2.0, at_s=0.003).samples(6, RATE_HZ, rng())
    np.testing.assert_array_equal(x, [0, 0, 0, -2, -2, -2])


def test_impacts_are_half_sines_that_come_again() -> None:
    x = Impact(peak=10.0, width_s=0.01, at_s=0.1, every_s=0.5).samples(1200, RATE_HZ, rng())
    assert np.flatnonzero(x > 9.999).tolist() == [105, 605, 1105]
    # Area of a half sine: 2/pi of peak times width; the sum of samples is within the trapezoidal rule's error.
    assert x[:500].sum() / RATE_HZ == pytest.approx(2 / np.pi * 10.0 * 0.01, rel=1e-2)
    assert np.all(x[:100] == 0)


def test_a_recorded_signal_is_given_sample_for_sample() -> None:
    recorded = Recorded(series=series(np.arange(10.0)), channel="/f.wrench.force.x")
    np.testing.assert_array_equal(recorded.samples(4, RATE_HZ, rng()), [0, 1, 2, 3])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RandomNoise(rms=0.0), "rms = 0.0"),
        (lambda: RandomNoise(rms=float("nan")), "rms = nan"),
        (lambda: RandomNoise(band_hz=(10.0, 600.0)).samples(100, RATE_HZ, rng()), "above 1200 Hz"),
        (lambda: RandomNoise(band_hz=(30.0, 10.0)).samples(100, RATE_HZ, rng()), "must rise"),
        (lambda: RandomNoise(band_hz=(10.1, 10.2)).samples(100, RATE_HZ, rng()), "no line between"),
        (lambda: Multisine(period_s=0.0), "period_s"),
        (lambda: Multisine(period_s=1.0, lines="even"), "none of full"),  # type: ignore[arg-type]  # a wrong word
        (lambda: Multisine(period_s=0.12345).samples(100, RATE_HZ, rng()), "whole number"),
        (lambda: Multisine(period_s=1.0, band_hz=(9.5, 10.5)).samples(100, RATE_HZ, rng()), "no odd line"),
        (lambda: SweptSine(start_hz=1.0, end_hz=500.0).samples(100, RATE_HZ, rng()), "above 1000 Hz"),
        (lambda: SweptSine(start_hz=0.0, end_hz=5.0), "start_hz"),
        (lambda: SweptSine(start_hz=1.0, end_hz=5.0, law="cubic"), "none of linear"),  # type: ignore[arg-type]  # a wrong word
        (lambda: Step(size=float("inf")), "size"),
        (lambda: Impact(width_s=0.001).samples(100, RATE_HZ, rng()), "two samples"),
        (lambda: Impact(width_s=0.1, every_s=0.1), "leave room"),
        (lambda: ten_zeros().samples(11, RATE_HZ, rng()), "11 needed"),
        (lambda: ten_zeros().samples(5, 500.0, rng()), "recorded at 1000 Hz"),
    ],
)  # fmt: skip
def test_impossible_requests_are_refused_with_the_number_that_is_wrong(make: object, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        make()  # type: ignore[operator]  # each is a function


def test_a_gap_in_a_recorded_signal_is_told_with_its_time() -> None:
    values = np.zeros(10)
    values[4] = np.nan
    with pytest.raises(ModelError, match=r"no sample at 0\.004 s"):
        Recorded(series=series(values), channel="/f.wrench.force.x").samples(8, RATE_HZ, rng())
    valid = np.ones((1, 10), dtype=bool)
    valid[0, 6] = False
    with pytest.raises(ModelError, match=r"no sample at 0\.006 s"):
        Recorded(series=series(np.zeros(10), valid=valid), channel="/f.wrench.force.x").samples(8, RATE_HZ, rng())


def test_a_channel_that_is_not_recorded_is_named() -> None:
    with pytest.raises(EstimateError, match="no channel 'nowhere'"):
        Recorded(series=series(np.zeros(10)), channel="nowhere").samples(8, RATE_HZ, rng())
