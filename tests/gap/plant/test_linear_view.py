"""A record on its lines against the simulation that made it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete

from chladni.gap.plant.linear_view import LinearView
from chladni.gap.plant.record_lines import all_lines, segment_lines
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure import Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, band_noise, chain, three_bodies

SAMPLES = 1500


def free_body():
    """Nothing holds the chain: a double pole at zero."""
    model = three_bodies()
    first = replace(model.structure.joints[0], stiffness=0.0, damping=0.0)
    return replace(model, structure=replace(model.structure, joints=(first, *model.structure.joints[1:])))


def controlled():
    """The last body is held at a reference by a law with a rate; the reference is the first input."""
    outputs = (StructureOutput(name="x2", measures="displacement", at="b2"), *three_bodies().outputs)
    law = Controller(
        name="axis", feedback="x2", drives="hammer", law="pd", gains={"kp": 3e4, "kd": 120.0}, rate_of="feedback"
    )
    return replace(three_bodies(), outputs=outputs, controllers=(law,))


def moved():
    """The first body's motion is prescribed."""
    return replace(three_bodies(), inputs=(StructureInput(name="shaker", kind="displacement", at="b0"),))


def late():
    """Driven with dead time."""
    return three_bodies().with_effects([attached("delay", "hammer", {"delay": 2.37 / RATE_HZ})])


def bare():
    """No body moves against the ground but through a damper: poles at zero beside fast ones."""
    structure = three_bodies().structure
    joints = (Joint(name="j0", between=("ground", "b0"), stiffness=0.0, damping=40.0), *structure.joints[1:])
    return replace(three_bodies(), structure=Structure(bodies=structure.bodies, joints=joints))


MODELS = {
    "chain": three_bodies,
    "free body": free_body,
    "damper only": bare,
    "controller": controlled,
    "late by a fraction of a sample": late,
    "prescribed displacement": moved,
    "held": lambda: three_bodies().with_holds({"hammer": "zoh"}),
    "held and late": lambda: late().with_holds({"hammer": "zoh"}),
    "band-limited": lambda: three_bodies().with_holds({"hammer": "band_limited"}),
    "band-limited and late": lambda: late().with_holds({"hammer": "band_limited"}),
    "prescribed displacement, band-limited": lambda: moved().with_holds({"shaker": "band_limited"}),
    "controller, band-limited": lambda: controlled().with_holds({"axis": "band_limited"}),
}


def viewed(model, lines, signals):
    compiled = model.compile()
    return LinearView(compiled, lines, signals, tuple(range(len(compiled.outputs))))


def left_of(view, outputs):
    """What neither inputs nor any transients explain, over what they do; and the transients."""
    measured = view.lines.spectrum(outputs)
    rest = measured - view.forced()
    printed = view.transients()
    stacked = printed.reshape(len(printed), -1).T
    scale = np.linalg.norm(stacked, axis=0)
    matrix = np.concatenate([stacked.real, stacked.imag]) / scale
    flat = np.moveaxis(rest, 1, 0).reshape(rest.shape[1], -1).T
    found = np.linalg.lstsq(matrix, np.concatenate([flat.real, flat.imag]), rcond=None)[0]
    transient = found / scale[:, None]
    return np.abs(measured - view.response(transient, ())).max() / np.abs(measured).max(), transient


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("segments", [False, True])
def test_inputs_and_transients_make_the_whole_record(name, segments):
    model = MODELS[name]()
    signals = band_noise(SAMPLES) * (1e-5 if name.startswith("prescribed") else 1.0)
    compiled = model.compile()
    initial = 1e-4 * np.random.default_rng(1).standard_normal(len(compiled.states))
    outputs = Integrator(compiled, RATE_HZ).run(signals, initial=initial).outputs
    lines = (
        segment_lines(300, samples=SAMPLES, sample_rate_hz=RATE_HZ)
        if segments
        else all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    )
    # Near a double pole at zero the lowest line loses the square of its distance: 1e-16/(2 pi/1500)^2 = 6e-12.
    assert left_of(viewed(model, lines, signals), outputs)[0] < 1e-9


def test_a_transient_is_the_start_less_the_end():
    model = three_bodies()
    signals = band_noise(SAMPLES + 1)
    initial = 1e-3 * np.random.default_rng(1).standard_normal(6)
    run = Integrator(model.compile(), RATE_HZ).run(signals, initial=initial)
    lines = all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    # The last step runs to the sample after the record, which a log hasn't: here it's there.
    view = viewed(model, lines, signals)
    transient = (run.states[:, 0] - run.states[:, SAMPLES])[:, None]
    measured = lines.spectrum(run.outputs[:, :SAMPLES])
    assert np.abs(view.response(transient, ()) - measured).max() < 1e-9 * np.abs(measured).max()


def test_a_force_at_a_port_prints_its_pattern():
    """A force at the middle body is a band-limited input there."""
    model = chain([2.0, 2.5, 3.0], [5e5, 6e5, 4e5], [40.0, 60.0, 50.0], at=1).with_holds({"hammer": "band_limited"})
    signals = band_noise(SAMPLES)
    lines = all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    view = viewed(model, lines, signals)
    asked = view.way_of_port(view.compiled.port_index("b1", "body"))
    wanted = view.way_of_input("hammer")
    np.testing.assert_allclose(view.pattern(asked), view.pattern(wanted), rtol=1e-9)
    force = lines.spectrum(signals)[0]
    start = np.zeros((6, 1))
    silent = viewed(model, lines, np.zeros_like(signals)).response(start, [(asked, force)])
    np.testing.assert_allclose(silent, view.pattern(asked)[:, None] * force, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(
    ("hold", "share", "most"), [("band_limited", 0.25, 1e-4), ("band_limited", 0.45, 2e-3), ("zoh", 0.45, 1e-9)]
)
def test_the_lines_are_those_of_the_equations_in_continuous_time(hold, share, most):
    """Pintelon and Schoukens, 2nd ed., chapter 13: ``H(j omega)`` of a band-limited input, and of a force.

    Of a held one ``sum over k of H(s_k) (1 - e^(-s T))/(s_k T)`` at the images s_k, which leaves the matrix of SciPy.
    """
    model = three_bodies().with_holds({"hammer": hold})
    lines = all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    view = viewed(model, lines, band_noise(SAMPLES))
    compiled, seen = model.compile(), lines.cycles <= share
    if hold == "zoh":
        a, b, c, d, _ = cont2discrete((compiled.a, compiled.b, compiled.c, compiled.d), 1 / RATE_HZ)
        inverse = np.linalg.inv(lines.z[:, None, None] * np.eye(6) - a)
        truth = np.moveaxis(c @ inverse @ b + d, 0, -1)[:, 0]
    else:
        truth = compiled.frequency_response(lines.frequency_hz)[:, 0]
    found = view.pattern(view.way_of_input("hammer"))
    assert np.abs(found - truth)[:, seen].max() < most * np.abs(truth[:, seen]).max()
    if hold == "band_limited":
        # The hammer hits the last body: a force there is the same.
        force = view.pattern(view.way_of_port(compiled.port_index("b2", "body")))
        np.testing.assert_allclose(force, found, rtol=1e-8)


@pytest.mark.parametrize("lines_of", ["a record without periods", "segments"])
def test_a_band_limited_log_is_explained_by_its_equations(lines_of):
    """Lines off the record's own, from a start in motion: steady states in closed form, and the log's ends told."""
    rng = np.random.default_rng(4)
    model = three_bodies()
    compiled = model.compile()
    frequency_hz = rng.uniform(0.004, 0.4, 40) * RATE_HZ
    amplitude = np.exp(2j * np.pi * rng.uniform(size=40))
    wave = np.exp(2j * np.pi * frequency_hz[:, None] * np.arange(SAMPLES) / RATE_HZ)
    signals = (amplitude @ wave).real[None]
    outputs = ((compiled.frequency_response(frequency_hz)[:, 0] * amplitude) @ wave).real
    lines = (
        segment_lines(300, samples=SAMPLES, sample_rate_hz=RATE_HZ)
        if lines_of == "segments"
        else all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    )
    left = {
        hold: left_of(viewed(model.with_holds({"hammer": hold}), lines, signals), outputs)[0]
        for hold in ("band_limited", "foh")
    }
    assert left["band_limited"] < 1e-3
    assert left["foh"] > 0.01


def test_motion_at_a_port_is_what_sensors_there_would_measure():
    measures = ("displacement", "velocity")
    outputs = tuple(StructureOutput(name=measure, measures=measure, at="j1") for measure in measures)
    model = replace(three_bodies(), outputs=outputs)
    lines = all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    view = viewed(model, lines, band_noise(SAMPLES))
    rng = np.random.default_rng(0)
    transient = rng.standard_normal((6, 1))
    force = rng.standard_normal((1, lines.index.size)) + 0j
    forces = [(view.way_of_port(view.compiled.port_index("b0", "body")), force)]
    found = np.stack(view.motion(view.compiled.port_index("j1", "joint"), transient, forces))
    np.testing.assert_allclose(found, view.response(transient, forces), rtol=1e-8)


def test_an_error_of_a_sensor_prints_on_it_alone():
    model = three_bodies()
    view = viewed(model, all_lines(SAMPLES, sample_rate_hz=RATE_HZ), band_noise(SAMPLES))
    np.testing.assert_allclose(np.abs(view.pattern(view.way_of_output(1)))[:, 0], [0.0, 1.0, 0.0], atol=1e-15)


def test_a_late_clock_turns_an_output_and_leaves_the_others():
    late = 0.3 / RATE_HZ
    model = replace(
        three_bodies(),
        outputs=tuple(StructureOutput(name=f"x{i}", measures="displacement", at=f"b{i}") for i in range(3)),
    )
    # Whole periods far below half the rate: between its samples a line is the sine that it stands for, but for the
    # square of its share of the rate.
    time = np.arange(6 * SAMPLES) / RATE_HZ
    signals = np.sin(2 * np.pi * 20 * RATE_HZ / SAMPLES * time)[None]
    shifted = model.with_effects([attached("time_offset", "x1", {"offset": late})])
    outputs = Integrator(shifted.compile(), RATE_HZ).run(signals).outputs[:, -SAMPLES:]
    lines = all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    view, plain = (viewed(one, lines, signals[:, -SAMPLES:]) for one in (shifted, model))
    line = 19
    measured = lines.spectrum(outputs)[:, 0, line]
    assert np.abs(view.forced()[:, 0, line] / measured - 1).max() < 1e-3
    assert np.abs(plain.forced()[1, 0, line] / measured[1] - 1) > 2e-2
