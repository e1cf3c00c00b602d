"""A nonlinear joint found from several levels and the modes of the lowest, without a model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.linear_approximation import best_linear_approximation
from chladni.gap.location.between_sensors import locate_between_sensors
from chladni.gap.location.level_change import level_change
from chladni.gap.location.modal_paths import modal_paths
from chladni.gap.location.path_fits import one_direction_share, pattern_losses, unseen_losses
from chladni.signals.errors import EstimateError
from tests.gap.comparison import made_measurements
from tests.gap.location import made_levels as made

BETWEEN = ("j3", "hardening_stiffness", (("cubic", 1e11),))
TO_GROUND = ("j0", "hardening_stiffness", (("cubic", 2e9),))
STOP = ("j3", "one_sided_stop", (("stiffness", 2e5), ("clearance", 4e-5)))
# Between body 3 and body 4, which has no sensor.
HIDDEN = ("j4", "hardening_stiffness", (("cubic", 1e11),))

STUCK = ("j3", "coulomb_friction", (("force", 3.0),))


def located(case):
    measurements, modes = made.levels(*case)
    return locate_between_sensors(measurements, modes, driving_point="a0")


@pytest.mark.parametrize(
    ("case", "names", "parity"),
    [(BETWEEN, ("a2", "a3"), ("odd",)), (TO_GROUND, ("a0",), ("odd",)), (STOP, ("a2", "a3"), ("odd", "even"))],
)
def test_the_joint_is_found_with_its_parity(case, names, parity):
    found = located(case)
    assert found.located is not None
    assert found.located.names == names
    assert found.parity == parity
    # The law is one of the functions or near one, and the motion is measured on both sides.
    assert found.located.motion > 0.75
    assert found.sites[1].motion < 0.5
    assert found.located.pattern == max(site.pattern for site in found.sites)
    assert "next to it" not in found.sentences()[0]
    assert found.located.label in found.sentences()[0]


def test_a_joint_with_a_sensor_on_one_side_only_is_not_named_for_certain():
    found = located(HIDDEN)
    assert found.sites[0].motion < 0.5
    assert found.located is None or "next to it" in found.sentences()[0]


def test_a_lowest_level_that_is_nonlinear_already_locates_nothing():
    """Friction holds the joint at the lowest level: its modes stand for nothing above, and the answer says so."""
    found = located(STUCK)
    assert found.located is None
    assert found.parity == ()
    assert "not located" in found.sentences()[0]
    assert "add a lower level" in found.sentences()[0]


def test_a_linear_machine_changes_by_noise_alone():
    measurements, modes = made.levels("", "", ())
    found = locate_between_sensors(measurements, modes, driving_point="a0")
    assert found.sites == ()
    assert found.located is None
    assert "noise" in found.sentences()[0]


def test_order_of_levels_and_sensors_does_not_matter():
    measurements, modes = made.levels(*BETWEEN)
    turned = [
        replace(one, outputs=one.outputs[::-1], output_names=one.output_names[::-1]) for one in measurements[::-1]
    ]
    found, again = located(BETWEEN), locate_between_sensors(turned, modes, driving_point="a0")
    assert again.level == found.level
    assert again.located is not None
    assert set(again.located.names) == {"a2", "a3"}
    # The optimum of the product is found from another start.
    assert again.located.motion == pytest.approx(found.sites[0].motion, abs=1e-3)


def test_same_seed_same_answer():
    assert located(BETWEEN) == located(BETWEEN)


def test_reciprocity_gives_paths_that_were_not_measured():
    """Path from a force between a2 and a3, against that of the machine itself: one direction a line."""
    measurements, modes = made.levels(*BETWEEN)
    change = level_change(measurements)
    paths = modal_paths(modes, change.frequency_hz, outputs=made.OUTPUTS, driving_point="a0", order=2)
    model = made.machine()
    columns = []
    for body in (2, 3):
        compiled = replace(model, inputs=(replace(model.inputs[0], at=f"b{body}"),)).compile()
        s = 2j * np.pi * change.frequency_hz[:, None, None]
        answer = compiled.c @ np.linalg.solve(s * np.eye(len(compiled.a)) - compiled.a, compiled.b) + compiled.d
        columns.append(answer[:, list(made.BODIES), 0].T)
    exact = columns[0] - columns[1]
    unit = (exact / np.sqrt(np.sum(np.abs(exact) ** 2, axis=0)))[None]
    left = {
        name: np.mean(pattern_losses(paths, np.array(direction, dtype=float), unit))
        for name, direction in {"right": (0, 1, -1), "a2": (0, 1, 0), "a0": (1, 0, 0)}.items()
    }
    # Modes from a log with a thousandth of noise; all of them lie within the band.
    assert left["right"] < 1e-3
    assert min(left["a2"], left["a0"]) > 30 * left["right"]


def test_a_force_of_two_parts_is_predicted_where_it_was_not_fitted():
    rng = np.random.default_rng(5)
    blocks = rng.standard_normal((4, 3, 60)) + 1j * rng.standard_normal((4, 3, 60))
    forces = rng.standard_normal((2, 3, 60)) + 1j * rng.standard_normal((2, 3, 60))
    path, law = np.array([1.0, -0.5, 2.0, 0.3]), np.array([0.7, -1.0, 0.2])
    change = np.tensordot(path, blocks, 1) * np.einsum("f,lfk->lk", law, forces)[:, None]
    whole = np.sum(np.abs(change) ** 2, axis=(0, 1))
    # The loading of the normal equations, a millionth, is all that is left.
    assert np.sum(unseen_losses(blocks, forces, change)) < 1e-8 * np.sum(whole)
    # Forces that have nothing to do with it predict worse than nothing.
    assert np.sum(unseen_losses(blocks, forces[:, :, ::-1].copy(), change)) > 0.9 * np.sum(whole)
    np.testing.assert_array_equal(unseen_losses(blocks, forces[:, :0], change), whole)


def test_one_place_prints_one_direction():
    rng = np.random.default_rng(6)
    pattern, force = (rng.standard_normal(size) + 1j * rng.standard_normal(size) for size in ((1, 3, 40), (2, 1, 40)))
    assert one_direction_share(pattern * force) == pytest.approx(1.0)
    assert one_direction_share(rng.standard_normal((2, 3, 40)) + 0j) < 0.95


def test_what_the_levels_lack_is_told():
    measurements, modes = made.levels(*BETWEEN)
    first = measurements[0]
    with pytest.raises(EstimateError, match="levels differ by 10%"):
        level_change([first, first])
    with pytest.raises(EstimateError, match=r"30 N: its input doesn't repeat"):
        level_change([first, replace(measurements[1], period_samples=None, transient_periods=0)])
    with pytest.raises(EstimateError, match=r"outputs of 30 N: a0, a2, b3; of 3 N: a0, a2, a3"):
        level_change([first, replace(measurements[1], output_names=("a0", "a2", "b3"))])
    with pytest.raises(EstimateError, match=r"outputs are in m, m/s\^2"):
        level_change([replace(first, output_units=("m", "m/s^2", "m/s^2")), measurements[1]])
    with pytest.raises(EstimateError, match=r"'a1' is none of the outputs a0, a2, a3"):
        locate_between_sensors(measurements, modes, driving_point="a1")
    named = replace(modes, channels=tuple(replace(one, name=f"x{one.name}") for one in modes.channels))
    with pytest.raises(EstimateError, match="no sensor 'a0', only xa0, xa2, xa3"):
        locate_between_sensors(measurements, named, driving_point="a0")


def test_measured_aircraft_is_nonlinear_between_wing_and_payload(shared_data: Path):
    """Clearance and friction in that connection, say those who measured it (Noël & Schoukens 2017)."""
    measurements = [made_measurements.aircraft(shared_data, level) for level in (1, 3, 5, 7)]
    modes = chladni.identify_modes(best_linear_approximation(measurements[0]))
    found = locate_between_sensors(measurements, modes, driving_point="excitation")
    assert found.located is not None
    assert found.located.names == ("wing_rail", "payload_rail")
    assert found.parity == ("odd", "even")
    # Of these sensors' patterns only that of the shaker's own place is far off.
    at_shaker = next(site for site in found.sites if site.names == ("excitation",))
    assert not at_shaker.pattern_rival
