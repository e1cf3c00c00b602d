"""The integrator against other integrators and exact solutions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, cont2discrete, lsim

from chladni_withheld.networks import laws
from chladni_withheld.networks.excitation import Signal
from chladni_withheld.networks.machine import Addition, Element, Link, Recorder, Satellite, record
from chladni_withheld.networks.network import GROUND, Drive, Sensor
from tests.withheld.networks.machines import grid, signal_of, two_bodies


def push(times_s):
    return 20 * np.sin(2 * np.pi * 17.0 * times_s) + 15 * np.cos(2 * np.pi * 31.0 * times_s + 0.4)


def state_space(network):
    mass, damping, stiffness = network.matrices()
    inverse, count = np.linalg.inv(mass), len(mass)
    a = np.block([[np.zeros((count, count)), np.eye(count)], [-inverse @ stiffness, -inverse @ damping]])
    b = np.vstack([np.zeros((count, len(network.drives))), inverse @ network.forces()])
    return a, b


def shown(network, x, u, a, b):
    """What the sensors of `two_bodies` show of states, by hand."""
    acceleration = (x @ a.T + u @ b.T)[:, 2:]
    joint = network.joints[1]
    way, speed = x[:, 1] - x[:, 0], x[:, 3] - x[:, 2]
    return np.array([acceleration[:, 0], x[:, 1], speed, joint.stiffness * way + joint.damping * speed])


def rms(values):
    return np.sqrt(np.mean(values**2, axis=-1))


def test_a_linear_machine_moves_as_scipy_moves_it():
    network, at = two_bodies(), grid()
    recording = record(network, (), [signal_of(push, at)], Recorder(grid=at))
    a, b = state_space(network)
    times_s = at.half_times_s()[::2]
    u = push(times_s)[:, np.newaxis]
    # Sixteen straight lines a sample are as near as 1e-3 of a sample's sixteenth.
    _, x, _ = lsim(StateSpace(a, b, np.eye(4), np.zeros((4, 1))), u, times_s - times_s[0])
    exact = shown(network, x, u, a, b)[:, at.before * at.over :: at.over][:, : at.samples]
    assert np.all(rms(recording.outputs - exact) < 2e-3 * rms(exact))


def test_a_held_command_moves_it_exactly_as_the_sampled_state_space():
    network, at = two_bodies(), grid()
    values = np.random.default_rng(3).normal(0, 10, at.before + at.samples)
    held = Signal(values=np.append(np.repeat(values, 2 * at.over), values[-1]), jumps=True)
    recording = record(network, (), [held], Recorder(grid=at))
    a, b = state_space(network)
    step_a, step_b, *_ = cont2discrete((a, b, np.eye(4), np.zeros((4, 1))), 1 / at.rate_hz)
    x = np.zeros((len(values), 4))
    for number in range(1, len(values)):
        x[number] = step_a @ x[number - 1] + step_b[:, 0] * values[number - 1]
    exact = shown(network, x, values[:, np.newaxis], a, b)[:, at.before :]
    assert np.all(rms(recording.outputs - exact) < 1e-5 * rms(exact))
    assert_allclose(recording.inputs[0], values[at.before :])


def moved_by_scipy(network, at, extra_force, method, states=0):
    """`two_bodies` with a force of `extra_force(way, speed, states)` across the bush, and its states' rates."""
    a, b = state_space(network)

    def slope(t, y):
        force, rates = extra_force(y[1] - y[0], y[3] - y[2], y[4:])
        base = a @ y[:4] + b[:, 0] * push(t)
        base[2] += force / network.masses[0]
        base[3] -= force / network.masses[1]
        return np.concatenate([base, rates])

    times_s = np.arange(at.samples) / at.rate_hz
    start_s = -at.before / at.rate_hz
    run = solve_ivp(
        slope, (start_s, times_s[-1]), np.zeros(4 + states), method=method, t_eval=times_s, rtol=1e-8, atol=1e-12
    )
    return run.y


def _wires(d, _s, _z):
    return 3e5 * d * (1 - 1e-3 / np.hypot(1e-3, d)), []


def _orifice(_d, s, _z):
    return 900 * s * np.hypot(s, 0.02), []


def _contact(d, s, _z):
    return max(4e8 * max(d - 1e-4, 0) ** 1.5 * (1 + 0.5 * s), 0), []


def _relaxation(_d, s, z):
    return 6e4 * z[0], [s - z[0] / 4e-3]


def _friction(_d, s, z):
    rate = s - 2e5 * abs(s) * z[0] / (4.0 + 2.0 / (1 + (s / 0.05) ** 2))
    return 2e5 * z[0] + 5.0 * rate, [rate]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("numbers", "code", "law", "method", "states"),
    [
        ((3e5, 1e-3), laws.WIRES, _wires, "DOP853", 0),
        ((900.0, 0.02), laws.TURBULENT, _orifice, "DOP853", 0),
        ((4e8, 1e-4, 0.5, 1.0), laws.HERTZ, _contact, "DOP853", 0),
        ((6e4, 4e-3), laws.RELAXATION, _relaxation, "Radau", 1),
        ((2e5, 4.0, 2.0, 0.05, 5.0), laws.BRISTLE, _friction, "Radau", 1),
    ],
)
def test_a_law_moves_it_as_scipy_moves_it(numbers, code, law, method, states):
    network, at = two_bodies(), grid(samples=150, before=50, over=64)
    addition = Addition(elements=(Element(code=code, first=0, second=1, numbers=numbers, joint=1),))
    recording = record(network, (addition,), [signal_of(push, at)], Recorder(grid=at))
    y = moved_by_scipy(network, at, law, method, states)
    without = record(network, (), [signal_of(push, at)], Recorder(grid=at))
    own, other = recording.outputs[1], y[1]
    assert rms(own - other) < 2e-4 * rms(other)
    assert rms(without.outputs[1] - other) > 0.02 * rms(other)
    forces = np.array([law(d, s, z)[0] for d, s, z in zip(y[1] - y[0], y[3] - y[2], y[4:].T, strict=True)])
    joint = network.joints[1]
    load = joint.stiffness * (y[1] - y[0]) + joint.damping * (y[3] - y[2]) + forces
    assert rms(recording.outputs[3] - load) < 1e-3 * rms(load)


def test_half_the_step_leaves_a_sixteenth_of_the_error():
    network = two_bodies()
    element = Element(code=laws.WIRES, first=0, second=1, numbers=(3e5, 1e-3))
    found = {}
    for over in (4, 8, 64):
        at = grid(samples=300, over=over)
        addition = Addition(elements=(element,))
        found[over] = record(network, (addition,), [signal_of(push, at)], Recorder(grid=at)).outputs[1]
    ratio = rms(found[4] - found[64]) / rms(found[8] - found[64])
    assert 12 < ratio < 20


def test_a_satellite_and_a_link_are_a_body_and_a_joint_that_the_network_could_have():
    network, at = two_bodies(), grid()
    signal = signal_of(push, at)
    link = Addition(links=(Link(first=0, second=1, stiffness=1e4, damping=2.0),))
    stiffer = network.with_numbers({"bush.stiffness": 6e4, "bush.damping": 8.0})
    linked = record(network, (link,), [signal], Recorder(grid=at)).outputs
    assert_allclose(linked[:3], record(stiffer, (), [signal], Recorder(grid=at)).outputs[:3], rtol=1e-9, atol=1e-12)
    # A thing on a spring a thousand times stiffer than all else is a mass.
    stuck = Addition(satellites=(Satellite(host=1, mass=0.3, stiffness=1e8, damping=3e3),))
    heavier = network.with_numbers({"head.mass": 1.5})
    fine = grid(over=64)
    moved = record(network, (stuck,), [signal_of(push, fine)], Recorder(grid=fine)).outputs
    assert np.all(
        rms(moved - record(heavier, (), [signal_of(push, fine)], Recorder(grid=fine)).outputs) < 5e-3 * rms(moved)
    )


def test_accelerometers_feel_a_shaken_ground_and_slow_shaking_moves_all_alike():
    sensors = (
        Sensor(name="acc_head", measures="acceleration", where="body", at=1),
        Sensor(name="pos_head", measures="displacement", where="body", at=1),
    )
    network = two_bodies(drives=(Drive(name="floor", where="ground", at=GROUND),), sensors=sensors)
    at = grid(samples=2000, before=2000)
    ground = signal_of(lambda t: np.sin(2 * np.pi * 0.5 * t), at)
    recording = record(network, (), [ground], Recorder(grid=at))
    assert_allclose(recording.outputs[0], recording.inputs[0], atol=2e-3)
    assert np.abs(recording.outputs[1]).max() < 2e-4
    unknown = Addition(floor=ground.values)
    silent = Signal(values=np.zeros_like(ground.values))
    assert_allclose(record(network, (unknown,), [silent], Recorder(grid=at)).outputs, recording.outputs, atol=1e-12)


def test_an_actuator_in_a_joint_pushes_its_second_body_and_pulls_its_first():
    network = two_bodies(drives=(Drive(name="actuator", where="joint", at=1),))
    by_pair = two_bodies(drives=(Drive(name="on", where="body", at=1), Drive(name="off", where="body", at=0)))
    at = grid()
    signal = signal_of(push, at)
    opposite = Signal(values=-signal.values)
    one = record(network, (), [signal], Recorder(grid=at)).outputs
    two = record(by_pair, (), [signal, opposite], Recorder(grid=at)).outputs
    assert_allclose(one, two, rtol=1e-9, atol=1e-12)


def test_skew_coupling_gives_no_energy():
    """Undamped, from a push: what a gyroscopic pair exchanges is neither made nor lost."""
    free = two_bodies().with_numbers({"mount.damping": 0.0, "bush.damping": 0.0, "strut.damping": 0.0})
    sensors = tuple(
        Sensor(name=f"{measures}{body}", measures=measures, where="body", at=body)
        for measures in ("displacement", "velocity")
        for body in (0, 1)
    )
    network = two_bodies(joints=free.joints, sensors=sensors)
    at = grid(samples=500, before=0, over=64)
    kick = signal_of(lambda t: 50 * np.exp(-0.5 * ((t - 0.02) / 0.004) ** 2), at)
    outputs = record(network, (Addition(skew=((0, 1, 40.0),)),), [kick], Recorder(grid=at)).outputs[:, 50:]
    mass, _, stiffness = network.matrices()
    x, v = outputs[:2], outputs[2:]
    energy = 0.5 * np.einsum("it,ij,jt->t", v, mass, v) + 0.5 * np.einsum("it,ij,jt->t", x, stiffness, x)
    assert np.ptp(energy) < 1e-5 * energy.mean()
    plain = record(network, (), [kick], Recorder(grid=at)).outputs[:, 50:]
    assert np.all(rms(outputs - plain) > 0.05 * rms(plain))
