"""Order tracking of a made run-up: orders 1, 2 and 5.7 that cross a resonance, of known amplitudes and phases."""

from functools import cache

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.orders import order_cuts, order_map, strongest_orders
from chladni.spectral.rotation import rotation
from tests.spectral.made_signals import series

RATE_HZ, SECONDS = 1000.0, 120.0
ORDERS = (1.0, 2.0, 5.7)
SIZES = (2.0, 1.0, 0.5)
RESONANCE_HZ, DAMPING = 80.0, 0.03
# Off zero, so that a phase by the wrong sign or zero is seen.
BEGINS_AT = 0.3


def speed_hz(t):
    return 10 + 40 * t / SECONDS


def turned(t):
    return BEGINS_AT + 10 * t + 20 * t**2 / SECONDS


def amplitude(order, speed):
    """Quasi-steady response of a resonance to an order: the run-up is slow against its decay."""
    ratio = order * speed / RESONANCE_HZ
    return dict(zip(ORDERS, SIZES, strict=True))[order] / (1 - ratio**2 + 2j * DAMPING * ratio)


@cache
def run_up():
    """Vibration, and the shaft by pulses (1 a revolution), wrapped angle and speed."""
    t = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ
    parts = [amplitude(order, speed_hz(t)) * np.exp(2j * np.pi * order * turned(t)) for order in ORDERS]
    vibration = np.sum(parts, axis=0).real + 9.81
    pulses = 2.5 + 2.5 * np.cos(2 * np.pi * (turned(t) - 0.25))
    angle = np.mod(2 * np.pi * turned(t), 2 * np.pi)
    channels = tuple(
        Channel(name=name, unit=unit)
        for name, unit in (("a", "m/s^2"), ("tacho", "V"), ("angle", "rad"), ("speed", "rad/s"))
    )
    values = np.stack([vibration, pulses, angle, 2 * np.pi * speed_hz(t)])
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels, start_time_ns=10**18)


def vibration():
    return run_up().select(["a"])


SOURCES = ("tacho", "phase", "speed")


@cache
def shaft(source):
    return rotation(run_up(), **{source: {"phase": "angle"}.get(source, source)})


@pytest.mark.parametrize("source", SOURCES)
def test_the_speed_is_found_by_each_channel(source):
    found = shaft(source).at(vibration())
    known = np.isfinite(found)
    assert known.mean() > 0.999
    apart = found[known] - turned(np.flatnonzero(known) / RATE_HZ)
    assert np.ptp(apart) < 1e-3


@pytest.mark.parametrize("method", ["angle", "vold-kalman"])
@pytest.mark.parametrize("source", SOURCES)
def test_amplitudes_through_the_resonance_are_true_to_one_percent(source, method):
    found = order_cuts(vibration(), shaft(source), orders=ORDERS, method=method)
    np.testing.assert_allclose(found.speed_hz, speed_hz(found.time_s), rtol=1e-3)
    # Vold-Kalman knows less of the ends.
    inner = slice(20, -20)
    for row, order in enumerate(ORDERS):
        truth = amplitude(order, found.speed_hz)
        np.testing.assert_allclose(np.abs(found.values[0, row, inner]), np.abs(truth)[inner], rtol=0.01)


@pytest.mark.parametrize("method", ["angle", "vold-kalman"])
def test_phases_turn_through_the_resonance_as_they_should(method):
    found = order_cuts(vibration(), shaft("phase"), orders=ORDERS, method=method)
    for row, order in enumerate(ORDERS):
        # Of the wrapped angle the zero is the shaft's own.
        truth = amplitude(order, found.speed_hz)
        assert np.abs(np.angle(found.values[0, row] / truth))[20:-20].max() < 0.02


def test_pulses_give_phases_from_pulse_to_pulse():
    found = order_cuts(vibration(), shaft("tacho"), orders=[1.0])
    # The pulse rises through its middle where the shaft stands at 0, so that pulses count from 1 on.
    assert np.abs(np.angle(found.values[0, 0] / amplitude(1.0, found.speed_hz))).max() < 0.02


def test_the_map_shows_the_same_amplitudes_and_nothing_between():
    found = order_map(vibration(), shaft("phase"), highest_order=8.0)
    assert found.order[-1] == 8.0
    for order in ORDERS:
        line = round(order * 10)
        truth = np.abs(amplitude(order, found.speed_hz))
        # A window of 10 revolutions averages over the narrow peak of the highest order.
        np.testing.assert_allclose(found.values[0, :, line], truth, rtol=0.03)
    assert np.median(found.values[0, :, 35]) < 1e-3
    np.testing.assert_allclose(found.values[0, :, 0], 9.81, rtol=1e-3)


def test_orders_that_stand_out_are_named_and_no_others():
    rng = np.random.default_rng(1)
    noise = 0.05 * rng.standard_normal(vibration().samples)
    noisy = TimeSeries(
        values=vibration().values + noise, sample_rate_hz=RATE_HZ, channels=vibration().channels, start_time_ns=10**18
    )
    found = order_map(noisy, shaft("phase"), highest_order=8.0)
    assert strongest_orders([found], count=5) == ORDERS
    assert strongest_orders([found], count=1) == (2.0,)
    alone = TimeSeries(values=noise[None], sample_rate_hz=RATE_HZ, channels=noisy.channels, start_time_ns=10**18)
    with pytest.raises(EstimateError, match="name the orders"):
        strongest_orders([order_map(alone, shaft("phase"), highest_order=8.0)], count=5)


def test_what_is_fast_does_not_alias_into_low_orders():
    # 380 Hz is order 38 at the start; angle steps for order 8 alone would fold it.
    t = run_up().times_s()
    loud = series(100 * np.cos(2 * np.pi * 380 * t), rate_hz=RATE_HZ)
    found = order_map(
        TimeSeries(values=loud.values, sample_rate_hz=RATE_HZ, channels=loud.channels, start_time_ns=10**18),
        shaft("phase"),
        highest_order=5.0,
    )
    assert np.nanmax(found.values[0, :, 5:]) < 0.05


def test_a_ridge_tells_the_shaft_where_nothing_else_does():
    found = rotation(run_up(), ridge="a", ridge_order=2.0, ridge_hz=(15.0, 105.0), resolution_hz=1.0)
    cuts = order_cuts(vibration(), found, orders=[2.0])
    inner = slice(60, -60)
    np.testing.assert_allclose(cuts.speed_hz[inner], speed_hz(cuts.time_s)[inner], rtol=0.01)
    truth = np.abs(amplitude(2.0, speed_hz(cuts.time_s)))
    np.testing.assert_allclose(np.abs(cuts.values[0, 0, inner]), truth[inner], rtol=0.02)


def test_vold_kalman_parts_orders_that_a_window_cannot():
    t = run_up().times_s()
    pair = np.cos(2 * np.pi * turned(t)) + 0.5 * np.cos(2 * np.pi * 1.1 * turned(t))
    both = TimeSeries(values=pair[None], sample_rate_hz=RATE_HZ, channels=(Channel(name="a"),), start_time_ns=10**18)
    parted = order_cuts(both, shaft("phase"), orders=[1.0, 1.1], method="vold-kalman", revolutions=60)
    # The beat has a period of 10 revolutions.
    for row, size in enumerate((1.0, 0.5)):
        np.testing.assert_allclose(np.abs(parted.values[0, row]), size, rtol=0.01)


def test_another_clock_may_tell_the_shaft():
    slow = TimeSeries(
        values=run_up().values[3:, ::20],
        sample_rate_hz=RATE_HZ / 20,
        channels=run_up().channels[3:],
        start_time_ns=10**18,
    )
    found = order_cuts(vibration(), rotation(slow, speed="speed"), orders=[2.0])
    np.testing.assert_allclose(np.abs(found.values[0, 0]), np.abs(amplitude(2.0, found.speed_hz)), rtol=0.01)


def test_where_the_angle_is_not_known_no_window_reaches():
    angle = run_up().values[2].copy()
    angle[40_000:41_000] = np.nan
    gapped = TimeSeries(
        values=angle[None],
        sample_rate_hz=RATE_HZ,
        channels=(Channel(name="angle", unit="rad"),),
        start_time_ns=10**18,
    )
    found = order_cuts(vibration(), rotation(gapped, phase="angle"), orders=[1.0])
    # Half a window of 8 revolutions, at 23 of them a second.
    assert np.all((found.time_s < 40.0 - 0.1) | (found.time_s > 41.0 + 0.1))
    np.testing.assert_allclose(np.abs(found.values[0, 0]), np.abs(amplitude(1.0, found.speed_hz)), rtol=0.01)


def test_a_lost_pulse_is_counted_and_told():
    t = np.arange(10_000) / RATE_HZ
    pulses = (np.mod(20 * t, 1) < 0.5) * 1.0
    pulses[4000:4049] = 0.0
    found = rotation(series(pulses, rate_hz=RATE_HZ), tacho="a", pulses_a_revolution=4)
    np.testing.assert_allclose(
        np.diff(found.revolutions), np.where(np.isclose(np.diff(found.time_s), 0.1), 0.5, 0.25)
    )
    assert "missing 1 pulse, first at 3.9" in found.notes[0]


def test_noise_is_no_train_of_pulses():
    with pytest.raises(EstimateError, match=r"more pulses seem to be missing than the .* that are there"):
        rotation(series(np.random.default_rng(1).standard_normal(4000), rate_hz=RATE_HZ), tacho="a")


def test_noise_on_an_edge_is_no_pulse():
    t = np.arange(20_000) / RATE_HZ
    noisy = np.sin(2 * np.pi * 5 * t) + 0.05 * np.random.default_rng(1).standard_normal(t.size)
    assert rotation(series(noisy, rate_hz=RATE_HZ), tacho="a").time_s.size == pytest.approx(100, abs=1)


def test_windows_that_miss_samples_are_left_out():
    values = vibration().values.copy()
    values[0, 50_000] = np.nan
    gapped = TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=vibration().channels, start_time_ns=10**18)
    for method in ("angle", "vold-kalman"):
        found = order_cuts(gapped, shaft("phase"), orders=[1.0], method=method)
        lost = np.isnan(found.values[0, 0])
        assert 1 <= lost.sum() <= 8
        assert np.abs(found.time_s[lost] - 50).max() < 0.3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "exactly one channel"),
        ({"tacho": "tacho", "speed": "speed"}, "exactly one channel"),
        ({"phase": "tacho"}, "tacho is in V; an angle must be in rad"),
        ({"speed": "a"}, r"a is in m/s\^2; a speed must be in rad/s or Hz"),
        ({"tacho": "tacho", "threshold": 7.0}, "0 pulses through 7; four are needed.* and 5,"),
        ({"tacho": "tacho", "pulses_a_revolution": 0.0}, "0 pulses a revolution"),
        ({"ridge": "a", "ridge_hz": (90.0, 20.0)}, "give LOW < HIGH of the ridge"),
        ({"speed": "engine"}, "no channel 'engine'"),
    ],
)
def test_what_tells_no_rotation_is_refused(options, words):
    with pytest.raises(EstimateError, match=words):
        rotation(run_up(), **options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"orders": [1.0, 1.0]}, "give different ones above 0"),
        ({"orders": [0.0]}, "give different ones above 0"),
        ({"orders": []}, "give different ones above 0"),
        ({"revolutions": 0.0}, "a window of 0 revolutions"),
        ({"revolutions": 1e6}, "a window takes 1e\\+06 revolutions"),
        ({"overlap": 1.0}, "overlap is 1"),
        ({"method": "gabor"}, "none of angle, vold-kalman"),
    ],
)
def test_what_cannot_be_cut_is_refused(options, words):
    with pytest.raises(EstimateError, match=words):
        order_cuts(vibration(), shaft("speed"), **options)


def test_a_shaft_that_turns_back_is_refused():
    t = np.arange(10_000) / RATE_HZ
    back = series(2 * np.pi * 5 * np.sin(t), rate_hz=RATE_HZ, units=["rad"])
    with pytest.raises(EstimateError, match=r"turns back by .* choose a part"):
        order_cuts(series(np.cos(t), rate_hz=RATE_HZ), rotation(back, phase="a"))
