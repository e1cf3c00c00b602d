"""A record on its lines against the simulation that made it."""

from dataclasses import replace

import numpy as np
import pytest

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
    "late by a fraction of a sample": lambda: three_bodies().with_effects(
        [attached("delay", "hammer", {"delay": 2.37 / RATE_HZ})]
    ),
    "prescribed displacement": moved,
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
    signals = band_noise(SAMPLES) * (1e-5 if name == "prescribed displacement" else 1.0)
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
    """A force at the middle body, straight between samples, is an input there."""
    model = chain([2.0, 2.5, 3.0], [5e5, 6e5, 4e5], [40.0, 60.0, 50.0], at=1)
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
