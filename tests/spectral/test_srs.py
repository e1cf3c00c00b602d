"""Shock response spectra against closed forms of oscillators under a half sine, and Smallwood's own coefficients."""

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.srs import srs
from tests.spectral.made_signals import blocks, noise, part, series

RATE_HZ = 20_000.0
PULSE_S, HEIGHT = 0.011, 500.0
FREQUENCY_HZ = np.geomspace(5.0, 2000.0, 25)


def pulse(*, rate_hz=RATE_HZ, seconds=0.2, offset=0.0, late_s=0.0):
    t = np.arange(round(seconds * rate_hz)) / rate_hz - late_s
    return offset + np.where((t >= 0) & (t <= PULSE_S), HEIGHT * np.sin(np.pi * t / PULSE_S), 0.0)


def half_sine_response(natural_hz, q):
    """Relative displacement, and absolute acceleration, of an oscillator under a half sine, at dense times.

    The steady state under a sine and a free decay that makes the start one at rest, and after the pulse a free decay
    from where it left the oscillator: textbook solutions, each exact.
    """
    omega, zeta, drive = 2 * np.pi * natural_hz, 1 / (2 * q), np.pi / PULSE_S
    pole = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    during = np.linspace(0, PULSE_S, 5000)
    after = np.linspace(0, 1.2 / natural_hz, 5000)
    steady = -HEIGHT / (omega**2 - drive**2 + 2j * zeta * omega * drive)

    def free(t, place, speed):
        """Oscillate from a place and a speed; give both over time."""
        weight = (speed - np.conj(pole) * place) / (2j * pole.imag)
        motion = weight * np.exp(pole * t)
        return 2 * motion.real, 2 * (pole * motion).real

    forced = steady * np.exp(1j * drive * during)
    place, speed = forced.imag, (1j * drive * forced).imag
    begin = free(during, -place[0], -speed[0])
    place, speed = place + begin[0], speed + begin[1]
    ring = free(after, place[-1], speed[-1])
    place, speed = np.append(place, ring[0]), np.append(speed, ring[1])
    return place, -(2 * zeta * omega * speed + omega**2 * place)


def test_named_channels_are_selected_with_their_rows():
    x = noise(3, 1000) + np.arange(3.0)[:, np.newaxis]
    chosen = srs(series(x, rate_hz=RATE_HZ)).select(["c", "a"])
    alone = srs(series(x, rate_hz=RATE_HZ).select(["c", "a"]))
    assert chosen.channels == alone.channels
    for name in ("positive", "negative", "offset"):
        np.testing.assert_array_equal(getattr(chosen, name), getattr(alone, name))


@pytest.mark.parametrize("q", [10.0, 50.0])
def test_a_half_sine_has_the_spectrum_of_the_closed_form(q):
    found = srs(series(pulse(), rate_hz=RATE_HZ), q=q, frequencies_hz=FREQUENCY_HZ)
    truth = [half_sine_response(natural_hz, q)[1] for natural_hz in FREQUENCY_HZ]
    np.testing.assert_allclose(found.positive[0], [one.max() for one in truth], rtol=0.01)
    # Of the kick back, too, in parts of the highest response at that frequency.
    apart = found.negative[0] + np.array([one.min() for one in truth])
    assert np.abs(apart / found.maximax[0]).max() < 0.01
    assert found.channels[0].unit == "m/s^2"


@pytest.mark.parametrize(
    ("quantity", "unit", "power"), [("relative-displacement", "m", 0), ("pseudo-velocity", "m/s", 1)]
)
def test_displacement_and_pseudo_velocity_are_those_of_the_closed_form(quantity, unit, power):
    found = srs(series(pulse(), rate_hz=RATE_HZ), quantity=quantity, frequencies_hz=FREQUENCY_HZ)
    truth = [np.abs(half_sine_response(natural_hz, 10.0)[0]).max() for natural_hz in FREQUENCY_HZ]
    np.testing.assert_allclose(found.maximax[0], truth * (2 * np.pi * FREQUENCY_HZ) ** power, rtol=0.01)
    assert found.channels[0].unit == unit


def test_slow_oscillators_tell_the_change_of_velocity_and_stiff_ones_the_peak():
    found = srs(series(pulse(), rate_hz=RATE_HZ), q=1e6, quantity="pseudo-velocity", frequencies_hz=[0.5, 1.0])
    np.testing.assert_allclose(found.maximax[0], HEIGHT * 2 * PULSE_S / np.pi, rtol=1e-3)
    stiff = srs(series(pulse(), rate_hz=RATE_HZ), frequencies_hz=[5000.0])
    assert stiff.maximax[0, 0] == pytest.approx(HEIGHT, rel=0.01)


def test_at_a_high_rate_it_is_smallwoods_recursion():
    x = noise(1, 20_000)[0]
    x[0] = 0.0
    natural_hz = 200.0
    # Smallwood 1981: E, K, C, S' as there; absolute acceleration, zeta 5 %.
    angle = 2 * np.pi * natural_hz / RATE_HZ
    decay, turn = np.exp(-0.05 * angle), angle * np.sqrt(1 - 0.05**2)
    c, s = decay * np.cos(turn), decay * np.sin(turn) / turn
    response = lfilter([1 - s, 2 * (s - c), decay**2 - s], [1, -2 * c, decay**2], np.append(x, np.zeros(100)))
    found = srs(series(x, rate_hz=RATE_HZ), frequencies_hz=[natural_hz])
    assert found.positive[0, 0] == pytest.approx(response.max(), rel=1e-9)
    assert found.negative[0, 0] == pytest.approx(-response.min(), rel=1e-9)


def test_a_period_of_few_samples_is_filled_in():
    # 2 kHz sampled at 8 kHz: the half sine itself is well sampled, the oscillator isn't.
    coarse = srs(series(pulse(rate_hz=8000.0, late_s=0.05), rate_hz=8000.0), frequencies_hz=[400.0, 2000.0])
    truth = [half_sine_response(natural_hz, 10.0)[1].max() for natural_hz in (400.0, 2000.0)]
    np.testing.assert_allclose(coarse.maximax[0], truth, rtol=0.01)
    assert "above 800 Hz" in coarse.notes[0]


def test_gravity_is_taken_off_or_kept_as_asked():
    with_gravity = series(pulse(offset=9.81), rate_hz=RATE_HZ)
    plain = srs(series(pulse(), rate_hz=RATE_HZ))
    found = srs(with_gravity)
    assert found.offset[0] == 9.81
    np.testing.assert_allclose(found.maximax, plain.maximax, rtol=1e-9)
    noisy = series(pulse(offset=9.81) + 0.1 * noise(1, 4000), rate_hz=RATE_HZ)
    assert srs(noisy, offset="median").offset[0] == pytest.approx(9.81, abs=0.1 * 1.25 / np.sqrt(4000) * 4)
    step = srs(
        series(np.full(8000, 9.81), rate_hz=RATE_HZ),
        quantity="relative-displacement",
        frequencies_hz=[100.0],
        offset="keep",
    )
    # An oscillator overshoots a step by exp(-pi zeta / sqrt(1 - zeta^2)).
    overshoot = np.exp(-np.pi * 0.05 / np.sqrt(1 - 0.05**2))
    assert step.maximax[0, 0] * (2 * np.pi * 100) ** 2 == pytest.approx(9.81 * (1 + overshoot), rel=1e-3)


def test_lines_stand_where_those_of_every_record_stand():
    found = srs(series(pulse(), rate_hz=RATE_HZ), lines_an_octave=6)
    assert 5.0 <= found.frequency_hz[0] < 5.0 * 2 ** (1 / 6)
    assert found.frequency_hz[-1] == pytest.approx(2000.0)
    assert np.isclose(found.frequency_hz, 1000.0).any()
    np.testing.assert_allclose(np.diff(np.log2(found.frequency_hz)), 1 / 6)
    band = srs(series(pulse(), rate_hz=RATE_HZ), band_hz=(125.0, 500.0), lines_an_octave=1)
    np.testing.assert_allclose(band.frequency_hz, [125.0, 250.0, 500.0])


def test_nothing_is_carried_across_a_gap():
    x = np.concatenate([pulse(late_s=0.05), pulse(late_s=0.05)])
    x[3000] = np.nan
    found = srs(series(x, rate_hz=RATE_HZ), frequencies_hz=FREQUENCY_HZ)
    # The second pulse is whole.
    alone = srs(series(pulse(late_s=0.05), rate_hz=RATE_HZ), frequencies_hz=FREQUENCY_HZ)
    np.testing.assert_allclose(found.maximax, alone.maximax, rtol=1e-6)
    assert "begin anew after each gap" in found.notes[0]


def test_an_array_without_units_has_a_spectrum_of_accelerations_alone():
    bare = series(pulse(), rate_hz=RATE_HZ, units=["1"])
    assert srs(bare, frequencies_hz=[80.0]).channels[0].unit == "1"
    with pytest.raises(EstimateError, match=r"a is in 1; .* of accelerations"):
        srs(bare, quantity="pseudo-velocity")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"q": 0.5}, "q is 0.5"),
        ({"q": np.inf}, "q is inf"),
        ({"frequencies_hz": [0.0, 10.0]}, "must rise, above 0"),
        ({"frequencies_hz": [20.0, 10.0]}, "must rise"),
        ({"frequencies_hz": [10_001.0]}, "half the sample rate, 10000 Hz"),
        ({"frequencies_hz": [np.nan]}, "must rise"),
        ({"frequencies_hz": [10.0], "band_hz": (1.0, 2.0)}, "give one of them"),
        ({"band_hz": (0.0, 100.0)}, "give LOW < HIGH"),
        ({"band_hz": (1.0, 100.0), "lines_an_octave": 0}, "lines an octave"),
        ({"band_hz": (1.0, 100.0), "lines_an_octave": 100_000}, "lines an octave"),
        ({"offset": "mean"}, "none of first, median, keep"),
    ],
)
def test_what_has_no_spectrum_is_refused(options, words):
    with pytest.raises((EstimateError, SetupError), match=words):
        srs(series(pulse(), rate_hz=RATE_HZ), **options)


def test_a_series_of_nothing_or_of_little_is_refused():
    with pytest.raises(EstimateError, match="holds no channel"):
        srs(series(np.zeros((1, 100)), rate_hz=RATE_HZ).select([]))
    with pytest.raises(EstimateError, match="3 samples without a gap: too few"):
        srs(series(np.zeros(3), rate_hz=RATE_HZ))


def test_a_force_and_an_empty_channel_are_refused_by_name():
    with pytest.raises(EstimateError, match="a is in N; a shock response spectrum is of accelerations"):
        srs(series(pulse(), rate_hz=RATE_HZ, units=["N"]))
    with pytest.raises(EstimateError, match="a: nothing was measured"):
        srs(series(np.full(100, np.nan), rate_hz=RATE_HZ))


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
@pytest.mark.parametrize(
    ("theirs", "quantity"),
    [("absacce", "absolute-acceleration"), ("reldisp", "relative-displacement"), ("pvelo", "pseudo-velocity")],
)
def test_pyyeti_agrees_where_a_period_has_32_samples(theirs, quantity):
    # Above, we compute what lies between the samples, and pyYeti by its defaults does so in another way.
    yeti = pytest.importorskip("pyyeti.srs")
    rate_hz, q = 2000.0, 25.0
    lines_hz = np.geomspace(5.0, rate_hz / 33, 20)
    signal = noise(1, 4000, seed=8)[0]
    wanted = yeti.srs(
        signal, rate_hz, lines_hz, q, stype=theirs, ic="zero", rolloff="none", ppc=1, time="total", parallel="no"
    )
    found = srs(series(signal, rate_hz=rate_hz), q=q, quantity=quantity, frequencies_hz=lines_hz, offset="keep")
    np.testing.assert_allclose(found.maximax[0], np.ravel(wanted), rtol=1e-9)


@pytest.mark.parametrize("lengths", [[1, 5, 700, 3], [64]])
def test_blocks_give_what_the_whole_gives(lengths):
    rng = np.random.default_rng(2)
    valid = np.ones((3, 4000), dtype=bool)
    # Channels with gaps of their own, one shorter than what resampling looks back, and one at the very end.
    valid[0, 1500:1700], valid[0, 1704:1710], valid[1, 1600:1601], valid[2, :7], valid[2, 3995:] = (False,) * 5
    whole = series(3 + rng.standard_normal((3, 4000)), rate_hz=1000.0, valid=valid)
    asked = {"frequencies_hz": [2.0, 20.0, 55.0, 180.0, 500.0]}
    found, expected = srs(blocks(whole, lengths), **asked), srs(whole, **asked)
    for name in ("positive", "negative", "offset"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-9)
    assert found.notes == expected.notes
    # Each run alone, at rest before, tells the same.
    first, second = (
        srs(part(whole.select(["b"]), *run), offset="keep", **asked) for run in ((0, 1600), (1601, 4000))
    )
    both = srs(whole.select(["b"]), offset="keep", **asked)
    np.testing.assert_allclose(both.positive, np.maximum(first.positive, second.positive), rtol=1e-9)


def test_a_stream_says_what_it_needs():
    whole = series(np.random.default_rng(2).standard_normal((1, 4000)), rate_hz=1000.0)
    with pytest.raises(EstimateError, match="blocks don't say how long the record is; give band_hz"):
        srs(blocks(whole, [100]))
    with pytest.raises(EstimateError, match="take offset first or keep"):
        srs(blocks(whole, [100]), band_hz=(1.0, 100.0), offset="median")
