"""Trials: what an effect's own file says of how it is looked for."""

import numpy as np
import pytest

from chladni.models.effects.anti_alias import response
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.clock_drift import drifted
from chladni.models.effects.geometric import turning
from chladni.models.effects.harmonics import bent_samples
from chladni.models.effects.law_trials import trials_of
from chladni.models.effects.trial import logarithms
from chladni.models.effects.unbalance import rotor
from tests.models.effects.known_motions import RATE_HZ, SAMPLES, along, along_joint, weighed
from tests.models.effects.own_effect import CUBIC_DAMPING

TIME_S = np.arange(SAMPLES) / RATE_HZ
WAY = 1e-3 * (np.sin(2 * np.pi * 7.0 * TIME_S) + 0.4 * np.sin(2 * np.pi * 23.0 * TIME_S))
AT_JOINTS = [kind for kind in CATALOGUE.values() if "joint" in kind.sites]


@pytest.mark.parametrize(("stiffness", "there"), [(4e4, True), (0.0, False)])
def test_a_joint_without_a_spring_has_none_that_could_soften_or_change(stiffness, there):
    motion = along_joint(WAY, stiffness=stiffness)
    words = {kind.name for kind in AT_JOINTS if [*trials_of(kind, motion)]}
    assert words.isdisjoint({"softening_stiffness", "backlash", "varying_stiffness"}) != there
    assert {"coulomb_friction", "hardening_stiffness"} <= words


def test_an_effect_without_trials_goes_along_its_law_over_the_usual_range_of_its_number():
    motion = along_joint(WAY)
    (trial,) = trials_of(CUBIC_DAMPING, motion)
    assert len(trial.grid) == 16
    shape = logarithms((40.0,))[0]
    force = trial.build(shape)
    # No amplitude is free: the number that enters the law is the one that is searched.
    assert not len(force.basis)
    assert force.fixed == pytest.approx(motion.spectrum(40.0 * motion.velocity**3))
    assert trial.values(shape, np.zeros(0)) == pytest.approx({"coefficient": 40.0})


def test_what_is_seen_in_samples_or_follows_nothing_is_tried_along_no_motion():
    motion = along_joint(WAY)
    read = [kind for kind in CATALOGUE.values() if kind.clues.in_samples or kind.clues.of_force]
    assert [kind.name for kind in read] == ["quantization", "base_vibration"]
    assert not any([*trials_of(kind, motion)] for kind in read)


def test_a_link_is_told_with_its_spring_its_damper_or_both():
    motion = along("pair", WAY)
    for stiffness, damping in ((3e4, 12.0), (3e4, 0.0), (0.0, 12.0)):
        force = stiffness * motion.displacement + damping * motion.velocity
        values, left = weighed(trials_of(CATALOGUE["missing_link"], motion), motion, force)
        assert values == pytest.approx({"stiffness": stiffness, "damping": damping}, abs=1e-6 * 3e4)
        assert left < 1e-12


def test_a_bent_command_is_told_with_both_powers():
    command = 4.0 * WAY / 1e-3
    force = bent_samples(command, RATE_HZ, 0.05, -0.03, 4.0) - command
    values, left = weighed(trials_of(CATALOGUE["harmonics"], along("input", command)), along("input", command), force)
    assert values["second"] / values["scale"] == pytest.approx(0.05 / 4.0)
    assert values["third"] / values["scale"] ** 2 == pytest.approx(-0.03 / 16.0)
    assert left < 1e-12


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_a_filter_is_told_with_its_order(order):
    noise = np.fft.rfft(np.random.default_rng(4).standard_normal(SAMPLES))
    # At half the rate samples have no phase that a filter could turn.
    motion = along("output", np.fft.irfft(np.append(noise[:-1], 0.0)))
    # A corner of the grid: what lies between is the search's.
    corner = RATE_HZ * np.geomspace(0.02, 2.0, 20)[5]
    filtered = np.fft.irfft(np.fft.rfft(motion.displacement) * np.append(1.0, response(motion.s, corner, order)))
    values, left = weighed(trials_of(CATALOGUE["anti_alias"], motion), motion, filtered - motion.displacement)
    assert values == pytest.approx({"corner": corner, "order": order})
    assert left < 1e-12


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_clock_is_told_with_its_rate_and_its_start(sign):
    motion = along("output", WAY)
    ppm = sign * 1e6 * np.geomspace(0.1, 60.0, 24)[12] / WAY.size
    force = drifted(WAY, RATE_HZ, ppm, 1e-5) - WAY
    values, left = weighed(trials_of(CATALOGUE["clock_drift"], motion), motion, force)
    assert values["ppm"] == pytest.approx(ppm)
    assert values["offset"] == pytest.approx(1e-5, rel=0.02)
    assert left < 1e-5


@pytest.mark.parametrize(("start_hz", "rise"), [(20.0, 8.0), (70.0, -9.0)])
def test_a_rotor_that_runs_up_or_down_is_told_with_its_speed(start_hz, rise):
    force = np.array(
        [rotor(0.0, 0.0, t, (2e-3, 2 * np.pi * start_hz, 2 * np.pi * rise, 0.3), [], []) for t in TIME_S]
    )
    motion = along("body", np.zeros(SAMPLES), force=force)
    values, _ = weighed(trials_of(CATALOGUE["unbalance"], motion), motion, force)
    assert values["frequency"] == pytest.approx(start_hz, abs=1.0)
    assert values["rise"] == pytest.approx(rise, abs=0.5)


def test_a_tone_that_keeps_its_frequency_is_no_rotor():
    force = np.sin(2 * np.pi * 31.0 * TIME_S)
    assert [*trials_of(CATALOGUE["unbalance"], along("body", np.zeros(SAMPLES), force=force))] == []


def test_a_spring_at_an_angle_is_told_with_its_length():
    motion = along_joint(WAY)
    length = float(np.sqrt(np.mean(WAY**2)) * np.geomspace(2.0, 30.0, 5)[1])
    numbers = (5e3, length * np.cos(np.radians(60.0)), length * np.sin(np.radians(60.0)), length)
    force = np.array([turning(d, 0.0, 0.0, numbers, [], []) for d in WAY])
    values, left = weighed(trials_of(CATALOGUE["geometric"], motion), motion, force)
    assert values == pytest.approx({"stiffness": 5e3, "length": length, "angle": np.radians(60.0)})
    assert left < 1e-12
