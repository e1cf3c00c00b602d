from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from chladni.models.effects.added_mass import mass_doubt
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure_input import StructureInput
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import DAMPING, MASS, STIFFNESS, one_body
from tests.models.structures.made_models import tree

FREQUENCY_HZ = np.linspace(0.5, 80.0, 160)


def test_the_natural_frequency_falls_as_the_closed_form_says() -> None:
    heavier = attached("added_mass", "mass", {"mass": 0.7}).attach(one_body())
    omega, zeta = sqrt(STIFFNESS / (MASS + 0.7)), DAMPING / (2 * sqrt(STIFFNESS * (MASS + 0.7)))
    pole = heavier.state_space().poles()[0]
    assert abs(pole) / (2 * pi) == pytest.approx(omega / (2 * pi), rel=1e-14)
    assert -pole.real / abs(pole) == pytest.approx(zeta, rel=1e-13)


@pytest.mark.parametrize("body", ["base", "left", "right"])
def test_it_is_the_model_of_a_heavier_body(body: str) -> None:
    model = tree()
    mass = {"base": 8.0, "left": 2.0, "right": 3.0}[body]
    heavier = model.with_values({f"{body}.mass": mass + 1.3}).compile()
    with_mass = attached("added_mass", body, {"mass": 1.3}).attach(model.compile())
    for name in ("a", "b", "c", "d", "g", "h"):
        given, wanted = getattr(with_mass, name), getattr(heavier, name)
        # Rounding of entries, which are as large as stiffness over mass.
        np.testing.assert_allclose(given, wanted, rtol=1e-12, atol=1e-14 * np.abs(wanted).max())


def test_it_resists_the_shaking_of_the_ground_too() -> None:
    model = tree()
    heavier = model.with_values({"right.mass": 4.0}).compile().frequency_response(FREQUENCY_HZ)
    given = attached("added_mass", "right", {"mass": 1.0}).attach(model.compile()).frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(given[:, 2], heavier[:, 2], rtol=1e-9, atol=1e-12 * np.abs(heavier[:, 2]).max())


def test_on_a_body_whose_motion_is_prescribed_it_changes_nothing_but_the_force_that_moves_it() -> None:
    model = tree()
    table = StructureInput(name="table", at="base", kind="displacement")
    driven = replace(model, inputs=(*model.inputs, table)).compile()
    heavier = attached("added_mass", "base", {"mass": 5.0}).attach(driven)
    np.testing.assert_allclose(
        heavier.frequency_response(FREQUENCY_HZ), driven.frequency_response(FREQUENCY_HZ), rtol=1e-12
    )


def test_two_masses_add_up() -> None:
    once = attached("added_mass", "mass", {"mass": 0.5}).attach(one_body())
    twice = attached("added_mass", "mass", {"mass": 0.25}).attach(once)
    direct = attached("added_mass", "mass", {"mass": 0.75}).attach(one_body())
    np.testing.assert_allclose(twice.a, direct.a, rtol=1e-13)


def test_less_mass_is_no_added_mass() -> None:
    with pytest.raises(ModelError, match=r"added_mass at 'mass': mass: -0.1 kg is not possible; give a value from 0"):
        attached("added_mass", "mass", {"mass": -0.1})


def test_an_added_mass_is_doubted_where_it_is_many_times_the_body_s() -> None:
    assert mass_doubt("carriage", 50.0, 2.0, "kg") is None
    assert "1100 times the 0.095 kg" in str(mass_doubt("carriage", 101.0, 0.095, "kg"))
