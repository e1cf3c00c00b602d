"""What must hold for any parameters and any motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import force, law_of
from tests.models.effects.small_models import one_body, with_loop

PLANT = one_body()
FREQUENCY_HZ = np.linspace(0.3, 30.0, 12)


def numbers(low, high):
    """Sizes that a model takes: zero, or none that only a denormal holds."""
    return st.floats(low, high).map(lambda value: value if abs(value) > 1e-100 else 0.0)


speeds = st.floats(-100.0, 100.0)
motions = numbers(-1.0, 1.0)
sizes = st.floats(1e-6, 1e6)


@given(s=speeds, size=sizes, excess=st.floats(1.0, 10.0), speed=st.floats(1e-6, 10.0), creep=st.floats(1e-9, 1.0))
def test_friction_and_drag_never_drive(s: float, size: float, excess: float, speed: float, creep: float) -> None:
    for effect in (
        attached("coulomb_friction", "spring", {"force": size, "creep_speed": creep}),
        attached(
            "stribeck_friction",
            "spring",
            {"coulomb": size, "static": excess * size, "speed": speed, "creep_speed": creep},
        ),
        attached("quadratic_damping", "spring", {"coefficient": size}),
    ):
        assert force(law_of(effect, PLANT), s=s) * s >= 0.0


@given(d=motions, s=speeds, clearance=motions, side=st.sampled_from([-1.0, 1.0]), dissipation=numbers(0.0, 100.0))
@pytest.mark.parametrize("variant", ["spring", "spring_damper", "hertz", "hertz_damper"])
def test_a_stop_only_pushes(
    variant: str, d: float, s: float, clearance: float, side: float, dissipation: float
) -> None:
    values = {"stiffness": 1e6, "clearance": clearance, "side": side}
    if variant.endswith("damper"):
        values["dissipation"] = dissipation
    effect = attached("one_sided_stop", "spring", values, variant=variant)
    assert side * force(law_of(effect, PLANT), d=d, s=s) >= 0.0


@given(w=st.floats(-1.0, 1.0), s=speeds, shape=st.floats(1.0, 50.0))
def test_bouc_wen_never_leaves_its_plateau(w: float, s: float, shape: float) -> None:
    law = law_of(attached("hysteresis", "spring", {"force": 1.0, "yield": 1.0, "shape": shape}), PLANT)
    rates = [0.0]
    law.function(0.0, s, 0.0, law.parameters, [w], rates)
    # At the plateau it comes back or stays; inside it runs the way the joint moves.
    assert rates[0] * s >= 0.0
    law.function(0.0, s, 0.0, law.parameters, [1.0], rates)
    assert rates[0] <= 1e-12


@given(first=st.floats(-10.0, 10.0), second=st.floats(-10.0, 10.0), step=st.floats(1e-3, 1.0))
def test_the_staircase_never_falls(first: float, second: float, step: float) -> None:
    (law,) = attached("quantization", "place", {"step": step}).attach(PLANT, in_loop=True).laws
    low, high = min(first, second), max(first, second)
    assert low + force(law, d=low) <= high + force(law, d=high) + 1e-9


@given(samples=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), limit=sizes, rate_hz=st.floats(1.0, 1e5))
def test_what_is_limited_once_is_limited(samples: list[float], limit: float, rate_hz: float) -> None:
    for word, name in (("saturation", "limit"), ("rate_limit", "rate")):
        ((_, action),) = attached(word, "motor", {name: limit}).attach(PLANT).input_maps
        once = action(np.array(samples), rate_hz)
        np.testing.assert_allclose(action(once, rate_hz), once, rtol=1e-12, atol=1e-9)


@given(
    gain=st.floats(0.2, 3.0),
    constant=st.floats(1e-4, 0.2),
    delay=numbers(0.0, 0.05),
    order=st.permutations(range(3)),
)
@pytest.mark.parametrize("in_loop", [False, True])
def test_linear_effects_at_one_input_commute(
    in_loop: bool, gain: float, constant: float, delay: float, order: list[int]
) -> None:
    effects = (
        attached("gain_error", "motor", {"gain": gain}),
        attached("lag", "motor", {"time_constant": constant}),
        attached("delay", "motor", {"delay": delay}),
    )
    listed = shuffled = with_loop(PLANT) if in_loop else PLANT
    for place, effect in zip(order, effects, strict=True):
        listed, shuffled = effect.attach(listed), effects[place].attach(shuffled)
    response = listed.frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(
        shuffled.frequency_response(FREQUENCY_HZ), response, rtol=1e-8, atol=1e-12 * np.abs(response).max()
    )


@given(mass=st.floats(1e-3, 1e3), more=st.floats(1e-3, 1e3))
def test_masses_add_up_whatever_their_size(mass: float, more: float) -> None:
    one_by_one = attached("added_mass", "mass", {"mass": more}).attach(
        attached("added_mass", "mass", {"mass": mass}).attach(PLANT)
    )
    at_once = attached("added_mass", "mass", {"mass": mass + more}).attach(PLANT)
    np.testing.assert_allclose(one_by_one.a, at_once.a, rtol=1e-10)
