"""Linear models: everything is exact, so tolerances are those of rounding."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lsim

from chladni.models.core.compiled_model import DelayLine, GeneratedInput
from chladni.models.core.port import Terminal
from chladni.models.integrator.integrator import Integrator, integrate
from chladni.models.structures.robot_arm import robot_arm
from chladni.signals.errors import ModelError
from chladni.signals.number_range import LARGEST
from tests.models.integrator.systems import compiled_structure, cubic, law, oscillator, plain_model

RATE_HZ = 1000.0


def clipped(samples, sample_rate_hz):
    return np.clip(samples, -1, 1)


def doubled(samples, sample_rate_hz):
    return 2 * samples


def noise(rows, count, seed=1):
    return np.random.default_rng(seed).standard_normal((rows, count))


def test_a_chain_of_five_bodies_follows_the_matrix_exponential():
    compiled = compiled_structure(robot_arm(), force_at="tool")
    signals = noise(1, 400)
    found = integrate(compiled, signals, RATE_HZ)
    # Augmented by the signal and its slope, one exponential a step.
    big = np.zeros((12, 12))
    big[:10, :10], big[:10, 10:11], big[10, 11] = compiled.a, compiled.b, RATE_HZ
    step = expm(big / RATE_HZ)
    state, states = np.zeros(10), [np.zeros(10)]
    for k in range(399):
        state = (step @ np.concatenate([state, signals[:, k], np.diff(signals[0, k : k + 2])]))[:10]
        states.append(state)
    truth = np.array(states).T
    np.testing.assert_allclose(found.states, truth, atol=1e-11 * np.abs(truth).max(axis=1, keepdims=True).min())
    assert np.abs(found.states - truth).max() <= 1e-11 * np.abs(truth).max()
    np.testing.assert_allclose(
        found.outputs[10:], compiled.a[5:] @ truth + compiled.b[5:] @ signals, atol=1e-9 * np.abs(found.outputs).max()
    )


def test_an_independent_program_agrees():
    compiled = compiled_structure(robot_arm(), force_at="tool")
    signals = noise(1, 300)
    times = np.arange(300) / RATE_HZ
    truth = lsim((compiled.a, compiled.b, compiled.c, compiled.d), signals[0], times)[1].T
    found = integrate(compiled, signals, RATE_HZ).outputs
    np.testing.assert_allclose(found, truth, atol=1e-9 * np.abs(truth).max())


@pytest.mark.parametrize("with_law", [False, True])
def test_a_free_body_under_a_ramp_moves_as_the_cube_of_time(with_law):
    # A is singular, and defective.
    laws = (law(0, cubic, 0.0),) if with_law else ()
    compiled = plain_model(
        [[0, 1], [0, 0]],
        [[0], [1]],
        [[1, 0]],
        [[0]],
        g=[[0], [-1]],
        h=[[0]],
        motion=([[1, 0]], [[0]], [[0]]),
        laws=laws,
    )
    times = np.arange(101) / RATE_HZ
    found = integrate(compiled, 6 * times[None], RATE_HZ)
    np.testing.assert_allclose(found.states[0], times**3, rtol=1e-12, atol=1e-18)


def test_initial_states_ring_down_in_closed_form():
    compiled = compiled_structure(oscillator(), force_at="body")
    times = np.arange(500) / RATE_HZ
    found = integrate(compiled, np.zeros((1, 500)), RATE_HZ, initial={"x_body": 0.01})
    omega0 = 2 * math.pi * 10
    zeta = 1 / (2 * omega0)
    omega = omega0 * math.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * omega0 * times)
    truth = 0.01 * decay * (np.cos(omega * times) + zeta * omega0 / omega * np.sin(omega * times))
    np.testing.assert_allclose(found.states[0], truth, atol=1e-15)
    again = integrate(compiled, np.zeros((1, 500)), RATE_HZ, initial=np.array([0.01, 0.0]))
    np.testing.assert_array_equal(again.states, found.states)


@pytest.mark.parametrize("delay_s", [0.004, 0.0037, 0.00031])
@pytest.mark.parametrize("with_law", [False, True])
def test_an_input_delay_is_exact_for_straight_lines(delay_s, with_law):
    laws = (law(0, cubic, 0.0),) if with_law else ()
    plant = {"g": [[-1]], "h": [[0]], "motion": ([[1]], [[0]], [[0]]), "laws": laws}
    compiled = plain_model([[-50]], [[50]], [[1]], [[0]], input_delays_s=(delay_s,), **plant)
    signals = noise(1, 60) + 3.0
    found = integrate(compiled, signals, RATE_HZ).outputs[0]
    # The response to each straight piece is known; before the delay nothing comes.
    times = np.arange(60) / RATE_HZ
    rises = np.diff(signals[0], prepend=0.0)
    truth = np.zeros(60)
    for k, t in enumerate(times):
        for j in range(60):
            since = t - delay_s - times[j]
            if since < 0:
                break
            slope = (rises[j + 1] if j < 59 else 0.0) - (rises[j] if j else 0.0)
            ramp = since - (1 - math.exp(-50 * since)) / 50
            truth[k] += slope * RATE_HZ * ramp + (signals[0, 0] * (1 - math.exp(-50 * since)) if j == 0 else 0.0)
    np.testing.assert_allclose(found, truth, atol=1e-12)


@pytest.mark.parametrize("offset_s", [0.003, 0.00042, -0.00042, -0.002, 0.0])
def test_a_late_clock_reads_the_exact_output_of_earlier(offset_s):
    compiled = compiled_structure(oscillator(), force_at="body", output_offsets_s=(offset_s, 0.0, 0.0))
    fine = 50
    signals = np.sin(2 * math.pi * 7 * np.arange(200) / RATE_HZ)[None]
    found = integrate(compiled, signals, RATE_HZ).outputs[0]
    padded = np.hstack([signals, np.repeat(signals[:, -1:], 5, axis=1)])
    slow = np.array([np.interp(np.arange(204 * fine + 1) / fine, np.arange(205), padded[0])])
    truth = integrate(replace(compiled, output_offsets_s=()), slow, RATE_HZ * fine).outputs[0]
    places = np.arange(200) * fine - round(offset_s * RATE_HZ * fine)
    expected = np.where(places < 0, truth[0], truth[np.maximum(places, 0)])
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(truth).max())


def test_a_prescribed_motion_acts_with_its_rate_and_second_derivative():
    # y = u'' + 2 u' + 3 u of a sine: the spline's error is (omega h)^4/720 of the second derivative.
    compiled = plain_model(
        np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((1, 0)), [[3, 2, 1]],
        inputs=(Terminal(name="floor", unit="m", derivatives=2),),
    )  # fmt: skip
    times = np.arange(400) / RATE_HZ
    omega = 2 * math.pi * 20
    found = integrate(compiled, np.sin(omega * times)[None], RATE_HZ).outputs[0]
    truth = (3 - omega**2) * np.sin(omega * times) + 2 * omega * np.cos(omega * times)
    inner = slice(30, -30)
    assert np.abs(found - truth)[inner].max() <= (omega / RATE_HZ) ** 4 / 720 * omega**2 * 1.5


@pytest.mark.parametrize("with_law", [False, True])
def test_motion_rate_and_acceleration_belong_to_one_curve(with_law):
    # A double integrator driven by u'' must give back u, also where steps are halved.
    laws = (law(0, cubic, 0.0),) if with_law else ()
    compiled = plain_model(
        [[0, 1], [0, 0]], [[0, 0, 0], [0, 0, 1]], [[1, 0]], [[0, 0, 0]],
        g=[[0], [-1]], h=[[0]], motion=([[1, 0]], [[0, 0, 0]], [[0]]), laws=laws,
        inputs=(Terminal(name="floor", unit="m", derivatives=2),),
    )  # fmt: skip
    signals = np.random.default_rng(5).standard_normal((1, 100))
    slope = (signals[0, 1] - signals[0, 0]) * RATE_HZ
    first = integrate(compiled, signals, RATE_HZ, initial=np.array([signals[0, 0], slope]))
    drift = first.states[0] - signals[0]
    # What is left is the straight line of an initial velocity that was not the spline's.
    line = np.polyval(np.polyfit(np.arange(100), drift, 1), np.arange(100))
    np.testing.assert_allclose(drift, line, atol=1e-8)


def test_a_generated_input_is_asked_for_its_samples():
    generated = GeneratedInput(terminal=Terminal(name="floor", unit="N"), samples=lambda t: 5.0 * t)
    compiled = plain_model(
        [[0.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]], inputs=(Terminal(name="u", unit="N"),), generated=(generated,)
    )
    times = np.arange(50) / RATE_HZ
    found = integrate(compiled, np.ones((1, 50)), RATE_HZ).states[0]
    np.testing.assert_allclose(found, times + 5 * times**2, atol=1e-13)


def test_maps_act_on_samples_before_and_after():
    compiled = plain_model(
        [[0.0]], [[1.0]], [[1.0]], [[0.0]],
        input_maps=((0, clipped),), output_maps=((0, doubled),),
    )  # fmt: skip
    signals = np.full((1, 20), 7.0)
    found = integrate(compiled, signals, RATE_HZ)
    np.testing.assert_allclose(found.outputs[0], 2 * np.arange(20) / RATE_HZ, atol=1e-15)
    assert signals[0, 0] == 7.0


@pytest.mark.parametrize("delay_s", [0.005, 0.0033, 0.0004])
def test_a_delay_in_a_loop_follows_the_method_of_steps(delay_s):
    # x' = u - x(t - tau), u = 1: polynomial pieces.
    compiled = plain_model(
        [[-1.0]], [[1.0]], [[1.0]], [[0.0]], g=[[-1.0]], h=[[0.0]], motion=([[1.0]], [[0.0]], [[0.0]]),
        delays=(DelayLine(port=0, delay_s=delay_s),),
    )  # fmt: skip
    scale = 200.0
    count = 12
    compiled = replace(compiled, a=compiled.a * scale, b=compiled.b * scale, g=compiled.g * scale)
    found = integrate(compiled, np.ones((1, count)), RATE_HZ).states[0]
    times = np.arange(count) / RATE_HZ
    truth = np.zeros(count)
    for piece in range(40):
        since = np.maximum(times - piece * delay_s, 0.0) * scale
        truth += (-1.0) ** piece * since ** (piece + 1) / math.factorial(piece + 1) * (times >= piece * delay_s)
    np.testing.assert_allclose(found, truth, atol=2e-6)


def test_a_delay_far_below_the_sample_interval_is_refused():
    compiled = plain_model(
        [[-1.0]], [[1.0]], [[1.0]], [[0.0]], g=[[-1.0]], h=[[0.0]], motion=([[1.0]], [[0.0]], [[0.0]]),
        delays=(DelayLine(port=0, delay_s=1e-8),),
    )  # fmt: skip
    with pytest.raises(ModelError, match="'p0' is shorter than a thousandth of the sample interval"):
        integrate(compiled, np.ones((1, 10)), RATE_HZ)


def test_a_port_without_a_law_costs_nothing():
    bare = compiled_structure(robot_arm(), force_at="tool")
    assert integrate(bare, noise(1, 10), RATE_HZ).ports == ()
    one = replace(bare, laws=(law(3, cubic, 1e9),))
    assert integrate(one, noise(1, 10), RATE_HZ).ports == (3,)


def test_one_integrator_runs_many_times_with_other_laws():
    compiled = compiled_structure(oscillator(), force_at="body", laws=(law(0, cubic, 1e6),))
    signals = 20 * noise(1, 200)
    first = Integrator(compiled, RATE_HZ)
    other = first.with_laws((law(0, cubic, 3e7),))
    truth = integrate(replace(compiled, laws=(law(0, cubic, 3e7),)), signals, RATE_HZ).states
    before = first.run(signals).states
    np.testing.assert_array_equal(other.run(signals).states, truth)
    np.testing.assert_array_equal(first.run(signals).states, before)
    with pytest.raises(ModelError, match="the integrator was made for"):
        first.with_laws(())


@pytest.mark.parametrize(
    ("signals", "rate_hz", "initial", "words"),
    [
        (np.zeros((2, 5)), 100.0, None, "1 inputs, samples"),
        (np.full((1, 5), np.nan), 100.0, None, "input 'force': sample 0 is nan"),
        (np.zeros((1, 5)), 0.0, None, "must be finite and positive"),
        (np.zeros((1, 5)), 100.0, {"nowhere": 1.0}, "no state 'nowhere'; states: x_body, v_body"),
        (np.zeros((1, 5)), 100.0, np.zeros(3), "initial state has shape"),
        (np.zeros((1, 5)), 100.0, {"x_body": math.inf}, "finite"),
    ],
)
def test_what_can_not_be_simulated_is_refused_in_words(signals, rate_hz, initial, words):
    compiled = compiled_structure(oscillator(), force_at="body")
    with pytest.raises(ModelError, match=words):
        integrate(compiled, signals, rate_hz, initial=initial)


def test_a_run_that_would_not_fit_is_refused_before_memory_is_taken():
    compiled = compiled_structure(oscillator(), force_at="body")
    with pytest.raises(ModelError, match="simulate less time or a lower rate"):
        integrate(compiled, np.broadcast_to(0.0, (1, 10**8)), RATE_HZ)


@pytest.mark.parametrize("growth", [2000.0, 300.0])
def test_an_unstable_linear_model_is_told_with_its_time(growth):
    compiled = plain_model([[growth]], [[1.0]], [[1.0]], [[0.0]])
    # x = (e^(a t) - 1)/a under a step; the first sample at which that is too large to be squared twice.
    first = math.ceil(RATE_HZ * math.log(growth * LARGEST) / growth)
    with pytest.raises(ModelError, match=rf"diverges: state 'x0' grows .* at {first / RATE_HZ:g} s; a loop is unst"):
        integrate(compiled, np.ones((1, 600)), RATE_HZ)


def test_a_state_that_diverges_late_is_told_though_the_outputs_see_nothing_of_it():
    compiled = plain_model([[-1.0, 0.0], [0.0, 2000.0]], [[1.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    with pytest.raises(ModelError, match="diverges: state 'x1'"):
        integrate(compiled, np.ones((1, 600)), RATE_HZ)


@pytest.mark.parametrize(
    ("c", "d", "words"),
    [(1e80, 0.0, r"diverges: output 'y0' grows .* at 0\.001 s"), (0.0, 1e80, r"output 'y0' is 1e\+80 at 0 s")],
)
def test_outputs_that_leave_all_numbers_are_told_where_the_states_do_not(c, d, words):
    compiled = plain_model([[-1.0]], [[1.0]], [[c]], [[d]])
    with pytest.raises(ModelError, match=words):
        integrate(compiled, np.ones((1, 10)), RATE_HZ)


def test_a_pole_that_no_step_can_follow_is_told():
    compiled = plain_model([[1e6]], [[1.0]], [[1.0]], [[0.0]])
    with pytest.raises(ModelError, match=r"leaves all numbers within a step of 0\.001 s"):
        integrate(compiled, np.ones((1, 10)), RATE_HZ)


@pytest.mark.parametrize("size", [1e200, math.inf, math.nan])
def test_inputs_that_no_estimator_could_square_are_refused(size):
    compiled = plain_model([[-1.0]], [[1.0]], [[1.0]], [[0.0]])
    with pytest.raises(ModelError, match="input 'u0': sample 3 is"):
        integrate(compiled, np.where(np.arange(10) == 3, size, 1.0)[None], RATE_HZ)


def test_negative_delays_and_tolerances_are_refused():
    compiled = plain_model([[-1.0]], [[1.0]], [[1.0]], [[0.0]], input_delays_s=(-0.1,))
    with pytest.raises(ModelError, match="can only be late"):
        integrate(compiled, np.ones((1, 5)), RATE_HZ)
    with pytest.raises(ModelError, match="must be positive"):
        integrate(compiled, np.ones((1, 5)), RATE_HZ, tolerance=0.0)
