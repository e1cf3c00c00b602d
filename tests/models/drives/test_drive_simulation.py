"""Drives through the integrator: exact where they are linear, bounded where they have limits and stops."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.simulate import simulate
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.models.drives.oracles import named

PNEUMATIC, HYDRAULIC, SERVO = (DRIVES[name] for name in ("pneumatic-motor", "hydraulic-motor", "dc-servo"))
LOOPS = [
    (PNEUMATIC, {}, 200.0),
    (HYDRAULIC, {}, 5e3),
    (HYDRAULIC, {"valve_lag": "on", "correction": "pd2", "loop": "position"}, 5e3),
    (SERVO, {}, 2e4),
    (SERVO, {"loop": "position", "gear": "on", "converter_lag": "on"}, 2e4),
]


def series(model, rate_hz, **samples):
    units = {terminal.name: terminal.unit for terminal in model.compile().inputs}
    channels = tuple(Channel(name=name, unit=units[name]) for name in samples)
    return TimeSeries(values=np.array(list(samples.values())), sample_rate_hz=rate_hz, channels=channels)


def held(model, rate_hz, seconds, **levels):
    """Constant from the first sample on: a step without a ramp."""
    return series(
        model, rate_hz, **{name: np.full(round(seconds * rate_hz), level) for name, level in levels.items()}
    )


def by_scipy(model, excitation):
    """The same equations and laws, called as Python, by Radau; inputs along straight lines."""
    compiled = model.compile()
    time = np.arange(excitation.samples) / excitation.sample_rate_hz
    rows = [[channel.name for channel in excitation.channels].index(t.name) if t.name in
            [channel.name for channel in excitation.channels] else None for t in compiled.inputs]  # fmt: skip

    def forces(t, x):
        u = np.array([0.0 if row is None else np.interp(t, time, excitation.values[row]) for row in rows])
        f = np.zeros(len(compiled.ports))
        # As many passes as ports in a row: what one law adds, the next one sees.
        for _ in range(3):
            d = compiled.displacement_state @ x + compiled.displacement_column @ u + compiled.displacement_port @ f
            s = compiled.velocity_state @ x + compiled.velocity_column @ u + compiled.velocity_port @ f
            f = np.zeros(len(compiled.ports))
            for law in compiled.laws:
                f[law.port] += law.function(d[law.port], s[law.port], t, law.parameters, (), ())
        return u, f

    def rates(t, x):
        u, f = forces(t, x)
        return compiled.a @ x + compiled.b @ u + compiled.g @ f

    found = solve_ivp(
        rates, (0.0, time[-1]), np.zeros(len(compiled.states)), method="Radau", t_eval=time, rtol=1e-8, atol=1e-11,
        max_step=20 / excitation.sample_rate_hz,
    )  # fmt: skip
    return found.y


@pytest.mark.parametrize(("kind", "options", "rate_hz"), LOOPS)
def test_linear_drives_answer_as_scipys(kind, options, rate_hz):
    model = drive_model(kind, {}, options)
    compiled = model.compile()
    rng = np.random.default_rng(11)
    noise = {terminal.name: rng.normal(size=2000) for terminal in compiled.inputs}
    found = simulate(model, series(model, rate_hz, **noise))
    system = (compiled.a, compiled.b, compiled.c, compiled.d)
    _, expected, _ = signal.lsim(system, np.array(list(noise.values())).T, np.arange(2000) / rate_hz)
    for row, terminal in enumerate(compiled.outputs):
        scale = np.abs(expected[:, row]).max()
        np.testing.assert_allclose(
            found.outputs.values[row], expected[:, row], atol=1e-9 * scale, err_msg=terminal.name
        )


def test_a_constant_load_rests_in_the_stop_by_its_force_over_its_stiffness():
    # So little air that it has leaked away within a second.
    values = {"start_position": 2e-4, "leakage": 0.7e-11, "air_volume": 1e-6, "stop_stiffness": 1e7}
    model = drive_model(PNEUMATIC, values, {"end_stops": "on"})
    found = simulate(model, held(model, 500.0, 20.0, load=300.0))
    displacement = found.states[found.state_names.index("displacement")]
    assert displacement[-1] == pytest.approx(-2e-4 - 300.0 / 1e7, rel=1e-6)
    # Arriving at the speed that leakage allows, v sqrt(m/k) deeper at most.
    speed = np.abs(found.states[found.state_names.index("velocity")]).max()
    assert displacement.min() >= -2e-4 - 300.0 / 1e7 - speed * np.sqrt(300.0 / 1e7)
    assert found.flags == ("not driven, taken as zero: flow",)
    values.pop("stop_stiffness")
    free = simulate(drive_model(PNEUMATIC, values), held(model, 500.0, 20.0, load=300.0))
    assert free.states[0].min() < 2 * displacement.min()
    assert any("the stroke ends there" in flag for flag in free.flags)


def test_stops_hold_both_ends_under_a_flow():
    values = {"start_position": 0.001, "stroke": 0.002, "leakage": 0.7e-11}
    model = drive_model(PNEUMATIC, values, {"end_stops": "on"})
    found = simulate(model, held(model, 1000.0, 3.0, flow=50e-6))
    displacement, pressure = found.states[0], found.states[2]
    assert displacement.max() > 0.001
    static = pressure.max() * 70e-4 / 1e8
    speed = 2 * 50e-6 / 70e-4
    assert displacement.max() <= 0.001 + static + speed * np.sqrt(300.0 / 1e8)


def test_saturation_bounds_the_flow_and_the_motor_comes_to_its_reference():
    options = {"saturation": "on", "valve_lag": "on", "loop": "position"}
    model = drive_model(HYDRAULIC, {}, options)
    found = simulate(model, held(model, 5e3, 1.0, reference=0.1))
    rows = named(model.compile().outputs)
    flow, displacement = (found.outputs.values[rows.index(name)] for name in ("motor_flow", "displacement"))
    assert np.abs(flow).max() == pytest.approx(400e-6, rel=1e-9)
    assert displacement[-1] == pytest.approx(0.1, rel=1e-3)
    assert any("the valve's dead zone or saturation acts" in flag for flag in found.flags)
    # Without it the loop asks for four times as much.
    free = simulate(
        drive_model(HYDRAULIC, {}, {**options, "saturation": "off"}), held(model, 5e3, 1.0, reference=0.1)
    )
    assert np.abs(free.outputs.values[rows.index("motor_flow")]).max() > 1e-3


def test_inside_its_dead_zone_a_valve_gives_no_flow():
    model = drive_model(HYDRAULIC, {"valve_overlap": 0.1}, {"dead_zone": "on"})
    found = simulate(model, held(model, 2e3, 0.2, flow=39e-6))
    flow = found.outputs.values[named(model.compile().outputs).index("motor_flow")]
    # The command and what the valve takes away cancel to rounding.
    assert np.abs(flow).max() <= np.finfo(float).eps * 39e-6


def test_a_dead_zone_leaves_its_half_width_over_the_gain():
    model = drive_model(HYDRAULIC, {}, {"dead_zone": "on", "loop": "position"})
    found = simulate(model, held(model, 2e3, 2.0, reference=0.01))
    p = model.parameters.numbers()
    left = p["valve_overlap"] * p["rated_flow"] / p["position_gain"]
    assert 0.01 - found.states[0, -1] == pytest.approx(left, rel=1e-3)


def test_seals_hold_the_piston_against_a_small_load():
    moved = []
    for word in ("on", "off"):
        model = drive_model(PNEUMATIC, {}, {"seal_friction": word})
        moved.append(np.abs(simulate(model, held(model, 1e3, 3.0, load=10.0)).states[0]).max())
    # The bristle yields at 0.13 mm; the air alone gives way by 10 N over A^2/c = 46 kN/m, and swings beyond.
    assert moved[0] < 0.13e-3
    assert moved[1] > 0.2e-3


@pytest.mark.parametrize(
    ("kind", "values", "options", "rate_hz", "seconds", "levels"),
    [
        (HYDRAULIC, {}, {"saturation": "on", "dead_zone": "on", "valve_lag": "on", "loop": "position"}, 2e4, 0.2,
         {"reference": 0.05}),
        pytest.param(SERVO, {"current_limit": 8.0, "voltage_limit": 24.0},
                     {"loop": "velocity", "voltage_limiter": "on", "current_limiter": "on", "converter_lag": "on"},
                     2e4, 0.05, {"velocity_reference": 150.0, "load_torque": 0.2}, marks=pytest.mark.nightly),
    ],
)  # fmt: skip
def test_limits_in_loops_agree_with_scipy(kind, values, options, rate_hz, seconds, levels):
    model = drive_model(kind, values, options)
    excitation = held(model, rate_hz, seconds, **levels)
    found, expected = simulate(model, excitation), by_scipy(model, excitation)
    assert found.state_names == model.compile().states
    for name, ours, theirs in zip(found.state_names, found.states, expected, strict=True):
        # 1e-4 is what switching laws are held to.
        assert np.sqrt(np.mean((ours - theirs) ** 2)) <= 1e-4 * np.sqrt(np.mean(theirs**2)), name


def test_voltage_and_current_keep_their_limits():
    options = {"loop": "velocity", "voltage_limiter": "on", "current_limiter": "on"}
    model = drive_model(SERVO, {"voltage_limit": 24.0, "current_limit": 8.0}, options)
    found = simulate(model, held(model, 2e4, 0.1, velocity_reference=150.0))
    for name, limit in (("voltage_limit", 24.0), ("current_reference_limit", 8.0)):
        motion = found.motion(name)
        assert np.abs(motion.displacement).max() > limit
        assert np.abs(motion.displacement + motion.force).max() <= limit * (1 + 1e-12)
    velocity = found.outputs.values[named(model.compile().outputs).index("velocity")]
    assert velocity[-1] == pytest.approx(150.0, rel=1e-6)
    assert len([flag for flag in found.flags if "limit acts" in flag]) == 2


def test_an_integral_that_tracks_its_limit_does_not_wind_up():
    def untracked(values, options):
        return [replace(loop, tracking=()) for loop in SERVO.loops(values, options)]

    values = {"current_limit": 4.0, "velocity_weight": 1.0}
    options = {"loop": "velocity", "current_limiter": "on"}
    overshoot = []
    for kind in (SERVO, replace(SERVO, loops=untracked)):
        model = drive_model(kind, values, options)
        found = simulate(model, held(model, 1e4, 0.2, velocity_reference=200.0))
        overshoot.append(found.outputs.values[3].max() / 200.0 - 1)
    assert overshoot[0] < 0.02
    assert overshoot[1] > 5 * overshoot[0]


def test_friction_at_the_piston_holds_it_against_a_small_load():
    friction = attached("coulomb_friction", "piston", {"force": 150.0})
    still = drive_model(PNEUMATIC).with_effects([friction])
    moved = [np.abs(simulate(model, held(model, 200.0, 5.0, load=100.0)).states[0]).max()
             for model in (still, drive_model(PNEUMATIC))]  # fmt: skip
    # The law is regularised: it creeps where it should stick.
    assert moved[0] < 0.2 * moved[1]
