"""The hidden laws against closed forms: what a cycle takes, where they end, what they leave alone."""

from math import pi

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.models.effects.hardening_stiffness import progressive
from chladni.models.effects.one_sided_stop import stop
from chladni.models.effects.saturation import clipped, smooth
from chladni_withheld.chains.equations import Assembly
from chladni_withheld.chains.simulation import integrate

X, OMEGA, CYCLES, PER_CYCLE = 0.01, 2 * pi, 6, 4000


def cycled(word, *numbers, amplitude=X, shift=0.0):
    """Displacement, speed and force over the last cycle of a sine."""
    t = np.arange(CYCLES * PER_CYCLE + 1) / PER_CYCLE
    d, s = shift + amplitude * np.sin(OMEGA * t), OMEGA * amplitude * np.cos(OMEGA * t)
    assembly = Assembly(inputs=["d", "s"])
    assembly.outputs["force"] = assembly.law("force", word, {"d": 1.0}, {"s": 1.0}, *numbers)
    force = integrate(assembly, np.vstack([d, s]), 1 / PER_CYCLE, steps=4)[0]
    last = slice(-PER_CYCLE - 1, None)
    return d[last], s[last], force[last]


def taken(d, force):
    """Energy of a cycle."""
    return float(np.trapezoid(force, d))


@pytest.mark.parametrize(
    ("word", "numbers"),
    [
        ("dahl", (8.0, 8.0 / 1e-5, 1.0)),
        ("lugre", (8.0, 8.0, 0.01, 2.0, 8.0 / 1e-5, 0.0)),
        ("bouc_wen", (8.0, 1e-5, 0.5, 0.5, 1.0)),
    ],
)
def test_friction_takes_four_times_force_and_amplitude_from_a_cycle(word, numbers):
    d, s, force = cycled(word, *numbers)
    # Presliding takes away about its own share of the way at each reversal: 1e-5 of 1e-2, some of it twice.
    assert_allclose(taken(d, force), 4 * 8.0 * X, rtol=4e-3)
    sliding = np.abs(s) > 0.5 * OMEGA * X
    assert_allclose(force[sliding], 8.0 * np.sign(s[sliding]), rtol=1e-3)


def test_stribecks_excess_shows_at_low_speed_only():
    speed = 0.2 * OMEGA * X
    _, s, force = cycled("lugre", 8.0, 14.0, speed, 2.0, 14.0 / 1e-5, 0.0)
    expected = (8.0 + 6.0 * np.exp(-((s / speed) ** 2))) * np.sign(s)
    # Within a few bristle lengths of a reversal the force is still on its way.
    moving = np.abs(s) > 0.15 * OMEGA * X
    assert_allclose(force[moving], expected[moving], rtol=0.02)


def test_bouc_wen_of_exponent_one_follows_its_exponential_from_rest():
    force, bend = 5.0, 0.003
    t = np.arange(PER_CYCLE // 4 + 1) / PER_CYCLE
    d, s = X * np.sin(OMEGA * t), OMEGA * X * np.cos(OMEGA * t)
    assembly = Assembly(inputs=["d", "s"])
    assembly.outputs["force"] = assembly.law("force", "bouc_wen", {"d": 1.0}, {"s": 1.0}, force, bend, 0.7, 0.3, 1.0)
    found = integrate(assembly, np.vstack([d, s]), 1 / PER_CYCLE, steps=4)[0]
    assert_allclose(found, force * (1 - np.exp(-d / bend)), atol=1e-5 * force)


def test_masing_network_unloads_by_masings_rule():
    # After a reversal at (D, F) the branch is the virgin curve, twice as wide and twice as high.
    d, s, force = cycled("masing", 5.0, 0.004)
    loading = s > 0
    d_up, f_up = d[loading], force[loading]
    order = np.argsort(d_up)
    half = np.interp(0.0, d_up[order], f_up[order])
    assert half > 0
    assert_allclose(force.max(), -force.min(), rtol=1e-6)
    # All sliders have given way at 1.75 times the mean yield displacement.
    assert_allclose(force.max(), 5.0, rtol=0.02)
    assert taken(d, force) > 0


def test_quadratic_damping_takes_its_closed_form():
    d, _, force = cycled("quadratic", 40.0, 1e-9)
    assert_allclose(taken(d, force), 8 / 3 * 40.0 * OMEGA**2 * X**3, rtol=1e-5)


@pytest.mark.parametrize(
    ("word", "numbers", "expected"),
    [
        ("cubic_quintic", (3e4, 2e8), lambda d: 3e4 * d**3 + 2e8 * d**5),
        ("rubber", (1e3, 0.004), lambda d: 1e3 * (0.004 * np.sinh(d / 0.004) - d)),
        ("arctangent", (1e3, 0.004), lambda d: 1e3 * (0.004 * np.arctan(d / 0.004) - d)),
        ("sine_spring", (1e3, 0.02), lambda d: 1e3 * (0.02 * np.sin(d / 0.02) - d)),
        ("ripple", (2.0, 0.003, 0.4, 0.2, 1.0, 0.1, 0.5),
         lambda d: 2 * (np.sin(2 * pi * d / 0.003 + 0.4) + 0.2 * np.sin(4 * pi * d / 0.003 + 1.0)
                        + 0.1 * np.sin(6 * pi * d / 0.003 + 0.5))),
        ("hard_limit", (0.004,), lambda d: np.clip(d, -0.004, 0.004)),
        ("hyperbolic_limit", (0.004,), lambda d: 0.004 * np.tanh(d / 0.004)),
        ("soft_limit", (0.004, 2.0), lambda d: d / np.sqrt(1 + (d / 0.004) ** 2)),
    ],
)  # fmt: skip
def test_elastic_laws_are_functions_of_displacement_and_take_nothing(word, numbers, expected):
    d, _, force = cycled(word, *numbers)
    assert_allclose(force, expected(d), rtol=1e-12, atol=1e-12)
    # The trapezoidal rule over a closed way is exact to its own second-order error.
    assert abs(taken(d, force)) < 1e-5 * np.abs(force).max() * X


def test_hertz_contact_presses_with_the_power_three_halves_and_never_pulls():
    d, _, force = cycled("contact", 2e6, 0.004, -1.0, 0.0, 1.5)
    depth = np.maximum(-d - 0.004, 0.0)
    assert_allclose(force, -2e6 * depth**1.5, rtol=1e-12, atol=1e-9)
    d, _, force = cycled("contact", 2e6, 0.004, 1.0, 0.5, 1.5)
    assert np.all(force >= 0)
    # A blow that doesn't bounce back takes energy.
    assert taken(d, force) > 0


def test_play_is_free_inside_and_a_spring_beyond():
    k, half = 1e4, 0.004
    d, _, force = cycled("soft_play", k, half, 1e-5, 0.0)
    whole = force + k * d
    outside = np.abs(d) > half + 2e-4
    assert_allclose(whole[outside], k * (d[outside] - half * np.sign(d[outside])), rtol=1e-6)
    assert np.abs(whole[np.abs(d) < half - 2e-4]).max() < 1e-6 * k * half


def test_overlap_shifts_what_is_beyond_it():
    d, _, force = cycled("overlap", 0.003, 1e-5)
    beyond = np.abs(d) > 0.0035
    assert_allclose(force[beyond], d[beyond] - 0.003 * np.sign(d[beyond]), rtol=1e-6)


def test_slew_follows_slowly_and_no_faster():
    rate = 0.3 * OMEGA * X
    _, _, force = cycled("slew", rate, 1e-4)
    found = np.diff(force) * PER_CYCLE
    assert np.abs(found).max() <= rate * (1 + 1e-6)
    # A triangle of that rate: a quarter of the period from its mean to its top.
    assert_allclose(force.max(), rate * 0.25, rtol=0.02)


def test_stiffness_changes_in_time():
    d, _, force = cycled("smooth_change", 100.0, 0.0, 1e-3)
    assert_allclose(force, 100.0 * d, rtol=1e-9, atol=1e-12)
    d, _, force = cycled("ramp_change", 100.0, 1.0, 2 * CYCLES - 1.0)
    t = CYCLES - 1 + np.arange(PER_CYCLE + 1) / PER_CYCLE
    assert_allclose(force, 100.0 * d * (t - 1) / (2 * CYCLES - 2), rtol=1e-9, atol=1e-12)
    d, _, force = cycled("periodic_change", 100.0, 2 * OMEGA, 0.3)
    assert_allclose(force, 100.0 * d * np.cos(2 * OMEGA * t + 0.3), rtol=1e-9, atol=1e-12)


def test_gain_depends_on_position():
    signal, position, value = cycled("position_gain", 0.2, 0.05)
    assert_allclose(value, signal * (1 + 0.2 * np.tanh(position / 0.05)), rtol=1e-12)


@pytest.mark.parametrize(
    ("word", "numbers", "law", "parameters"),
    [
        ("cubic_quintic", (1e7, 4e11), progressive, (1e7, 5e-3)),
        ("contact", (1e5, 0.004, -1.0, 0.8, 1.0), stop, (1e5, 0.004, -1.0, 1.0, 1.0, 0.8)),
        ("hard_limit", (0.006,), clipped, (0.006,)),
        ("hyperbolic_limit", (0.006,), smooth, (0.006,)),
    ],
)
def test_laws_that_the_page_says_are_the_catalogues_are(word, numbers, law, parameters):
    d, s, force = cycled(word, *numbers)
    ours = np.array([law(*each, 0.0, parameters, None, None) for each in zip(d, s, strict=True)])
    # At an actuator the catalogue's law is what it takes from the signal.
    ours += d if word.endswith("limit") else 0.0
    # One formula in two ways of writing: rounding alone differs.
    assert_allclose(force, ours, rtol=1e-12, atol=1e-12 * np.abs(force).max())
    assert np.ptp(force) > 0
