"""Marches with dead time in a loop, and their slopes: against the integrator, against differences of the march."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.law_plant import Setting, coarse_run, fine_run, slopes_of
from chladni.gap.plant.linear_run import is_plain
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.models.integrator.trapezoid_march import run_laws
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

SAMPLES = 500
LAW = attached("hardening_stiffness", "j1", {"cubic": 1e12})
#: Dead times in samples: inside the step, inside the one before, whole and far behind.
SAMPLES_LATE = (0.4, 1.3, 3.0, 7.6)
#: Beside a law the last is the hardest: far behind, and between samples.
BESIDE = [
    *(pytest.param(samples, (), id=f"{samples}-alone") for samples in SAMPLES_LATE),
    pytest.param(7.6, (LAW,), id="7.6-beside a law"),
    *(
        pytest.param(samples, (LAW,), id=f"{samples}-beside a law", marks=pytest.mark.nightly)
        for samples in SAMPLES_LATE[:-1]
    ),
]


def loop():
    """A servo at the third body whose command comes late."""
    outputs = (StructureOutput(name="x2", measures="displacement", at="b2"), *three_bodies().outputs)
    law = Controller(
        name="axis", feedback="x2", drives="hammer", law="pd", gains={"kp": 3e3, "kd": 20.0}, rate_of="feedback"
    )
    return replace(three_bodies(), outputs=outputs, controllers=(law,))


def late(samples):
    return attached("delay", "hammer", {"delay": samples / RATE_HZ})


@pytest.fixture(scope="module")
def run():
    model = loop()
    inputs = len(model.compile().inputs)
    signals = np.concatenate([band_noise(SAMPLES, seed=seed, rms=0.02) for seed in range(inputs)])
    return FreeRun(model, measured(model, signals)[0], tolerance=1e-9)


def start_in_motion(run, effects, windows=1):
    initial = np.zeros((windows, len(run.compiled(None, effects).states)))
    # At the place itself: before a start nothing is behind, so a place elsewhere would be a jump.
    initial[:, 3:6] = 0.02, -0.04, 0.02
    return initial


def far_off(found, wanted):
    return np.sqrt(np.mean((found - wanted) ** 2) / np.mean(wanted**2))


@pytest.mark.parametrize(("samples", "laws"), BESIDE)
def test_the_march_converges_to_the_integrator(samples, laws, run):
    effects = (*laws, late(samples))
    compiled = run.compiled(None, effects)
    assert not is_plain(compiled)
    start = np.zeros((1, len(compiled.states)))
    exact = Integrator(compiled, RATE_HZ, tolerance=1e-10).run(run.measurement.inputs).outputs
    errors = [
        far_off(run_laws(made, ((0, SAMPLES),), start, RATE_HZ).outputs, exact)
        for made in (run.equations(compiled, parts) for parts in (2, 8))
    ]
    # Straight lines of force between steps have order 2: a sixteenth.
    assert errors[1] < errors[0] / 10
    assert errors[1] < 5e-3


@pytest.mark.parametrize(("samples", "laws"), BESIDE)
def test_slopes_are_differences_of_the_march(samples, laws, run):
    effects, by = (*laws, late(samples)), 1e-6
    unknowns = len(run.tunables.names)
    z = np.linspace(-0.5, 0.5, unknowns)
    start = start_in_motion(run, effects)
    changed = [Setting(z + by * row, effects) for row in np.eye(unknowns)]
    changed.append(Setting(z, (*laws, late(samples * (1 + by)))))
    here = coarse_run(run, Setting(z, effects), start)
    own, starts = slopes_of(run, here, [(setting, by) for setting in changed])
    moved = start.copy()
    moved[0, 4] += 1e-7
    runs = [(coarse_run(run, setting, start), by) for setting in changed]
    runs.append((coarse_run(run, Setting(z, effects), moved), 1e-7))
    for found, (there, size) in zip([*own, starts[4]], runs, strict=True):
        difference = (there.outputs - here.outputs) / size
        assert np.linalg.norm(difference) > 0
        assert np.linalg.norm(found - difference) < 2e-3 * np.linalg.norm(difference)


def test_slopes_along_a_fine_run_are_those_of_fine_runs(run):
    """Over windows, with nothing behind each, at a dead time where the reference's straight lines have no kink."""
    cut = FreeRun(loop(), run.measurement, tolerance=1e-9, windows=((0, 200), (200, SAMPLES)))
    effects, by = (LAW, late(3.5)), 1e-3
    z = np.zeros(len(run.tunables.names))
    start = start_in_motion(run, effects, windows=2)
    here = fine_run(cut, Setting(z, effects), start)
    np.testing.assert_array_equal(here.outputs, cut.outputs(z, effects, start))
    later = (LAW, late(3.5 * (1 + by)))
    own, _ = slopes_of(cut, here, [(Setting(z, later), by)])
    difference = (cut.outputs(z, later, start) - here.outputs) / by
    assert np.linalg.norm(own[0] - difference) < 0.05 * np.linalg.norm(difference)
