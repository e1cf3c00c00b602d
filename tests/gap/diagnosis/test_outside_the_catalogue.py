"""What isn't in the catalogue is unknown, or told for what it comes near to without being sure."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.arm import among_few, arm, measured
from tests.gap.rubber import Rubber

COEFFICIENT = 70.0


@dataclass(frozen=True)
class Wheel:
    """Pushes two bodies aside by each other's velocity, without doing work: as the catalogue's word does."""

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


@pytest.mark.nightly
def test_a_wheel_that_spins_between_two_bodies_is_unknown_where_its_word_is_left_out() -> None:
    found = diagnose(arm(), [measured((Wheel(),), seed=3)], leave_out={"gyroscopic"})
    assert found.verdict == "unknown"


@pytest.mark.nightly
@pytest.mark.slow
@among_few("added_mass", "extra_mode", "mounting_resonance", "hysteresis")
def test_rubber_is_no_mass_on_a_mount(out: frozenset[str]) -> None:
    found = diagnose(arm(), [measured((Rubber(),), seed=3)], leave_out=out)
    assert found.verdict == "unknown"


@pytest.mark.nightly
def test_a_joint_that_relaxes_a_little_passes_for_no_wrong_value() -> None:
    out = frozenset(CATALOGUE)
    relaxing = diagnose(arm(), [measured((Rubber(stiffness=2e3),), seed=5, seconds=5.0)], leave_out=out)
    assert relaxing.verdict == "unknown"
    off = {"shoulder.damping": 2.0, "shoulder.stiffness": 1.2}
    stiffer = diagnose(arm(), [measured(seed=5, seconds=5.0, off=off)], leave_out=out)
    assert stiffer.verdict == "parameters"
    assert {one.site for one in stiffer.causes} == set(off)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_loop_is_believed_where_there_is_one() -> None:
    # Half of a millimetre and more: what yields sooner is friction.
    values = {"force": 20.0, "yield": 5e-4, "shape": 2.0}
    log = measured((chladni.attached("hysteresis", "elbow", values),), seed=5, seconds=5.0)
    found = diagnose(arm(), [log], leave_out=frozenset(CATALOGUE) - {"hysteresis", "gain_error", "delay"})
    assert [(one.effect, one.site) for one in found.causes] == [("hysteresis", "elbow")]


@pytest.mark.nightly
def test_equal_mounts_on_all_sensors_are_no_causes_where_one_filter_of_the_command_does_as_much() -> None:
    log = measured((chladni.attached("lag", "shaker", {"time_constant": 5e-4}),), seed=5, seconds=5.0)
    found = diagnose(arm(), [log], leave_out=frozenset(CATALOGUE) - {"mounting_resonance", "gain_error"})
    assert found.verdict == "unknown"
