import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import force
from tests.models.effects.small_models import one_body, with_loop

SAMPLES = np.array([-900.0, -3.0, 0.0, 2.5, 4.0, 1e6])


@pytest.mark.parametrize(
    ("variant", "shape"),
    [("clipped", lambda u: np.clip(u, -3.0, 3.0)), ("smooth", lambda u: 3.0 * np.tanh(u / 3.0))],
)
def test_samples_outside_of_loops_and_the_law_inside_take_one_shape(variant: str, shape) -> None:
    effect = attached("saturation", "motor", {"limit": 3.0}, variant=variant)
    outside, inside = effect.attach(one_body()), effect.attach(with_loop(one_body()))
    assert not outside.laws
    ((row, action),) = outside.input_maps
    assert row == 0
    np.testing.assert_allclose(action(SAMPLES, 100.0), shape(SAMPLES), rtol=1e-14)
    (law,) = inside.laws
    assert (inside.ports[law.port].name, inside.ports[law.port].kind) == ("motor", "input")
    for sample in SAMPLES:
        assert sample + force(law, d=sample) == pytest.approx(shape(sample), rel=1e-9, abs=1e-12)


def test_rounded_corners_are_those_of_the_clip_averaged_over_a_bell() -> None:
    limit, knee = 3.0, 0.25
    effect = attached("saturation", "motor", {"limit": limit, "knee": knee}, variant="rounded")
    outside, inside = effect.attach(one_body()), effect.attach(with_loop(one_body()))
    ((_, action),) = outside.input_maps
    (law,) = inside.laws
    # Of sech(x/w)^2/(2 w), whose integral is 1, by the trapezoidal rule: it falls as exp(-2 x/w), so nothing is cut.
    width = knee * limit
    away = np.linspace(-20.0 * width, 20.0 * width, 20001)
    bell = 1.0 / (2.0 * width * np.cosh(away / width) ** 2)
    for sample in (*SAMPLES, limit, -limit):
        wanted = np.trapezoid(np.clip(sample + away, -limit, limit) * bell, away)
        assert action(np.array([sample]), 100.0)[0] == pytest.approx(wanted, rel=1e-7, abs=1e-12)
        assert sample + force(law, d=sample) == pytest.approx(wanted, rel=1e-7, abs=1e-9)


def test_behind_a_gain_it_limits_what_the_gain_gives() -> None:
    louder = attached("gain_error", "motor", {"gain": -2.0}).attach(one_body())
    limited = attached("saturation", "motor", {"limit": 3.0}).attach(louder)
    ((_, action),) = limited.input_maps
    np.testing.assert_allclose(limited.b[1, 0] * action(SAMPLES, 100.0), np.clip(-2.0 * SAMPLES, -3, 3) / 2.0)


def test_behind_a_gain_of_nothing_or_a_lag_it_is_a_law() -> None:
    for effect in (attached("gain_error", "motor", {"gain": 0.0}), attached("lag", "motor", {"time_constant": 0.1})):
        limited = attached("saturation", "motor", {"limit": 3.0}).attach(effect.attach(one_body()))
        assert not limited.input_maps
        (law,) = limited.laws
        np.testing.assert_allclose(limited.g[:, law.port], [0.0, 0.5, *[0.0] * (len(limited.states) - 2)])


def test_two_in_a_loop_act_one_after_the_other() -> None:
    once = attached("dead_zone", "motor", {"width": 1.0}).attach(with_loop(one_body()))
    twice = attached("saturation", "motor", {"limit": 3.0}).attach(once)
    first, second = twice.laws
    assert twice.ports[first.port].name == twice.ports[second.port].name == "motor"
    # What the second sees is what the first leaves, and both go the way of the command.
    assert twice.displacement_port[second.port, first.port] == 1.0
    np.testing.assert_array_equal(twice.g[:, first.port], twice.g[:, second.port])
    np.testing.assert_array_equal(twice.h[:, first.port], twice.h[:, second.port])
    for command in (-9.0, -0.5, 2.0, 77.0):
        left = command + force(first, d=command)
        seen = command + twice.displacement_port[second.port, first.port] * force(first, d=command)
        acts = left + force(second, d=seen)
        assert acts == pytest.approx(np.clip(np.sign(command) * max(abs(command) - 1.0, 0.0), -3, 3), abs=1e-12)
