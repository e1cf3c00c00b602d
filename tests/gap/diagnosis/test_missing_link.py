"""A spring that the model has no joint for is told with the two that it links."""

from collections.abc import Collection

import pytest

from chladni.gap.diagnosis.diagnose import diagnose
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.made_log import band_noise, measured, three_bodies


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        {"missing_link", "coulomb_friction", "gain_error"},
        pytest.param(CATALOGUE, id="catalogue", marks=pytest.mark.nightly),
    ],
)
@pytest.mark.parametrize("site", ["b0~b2", pytest.param("ground~b1", marks=pytest.mark.nightly)])
def test_a_spring_between_two_that_share_no_joint_is_a_missing_link(site: str, words: Collection[str]) -> None:
    link = attached("missing_link", site, {"stiffness": 3e5, "damping": 40.0})
    log, _ = measured(three_bodies().with_effects((link,)), band_noise(2000, rms=150.0))
    found = diagnose(three_bodies(), [log], leave_out=frozenset(CATALOGUE) - set(words))
    (cause,) = found.causes
    assert (cause.effect, cause.site) == ("missing_link", site)
    assert cause.parameters["stiffness"].value == pytest.approx(3e5, rel=0.02)
    assert cause.parameters["damping"].value == pytest.approx(40.0, rel=0.2)
