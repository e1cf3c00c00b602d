"""A missing force is located, its shape recovered, and the noise behind it estimated again."""

import numpy as np
import pytest
from scipy.signal import chirp

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.location.locate import Location, locate
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.tunable import Tunables
from tests.gap.arm import arm, measured, with_outputs
from tests.gap.made_log import RATE_HZ, chain
from tests.gap.made_log import measured as measured_run


@pytest.fixture(scope="module")
def hardened() -> Location:
    spring = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
    log = measured((spring,), seconds=6.0, seed=4)
    return locate(arm(), log, estimate_noise(log), Tunables.of(arm()))


def test_the_right_place_explains_all_and_others_do_not(hardened: Location) -> None:
    assert hardened.best is not None
    assert "hand" in hardened.best.places[0].names
    assert hardened.best.profile.chi < 2.0
    assert hardened.ranked[1].profile.chi > 5.0 * hardened.best.profile.chi
    assert hardened.shares["hand"] > 0.9


def test_the_recovered_force_is_the_cube_of_the_displacement(hardened: Location) -> None:
    assert hardened.best is not None
    site = next(one for one in hardened.best.places[0].sites if one.name == "hand")
    found = recovered(hardened.problem, hardened.best.profile, site)
    inside = slice(300, -300)
    d = found.displacement[inside]
    # Stiffness and damping of the joint itself are as free as the force: what is left is the law.
    basis = np.stack([d, found.velocity[inside], d**3])
    share = np.linalg.lstsq(basis.T, found.force[inside], rcond=None)[0]
    # A regression on a displacement that has noise itself comes out low, by a quarter here.
    assert share[2] == pytest.approx(3e10, rel=0.35)
    cubic = basis[2] - basis[:2].T @ np.linalg.lstsq(basis[:2].T, basis[2], rcond=None)[0]
    rest = found.force[inside] - basis[:2].T @ np.linalg.lstsq(basis[:2].T, found.force[inside], rcond=None)[0]
    assert np.corrcoef(cubic, rest)[0, 1] > 0.7


def test_noise_that_held_distortion_is_lowered(hardened: Location) -> None:
    # One per cent of each output's RMS was added.
    rms = np.std(hardened.problem.measurement.outputs, axis=1)
    assert np.all(hardened.problem.noise.rms < 0.05 * rms)


def test_with_one_sensor_every_place_stays_open() -> None:
    log = with_outputs(measured(seconds=4.0), ["acc_wrist"])
    found = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    names = {site.name for located in found.ranked for site in located.places[0].sites}
    assert {"shoulder", "elbow", "hand", "shaker", "acc_wrist"} <= names
    # Each would explain all: a share, whether one or none, would say that the sensor can tell.
    assert found.shares == {}


@pytest.mark.nightly
def test_a_place_that_short_stretches_cannot_tell_is_found_on_the_record() -> None:
    # Two sensors on five bodies: the states at the start of each short stretch could print all that a force does.
    model = chain([2.0, 2.5, 3.0, 1.0, 1.5], [5e5, 6e5, 4e5, 3e5, 4e5], [20.0, 30.0, 20.0, 20.0, 20.0], at=2)
    off = {
        name: one.value * (1 + 0.03 * np.sin(5 * place)) for place, (name, one) in enumerate(model.parameters.items())
    }
    machine = model.with_values(off).with_effects((chladni.attached("hardening_stiffness", "j4", {"cubic": 4e13}),))
    sweep = 100.0 * chirp(np.arange(8192) / RATE_HZ, 5.0, 8.0, 150.0)[None]
    log = measured_run(machine, sweep, outputs=[0, 2])[0]
    found = locate(model, log, estimate_noise(log), Tunables.of(model))
    near = [located for located in found.ranked if located.profile.chi < 1.1]
    assert "j4" in {name for located in near for name in located.places[0].names}


# Below what a model is granted to be wrong by, and above.
@pytest.mark.parametrize("noise", [pytest.param(0.001, marks=pytest.mark.nightly), 0.02])
def test_a_floor_behind_a_force_is_that_of_the_noise(noise: float) -> None:
    late = chladni.attached("delay", "shaker", {"delay": 0.003})
    log = measured((late,), seconds=4.0, noise=noise)
    found = locate(arm(), log, estimate_noise(log), Tunables.of(arm())).problem.noise
    np.testing.assert_allclose(found.rms, noise * log.outputs.std(axis=1), rtol=0.25)


def test_two_sensors_dont_lower_each_others_floor() -> None:
    # Another hold than the model's leaves a little everywhere, and a force somewhere explains it.
    held = arm().with_holds({"shaker": "zoh"})
    log = with_outputs(measured((), seconds=3.0, noise=0.02, model=held, seed=1), ("acc_arm", "acc_wrist"))
    before = estimate_noise(log)
    found = locate(arm(), log, before, Tunables.of(arm())).problem.noise
    assert np.all(found.rms > 0.98 * before.rms)
