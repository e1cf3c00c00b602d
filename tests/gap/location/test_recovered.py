"""Force and motion at a site: not made of noise where sensors hardly see them, and beside another unknown force."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.location.profile import profiled
from chladni.gap.location.recovered import _unknowns, recovered
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

SAMPLES = 6000
SPRING = attached("hardening_stiffness", "j1", {"cubic": 4e12})
JOINT = Site(name="j1", kind="joint")


def located(machine, *, drift=0.0, others=()):
    """A log with noise below 4 Hz that its floor knows nothing of, and a profile of the spring's joint."""
    log, floor = measured(machine, band_noise(SAMPLES, rms=150.0))
    slow = np.fft.rfft(np.random.default_rng(7).standard_normal(log.outputs.shape))
    slow[:, np.fft.rfftfreq(SAMPLES, 1.0 / RATE_HZ) > 4.0] = 0.0
    log = replace(log, outputs=log.outputs + drift * floor.rms[:, None] * np.fft.irfft(slow))
    run = FreeRun(three_bodies(), log)
    problem = LinearProblem(three_bodies(), log, floor, run.tunables, all_lines(SAMPLES, RATE_HZ))
    return problem, profiled(problem, (JOINT, *others), np.zeros(len(run.tunables.names)))


def true_motion(problem, effects):
    return FreeRun(three_bodies(), problem.measurement).motion(None, effects, site="j1")


@pytest.mark.parametrize("drift", [0.0, 5.0])
def test_motion_is_not_made_of_noise_where_accelerometers_hardly_see_a_force(drift: float) -> None:
    problem, profile = located(three_bodies().with_effects((SPRING,)), drift=drift)
    found = recovered(problem, profile, JOINT).displacement
    truth = true_motion(problem, (SPRING,)).displacement
    assert np.std(found - truth) < 0.2 * np.std(truth)


def test_states_are_those_that_the_machine_went_through() -> None:
    machine = three_bodies().with_effects((SPRING,))
    problem, profile = located(machine)
    found = recovered(problem, profile, JOINT).states(problem)
    compiled = machine.compile()
    truth = Integrator(compiled, RATE_HZ, tolerance=1e-9).run(problem.measurement.inputs).states
    assert compiled.states == three_bodies().compile().states
    apart = np.std(found - truth, axis=1) / np.std(truth, axis=1)
    assert np.all(apart < 0.2)
    # Accelerometers hardly see how a slow force displaces; speeds they do.
    assert np.all(apart[3:] < 0.05)


def test_another_force_is_neither_taken_for_this_one_nor_left_out_of_the_motion() -> None:
    blow = attached("tonal_disturbance", "b2", {"frequency": 60.0, "amplitude": 150.0, "phase": 0.0})
    other = Site(name="b2", kind="body")
    problem, profile = located(three_bodies().with_effects((SPRING, blow)), others=(other,))
    truth = true_motion(problem, (SPRING, blow))
    both, alone = (recovered(problem, profile, JOINT, others) for others in ((other,), ()))
    assert np.std(both.displacement - truth.displacement) < 0.3 * np.std(truth.displacement)
    # Speeds: how a slow force displaces is hardly seen either way.
    apart, without = (np.std(one.velocity - truth.velocity) for one in (both, alone))
    assert apart < 0.2 * np.std(truth.velocity)
    assert apart < 0.6 * without


def test_of_a_sensor_the_signal_is_what_the_model_shows_however_loud_its_noise_is_thought() -> None:
    log, floor = measured(three_bodies(), band_noise(SAMPLES, rms=150.0))
    range_end = 1.3 * np.std(log.outputs[0])
    clipped = np.clip(log.outputs[0], -range_end, range_end)
    seen = replace(log, outputs=np.stack([clipped, *log.outputs[1:]]))
    loud = floor.raised(np.array([np.std(log.outputs[0] - clipped), 0.0, 0.0]))
    problem = LinearProblem(
        three_bodies(), seen, loud, FreeRun(three_bodies(), seen).tunables, all_lines(SAMPLES, RATE_HZ)
    )
    site = Site(name="a0", kind="output")
    found = recovered(problem, profiled(problem, (site,), np.zeros(len(problem.tunables.names))), site)
    assert np.std(found.displacement - log.outputs[0]) < 0.03 * np.std(log.outputs[0])


@pytest.mark.parametrize("apart", [0.0, 1e-12, 1e-9])
def test_where_two_forces_print_one_pattern_their_covariance_has_an_inverse(apart: float) -> None:
    # Of a joint and the ground beside it, driven by a pulse, each beside the other could be of any size.
    rng = np.random.default_rng(0)
    first, other, residual = (rng.standard_normal((3, 60)) + 1j * rng.standard_normal((3, 60)) for _ in range(3))
    transients = rng.standard_normal((2, 3, 60)) + 0j
    patterns, none = [first, first + apart * other], (np.zeros((2, 1)), np.zeros((2, 2)))
    force, _, transient = _unknowns(patterns, residual, transients, *none)
    assert np.all(np.isfinite(force))
    assert np.all(np.isfinite(transient))
