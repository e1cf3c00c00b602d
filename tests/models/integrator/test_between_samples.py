"""Inputs that are held, straight or band-limited between their samples, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import cont2discrete, lfilter

from chladni.models.core.port import Terminal
from chladni.models.integrator.band_limited import REACH, nodes, polynomials
from chladni.models.integrator.integrator import Integrator, integrate
from chladni.signals.errors import ModelError
from tests.models.integrator.systems import compiled_structure, cubic, law, oscillator, plain_model, relative_rms

RATE_HZ, SAMPLES = 1000.0, 4000


class Multisine:
    """Twenty lines of random phase up to a share of the rate, none of them on the record's."""

    def __init__(self, highest: float, lowest: float = 0.005) -> None:
        rng = np.random.default_rng(2)
        self.omega = 2 * np.pi * RATE_HZ * np.sort(rng.uniform(lowest, highest, 20))
        self.omega[-1] = 2 * np.pi * RATE_HZ * highest
        self.amplitude = np.exp(2j * np.pi * rng.uniform(size=20))

    def at(self, times, order=0):
        lines = self.amplitude * (1j * self.omega) ** order
        return (lines @ np.exp(1j * np.outer(self.omega, np.atleast_1d(times)))).real

    def response(self, a, b, times):
        """Steady states ``[state, time]`` of ``x' = a x + b u``."""
        inverse = np.linalg.inv(1j * self.omega[:, None, None] * np.eye(len(a)) - a)
        lines = (inverse @ b)[:, :, 0] * self.amplitude[:, None]
        return (lines.T @ np.exp(1j * np.outer(self.omega, times))).real


def machine(**changes):
    """An oscillator of 60 Hz, damped by 2 %."""
    return compiled_structure(oscillator(frequency_hz=60.0, damping=15.0), force_at="body", **changes)


def held(compiled, hold):
    return compiled.with_holds({terminal.name: hold for terminal in compiled.inputs})


TIMES = np.arange(SAMPLES) / RATE_HZ


@pytest.mark.parametrize(("share", "most"), [(0.1, 1e-5), (0.25, 1e-4), (0.4, 1e-3), (0.45, 2e-3)])
def test_between_samples_a_band_limited_signal_is_itself(share, most):
    signal = Multisine(share)
    found = polynomials(signal.at(TIMES), 5, 0.0, SAMPLES)
    inside = np.linspace(0, 1, 21)
    truth = signal.at(((np.arange(SAMPLES) + inside[:, None]) / RATE_HZ).ravel()).reshape(21, SAMPLES)
    missed = np.vander(inside, 6, increasing=True) @ found - truth
    rms = math.sqrt(np.mean(truth**2))
    assert math.sqrt(np.mean(missed[:, REACH:-REACH] ** 2)) < most * rms
    # Where the record begins nobody knows what was before: a tenth at most, for a few samples.
    assert math.sqrt(np.mean(missed[:, :8] ** 2)) < 0.1 * rms


def test_steps_of_a_band_limited_signal_join():
    signals = np.random.default_rng(1).standard_normal(200)
    found = polynomials(signals, 5, 0.0, 200)
    np.testing.assert_allclose(found[0], signals, atol=1e-12)
    np.testing.assert_allclose(found.sum(axis=0)[:-1], signals[1:], atol=1e-11)


@pytest.mark.parametrize("samples", [1, 2, 3, 40])
def test_short_signals_are_taken(samples):
    found = polynomials(np.full(samples, 3.0), 5, 0.0, samples + 2)
    np.testing.assert_allclose(found[0], 3.0)
    np.testing.assert_allclose(found[1:], 0.0, atol=1e-9)


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize(("share", "most"), [(0.1, 1e-5), (0.25, 2e-5), (0.4, 5e-5)])
def test_a_multisine_through_an_oscillator(share, most, moving):
    """Steady state, and the transient from rest."""
    compiled, signal = machine(), Multisine(share)
    steady = signal.response(compiled.a, compiled.b, TIMES)
    start = steady[:, 0] if moving else np.zeros(2)
    free = np.array([expm(compiled.a * t) @ (start - steady[:, 0]) for t in TIMES[:500]]).T
    truth = steady.copy()
    truth[:, :500] += free
    truth = truth[:, :500]
    found = integrate(held(compiled, "band_limited"), signal.at(TIMES)[None], RATE_HZ, initial=start)
    missed = relative_rms(found.states[:, :500], truth)
    straight = relative_rms(
        integrate(compiled, signal.at(TIMES)[None], RATE_HZ, initial=start).states[:, :500], truth
    )
    assert missed < most
    assert straight > 10 * missed


@pytest.mark.parametrize("late", [0.37, 3.0, 5.62])
def test_dead_time_of_a_band_limited_input_shifts_it(late):
    signal = Multisine(0.3)
    compiled = replace(held(machine(), "band_limited"), input_delays_s=(late / RATE_HZ,))
    begin = 1500
    truth = signal.response(compiled.a, compiled.b, TIMES - late / RATE_HZ)[:, begin:]
    found = integrate(compiled, signal.at(TIMES)[None], RATE_HZ).states[:, begin:]
    # 0.02 of 60 Hz decays by e^-11 in 1.5 s.
    assert relative_rms(found, truth) < 3e-4
    assert found.shape == truth.shape


@pytest.mark.parametrize("late", [0, 3, 2.37])
def test_a_held_input_is_a_staircase(late):
    compiled = replace(held(machine(), "zoh"), input_delays_s=(late / RATE_HZ,))
    signals = np.random.default_rng(3).standard_normal(300)
    finer = 100
    whole = round(late * finer)
    stairs = np.concatenate([np.zeros(whole), np.repeat(signals, finer)])[: 300 * finer]
    a, b, *_ = cont2discrete((compiled.a, compiled.b, np.eye(2), np.zeros((2, 1))), 1 / (RATE_HZ * finer))
    state, states = np.zeros(2), []
    for sample, value in enumerate(stairs):
        if sample % finer == 0:
            states.append(state)
        state = a @ state + b[:, 0] * value
    found = integrate(compiled, signals[None], RATE_HZ)
    truth = np.array(states).T
    np.testing.assert_allclose(found.states, truth, atol=1e-9 * np.abs(truth).max(axis=1).min())
    # What passes at once is what is there at the stamp.
    through = found.outputs[2] - compiled.a[1] @ found.states
    np.testing.assert_allclose(through, stairs[::finer] * compiled.b[1], atol=1e-9)


def test_laws_see_a_band_limited_input_between_its_samples():
    signal = Multisine(0.25)
    compiled = machine(laws=(law(0, cubic, 1e14),))
    truth = solve_ivp(
        lambda t, y: compiled.a @ y + compiled.b[:, 0] * signal.at(t)[0] + compiled.g[:, 0] * 1e14 * y[0] ** 3,
        (0, TIMES[600]), np.zeros(2), t_eval=TIMES[:600], method="DOP853", rtol=1e-10, atol=1e-16,
    ).y  # fmt: skip
    linear = signal.response(compiled.a, compiled.b, TIMES)
    assert np.abs(1e14 * truth[0] ** 3).max() > 0.02 * np.abs(signal.at(TIMES)).max()
    assert linear.shape == (2, SAMPLES)
    found = integrate(held(compiled, "band_limited"), signal.at(TIMES)[None], RATE_HZ).states[:, :600]
    assert relative_rms(found, truth) < 1e-3
    assert relative_rms(integrate(compiled, signal.at(TIMES)[None], RATE_HZ).states[:, :600], truth) > 1e-2


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_laws_see_a_held_input_jump(scheme):
    """A law on the command itself, and one behind the oscillator that it drives."""
    signals = np.random.default_rng(5).standard_normal(200)
    doubling = plain_model(
        [[-50.0]], [[50.0]], [[1.0]], [[0.0]], g=[[50.0]], h=[[0.0]], motion=([[0.0]], [[1.0]], [[0.0]]),
        laws=(law(0, cubic, 1.0),),
    )  # fmt: skip
    found = Integrator(held(doubling, "zoh"), RATE_HZ, scheme=scheme).run(signals[None])
    decay = math.exp(-50 / RATE_HZ)
    behind = lfilter([0.0, 1 - decay], [1.0, -decay], signals + cubic_of(signals))
    np.testing.assert_allclose(found.states[0], behind, atol=1e-7)


def cubic_of(values):
    return np.array([cubic(value, 0.0, 0.0, (1.0,), (), ()) for value in values])


def test_a_prescribed_motion_is_band_limited_with_its_rates():
    """Its acceleration is read at once; a spline misses more of it."""
    signal = Multisine(0.25, lowest=0.05)
    motion = Terminal(name="stroke", unit="m", derivatives=2)
    model = plain_model(
        np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((3, 0)), np.eye(3), inputs=(motion,), states=(), ports=(),
        outputs=tuple(Terminal(name=name, unit="m") for name in "xva"),
    )  # fmt: skip
    truth = np.array([signal.at(TIMES, order) for order in range(3)])[:, REACH:-REACH]
    missed = {}
    for hold in ("foh", "band_limited"):
        found = integrate(held(model, hold), signal.at(TIMES)[None], RATE_HZ).outputs[:, REACH:-REACH]
        missed[hold] = relative_rms(found, truth)
    assert missed["band_limited"] < 1e-3 < missed["foh"]


def test_an_input_whose_rate_acts_is_not_held():
    model = plain_model(
        [[-1.0]], np.zeros((1, 3)), [[1.0]], np.zeros((1, 3)),
        inputs=(Terminal(name="stroke", unit="m", derivatives=2, hold="zoh"),),
    )  # fmt: skip
    with pytest.raises(ModelError, match=r"'stroke' is held .*, and its rate acts too"):
        Integrator(model, RATE_HZ)


def test_nodes_are_those_of_lobatto():
    assert nodes(5)[0] == 0.0
    assert nodes(5)[-1] == 1.0
    np.testing.assert_allclose(nodes(5) + nodes(5)[::-1], 1.0)
