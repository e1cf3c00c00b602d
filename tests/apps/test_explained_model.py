"""A model with what was found in it: simulated, written and read back, it is the machine."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.apps.explained_model import explained_model
from chladni.gap.records.diagnosis import Diagnosis, FittedNumber
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.files.model_file import load_model, write_model
from chladni.models.integrator.simulate import simulate
from chladni.signals.errors import ModelError
from tests import made_diagnosis as made


def exact() -> Diagnosis:
    cause = made.friction(parameters={"force": FittedNumber(value=made.FRICTION_N, std=0.1, unit="N")})
    return replace(made.diagnosis(), causes=(cause,), tuned_parameters={})


def test_the_explained_model_simulates_the_machine() -> None:
    model = explained_model(made.arm_model(), exact())
    outputs = simulate(model, made.drive()).outputs.values
    # The same model by the same integrator: nothing but rounding lies between.
    np.testing.assert_allclose(outputs, made.rubbing_run().outputs.values, rtol=1e-12, atol=1e-12)


def test_tuned_values_and_effects_go_into_the_file_and_come_back(tmp_path: Path) -> None:
    found = made.two_causes()
    model = explained_model(made.arm_model(), found)
    write_model(model, tmp_path / "explained.toml")
    again = load_model(tmp_path / "explained.toml")
    assert again.parameters["elbow.stiffness"].value == 20400.0
    assert [(one.effect, one.site) for one in again.effects] == [
        ("coulomb_friction", "elbow"), ("gain_error", "acc_wrist")
    ]  # fmt: skip
    assert again.effects[0].values["force"] == 8.1
    first, second = (simulate(one, made.drive()).outputs.values for one in (model, again))
    np.testing.assert_array_equal(first, second)


#: Where each kind of site is in the model of the tests.
SITES = {
    "joint": "elbow",
    "body": "wrist",
    "input": "shaker",
    "output": "acc_wrist",
    "ground": "ground",
    "pair": "column~wrist",
    "output_pair": "acc_column~acc_wrist",
}


@pytest.mark.parametrize("word", CATALOGUE)
def test_every_word_goes_into_the_file_and_comes_back(tmp_path: Path, word: str) -> None:
    kind = CATALOGUE[word]
    for variant in kind.variants:
        typical = kind.parameters_of(variant.name)
        cause = made.friction(
            effect=word, site=SITES[kind.sites[0]], variant=variant.name,
            source="acc_column" if word == "cross_axis" else None,
            parameters={
                name: FittedNumber(value=one.value, std=None, unit=one.unit) for name, one in typical.items()
            },
        )  # fmt: skip
        model = explained_model(made.arm_model(), replace(made.diagnosis(), causes=(cause,)))
        write_model(model, tmp_path / "explained.toml")
        (again,) = load_model(tmp_path / "explained.toml").effects
        assert (again.effect, again.site, again.variant, again.source) == (
            word, cause.site, variant.name, cause.source
        )  # fmt: skip
        assert again.values == model.effects[0].values
        load_model(tmp_path / "explained.toml").compile()


def test_a_wrong_value_is_set_and_no_effect_is_added() -> None:
    model = explained_model(made.arm_model(), made.wrong_values())
    assert model.parameters["elbow.stiffness"].value == 31000.0
    assert model.effects == ()
    alone = explained_model(made.arm_model(), replace(made.wrong_values(), tuned_parameters={}))
    assert alone.parameters["elbow.stiffness"].value == 31000.0


def test_effects_that_were_known_before_stay() -> None:
    known = explained_model(made.arm_model(), exact())
    both = explained_model(known, replace(made.two_causes(), causes=made.two_causes().causes[1:]))
    assert [one.effect for one in both.effects] == ["coulomb_friction", "gain_error"]


def test_effects_of_ones_own_take_part_by_their_record() -> None:
    brake = replace(CATALOGUE["quadratic_damping"], name="magnetic_brake")
    cause = made.friction(
        effect="magnetic_brake", variant=None, parameters={"coefficient": FittedNumber(value=3.0, std=0.1, unit="1")}
    )
    found = replace(made.diagnosis(), causes=(cause,))
    model = explained_model(made.arm_model(), found, own_effects=[brake])
    assert model.effects[0].effect == "magnetic_brake"
    with pytest.raises(ModelError, match="magnetic_brake"):
        explained_model(made.arm_model(), found)


def test_a_diagnosis_of_another_model_is_refused() -> None:
    found = replace(made.diagnosis(), causes=(made.friction(site="knee"),), tuned_parameters={})
    with pytest.raises(ModelError, match="knee"):
        explained_model(made.arm_model(), found).compile()
