from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.motions import energy, force, law_of, loop
from tests.models.effects.small_models import one_body, with_loop
from tests.models.structures.made_models import tree

VALUES = {"amplitude": 2.0, "period": 0.02, "phase": 0.4}
TEETH = {**VALUES, "second_sine": 0.3, "second_cosine": -0.1}


@pytest.mark.parametrize(("site", "kind", "sign"), [("spring", "joint", -1.0), ("motor", "actuation", 1.0)])
def test_the_force_repeats_with_the_position_of_the_place(site: str, kind: str, sign: float) -> None:
    compiled = attached("ripple", site, VALUES).attach(one_body())
    (law,) = compiled.laws
    assert compiled.ports[law.port].kind == kind
    for d in (-0.013, 0.0, 0.004):
        assert force(law, d=d) == pytest.approx(2.0 * sin(2 * pi * d / 0.02 + 0.4), rel=1e-12)
        assert force(law, d=d + 0.06) == pytest.approx(force(law, d=d), rel=1e-9)
    # At a joint it resists, at an input it drives.
    assert np.sign(compiled.g[1, law.port]) == sign


def test_teeth_have_a_second_harmonic() -> None:
    (law,) = attached("ripple", "spring", TEETH, variant="harmonics").attach(one_body()).laws
    for d in (-0.013, 0.0, 0.004):
        angle = 2 * pi * d / 0.02 + 0.4
        expected = 2.0 * (sin(angle) + 0.3 * sin(2 * angle) - 0.1 * cos(2 * angle))
        assert force(law, d=d) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("values", "variant"), [(VALUES, "sine"), (TEETH, "harmonics")])
def test_it_takes_no_energy(values: dict[str, float], variant: str) -> None:
    law = law_of(attached("ripple", "spring", values, variant=variant), one_body())
    assert energy(*loop(law, 0.05, 3.0)) == pytest.approx(0.0, abs=1e-9)


def test_in_a_loop_it_follows_the_position_too() -> None:
    compiled = attached("ripple", "motor", VALUES).attach(with_loop(one_body()))
    assert compiled.ports[compiled.laws[0].port].kind == "actuation"


def test_an_input_that_acts_nowhere_in_particular_has_no_ripple() -> None:
    with pytest.raises(ModelError, match=r"ripple at 'floor': this input doesn't act at a place that moves"):
        attached("ripple", "floor", VALUES).attach(replace(tree()).compile())
