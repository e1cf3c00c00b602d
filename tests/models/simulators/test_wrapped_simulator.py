"""Effects at signals and joints of a system without equations."""

import numpy as np
import pytest

import chladni
from chladni.models.core.port import Port, Terminal
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.simulators.wrapped_simulator import joint_law, with_signals_changed
from chladni.signals.errors import ModelError

RATE_HZ = 100.0
TERMINALS = (Terminal(name="one", unit="N"), Terminal(name="two", unit="N"))
TIME_S = np.arange(400) / RATE_HZ
SIGNALS = np.array([np.sin(2 * np.pi * 2 * TIME_S), np.cos(2 * np.pi * 3 * TIME_S)])
JOINT = Port(name="elbow", kind="joint", unit="N m", displacement_unit="rad", stiffness=50.0, damping=0.3)


def changed(effect, kind):
    return with_signals_changed(SIGNALS, RATE_HZ, TERMINALS, [effect], kind)


def test_without_effects_signals_stay():
    assert with_signals_changed(SIGNALS, RATE_HZ, TERMINALS, [], "input") is SIGNALS


@pytest.mark.parametrize(
    ("effect", "values", "kind", "exact"),
    [
        ("gain_error", {"gain": 1.2}, "input", 1.2 * SIGNALS[0]),
        ("gain_error", {"gain": -1.0}, "output", -SIGNALS[0]),
        ("saturation", {"limit": 0.5}, "input", np.clip(SIGNALS[0], -0.5, 0.5)),
        ("clipping", {"limit": 0.5}, "output", np.clip(SIGNALS[0], -0.5, 0.5)),
        ("quantization", {"step": 0.25}, "output", 0.25 * np.round(SIGNALS[0] / 0.25)),
        ("delay", {"delay": 0.03}, "input", np.concatenate([np.zeros(3), SIGNALS[0][:-3]])),
        ("time_offset", {"offset": 0.03}, "output", None),
    ],
)
def test_signals_change_as_the_law_says(effect, values, kind, exact):
    found = changed(chladni.attached(effect, "one", values), kind)
    if exact is None:
        assert np.allclose(found[0, 3:], SIGNALS[0, :-3], atol=1e-12)
    else:
        assert np.allclose(found[0], exact, atol=1e-12)
    assert np.array_equal(found[1], SIGNALS[1])


def test_effects_act_in_the_order_of_the_signal():
    gain = chladni.attached("gain_error", "one", {"gain": 2.0})
    clip = chladni.attached("clipping", "one", {"limit": 0.5})
    found = with_signals_changed(SIGNALS, RATE_HZ, TERMINALS, [gain, clip], "output")
    assert np.allclose(found[0], np.clip(2 * SIGNALS[0], -0.5, 0.5))
    found = with_signals_changed(SIGNALS, RATE_HZ, TERMINALS, [clip, gain], "output")
    assert np.allclose(found[0], 2 * np.clip(SIGNALS[0], -0.5, 0.5))


def test_cross_axis_feels_the_other_output():
    found = changed(chladni.attached("cross_axis", "one", {"coefficient": 0.1}, source="two"), "output")
    assert np.allclose(found[0], SIGNALS[0] + 0.1 * SIGNALS[1])


@pytest.mark.parametrize("kind", ["input", "output"])
def test_every_effect_of_the_catalogue_acts_on_signals(kind):
    for effect in CATALOGUE.values():
        if kind not in effect.sites or effect.name == "ripple":
            continue
        for variant in effect.variants:
            values = {**effect.parameters_of(variant.name).numbers()}
            source = "two" if effect.needs_source else None
            whole = chladni.attached(effect, "one", values, variant=variant.name, source=source)
            assert np.all(np.isfinite(changed(whole, kind)))


def test_ripple_at_an_input_has_no_position():
    with pytest.raises(ModelError, match="no position"):
        changed(chladni.attached("ripple", "one", {"amplitude": 1.0, "period": 0.1}), "input")


def test_every_effect_at_joints_is_a_law():
    for effect in CATALOGUE.values():
        if "joint" not in effect.sites:
            continue
        for variant in effect.variants:
            values = effect.parameters_of(variant.name).numbers()
            law = joint_law(JOINT, [chladni.attached(effect, "elbow", values, variant=variant.name)])
            assert len(law.laws) == 1


def test_backlash_takes_the_joints_spring_away():
    law = joint_law(JOINT, [chladni.attached("backlash", "elbow", {"gap": 0.02})]).started()
    assert law(0.05, 0.0, 0.0) == pytest.approx(-50.0 * 0.01)
    assert law(0.005, 0.0, 0.0) == pytest.approx(-50.0 * 0.005)


def test_laws_at_one_joint_add_up():
    friction = chladni.attached("coulomb_friction", "elbow", {"force": 2.0})
    drag = chladni.attached("quadratic_damping", "elbow", {"coefficient": 3.0})
    assert joint_law(JOINT, [friction, drag]).started()(0.0, 1.0, 0.0) == pytest.approx(5.0)
