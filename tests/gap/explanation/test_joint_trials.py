"""The screen at a joint: which word it puts first, and with which numbers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.hypotheses import effect_hypotheses
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import WORDS, band_noise, chain, damper, measured, white_floor

RATE_HZ, SAMPLES = 200.0, 1600
STIFFNESS, DAMPING = 900.0, 3000.0


def spencer(time_s, alpha, delta, c0, c1):
    """Spencer's law of a damper (1997), n = 2, beta = gamma = delta/2: Bouc-Wen beside c0, both behind c1."""
    omega = 2 * np.pi * 0.5

    def rates(t, state):
        z, v = state[1], 0.02 * omega * np.cos(omega * t)
        behind = (alpha * z + c0 * v) / (c0 + c1)
        return [behind, delta * (v - behind) - 0.5 * delta * (abs(v - behind) * z * abs(z) + (v - behind) * z * z)]

    found = solve_ivp(rates, (0, time_s[-1]), [0.0, 0.0], t_eval=time_s, max_step=2e-3, rtol=1e-6)
    return c1 * np.array([rates(t, state)[0] for t, state in zip(time_s, found.y.T, strict=True)])


def screened_at_an_oscillator(effect, *, damping=20.0, measures="displacement", samples=3000, rms=60.0, noise=2e-3):
    """Forms by rising cost, screened at 1 kg on a spring, 32 Hz, whose log has an effect that its model lacks."""
    seen = (StructureOutput(name="motion", measures=measures, at="b0"),)
    model = replace(chain([1.0], [4e4], [damping]), outputs=seen)
    log, floor = measured(model.with_effects((effect,)), band_noise(samples, rms=rms), noise=noise)
    location = locate(model, log, floor, Tunables.of(model))
    return screened(location, location.ranked, WORDS)


@pytest.fixture(scope="module")
def found():
    time_s = np.arange(SAMPLES) / RATE_HZ
    stroke = 0.02 * np.sin(2 * np.pi * 0.5 * time_s)
    force = STIFFNESS * stroke + spencer(time_s, alpha=800.0, delta=1500.0, c0=DAMPING, c1=6e4)
    noise = 0.003 * np.std(force)
    force = force + noise * np.random.default_rng(1).standard_normal(SAMPLES)
    model = damper()
    log = Measurement(
        log="made", sample_rate_hz=RATE_HZ, inputs=stroke[None], outputs=force[None],
        input_names=("stroke",), output_names=("force",), output_units=("N",),
    )  # fmt: skip
    location = locate(model, log, white_floor([noise]), Tunables.of(model))
    return screened(location, location.ranked, WORDS)


def test_a_yielding_element_behind_a_dashpot_is_hysteresis(found):
    best = found[0].trial
    assert (best.effect, best.form.variant, best.site.name) == ("hysteresis", "creeping", "seal")
    rival = next(one for one in found if one.trial.effect == "coulomb_friction")
    assert rival.misfit > 2 * found[0].misfit


def test_its_numbers_are_those_of_the_law_with_both_dashpots_in_one(found):
    # c0 beside the element and c1 behind both are, with kappa = c1/(c0 + c1), a dashpot kappa c0 beside all and one
    # of kappa c1 behind the element, whose force is kappa alpha and whose yield is 1/(delta kappa).
    kappa = 6e4 / (DAMPING + 6e4)
    values = found[0].values
    assert values["force"] == pytest.approx(kappa * 800.0, rel=0.05)
    assert values["slip_speed"] == pytest.approx(800.0 / 6e4, rel=0.2)
    # The screen knows shape 1 only, which bends earlier than the shape of 2 that acts.
    assert values["yield"] == pytest.approx(1 / (1500.0 * kappa), rel=0.4)


@pytest.mark.nightly
def test_a_cube_whose_middle_lies_beside_rest_is_told_with_its_square():
    values = {"cubic": 3e8, "quadratic": -6e5}
    cube = attached("hardening_stiffness", "j0", values, variant="asymmetric")
    best = screened_at_an_oscillator(cube, damping=8.0, samples=2000)[0]
    assert (best.trial.effect, best.trial.form.variant) == ("hardening_stiffness", "asymmetric")
    assert best.values["cubic"] == pytest.approx(values["cubic"], rel=0.1)
    assert best.values["quadratic"] == pytest.approx(values["quadratic"], rel=0.15)


@pytest.mark.nightly
def test_teeth_are_told_with_their_second_harmonic():
    values = {"amplitude": 6.0, "period": 1.3e-3, "phase": 0.8, "second_sine": -0.25, "second_cosine": 0.2}
    teeth = attached("ripple", "j0", values, variant="harmonics")
    # The actuator's ripple is the joint's with the other sign: which of the two comes first is rounding's choice.
    best, *others = (one for one in screened_at_an_oscillator(teeth, noise=1e-3) if one.trial.site.name == "j0")
    assert (best.trial.effect, best.trial.form.variant) == ("ripple", "harmonics")
    # But for the phase: where the middle of the way lies no spectrum without its mean tells.
    assert best.values["amplitude"] == pytest.approx(values["amplitude"], rel=0.1)
    assert best.values["period"] == pytest.approx(values["period"], rel=0.05)
    assert best.values["second_sine"] == pytest.approx(values["second_sine"], abs=0.1)
    assert best.values["second_cosine"] == pytest.approx(values["second_cosine"], abs=0.1)
    sine = next(one for one in others if (one.trial.effect, one.trial.form.variant) == ("ripple", "sine"))
    assert sine.misfit > 3 * best.misfit


@pytest.mark.nightly
def test_bristles_that_bend_within_a_sample_are_found():
    dahl = attached("coulomb_friction", "j0", {"force": 20.0, "presliding": 2e-6}, variant="bristle")
    screen = screened_at_an_oscillator(dahl, measures="acceleration", samples=6000, rms=100.0)
    forms = {(one.trial.effect, one.trial.form.variant): one for one in screen}
    found = forms["coulomb_friction", "bristle"].values
    # Between two samples it moves ten times as far as the bristles bend. Along the recovered motion they seem a fifth
    # to a third longer, whatever the noise: near enough for a fit to begin with.
    assert found["presliding"] == pytest.approx(2.5e-6, rel=0.2)
    assert found["force"] == pytest.approx(20.0, rel=0.1)


@pytest.mark.nightly
def test_a_round_contact_is_a_stop_and_no_spring_that_hardens_to_one_side():
    values = {"stiffness": 6e4, "clearance": 1.5e-3, "depth": 1e-3, "dissipation": 0.3}
    contact = attached("one_sided_stop", "j0", values, variant="hertz_damper")
    best = screened_at_an_oscillator(contact)[0]
    assert (best.trial.effect, best.trial.form.variant, best.values["side"]) == (
        "one_sided_stop",
        "hertz_damper",
        1.0,
    )
    assert best.values["clearance"] == pytest.approx(1.5e-3, rel=0.2)
    # Stiffness at another depth is the same law: compared as N/m^1.5.
    found = best.values["stiffness"] / np.sqrt(best.values["depth"])
    assert found == pytest.approx(6e4 / np.sqrt(1e-3), rel=0.3)


def test_a_few_forms_that_are_as_good_as_the_last_one_are_tried_too(found):
    plain = [replace(one, misfit=float(place + 1) * one.expected) for place, one in enumerate(found[:6])]
    assert len(effect_hypotheses(plain, count=3)) == 3
    tied = [*plain[:3], *(replace(one, misfit=plain[2].misfit) for one in plain[3:])]
    assert len(effect_hypotheses(tied, count=3)) == 5
