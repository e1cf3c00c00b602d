import numpy as np
import pytest

from chladni.gap.plant.tunable import Tunables
from chladni.signals.errors import EstimateError
from tests.gap.made_log import chain, three_bodies


def test_a_sigma_is_the_tolerance_of_the_value():
    tunables = Tunables.of(three_bodies())
    z = np.zeros(9)
    z[tunables.names.index("j1.stiffness")] = 2.0
    values = tunables.values(z)
    assert values["j1.stiffness"] == pytest.approx(6e5 * np.exp(0.1), rel=1e-15)
    assert values["b0.mass"] == 2.0


def test_values_are_e_folds_of_the_tolerance():
    tunables = Tunables.of(three_bodies())
    z = np.random.default_rng(0).standard_normal(9)
    values = np.array([*tunables.values(z).values()])
    np.testing.assert_allclose(np.log(values / tunables.nominal) / tunables.tolerance, z, rtol=1e-12, atol=1e-12)


def test_what_is_zero_or_certain_does_not_move():
    from dataclasses import replace

    model = replace(chain([1.0, 1.0], [1e5, 0.0], [10.0, 10.0]), tolerances={"b1.mass": 0.0})
    assert Tunables.of(model).names == ("b0.mass", "j0.stiffness", "j0.damping", "j1.damping")


def test_mistakes_are_named():
    tunables = Tunables.of(three_bodies())
    with pytest.raises(EstimateError, match="shape"):
        tunables.values(np.zeros(3))
