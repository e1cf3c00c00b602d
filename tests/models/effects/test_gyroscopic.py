import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import DAMPING, MASS, STIFFNESS, one_body, two_bodies


def test_two_alike_whirl_forward_and_back() -> None:
    # m z'' + (c - j g) z' + k z = 0 for z = x + j y (Friswell and others, Dynamics of Rotating Machines, chapter 3).
    coefficient = 9.0
    coupled = attached("gyroscopic", "mass~other", {"coefficient": coefficient}).attach(two_bodies())
    wanted = np.roots([MASS, DAMPING - 1j * coefficient, STIFFNESS])
    found = np.linalg.eigvals(coupled.a)
    assert sorted(found.imag) == pytest.approx(sorted([*wanted.imag, *(-wanted.imag)]), rel=1e-9)
    # It takes no energy: damping decays the sum of both as before.
    assert found.real.sum() == pytest.approx(np.linalg.eigvals(two_bodies().a).real.sum())


def test_the_ground_has_no_velocity() -> None:
    with pytest.raises(ModelError, match="a rotor couples two bodies"):
        attached("gyroscopic", "ground~mass", {"coefficient": 1.0}).attach(one_body())
