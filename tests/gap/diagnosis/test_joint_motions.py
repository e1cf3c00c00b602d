"""How each joint moves while a log runs."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chladni.gap.comparison.log_regimes import amplitude
from chladni.gap.comparison.shares import regime_shares
from chladni.gap.diagnosis.diagnose import joint_motions
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.places import Site
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.errors import ModelError
from tests.gap.arm import RATE_HZ, arm, low_passed, measured

FREQUENCY_HZ, FORCE_N = 12.0, 50.0
STIFFNESS, DAMPING, MASS = 4.0e5, 900.0, 40.0


def slide() -> StructureModel:
    """One mass on a spring: its motion under a sine is known."""
    return StructureModel(
        name="slide",
        structure=Structure(
            bodies=(Body(name="table", mass=MASS),),
            joints=(Joint(name="guide", between=("ground", "table"), stiffness=STIFFNESS, damping=DAMPING),),
        ),
        inputs=(StructureInput(name="shaker", at="table"),),
        outputs=(StructureOutput(name="acc", measures="acceleration", at="table"),),
    )


def study(model: StructureModel, force: Any = None) -> Any:
    log = measured(model=model, force=force, seconds=4.0)
    return SimpleNamespace(model=model, measurement=log, contest=SimpleNamespace(run=FreeRun(model, log)))


def fit(model: StructureModel) -> Any:
    return SimpleNamespace(z=np.zeros(len(model.parameters)), effects=(), initial=None)


def test_a_sine_on_a_travel_has_the_amplitude_of_the_sine() -> None:
    place = np.arange(4000)
    found = amplitude(2e-3 * np.sin(2 * np.pi * place / 50) + 1e-7 * place + 5.0, 50)
    assert found.shape == place.shape
    # The travel adds a little of its own to each period.
    assert found == pytest.approx(2e-3, rel=1e-3)


def test_the_amplitude_follows_what_grows_and_fades() -> None:
    place = np.arange(8000)
    envelope = 1.0 + 0.8 * np.sin(2 * np.pi * place / 8000)
    assert amplitude(envelope * np.sin(2 * np.pi * place / 40), 40) == pytest.approx(envelope, abs=0.02)


def test_a_record_shorter_than_a_period_has_one_amplitude() -> None:
    assert np.ptp(amplitude(np.sin(np.arange(30.0) / 9), 500)) == 0


def test_a_mass_on_a_spring_moves_as_the_formula_says() -> None:
    time_s = np.arange(4000) / RATE_HZ
    model = slide()
    found = joint_motions(study(model, FORCE_N * np.sin(2 * np.pi * FREQUENCY_HZ * time_s)), fit(model), None)
    units = {name: one.unit for name, one in found.items()}
    assert units == {"guide.displacement": "m", "guide.velocity": "m/s", "guide.amplitude": "m"}
    omega = 2 * np.pi * FREQUENCY_HZ
    size = FORCE_N / abs(STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING)
    # The first second forgets how it began: e^-11.
    late = slice(1000, None)
    assert np.max(found["guide.displacement"].values[late]) == pytest.approx(size, rel=1e-2)
    assert np.max(found["guide.velocity"].values[late]) == pytest.approx(omega * size, rel=1e-2)
    # Over a period of the mode, 0.76 of the sine's, it goes up and down about the sine's own.
    assert np.mean(found["guide.amplitude"].values[late]) == pytest.approx(size, rel=0.1)


def test_every_joint_is_there_and_the_recovered_motion_is_kept() -> None:
    model = arm()
    beside = study(model)
    seen = np.sin(np.arange(beside.measurement.samples) / 30)
    known: Any = SimpleNamespace(site=Site(name="elbow", kind="joint"), displacement=seen, velocity=np.gradient(seen))
    found = joint_motions(beside, fit(model), known)
    assert {name.split(".")[0] for name in found} == {"shoulder", "elbow", "hand"}
    assert found["elbow.displacement"].values is seen
    assert not np.array_equal(joint_motions(beside, fit(model), None)["elbow.displacement"].values, seen)
    at_input: Any = SimpleNamespace(site=Site(name="shaker", kind="input"), displacement=seen, velocity=seen)
    assert len(joint_motions(beside, fit(model), at_input)) == 9


def test_a_run_that_diverges_leaves_what_was_recovered() -> None:
    model = arm()
    beside = study(model)

    def diverging(*_: object) -> None:
        raise ModelError("the model diverges")

    beside.contest.run = SimpleNamespace(compiled=beside.contest.run.compiled, motions=diverging)
    seen = np.sin(np.arange(beside.measurement.samples) / 30)
    known: Any = SimpleNamespace(site=Site(name="hand", kind="joint"), displacement=seen, velocity=seen)
    assert joint_motions(beside, fit(model), None) == {}
    assert set(joint_motions(beside, fit(model), known)) == {
        "hand.displacement", "hand.velocity", "hand.amplitude"
    }  # fmt: skip


def test_a_gap_that_a_joint_s_motion_makes_is_told_by_that_joint() -> None:
    model = arm()
    # Steady numbers, so that the hardening is all of the gap.
    right = dict.fromkeys(model.parameters, 1.0)
    rises = 0.6 + 0.5 * np.sin(2 * np.pi * np.arange(8000) / 1600)
    force = rises * low_passed(200.0 * np.random.default_rng(1).standard_normal(8000))
    stiffer = attached("hardening_stiffness", "hand", {"cubic": 3e8})
    log = measured((stiffer,), off=right, seconds=8.0, force=force)
    run = FreeRun(model, log)
    beside: Any = SimpleNamespace(model=model, measurement=log, contest=SimpleNamespace(run=run))
    motions = joint_motions(beside, fit(model), None)
    residual = log.outputs - run.outputs()
    (first, *_) = regime_shares(residual, log.outputs, motions, beyond_motion=True)
    assert first.variable == "hand.amplitude"
    assert first.high == motions["hand.amplitude"].values.max()
    assert first.time is not None
    assert first.share > 2 * first.time
