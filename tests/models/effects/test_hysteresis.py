import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.stops import stops_along
from tests.models.effects.motions import driven, energy, law_of, loop
from tests.models.effects.small_models import one_body

FORCE, YIELD = 12.0, 1e-4


def _law(shape: float = 1.0):  # type: ignore[no-untyped-def]
    return law_of(attached("hysteresis", "spring", {"force": FORCE, "yield": YIELD, "shape": shape}), one_body())


@pytest.mark.parametrize("shape", [1.0, 2.0, 6.0])
def test_pulled_far_it_comes_to_a_plateau_of_the_force(shape: float) -> None:
    times_s = np.linspace(0, 1, 21)
    found = driven(_law(shape), lambda t: 40 * YIELD * t, lambda _t: 40 * YIELD, times_s)
    assert found[-1] == pytest.approx(FORCE, rel=1e-6)


def test_pulled_at_shape_one_it_follows_the_exponential() -> None:
    times_s = np.linspace(0, 1, 21)
    found = driven(_law(), lambda t: 3 * YIELD * t, lambda _t: 3 * YIELD, times_s)
    # yield dw/dd = 1 - w
    np.testing.assert_allclose(found, FORCE * (1 - np.exp(-3 * times_s)), atol=1e-7 * FORCE)


def test_pulled_at_shape_two_it_follows_the_hyperbolic_tangent() -> None:
    times_s = np.linspace(0, 1, 21)
    found = driven(_law(2.0), lambda t: 3 * YIELD * t, lambda _t: 3 * YIELD, times_s)
    # yield dw/dd = 1 - w^2
    np.testing.assert_allclose(found, FORCE * np.tanh(3 * times_s), atol=1e-7 * FORCE)


def test_it_unloads_along_the_initial_stiffness() -> None:
    law = _law(3.0)
    rates = [0.0]
    law.function(0.0, -1.0, 0.0, law.parameters, [0.8], rates)
    # While w and s have opposite signs dw/dd = 1/yield exactly.
    assert rates[0] == pytest.approx(-1 / YIELD, rel=1e-14)


def test_small_motions_see_a_spring_of_force_over_yield() -> None:
    d, f = loop(_law(2.0), 1e-3 * YIELD, 5.0)
    np.testing.assert_allclose(f, FORCE / YIELD * d, atol=1e-5 * FORCE / YIELD * 1e-3 * YIELD)


def test_large_cycles_take_what_friction_with_elastic_reversals_takes() -> None:
    amplitude = 100 * YIELD
    # At shape 1, per half cycle: w comes from -1 to 0 as a straight line along yield, then 1 - w decays as
    # exp(-way/yield). Of 1 - w along the way that makes 1.5 yield and then 1 yield.
    wanted = 2 * FORCE * (2 * amplitude - 2.5 * YIELD)
    assert energy(*loop(_law(), amplitude, 5.0)) == pytest.approx(wanted, rel=1e-4)


def test_turning_the_speed_of_a_cycle_changes_nothing() -> None:
    slow, fast = energy(*loop(_law(2.0), 3 * YIELD, 0.01)), energy(*loop(_law(2.0), 3 * YIELD, 100.0))
    assert slow == pytest.approx(fast, rel=1e-6)


SLIP = 0.02


def _creeping(**values: float):  # type: ignore[no-untyped-def]
    given = {"force": FORCE, "yield": YIELD, "slip_speed": SLIP, **values}
    return law_of(attached("hysteresis", "spring", given, variant="creeping"), one_body())


@pytest.mark.parametrize(("speed", "share"), [(0.3, 0.3), (0.9, 0.9), (1.5, 1.0), (-4.0, -1.0)])
def test_a_creeping_element_holds_what_its_dashpot_carries_and_no_more_than_its_force(
    speed: float, share: float
) -> None:
    times_s = np.linspace(0, 100 * YIELD / SLIP, 21)
    found = driven(_creeping(shape=3.0), lambda t: speed * SLIP * t, lambda _t: speed * SLIP, times_s)
    assert found[-1] == pytest.approx(share * FORCE, rel=1e-6)


def test_a_creeping_element_held_still_forgets_over_the_time_of_yield_and_slip_speed() -> None:
    # At loop 1/2 the law unloads along its stiffness: spring and dashpot in series.
    rates = [0.0]
    law = _creeping(shape=2.0)
    law.function(0.0, 0.0, 0.0, law.parameters, [0.6], rates)
    assert rates[0] == pytest.approx(-0.6 * SLIP / YIELD, rel=1e-14)


def test_without_a_dashpot_a_creeping_element_is_the_plain_one() -> None:
    plain, creeping = loop(_law(2.0), 3 * YIELD, 5.0), loop(_creeping(shape=2.0, slip_speed=0.0), 3 * YIELD, 5.0)
    np.testing.assert_allclose(creeping[1], plain[1], atol=1e-6 * FORCE)


def test_the_loop_of_a_creeping_element_is_dahls_at_one() -> None:
    # Dahl's friction unloads as it loaded: w' = (s - |s| w)/yield.
    law = _creeping(loop=1.0, slip_speed=0.0)
    for w in (-0.7, 0.2, 0.9):
        for s in (-3.0, 2.0):
            rates = [0.0]
            law.function(0.0, s, 0.0, law.parameters, [w], rates)
            assert rates[0] == pytest.approx((s - abs(s) * w) / YIELD, rel=1e-12)


@pytest.mark.parametrize("speed", [0.05, 1.0, 20.0])
def test_a_creeping_element_takes_energy_at_any_speed(speed: float) -> None:
    assert energy(*loop(_creeping(loop=4.0), 2 * YIELD, speed * SLIP / (2 * YIELD))) > 0.0


def _sliders(**values: float):  # type: ignore[no-untyped-def]
    given = {"force": FORCE, "yield": YIELD, "shape": 40.0, **values}
    return law_of(attached("hysteresis", "spring", given, variant="sliders"), one_body())


def test_sliders_slip_one_after_another_along_iwans_backbone() -> None:
    # Of an even spread up to 2 yield the springs that are left carry k (d - d^2/(4 yield)).
    times_s = np.linspace(0, 1, 41)
    d = 2 * YIELD * times_s
    found = driven(_sliders(), lambda t: 2 * YIELD * t, lambda _t: 2 * YIELD, times_s)
    # Six in place of a continuum.
    np.testing.assert_allclose(found, FORCE / YIELD * (d - d**2 / (4 * YIELD)), atol=0.02 * FORCE)


@pytest.mark.parametrize("spread", [0.1, 1.0, 5.0])
def test_sliders_are_as_stiff_at_first_as_force_over_yield_and_hold_the_force(spread: float) -> None:
    d, f = loop(_sliders(spread=spread), 1e-4 * YIELD, 5.0)
    np.testing.assert_allclose(f, FORCE / YIELD * d, atol=1e-5 * FORCE / YIELD * 1e-4 * YIELD)
    times_s = np.linspace(0, 1, 21)
    found = driven(_sliders(spread=spread), lambda t: 40 * YIELD * t, lambda _t: 40 * YIELD, times_s)
    assert found[-1] == pytest.approx(FORCE, rel=1e-6)


def test_loops_of_sliders_are_the_backbone_twice_as_large() -> None:
    # Masing's rule: from a turn at d0 the force goes back by twice what it took from rest to half the way.
    amplitude, times_s = 1.5 * YIELD, np.linspace(0, 2, 81)
    found = driven(
        _sliders(), lambda t: amplitude * (1 - abs(t - 1)), lambda t: amplitude * (1.0 if t < 1 else -1.0), times_s
    )
    there, back = found[:41], found[40:]
    np.testing.assert_allclose(back[0] - back[::2], 2 * there[:21], atol=0.01 * FORCE)


@pytest.mark.nightly
def test_along_a_known_motion_sliders_are_springs_that_are_cut_off() -> None:
    d = 3 * YIELD * np.sin(np.linspace(0, 20, 1001)) * np.linspace(0, 1, 1001)
    law = _sliders()
    yields, stiffnesses = np.reshape(law.parameters[1:], (2, -1))
    found = driven(
        law, lambda t: np.interp(t, np.arange(1001), d), lambda t: np.interp(t, np.arange(1001), np.gradient(d)),
        np.arange(1001.0),
    )  # fmt: skip
    np.testing.assert_allclose(stops_along(d, yields, stiffnesses), found, atol=0.03 * FORCE)
