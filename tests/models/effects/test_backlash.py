import pytest

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.motions import force, law_of
from tests.models.effects.small_models import DAMPING, STIFFNESS, one_body

GAP = 2e-4


@pytest.mark.parametrize(
    ("d", "spring_force"),
    [(0.0, 0.0), (0.9e-4, 0.0), (1e-4, 0.0), (3e-4, STIFFNESS * 2e-4), (-3e-4, -STIFFNESS * 2e-4)],
)
def test_the_joints_spring_acts_only_outside_the_gap(d: float, spring_force: float) -> None:
    law = law_of(attached("backlash", "spring", {"gap": GAP}), one_body())
    assert STIFFNESS * d + force(law, d=d, s=0.3) == pytest.approx(spring_force, abs=1e-15)


@pytest.mark.parametrize(("d", "share"), [(0.0, 0.0), (0.99e-4, 0.0), (1.05e-4, 0.5), (1.1e-4, 1.0), (-2e-4, 1.0)])
def test_the_damper_too_acts_in_contact_only_when_asked(d: float, share: float) -> None:
    law = law_of(attached("backlash", "spring", {"gap": GAP}, variant="contact_damping"), one_body())
    spring = law_of(attached("backlash", "spring", {"gap": GAP}), one_body())
    s = 0.3
    damper = DAMPING * s + force(law, d=d, s=s) - force(spring, d=d)
    assert damper == pytest.approx(share * DAMPING * s, abs=1e-12)


def test_a_joint_without_spring_has_no_play() -> None:
    with pytest.raises(ModelError, match=r"backlash at 'spring': the joint has no spring that could have play"):
        attached("backlash", "spring", {"gap": GAP}).attach(one_body(stiffness=0.0))
