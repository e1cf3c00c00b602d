"""Laws: order of each scheme, agreement with SciPy, refinement, and what is told when it fails."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chladni.models.core.compiled_model import DelayLine
from chladni.models.core.port import Port
from chladni.models.integrator.integrator import Integrator, integrate
from chladni.models.structures.robot_arm import robot_arm
from chladni.signals.errors import ModelError
from tests.models.integrator import systems
from tests.models.integrator.systems import compiled_structure, law, oscillator, plain_model

RATE_HZ = 500.0


def one_body(*laws):
    return compiled_structure(oscillator(), force_at="body", laws=laws)


def two_tones(count, rate_hz, amplitude=20.0):
    times = np.arange(count) / rate_hz
    return amplitude * (np.sin(2 * math.pi * 5 * times) + 0.5 * np.sin(2 * math.pi * 8.3 * times))[None]


SMOOTH = {
    "cubic": law(0, systems.cubic, 2e6),
    "smooth hysteresis": law(0, systems.smooth_hysteresis, 5.0, 2e-3, 0.2, state=(0.0,)),
    "gentle friction": law(0, systems.coulomb, 3.0, 0.3),
}
SWITCHING = {
    "coulomb": law(0, systems.coulomb, 5.0, 1e-4),
    "stribeck": law(0, systems.stribeck, 4.0, 6.0, 0.02, 1e-3),
    "backlash": law(0, systems.backlash, (2 * math.pi * 10) ** 2, 2e-3),
    "stop": law(0, systems.one_sided_stop, 5e4, 2e-3),
    "bouc-wen": law(0, systems.bouc_wen, 5.0, 2e-3, 1.0, state=(0.0,)),
    "quadratic damping": law(0, systems.quadratic_damping, 20.0),
}


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize(("scheme", "order"), [("explicit", 4.0), ("implicit", 5.0)])
def test_order_of_each_scheme_by_regression(name, scheme, order):
    compiled = one_body(SMOOTH[name])
    rates = np.array([400.0, 800.0, 1600.0, 3200.0])
    # Straight lines between the samples of the lowest rate: the same problem at every rate.
    signals = two_tones(61, rates[0])
    truth = integrate(compiled, systems.refined(signals, 32), 32 * rates[0], tolerance=1e-13).states[:, ::32]
    errors = []
    for rate in rates:
        times = round(rate / rates[0])
        run = Integrator(compiled, rate, tolerance=math.inf, scheme=scheme).run(systems.refined(signals, times))
        assert run.refined_steps == 0
        errors.append(systems.relative_rms(run.states[:, ::times], truth))
    slope = np.polyfit(np.log(1 / rates), np.log(errors), 1)[0]
    # The coarsest rate isn't asymptotic; collocation gains up to half an order there.
    assert order - 0.4 <= slope <= order + 1.5


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["smooth hysteresis", *(pytest.param(one, marks=pytest.mark.nightly) for one in ("cubic", "gentle friction"))],
)
def test_smooth_laws_agree_with_scipy_over_fifty_cycles(name):
    compiled = one_body(SMOOTH[name])
    signals = two_tones(200, 20.0)
    # Few samples keep SciPy quick: fifty cycles of the lower tone, whose lines are bent four times a cycle.
    found = integrate(compiled, signals, 20.0).states
    truth = systems.reference_states(compiled, signals, 20.0, method="DOP853", rtol=1e-10, atol=1e-14)
    assert systems.relative_rms(found, truth) <= 1e-5


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "backlash",
        "bouc-wen",
        *(pytest.param(one, marks=pytest.mark.nightly) for one in ("stribeck", "quadratic damping", "stop")),
    ],
)
def test_switching_laws_agree_with_radau_over_ten_cycles(name):
    compiled = one_body(SWITCHING[name])
    signals = two_tones(60, 30.0)
    found = integrate(compiled, signals, 30.0).states
    truth = systems.reference_states(compiled, signals, 30.0, rtol=1e-7, atol=1e-11)
    assert systems.relative_rms(found, truth) <= 1e-4


@pytest.mark.parametrize("name", SWITCHING)
def test_halving_the_step_changes_little(name):
    compiled = one_body(SWITCHING[name])
    signals = two_tones(1000, RATE_HZ)
    whole = integrate(compiled, signals, RATE_HZ)
    half = integrate(compiled, systems.refined(signals, 2), 2 * RATE_HZ)
    assert systems.relative_rms(whole.states, half.states[:, ::2]) <= 1e-4
    assert 0 < whole.refined_steps < 1000
    assert whole.steps > 1000


def test_a_tighter_tolerance_changes_little_where_noise_rattles_in_a_backlash():
    # Each contact that is met a little late is another motion some contacts later.
    spectrum = np.fft.rfft(np.random.default_rng(1).standard_normal(600))
    frequency_hz = np.fft.rfftfreq(600, 1 / 200)
    spectrum[(frequency_hz < 1) | (frequency_hz > 20)] = 0
    signals = np.fft.irfft(spectrum, 600)[None]
    compiled = one_body(SWITCHING["backlash"])
    found = integrate(compiled, 3 * signals / signals.std(), 200.0)
    tight = integrate(compiled, 3 * signals / signals.std(), 200.0, tolerance=1e-10)
    assert systems.relative_rms(found.states, tight.states) <= 1e-4


def test_sticking_friction_holds_a_body_against_a_lower_force():
    # 4 N against 5 N: the body creeps with the regularised law's velocity, w artanh(4/5).
    compiled = plain_model(
        [[0.0]], [[1.0]], [[1.0]], [[0.0]], g=[[-1.0]], h=[[0.0]], motion=([[0.0]], [[0.0]], [[0.0]]),
        velocity_state=np.array([[1.0]]), laws=(law(0, systems.coulomb, 5.0, 1e-6),),
    )  # fmt: skip
    found = integrate(compiled, np.full((1, 200), 4.0), RATE_HZ)
    np.testing.assert_allclose(found.states[0, 1:], 1e-6 * math.atanh(0.8), rtol=1e-6)
    np.testing.assert_allclose(found.force[0, 1:], 4.0, rtol=1e-6)
    assert found.steps < 2000


def test_sliding_friction_stops_a_body_in_closed_form():
    # v falls from 1 m/s by 5 m/s^2: it stands at 0.2 s, after 0.1 m.
    compiled = plain_model(
        [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], g=[[0], [-1]], h=[[0]],
        motion=([[1, 0]], [[0]], [[0]]), velocity_state=np.array([[0.0, 1.0]]),
        laws=(law(0, systems.coulomb, 5.0, 1e-6),),
    )  # fmt: skip
    found = integrate(compiled, np.zeros((1, 200)), RATE_HZ, initial={"x1": 1.0})
    times = np.arange(200) / RATE_HZ
    moving = times < 0.1999
    np.testing.assert_allclose(found.states[0][moving], (times - 2.5 * times**2)[moving], atol=1e-7)
    np.testing.assert_allclose(found.states[0][~moving][2:], 0.1, atol=1e-6)


def test_motion_and_force_at_the_port_are_recorded():
    compiled = one_body(SWITCHING["quadratic damping"])
    found = integrate(compiled, two_tones(300, RATE_HZ), RATE_HZ)
    np.testing.assert_allclose(found.displacement[0], found.states[0], atol=1e-15)
    np.testing.assert_allclose(found.velocity[0], found.states[1], atol=1e-13)
    np.testing.assert_allclose(found.force[0], 20 * found.states[1] * np.abs(found.states[1]), atol=1e-9)
    acceleration = compiled.a[1] @ found.states + two_tones(300, RATE_HZ)[0] - found.force[0]
    np.testing.assert_allclose(found.outputs[2], acceleration, atol=1e-9)


def test_several_laws_at_one_port_add_up():
    signals = two_tones(300, RATE_HZ)
    together = integrate(one_body(law(0, systems.cubic, 1e6), law(0, systems.cubic, 5e5)), signals, RATE_HZ)
    alone = integrate(one_body(law(0, systems.cubic, 1.5e6)), signals, RATE_HZ)
    np.testing.assert_allclose(together.states, alone.states, rtol=0, atol=1e-12)


def test_laws_at_an_input_act_in_order_whatever_the_order_of_the_ports():
    # First a dead band, then a limit: port 1 before port 0, since port 0 sees what port 1 adds.
    compiled = plain_model(
        [[-10.0]], [[10.0]], [[1.0]], [[0.0]], g=[[10.0, 10.0]], h=[[0.0, 0.0]],
        motion=([[0.0], [0.0]], [[1.0], [1.0]], [[0.0, 1.0], [0.0, 0.0]]),
        laws=(law(0, systems.saturation, 1.0), law(1, double, 0.0)),
    )  # fmt: skip
    # The limit is met on a sample, so that limiting the samples is the truth.
    signals = np.linspace(0, 2, 301)[None]
    found = integrate(compiled, signals, RATE_HZ)
    np.testing.assert_allclose(found.displacement[found.ports.index(0)], 2 * signals[0], atol=1e-12)
    expected = integrate(replace(compiled, laws=()), np.minimum(2 * signals, 1.0), RATE_HZ)
    np.testing.assert_allclose(found.outputs[0], expected.outputs[0], atol=1e-7)


def double(d, s, t, parameters, state, rates):
    return d


def test_a_saturated_loop_of_laws_at_once_is_solved():
    # d = u - f at once: an algebraic loop; f = sat(d) - d has one solution in closed form.
    compiled = plain_model(
        [[-5.0]], [[5.0]], [[1.0]], [[0.0]], g=[[0.0]], h=[[1.0]],
        motion=([[0.0]], [[1.0]], [[0.5]]), laws=(law(0, systems.saturation, 1.0),),
    )  # fmt: skip
    signals = np.full((1, 40), 3.0)
    found = integrate(compiled, signals, RATE_HZ)
    # d = 3 + f/2 and f = 1 - d: d = 7/3.
    np.testing.assert_allclose(found.displacement[0], 7 / 3, rtol=1e-9)
    np.testing.assert_allclose(found.force[0], -4 / 3, rtol=1e-9)


def test_a_saturated_axis_in_a_loop_changes_little_when_the_step_is_halved():
    # Position loop around a double integrator with damping, the command limited to 1.
    compiled = plain_model(
        [[0, 1], [-400, -8]], [[0], [400]], [[1, 0]], [[0]], g=[[0], [1]], h=[[0]],
        motion=([[-400, 0]], [[400]], [[0]]), laws=(law(0, systems.saturation, 1.0),),
    )  # fmt: skip
    signals = 0.02 * two_tones(400, 200.0, 1.0)
    found = integrate(compiled, signals, 200.0).states
    half = integrate(compiled, systems.refined(signals, 2), 400.0).states[:, ::2]
    assert systems.relative_rms(found, half) <= 1e-4
    limited = np.abs(400 * (signals[0] - found[0])) > 1
    assert 0.05 < limited.mean() < 0.95


def test_an_output_between_the_samples_sees_the_laws_there():
    compiled = one_body(SMOOTH["cubic"])
    late = replace(compiled, output_offsets_s=(0.0, 0.0, 0.25 / RATE_HZ))
    signals = two_tones(300, RATE_HZ)
    truth = integrate(compiled, systems.refined(signals, 4), 4 * RATE_HZ).outputs[2]
    found = integrate(late, signals, RATE_HZ).outputs[2]
    np.testing.assert_allclose(found[1:], truth[3::4][: found.size - 1], atol=1e-4 * np.abs(truth).max())


def test_a_delayed_spring_agrees_with_a_fine_run():
    # x'' + ... + k x(t - tau): a loop with dead time around a structure, law beside it.
    compiled = replace(one_body(SMOOTH["cubic"]), delays=(DelayLine(port=0, delay_s=0.0031),))
    signals = two_tones(200, RATE_HZ)
    found = integrate(compiled, signals, RATE_HZ).states
    fine = integrate(compiled, systems.refined(signals, 8), 8 * RATE_HZ).states[:, ::8]
    assert systems.relative_rms(found, fine) <= 1e-6


def test_five_bodies_with_friction_in_every_joint():
    laws = tuple(law(port, systems.coulomb, 2.0, 1e-4) for port in range(5))
    compiled = compiled_structure(robot_arm(), force_at="tool", laws=laws)
    signals = two_tones(400, RATE_HZ, 40.0)
    whole = integrate(compiled, signals, RATE_HZ).states
    half = integrate(compiled, systems.refined(signals, 2), 2 * RATE_HZ).states[:, ::2]
    assert systems.relative_rms(whole, half) <= 1e-4


def hard_sign(d, s, t, parameters, state, rates):
    return parameters[0] if s > 0.0 else -parameters[0]


def root_of_displacement(d, s, t, parameters, state, rates):
    return math.sqrt(d - parameters[0])


def runaway(d, s, t, parameters, state, rates):
    return -parameters[0] * d * d * d


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (law(0, root_of_displacement, 1.0), r"'joint' \(root_of_displacement\) gives no number at 0 s"),
        (law(0, runaway, 1e7), r"'joint' \(runaway\)"),
    ],
)
def test_a_law_that_leaves_the_numbers_is_told_with_time_and_place(bad, words):
    with pytest.raises(ModelError, match=words):
        integrate(one_body(bad), two_tones(400, RATE_HZ, 100.0), RATE_HZ)


def test_laws_in_a_loop_without_a_solution_are_told():
    compiled = plain_model(
        [[-1.0]], [[1.0]], [[1.0]], [[0.0]], g=[[0.0]], h=[[0.0]],
        motion=([[0.0]], [[1.0]], [[1.0]]), laws=(law(0, double, 0.0),), ports=(Port(name="valve", kind="input"),),
    )  # fmt: skip
    with pytest.raises(ModelError, match="the laws at valve form an algebraic loop without a solution at 0 s"):
        integrate(compiled, np.ones((1, 5)), RATE_HZ)
