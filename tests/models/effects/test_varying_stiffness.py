import pytest

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.motions import force, law_of
from tests.models.effects.small_models import STIFFNESS, one_body

VALUES = {"relative_change": -0.3, "time": 4.0}


@pytest.mark.parametrize(("t", "change"), [(0.0, 0.0), (1.0, -0.075), (4.0, -0.3), (9.0, -0.3)])
def test_a_drift_grows_from_the_start_to_its_time(t: float, change: float) -> None:
    law = law_of(attached("varying_stiffness", "spring", VALUES), one_body())
    assert force(law, d=0.01, t=t) == pytest.approx(change * STIFFNESS * 0.01, abs=1e-15)


@pytest.mark.parametrize(("t", "change"), [(0.0, 0.0), (3.75, 0.0), (4.0, -0.15), (4.25, -0.3), (9.0, -0.3)])
def test_a_step_has_its_middle_at_its_time(t: float, change: float) -> None:
    law = law_of(attached("varying_stiffness", "spring", {**VALUES, "rise": 0.5}, variant="step"), one_body())
    assert force(law, d=0.01, t=t) == pytest.approx(change * STIFFNESS * 0.01, abs=1e-15)


def test_a_drift_of_no_duration_is_complete_at_once() -> None:
    law = law_of(attached("varying_stiffness", "spring", {**VALUES, "time": 0.0}), one_body())
    assert force(law, d=0.01) == pytest.approx(-0.3 * STIFFNESS * 0.01, rel=1e-14)


@pytest.mark.parametrize("variant", ["drift", "step"])
def test_a_joint_without_spring_has_nothing_that_varies(variant: str) -> None:
    with pytest.raises(ModelError, match=r"varying_stiffness at 'spring': the joint has no spring"):
        attached("varying_stiffness", "spring", VALUES, variant=variant).attach(one_body(stiffness=0.0))
