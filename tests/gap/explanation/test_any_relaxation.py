"""A joint of rubber is told from all else that is linear."""

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.explanation.any_relaxation import Relaxation, any_relaxation
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from tests.gap.arm import arm, measured
from tests.gap.rubber import CORNERS_HZ, Rubber


def relaxation_of(*effects, joint: str) -> tuple[float, Relaxation | None]:
    log = measured(effects, seed=3)
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    located = next(one for one in location.ranked if joint in one.places[0].names)
    site = next(one for one in located.places[0].sites if one.name == joint)
    return location.tuned.chi, any_relaxation(location, located, site)


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["shoulder", "elbow", "hand"])
def test_branches_a_decade_apart_do_what_closer_ones_do(joint: str) -> None:
    before, found = relaxation_of(Rubber(site=joint), joint=joint)
    assert before > 10.0
    assert found is not None
    assert found.chi < 1.1
    s = 2j * np.pi * np.array(found.band_hz)[:, None]
    low, high = np.sum(Rubber().stiffness * s / (s + 2 * np.pi * np.array(CORNERS_HZ)), axis=1)
    assert found.rise == pytest.approx(high.real - low.real, rel=0.1)
    assert found.loss == pytest.approx(Rubber().stiffness, rel=0.5)
    assert f"stiffness of {joint} that rises" in found.sentence()
    assert found.unit == "N/m"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "site", "values", "joint"),
    [
        ("extra_mode", "column", {"mass": 0.8, "frequency": 30.0, "damping_ratio": 0.05}, "shoulder"),
        ("added_mass", "column", {"mass": 3.0}, "shoulder"),
        pytest.param("hardening_stiffness", "elbow", {"cubic": 1e12}, "elbow", marks=pytest.mark.nightly),
        ("coulomb_friction", "elbow", {"force": 8.0}, "elbow"),
        pytest.param("delay", "shaker", {"delay": 1e-3}, "hand", marks=pytest.mark.nightly),
    ],
)
def test_relaxing_explains_no_other_effect(word: str, site: str, values: dict[str, float], joint: str) -> None:
    before, found = relaxation_of(chladni.attached(word, site, values), joint=joint)
    assert before > 3.0
    assert found is None or found.chi > 2.0


@pytest.mark.slow
def test_rubber_is_no_mass_on_a_mount_and_the_answer_says_what_fits() -> None:
    found = diagnose(arm(), [measured((Rubber(),), seed=3)])
    assert found.verdict == "unknown"
    assert found.advice is not None
    assert "stiffness of shoulder that rises by" in found.advice
