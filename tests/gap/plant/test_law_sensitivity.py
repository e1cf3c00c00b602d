"""Coarse marches with laws, and their slopes: against the integrator, against differences of the march itself."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.law_plant import Setting, coarse_run, fine_run, slopes_of
from chladni.gap.plant.linear_run import is_plain
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.models.integrator.slopes import modal_coordinates
from chladni.models.integrator.trapezoid_march import run_laws
from chladni.signals.errors import ModelError
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

LAWS = {
    "hardening": attached("hardening_stiffness", "j1", {"cubic": 1e12}),
    "quadratic": attached("quadratic_damping", "j2", {"coefficient": 3e3}),
    "coulomb": attached("coulomb_friction", "j1", {"force": 8.0, "creep_speed": 1e-3}),
    "bristle": attached("coulomb_friction", "j1", {"force": 8.0, "presliding": 3e-5}, variant="bristle"),
    "bouc_wen": attached("hysteresis", "j0", {"force": 20.0, "yield": 5e-5, "shape": 2.0}),
    "creeping": attached(
        "hysteresis", "j0", {"force": 20.0, "yield": 5e-5, "slip_speed": 5e-3, "loop": 1.0}, variant="creeping"
    ),
    "backlash": attached("backlash", "j1", {"gap": 2e-5}),
    "drift": attached("varying_stiffness", "j0", {"relative_change": 0.3, "time": 0.7}),
}
SAMPLES = 1000


@pytest.fixture(scope="module")
def run():
    return FreeRun(three_bodies(), measured(three_bodies(), band_noise(SAMPLES))[0], tolerance=1e-9)


def start_in_motion(run, effects):
    initial = np.zeros(len(run.compiled(None, effects).states))
    initial[:3] = 1e-4, -2e-4, 1e-4
    return initial[None]


@pytest.mark.parametrize("name", LAWS)
def test_the_march_converges_to_the_integrator(name, run):
    compiled = three_bodies().with_effects([LAWS[name]]).compile()
    start = start_in_motion(run, (LAWS[name],))
    exact = Integrator(compiled, RATE_HZ, tolerance=1e-10).run(run.measurement.inputs, initial=start[0]).outputs
    errors = []
    for parts in (2, 8):
        equation = run.equations(compiled, parts)
        found = run_laws(equation, ((0, SAMPLES),), start, RATE_HZ).outputs
        errors.append(np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)))
    # Straight lines between steps have order 2: a sixteenth. Contacts and sticking begin inside a step: order 1.
    assert errors[1] < errors[0] * (1 / 10 if name in ("hardening", "quadratic", "drift") else 1 / 2.5)
    assert errors[1] < 5e-3


@pytest.mark.parametrize("name", LAWS)
def test_slopes_are_differences_of_the_march(name, run):
    effect, by = LAWS[name], 1e-6
    z = np.linspace(-0.5, 0.5, 9)
    start = start_in_motion(run, (effect,))
    first = effect.kind.required[0]
    stronger = replace(effect, values={**effect.values, first: effect.values[first] * (1 + by)})
    places = (0, 4, 8)
    changed = [Setting(z + by * np.eye(9)[place], (effect,)) for place in places] + [Setting(z, (stronger,))]
    here = coarse_run(run, Setting(z, (effect,)), start)
    own, starts = slopes_of(run, here, [(setting, by) for setting in changed])
    moved = start.copy()
    moved[0, 4] += 1e-7
    runs = [(coarse_run(run, setting, start), by) for setting in changed]
    runs.append((coarse_run(run, Setting(z, (effect,)), moved), 1e-7))
    for found, (there, size) in zip([*own, starts[4]], runs, strict=True):
        difference = (there.outputs - here.outputs) / size
        # A difference sees the curvature of the laws, and a step in which a contact begins in one run only.
        allowed = 2e-2 if name == "backlash" else 2e-3
        assert np.linalg.norm(found - difference) < allowed * np.linalg.norm(difference)


def test_slopes_along_a_fine_run_are_those_of_fine_runs(run):
    effect, by = LAWS["quadratic"], 1e-3
    start = start_in_motion(run, (effect,))
    z = np.zeros(9)
    here = fine_run(run, Setting(z, (effect,)), start)
    np.testing.assert_array_equal(here.outputs, run.outputs(z, (effect,), start))
    own, _ = slopes_of(run, here, [(Setting(z + by * np.eye(9)[3], (effect,)), by)])
    difference = (run.outputs(z + by * np.eye(9)[3], (effect,), start) - here.outputs) / by
    # The slopes follow the exact run in steps of a sample, whose forces are straight lines.
    assert np.linalg.norm(own[0] - difference) < 0.05 * np.linalg.norm(difference)


def test_slopes_see_what_acts_on_samples(run):
    """A command that saturates and a sensor that clips beside a law: neither is in the equations."""
    law = LAWS["hardening"]

    def effects(limit, clip):
        return (
            law,
            attached("saturation", "hammer", {"limit": limit}),
            attached("clipping", "a1", {"limit": clip}),
        )

    z, by, start = np.zeros(9), 1e-6, start_in_motion(run, (law,))
    here = coarse_run(run, Setting(z, effects(80.0, 20.0)), start)
    changed = [Setting(z, effects(80.0 * (1 + by), 20.0)), Setting(z, effects(80.0, 20.0 * (1 + by)))]
    own, _ = slopes_of(run, here, [(setting, by) for setting in changed])
    for found, setting in zip(own, changed, strict=True):
        difference = (coarse_run(run, setting, start).outputs - here.outputs) / by
        assert np.linalg.norm(difference) > 0
        assert np.linalg.norm(found - difference) < 2e-2 * np.linalg.norm(difference)


def test_each_window_has_its_own_start(run):
    windows = ((0, 400), (400, SAMPLES))
    cut = FreeRun(three_bodies(), run.measurement, windows=windows)
    effect = LAWS["hardening"]
    starts = np.repeat(start_in_motion(run, (effect,)), 2, axis=0)
    here = coarse_run(cut, Setting(np.zeros(9), (effect,)), starts)
    _, found = slopes_of(cut, here, [])
    moved = starts.copy()
    moved[1, 0] += 1e-8
    difference = (coarse_run(cut, Setting(np.zeros(9), (effect,)), moved).outputs - here.outputs) / 1e-8
    assert not difference[:, :400].any()
    np.testing.assert_allclose(found[0][:, 400:], difference[:, 400:], rtol=0, atol=2e-3 * np.abs(difference).max())


def test_modal_coordinates_are_blocks():
    matrix = np.array([[0.0, 1.0, 0.0], [-4.0, -0.2, 0.0], [0.3, 0.0, -1.0]])
    to_modal, from_modal = modal_coordinates(matrix)
    blocks = to_modal @ matrix @ from_modal
    off = blocks.copy()
    off[:2, :2] = off[2, 2] = 0.0
    assert np.abs(blocks).max() > 1
    # One of the orders of a pair and a real one.
    assert min(np.abs(off).max(), np.abs(blocks[0, 1:]).max() + np.abs(blocks[1:, 0]).max()) < 1e-14


def test_a_double_integrator_has_no_modal_coordinates():
    to_modal, from_modal = modal_coordinates(np.array([[1.0, 0.1], [0.0, 1.0]]))
    np.testing.assert_array_equal(to_modal, np.eye(2))
    np.testing.assert_array_equal(from_modal, np.eye(2))


def test_a_model_that_diverges_says_so(run):
    compiled = three_bodies().with_effects([LAWS["hardening"]]).compile()
    equation = run.equations(compiled, 1)
    with pytest.raises(ModelError, match=r"diverges|missed"):
        run_laws(equation, ((0, SAMPLES),), np.full((1, 6), 1e160), RATE_HZ)


def test_a_recursion_from_sample_to_sample_runs_by_itself():
    model = three_bodies().with_effects([LAWS["hardening"]])
    assert not is_plain(model.compile())
    assert is_plain(three_bodies().compile())
