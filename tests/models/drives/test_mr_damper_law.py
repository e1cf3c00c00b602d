import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from chladni.models.drives.mr_coefficients import MrAsymmetry, MrCoefficients
from chladni.models.drives.mr_damper_law import (
    ASYMMETRY_ORDER,
    PAPER_ORDER,
    asymmetric_bouc_wen,
    modified_bouc_wen,
)
from chladni.models.drives.mr_shipped import MEASURED_DAMPER, MEASURED_DAMPER_ASYMMETRIC

numbers = st.floats(-1.0, 1.0)


def paper(x, v, t, law):
    """Equation 5 as the paper writes it, in y and z; force, x - y and z at the times."""
    alpha, c0, c1, k0, k1, x0, beta, gamma, delta, n, _ = law.parameters

    def rate_of_y(time, y, z):
        return (alpha * z + c0 * v(time) + k0 * (x(time) - y)) / (c0 + c1)

    def rates(time, state):
        y, z = state
        inner = v(time) - rate_of_y(time, y, z)
        return [
            rate_of_y(time, y, z),
            -gamma * abs(inner) * z * abs(z) ** (n - 1) - beta * inner * abs(z) ** n + delta * inner,
        ]

    solved = solve_ivp(rates, (t[0], t[-1]), [x(t[0]), 1e-12], t_eval=t, method="Radau", rtol=1e-10, atol=1e-12)
    y, z = solved.y
    inner = v(t) - rate_of_y(t, y, z)
    return c0 * inner + k0 * (x(t) - y) + k1 * (x(t) - x0) + alpha * z, x(t) - y, z


def test_it_is_equation_5_of_the_paper():
    law = MEASURED_DAMPER.law(0.5)
    t = np.linspace(0.0, 2.0, 201)
    x, v = (lambda time: 0.02 * np.sin(np.pi * time)), (lambda time: 0.02 * np.pi * np.cos(np.pi * time))
    force, w, z = paper(x, v, t, law)
    ours = [
        modified_bouc_wen(x(time), v(time), time, law.parameters, state, [0.0, 0.0])
        for time, state in zip(t, zip(w, z, strict=True), strict=True)
    ]
    assert ours == pytest.approx(force, rel=1e-9, abs=1e-9 * np.abs(force).max())


@given(w=numbers, z=numbers, d=numbers, s=numbers)
def test_an_asymmetry_of_nothing_is_the_paper_s_law(w, z, d, s):
    law = MEASURED_DAMPER.law(1.0)
    rates, other = [0.0, 0.0], [0.0, 0.0]
    force = modified_bouc_wen(d, s, 0.0, law.parameters, [w, z], rates)
    parameters = (*law.parameters, *MrAsymmetry(speed=0.01).numbers())
    assert asymmetric_bouc_wen(d, s, 0.0, parameters, [w, z], other) == pytest.approx(force, rel=1e-14)
    assert other == pytest.approx(rates, rel=1e-14)


@given(z=numbers, w=numbers, s=numbers)
def test_extension_and_compression_mirror_each_other_when_the_sides_change_places(z, w, s):
    """u -> -u with every motion and force turned around."""
    terms = {name: 0.3 for name in ASYMMETRY_ORDER if name.endswith(("moving", "sides"))}
    turned = {name: -value if name.endswith("sides") else value for name, value in terms.items()}
    base = MEASURED_DAMPER.law(0.5).parameters
    base = (*base[:5], 0.0, *base[6:])
    rates, other = [0.0, 0.0], [0.0, 0.0]
    one = asymmetric_bouc_wen(
        0.01, s, 0.0, (*base, *MrAsymmetry(speed=0.02, **terms).numbers()), [w, z], rates
    )  # fmt: skip
    two = asymmetric_bouc_wen(
        -0.01, -s, 0.0, (*base, *MrAsymmetry(speed=0.02, **turned).numbers()), [-w, -z], other
    )  # fmt: skip
    assert two == pytest.approx(-one, rel=1e-12, abs=1e-9)
    assert other == pytest.approx([-rate for rate in rates], rel=1e-12, abs=1e-9)


def test_each_side_has_the_coefficients_it_is_told():
    """Fast extension: u = 1, so the law is the paper's with coefficients times exp(sides + moving)."""
    sides = MrAsymmetry(
        alpha_sides=0.1, c0_sides=0.2, c1_sides=0.3, k0_sides=0.4, k1_sides=50.0, alpha_moving=0.5, c1_moving=-0.6,
        yield_moving=0.7, speed=1e-6,
    )  # fmt: skip
    base = dict(zip(PAPER_ORDER, MEASURED_DAMPER.law(0.5).parameters, strict=True))
    scales = {"alpha": 0.6, "c0": 0.2, "c1": -0.3, "k0": 0.4}
    moved = {name: value * np.exp(scales.get(name, 0.0)) for name, value in base.items()}
    moved["k1"] += 50.0
    for name in ("beta", "gamma", "delta"):
        moved[name] *= np.exp(-0.7)
    rates, other = [0.0, 0.0], [0.0, 0.0]
    state = [1e-4, 0.4]
    force = asymmetric_bouc_wen(0.01, 0.05, 0.0, (*base.values(), *sides.numbers()), state, rates)
    assert force == pytest.approx(modified_bouc_wen(0.01, 0.05, 0.0, (*moved.values(),), state, other), rel=1e-13)
    assert rates == pytest.approx(other, rel=1e-13)


def test_a_step_that_ran_far_away_does_not_overflow():
    law = MEASURED_DAMPER_ASYMMETRIC.law(1.0)
    rates = [0.0, 0.0]
    for z in (1e200, -1e200):
        modified_bouc_wen(0.0, 1.0, 0.0, law.parameters, [0.0, z], rates)
        assert np.all(np.isfinite(rates))


@given(side=st.sampled_from((-1.0, 1.0)), s=st.floats(-0.2, 0.2))
def test_at_its_bound_no_motion_drives_the_loop_further_out(side, s):
    law, rates = MEASURED_DAMPER.law(1.0), [0.0, 0.0]
    modified_bouc_wen(0.0, s, 0.0, law.parameters, [0.0, side * MEASURED_DAMPER.z_bound], rates)
    # z' is the difference of two terms of the size delta s.
    assert rates[1] * side <= 1e-13 * law.parameters[8]


def test_coefficients_say_which_mistake_they_hold():
    from chladni.signals.errors import ModelError

    good = {
        "alpha": (1.0,),
        "c0": (1.0,),
        "c1": (1.0,),
        "k0": (0.0,),
        "beta": 0.0,
        "gamma": 1.0,
        "delta": 1.0,
        "n": 1.0,
    }
    MrCoefficients(**good)
    for change, words in (
        ({"alpha": ()}, "alpha: 0 coefficients"),
        ({"c0": (1.0,) * 5}, "c0: 5 coefficients"),
        ({"k0": (float("nan"),)}, "k0: nan is not finite"),
        ({"delta": 0.0}, "the loop is bounded only with"),
        ({"gamma": -1.0}, "the loop is bounded only with"),
        ({"n": 0.5}, "the loop is bounded only with"),
    ):
        with pytest.raises(ModelError, match=words):
            MrCoefficients(**{**good, **change})
    with pytest.raises(ModelError, match="speed: 0 m/s is not possible"):
        MrAsymmetry(speed=0.0)
    falling = MrCoefficients(**{**good, "alpha": (1.0, -2.0)})
    assert falling.value("alpha", 0.25) == 0.5
    with pytest.raises(ModelError, match=r"alpha\(1 A\) = -1 is not possible; the coefficients hold from 0 to 1 A"):
        falling.law(1.0)
    with pytest.raises(ModelError, match=r"c1\(0 A\) = 0 is not possible"):
        MrCoefficients(**{**good, "c1": (0.0,)}).law(0.0)


def test_a_larger_damper_has_a_larger_force_in_every_term():
    for coefficients in (MEASURED_DAMPER, MEASURED_DAMPER_ASYMMETRIC):
        law, double = coefficients.law(0.5), coefficients.scaled(force=2.0).law(0.5)
        rates, other, state = [0.0, 0.0], [0.0, 0.0], [1e-4, 0.3]
        force = law.function(0.01, 0.03, 0.0, law.parameters, state, rates)
        assert double.function(0.01, 0.03, 0.0, double.parameters, state, other) == pytest.approx(2 * force)
        assert other == pytest.approx(rates)
    one = MEASURED_DAMPER.scaled(alpha=2.0, c0=3.0, c1=4.0)
    for name, factor in (("alpha", 2.0), ("c0", 3.0), ("c1", 4.0), ("k0", 1.0)):
        assert one.value(name, 0.7) == pytest.approx(factor * MEASURED_DAMPER.value(name, 0.7))


def test_shipped_coefficients_are_positive_over_their_currents_and_keep_a_joint_from_running_away():
    for coefficients in (MEASURED_DAMPER, MEASURED_DAMPER_ASYMMETRIC):
        for current in np.linspace(0.0, 1.0, 101):
            assert min(coefficients.law(current).parameters[:4]) > 0
        assert coefficients.k1 >= 0
        assert coefficients.gamma >= abs(coefficients.beta)
        assert coefficients.z_bound == pytest.approx(1.0, rel=1e-4)
        assert "second order in current" in coefficients.origin
