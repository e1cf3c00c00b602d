"""A spinning wheel between two bodies is told from all else that is linear."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.explanation.any_coupling import Coupling, any_coupling
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from chladni.models.core.compiled_model import CompiledModel
from tests.gap.arm import arm, measured

COEFFICIENT = 70.0


@dataclass(frozen=True)
class Wheel:
    """Pushes two bodies aside by each other's velocity, without doing work."""

    effect: str = "gyroscopic_coupling"
    site: str = "wrist"

    @property
    def values(self) -> Mapping[str, float]:
        return {}

    def attach(self, compiled: CompiledModel) -> CompiledModel:
        column, wrist = (compiled.port_index(name, "body") for name in ("column", "wrist"))
        force = np.zeros((len(compiled.ports), len(compiled.states)))
        force[wrist] = COEFFICIENT * compiled.velocity_state[column]
        force[column] = -COEFFICIENT * compiled.velocity_state[wrist]
        return replace(compiled, a=compiled.a + compiled.g @ force, c=compiled.c + compiled.h @ force)


def coupling_of(*effects) -> tuple[float, Coupling]:
    log = measured(effects, seed=3)
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    found = any_coupling(location)
    assert found is not None
    return location.tuned.chi, found


def test_the_bodies_and_both_coefficients_are_found() -> None:
    before, found = coupling_of(Wheel())
    assert before > 10.0
    assert found.chi < 1.05
    assert (found.first, found.second) == ("column", "wrist")
    assert found.on_second == pytest.approx(-COEFFICIENT, rel=0.02)
    assert found.on_first == pytest.approx(COEFFICIENT, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "site", "values"),
    [
        ("time_offset", "acc_wrist", {"offset": 1e-4}),
        ("delay", "shaker", {"delay": 2e-4}),
        pytest.param(
            "mounting_resonance", "acc_arm", {"frequency": 250.0, "damping_ratio": 0.03}, marks=pytest.mark.nightly
        ),
        pytest.param(
            "extra_mode", "arm", {"mass": 0.4, "frequency": 30.0, "damping_ratio": 0.02}, marks=pytest.mark.nightly
        ),
        ("coulomb_friction", "elbow", {"force": 8.0}),
    ],
)
def test_velocities_explain_no_other_effect(word: str, site: str, values: dict[str, float]) -> None:
    before, found = coupling_of(chladni.attached(word, site, values))
    assert before > 3.0
    assert found.chi - 1.0 > 0.2 * (before - 1.0)


@pytest.mark.nightly
def test_a_wheel_is_no_effect_of_the_catalogue_and_the_answer_says_what_fits() -> None:
    found = diagnose(arm(), [measured((Wheel(),), seed=3)])
    assert found.verdict == "unknown"
    assert found.advice is not None
    assert "times the velocity of wrist on column" in found.advice
    assert "N s/m" in found.advice
    assert "wheel" in found.advice
