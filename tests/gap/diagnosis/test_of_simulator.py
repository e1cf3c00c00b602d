"""Diagnosis of simulators without equations: a mass on a guide in MuJoCo, and what was done to it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import chladni
from chladni.apps.explained_model import explained_simulator
from chladni.gap.diagnosis.of_simulator import diagnose_simulator
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.catalogue import CATALOGUE, FAMILIES
from chladni.models.effects.effect_kind import EffectKind, Variant
from chladni.models.excitations.multisine import Multisine
from chladni.models.simulators.mujoco_simulator import mujoco_simulator
from chladni.models.simulators.wrapped_simulator import WrappedSimulator
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, ModelError
from chladni.signals.time_series import TimeSeries
from tests.gap.arm import all_but, among_few
from tests.models.simulators.slide import mjcf

pytest.importorskip("mujoco", reason="needs the extra [mujoco]")

RATE_HZ, SECONDS, NOISE = 200.0, 6.0, 0.01


def sticky(_d, s, _t, parameters, _state, _rates):
    """Friction that falls with speed by another law than the catalogue's."""
    return parameters[0] * s / (0.01 + abs(s)) * (1.0 + 0.4 / (1.0 + 400.0 * s * s))


def cubic(_d, s, _t, parameters, _state, _rates):
    return parameters[0] * s * s * s


def own_kind(name, law, unit, value):
    return EffectKind(
        name=name,
        family="damping",
        meaning="one's own",
        sites=("joint",),
        parameters=Parameters(
            (Parameter(name="strength", value=value, unit=unit, low=0.0, high=1e4, minimum=0.0, maximum=1e12),)
        ),
        neutral={"strength": 0.0},
        variants=(
            Variant(
                name="own",
                attach=LawAtPort(law=law, numbers=lambda values, _port: (values["strength"],)),
                formula="own",
            ),
        ),
    )


STICKY = own_kind("sticky", sticky, "N", 4.0)
CUBIC_DAMPING = own_kind("cubic_damping", cubic, "N s^3/m^3", 50.0)


def slide(step_s=1 / RATE_HZ):
    return mujoco_simulator(
        mjcf(step_s),
        inputs={"push": None},
        outputs=dict.fromkeys(["place", "speed", "acc.x"]),
        joints=["guide"],
        parameters={"guide.stiffness": 0.05, "guide.damping": 0.1},
    )


def log_of(effects, values, *, seed=2, seconds=SECONDS, step_s=1 / RATE_HZ):
    """What a machine with other numbers and effects would log; its steps are the simulator's, as nothing else is."""
    rng = np.random.default_rng(seed)
    drive = Multisine(rms=12.0, period_s=1.5, band_hz=(0.6, 9.0), lines="full")
    force = drive.samples(round(seconds * RATE_HZ), RATE_HZ, rng)[None]
    machine = WrappedSimulator(simulator=slide(step_s), values=values, effects=tuple(effects))
    outputs = machine.respond(force, RATE_HZ).outputs
    noise = NOISE * outputs.std(axis=1, keepdims=True) * rng.normal(size=outputs.shape)
    names = [("push", "N"), ("place", "m"), ("speed", "m/s"), ("acc.x", "m/s^2")]
    return TimeSeries(
        values=np.vstack([force, outputs + noise]),
        sample_rate_hz=RATE_HZ,
        channels=tuple(Channel(name=name, unit=unit) for name, unit in names),
    )


MOVED = {"guide.stiffness": 830.0, "guide.damping": 3.7}


#: Left out are the others of the catalogue.
FEW = all_but()


@cache
def of_friction(out=FEW):
    """One diagnosis that several tests look at, and the progress that was told."""
    told = []
    log = log_of([chladni.attached(STICKY, "guide", {"strength": 4.0})], MOVED)
    found = diagnose_simulator(slide(), log, leave_out=out, progress=lambda *one: told.append(one))
    return found, told


@pytest.mark.nightly
@pytest.mark.slow
def test_friction_by_another_law_is_named():
    found, _ = of_friction(frozenset())
    assert found.verdict == "effect"
    (cause,) = found.causes
    assert cause.effect in FAMILIES["friction"]
    assert all(one.effect in FAMILIES["friction"] for one in cause.alternatives)
    assert (cause.site, cause.group) == ("guide", ("guide",))
    assert 0.5 < cause.probability <= 1.0
    assert found.gap.closed > 0.9
    assert cause.share == found.gap.explained
    assert 0.95 < cause.share <= 1.0
    assert found.gap.before > found.gap.tuned > 5 * found.gap.after
    # Tuning alone would have taken the friction for damping.
    assert found.tuned_parameters["guide.stiffness"].value == pytest.approx(830.0, rel=0.01)
    assert cause.parameters[next(iter(cause.parameters))].unit == "N"


@pytest.mark.nightly
def test_what_was_found_is_simulated():
    found, _ = of_friction()
    signals = found.signals
    again = explained_simulator(slide(), found).respond(
        log_of([chladni.attached(STICKY, "guide", {"strength": 4.0})], MOVED).values[:1], RATE_HZ
    )
    # But for a constant of each sensor, which no simulator explains.
    constants = signals.after - again.outputs
    assert np.allclose(constants, constants[:, :1], rtol=1e-9, atol=1e-9)
    assert np.all(np.abs(constants[:, 0]) < signals.noise_rms)


@pytest.mark.nightly
def test_where_the_gap_lies():
    where = of_friction()[0].where
    assert [channel.name for channel in where.channels] == ["place", "speed", "acc.x"]
    assert sum(band.share for band in where.bands) == pytest.approx(1.0)
    # A force on the cart and one at its guide are the same to all sensors.
    assert (where.sites[0].name, where.sites[0].group) == ("guide", ("push",))
    assert where.sites[0].share > 0.99 > 0.6 > max(site.share for site in where.sites[2:])


def test_the_force_is_recovered_without_its_law():
    found, _ = of_friction()
    (force,) = found.restoring_forces
    truth = np.array([sticky(0.0, s, 0.0, (4.0,), None, None) for s in force.velocity])
    # Of Wiener's filter, at 1 % of noise.
    assert np.std(force.force - truth) < 0.2 * np.std(truth)
    assert (force.site, force.force_unit, force.displacement_unit) == ("guide", "N", "m")


@pytest.mark.nightly
def test_same_log_same_answer():
    log = log_of([chladni.attached("delay", "push", {"delay": 0.004})], MOVED)
    first, second = (diagnose_simulator(slide(), log, leave_out=all_but("delay")) for _ in range(2))
    assert (first.causes, first.ranking, first.gap) == (second.causes, second.ranking, second.gap)


@pytest.mark.nightly
@among_few("delay", "lag")
def test_late_commands_are_named(out):
    log = log_of([chladni.attached("delay", "push", {"delay": 0.007})], MOVED)
    found = diagnose_simulator(slide(), log, leave_out=out)
    (cause,) = found.causes
    assert (cause.effect, cause.site) == ("delay", "push")
    # A sample lasts 5 ms; held and joined by straight lines differ by a fraction of it.
    assert cause.parameters["delay"].value == pytest.approx(0.007, abs=5e-4)


@pytest.mark.nightly
@among_few("clipping")
def test_a_clipped_sensor_is_named(out):
    log = log_of([chladni.attached("clipping", "speed", {"limit": 0.1})], MOVED)
    found = diagnose_simulator(slide(), log, leave_out=out)
    (cause,) = found.causes
    assert (cause.effect, cause.site) == ("clipping", "speed")
    assert cause.parameters["limit"].value == pytest.approx(0.1, rel=0.02)
    assert cause.parameters["limit"].unit == "m/s"


@pytest.mark.nightly
def test_the_simulators_own_step_is_told():
    # Euler's steps of 5 ms against 1.25 ms: late by about 2 ms, which looks like a delay.
    found = diagnose_simulator(slide(), log_of([], MOVED, step_s=1 / RATE_HZ / 4))
    assert any("half the simulator's step" in remark for remark in found.remarks)
    fine_s = 1 / RATE_HZ / 16
    found = diagnose_simulator(slide(fine_s), log_of([], MOVED, step_s=fine_s))
    assert not any("half the simulator's step" in remark for remark in found.remarks)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.nightly)])
def test_no_effect_where_only_parameters_are_off(seed):
    found = diagnose_simulator(slide(), log_of([], MOVED, seed=seed))
    assert (found.verdict, found.causes) == ("none", ())
    assert found.gap.tuned < 1.1 * found.gap.noise < found.gap.before


@pytest.mark.nightly
@pytest.mark.slow
@among_few()
def test_a_parameter_far_beyond_its_tolerance_is_named(out):
    found = diagnose_simulator(slide(), log_of([], {"guide.stiffness": 1200.0}), leave_out=out)
    assert found.verdict == "parameters"
    assert [(cause.effect, cause.site) for cause in found.causes] == [("parameter", "guide.stiffness")]
    assert found.causes[0].probability > 0.9
    assert found.causes[0].share == found.gap.explained
    assert found.gap.explained > 0.9
    assert found.tuned_parameters["guide.stiffness"].value == pytest.approx(1200.0, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("words", [{"coulomb_friction"}, pytest.param(CATALOGUE, marks=pytest.mark.nightly)])
def test_an_effect_of_ones_own_takes_part(words):
    log = log_of([chladni.attached(CUBIC_DAMPING, "guide", {"strength": 900.0})], MOVED)
    out = frozenset(CATALOGUE) - frozenset(words)
    found = diagnose_simulator(slide(), log, own_effects=(CUBIC_DAMPING,), leave_out=out)
    assert [(cause.effect, cause.site) for cause in found.causes] == [("cubic_damping", "guide")]
    assert found.causes[0].parameters["strength"].value == pytest.approx(900.0, rel=0.05)


@pytest.mark.nightly
def test_what_no_effect_left_explains_is_unknown():
    log = log_of([chladni.attached("time_offset", "speed", {"offset": 0.02})], MOVED)
    out = ("time_offset", "mounting_resonance", "cross_axis", "ac_coupling", "anti_alias", "clock_drift")
    found = diagnose_simulator(slide(), log, leave_out=out)
    assert (found.verdict, found.causes) == ("unknown", ())
    # What isn't explained is what tuning left, not what it began with.
    assert found.left is not None
    assert found.left.channels != found.where.channels
    assert "explains the gap" in found.advice


def test_progress_is_told():
    _, told = of_friction()
    assert told[0] == ("locating", 0.0)
    assert all(0 <= share <= 1 for _, share in told)


def test_logs_that_do_not_fit_are_told():
    log = log_of([], {})
    with pytest.raises(ModelError, match="none of their names"):
        diagnose_simulator(slide(), log.select(["place", "speed"]), log="a.mcap")
    with pytest.raises(LogError, match="nothing to compare"):
        diagnose_simulator(slide(), log.select(["push"]), log="a.mcap")
    other = replace(log, channels=(replace(log.channels[0], unit="m"), *log.channels[1:]))
    with pytest.raises(ModelError, match="'push'"):
        diagnose_simulator(slide(), other)
