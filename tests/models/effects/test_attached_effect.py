import pytest

from chladni.models.core.port import Port
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.errors import ModelError
from tests.models.effects.own_effect import CUBIC_DAMPING
from tests.models.effects.small_models import one_body, with_loop
from tests.models.structures.made_models import tree


def test_it_is_an_effect_of_the_core() -> None:
    effect = attached("coulomb_friction", "spring", {"force": 8.1})
    assert (effect.effect, effect.site, effect.values["force"]) == ("coulomb_friction", "spring", 8.1)


def test_what_is_optional_keeps_its_value() -> None:
    made = attached("coulomb_friction", "spring", {"force": 8.1})
    assert made.values == {"force": 8.1, "offset": 0.0, "creep_speed": 1e-4}
    assert made.parameters["creep_speed"].unit == "m/s"
    assert made.variant == "regularised"


@pytest.mark.parametrize(
    ("word", "values", "variant", "message"),
    [
        ("coulomb_frictoin", {}, None, r"no effect 'coulomb_frictoin'; did you mean coulomb_friction\?"),
        ("xyz", {}, None, r"no effect 'xyz'; effects: coulomb_friction, stribeck_friction, "),
        ("coulomb_friction", {}, None, r"coulomb_friction at 'spring': give force \[N\]"),
        ("stribeck_friction", {"static": 2.0}, None, r"give coulomb \[N\], speed \[m/s\]"),
        ("coulomb_friction", {"force_n": 1.0}, None, r"at 'spring': no parameter 'force_n'; did you mean force\?"),
        ("coulomb_friction", {"force": -1.0}, None, r"at 'spring': force: -1 N is not possible; give a value from 0"),
        ("coulomb_friction", {"force": float("nan")}, None, r"at 'spring': force: nan is not finite"),
        ("coulomb_friction", {"force": 1.0}, "bristel", r"no variant 'bristel'; did you mean bristle\?"),
        ("coulomb_friction", {"force": 1.0, "presliding": 1e-6}, None, r"no parameter 'presliding'"),
        ("softening_stiffness", {"cubic": 1.0}, None, r"cubic: 1 N/m\^3 is not possible; give a value from -"),
    ],
)  # fmt: skip
def test_mistakes_are_told_in_one_line(
    word: str, values: dict[str, float], variant: str | None, message: str
) -> None:
    with pytest.raises(ModelError, match=message) as caught:
        attached(word, "spring", values, variant=variant)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("word", "site", "values", "message"),
    [
        ("coulomb_friction", "hammer", {"force": 1.0}, r"acts at a joint, but 'hammer' is an input; possible "),
        ("added_mass", "tie", {"mass": 1.0}, r"acts at a body, but 'tie' is a joint; possible sites: base, "),
        ("gain_error", "left", {"gain": 1.0}, r"acts at an input or an output, but 'left' is a body"),
        ("coulomb_friction", "knie", {"force": 1.0}, r"there is no 'knie'; did you mean knee\?"),
        ("base_vibration", "foot", {"level": 1.0, "band": 9.0}, r"acts at the ground, but 'foot' is a joint"),
        ("delay", "qqq", {"delay": 1.0}, r"there is no 'qqq'; possible sites: hammer, actuator, floor"),
    ],
)  # fmt: skip
def test_a_site_where_it_cannot_act_is_told_with_those_where_it_can(
    word: str, site: str, values: dict[str, float], message: str
) -> None:
    with pytest.raises(ModelError, match=message):
        attached(word, site, values).attach(tree().compile())


def test_a_model_without_ground_cannot_shake() -> None:
    from chladni.models.drives.catalogue import DRIVES
    from chladni.models.drives.drive_model import drive_model

    motor = drive_model(DRIVES["pneumatic-motor"]).compile()
    with pytest.raises(ModelError, match=r"there is no 'ground'; possible sites: none"):
        attached("base_vibration", "ground", {"level": 1.0, "band": 9.0}).attach(motor)


def test_a_record_is_made_only_of_parts_that_fit() -> None:
    kind = CATALOGUE["coulomb_friction"]
    common = {"name": "x", "family": "friction", "meaning": "x", "parameters": kind.parameters}
    with pytest.raises(ModelError, match=r"effect 'x': it needs at least one kind of site and one variant"):
        EffectKind(**common, sites=(), variants=kind.variants)
    with pytest.raises(ModelError, match=r"no parameter 'offset_n'; did you mean offset\?"):
        EffectKind(**common, sites=("joint",), variants=kind.variants, optional=("offset_n",))


def test_ones_own_effect_attaches_like_those_of_the_catalogue() -> None:
    effect = attached(CUBIC_DAMPING, "spring", {"coefficient": 3.0})
    compiled = effect.attach(one_body())
    assert compiled.ports[compiled.laws[0].port] == Port(name="spring", kind="joint", stiffness=800.0, damping=4.0)
    assert "cubic_damping" not in CATALOGUE


def test_an_input_that_a_controller_drives_is_a_site() -> None:
    closed = with_loop(one_body())
    assert attached("saturation", "motor", {"limit": 1.0}).attach(closed).laws
    assert attached("saturation", "reference", {"limit": 1.0}).attach(closed).input_maps


def test_values_are_its_own_copy() -> None:
    values = {"mass": 1.0}
    made = attached("added_mass", "mass", values)
    values["mass"] = 9.0
    assert made.values["mass"] == 1.0
    assert isinstance(made, AttachedEffect)
