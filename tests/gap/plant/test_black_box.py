"""A black box against the equations that are in it: what its runs tell is what a linear view knows."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.gap.location.profile import profile_at
from chladni.gap.plant.black_box import BlackBox, BlackBoxRuns
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site, placed, sites_of
from chladni.gap.plant.record_lines import all_lines, segment_lines
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Terminal
from chladni.models.integrator.integrator import Integrator
from chladni.models.simulators.callable_simulator import callable_simulator
from chladni.models.simulators.wrapped_simulator import WrappedSimulator
from tests.models.simulators.slide import STIFFNESS, in_python, model

RATE_HZ, SAMPLES = 100.0, 600


def box():
    """The same, behind a function that tells nothing but outputs."""

    def respond(inputs, sample_rate_hz, values, _joint_laws):
        return Integrator(model().with_values(values).compile(), sample_rate_hz).run(inputs).outputs

    stiffness = Parameter(
        name="guide.stiffness", value=STIFFNESS, unit="N/m", low=100.0, high=5e3, minimum=0.0, tolerance=0.05
    )
    simulator = callable_simulator(
        respond,
        name="slide",
        inputs=(Terminal(name="push", unit="N"),),
        outputs=(Terminal(name="place", unit="m"), Terminal(name="speed", unit="m/s")),
        parameters=Parameters((stiffness,)),
    )
    return WrappedSimulator(simulator=simulator)


def log_of(plant, force):
    inputs = np.random.default_rng(0).normal(size=(1, SAMPLES)) if force is None else force
    outputs = plant.respond(inputs, RATE_HZ).outputs
    return Measurement(
        log="made", sample_rate_hz=RATE_HZ, inputs=inputs, outputs=outputs,
        input_names=("push",), output_names=("place", "speed"), output_units=("m", "m/s"),
    )  # fmt: skip


def white(measurement, share=1e-3):
    rms = share * measurement.outputs.std(axis=1)
    return NoiseFloor(
        rms=rms, whitening=np.ones((2, 1)), innovation_rms=rms, method=("periods",) * 2,
        std=np.full(2, 0.01), upper_bound=np.zeros(2, dtype=bool),
    )  # fmt: skip


def problem_of(plant, measurement, lines=None):
    lines = all_lines(measurement.samples, RATE_HZ) if lines is None else lines
    return LinearProblem(plant, measurement, white(measurement), Tunables.of(plant), lines)


def test_only_what_responds_is_a_black_box():
    assert isinstance(box(), BlackBox)
    assert not isinstance(model(), BlackBox)


@pytest.mark.parametrize("segment", [None, 150])
def test_pulses_tell_what_a_change_of_an_input_prints(segment):
    measurement = log_of(box(), None)
    lines = None if segment is None else segment_lines(segment, samples=SAMPLES, sample_rate_hz=RATE_HZ)
    known = LinearProblem(model(), measurement, white(measurement), Tunables.of(model()), all_lines(SAMPLES, RATE_HZ))
    told = problem_of(box(), measurement, lines)
    found, exact = (
        one.view(np.zeros(len(one.tunables.names))) for one in (told, known if segment is None else known.on(lines))
    )
    patterns = [view.pattern(view.way_of_input("push")) for view in (found, exact)]
    # The record is six times as long as the slide rings: e^-6 of the answer is cut off.
    assert np.abs(patterns[0] - patterns[1]).max() < 5e-3 * np.abs(patterns[1]).max()


def test_slopes_are_those_of_its_runs():
    measurement = log_of(box(), None)
    told = problem_of(box(), measurement)
    slope = told.slopes(np.zeros(1), np.zeros((0, 1)), ())[0]
    step = 1e-4
    exact = (told.view(np.array([step])).forced() - told.view(np.zeros(1)).forced()) * told.weight / step
    assert np.abs(slope - exact).max() < 0.05 * np.abs(exact).max()


def test_a_missing_change_of_an_input_explains_all_up_to_the_records_end():
    rng = np.random.default_rng(3)
    inputs = rng.normal(size=(1, SAMPLES))
    # It acts until the last sample, so that the machine is in motion when the record ends.
    measurement = replace(log_of(box(), inputs + 0.3 * rng.normal(size=inputs.shape)), inputs=inputs)
    told = problem_of(box(), measurement)
    alone, with_force = (profile_at(told, sites, np.zeros(1)) for sites in ((), (Site(name="push", kind="input"),)))
    assert with_force.misfit < 1e-4 * alone.misfit


def test_a_force_at_a_joint_and_a_push_on_its_body_are_one_place():
    plant = in_python()
    measurement = log_of(WrappedSimulator(simulator=plant), None)
    told = problem_of(WrappedSimulator(simulator=plant), measurement)
    view = told.view(np.zeros(len(told.tunables.names)))
    sites = sites_of(view.compiled, measurement.output_names)
    names = [place.names for place in placed(view, sites, measurement.output_names, told.noise)]
    assert names[0] == ("guide", "push")
    assert names[1:] == [("place",), ("speed",)]


def test_runs_carry_effects_and_tell_what_laws_saw():
    measurement = log_of(WrappedSimulator(simulator=in_python()), None)
    run = FreeRun(WrappedSimulator(simulator=in_python()), measurement)
    friction = chladni.attached("coulomb_friction", "guide", {"force": 0.1, "creep_speed": 0.02})
    z = np.zeros(len(run.tunables.names))
    assert run.is_black_box
    assert np.array_equal(run.outputs(), measurement.outputs)
    slower = run.outputs(z, (friction,))
    displacement, velocity = run.law_motion(z, (friction,), np.zeros((1, 0)), site="guide")
    assert slower[1].std() < measurement.outputs[1].std()
    assert np.allclose([displacement, velocity], slower)
    force = run.motion(z, (friction,), site="guide").force
    assert np.allclose(force, 0.1 * np.tanh(velocity / 0.02))


def test_a_sensor_that_answers_by_the_pose_says_little_of_where_a_force_is():
    def respond(inputs, _sample_rate_hz, _values, _joint_laws):
        # A weak echo, and its square, which a small change moves by twice what stands there.
        way = np.cumsum(inputs[0]) / 30.0
        return np.array([inputs[0], way**2])

    simulator = callable_simulator(
        respond,
        name="bent",
        inputs=(Terminal(name="push", unit="N"),),
        outputs=(Terminal(name="place", unit="m"), Terminal(name="speed", unit="m/s")),
    )
    plant = WrappedSimulator(simulator=simulator)
    measurement = log_of(plant, None)
    plain, bent = BlackBoxRuns(plant, Tunables.of(plant), measurement).doubt()
    assert plain < 1e-12
    assert bent > 0.1
