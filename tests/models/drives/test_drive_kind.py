import pytest

from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_kind import no_limits, no_loops
from chladni.signals.errors import ModelError
from chladni.signals.units import si_factor

KINDS = pytest.mark.parametrize("kind", DRIVES.values(), ids=list(DRIVES))


@KINDS
def test_every_parameter_is_told_in_a_unit_that_is_known(kind):
    for parameter in kind.parameters.values():
        factor, unit = si_factor(parameter.shown_unit or parameter.unit)
        assert unit == si_factor(parameter.unit)[1], parameter.name
        assert factor > 0
        assert parameter.usual, parameter.name
        assert parameter.meaning


@KINDS
def test_names_of_options_that_parameters_act_with_are_there(kind):
    choices = {option.name: option.choices for option in kind.options}
    for name, (option, words) in kind.acts_with.items():
        assert name in kind.parameters
        assert set(words) <= set(choices[option])


@KINDS
def test_each_word_of_each_option_makes_a_model(kind):
    for option in kind.options:
        for word in option.choices:
            compiled = kind.build(kind.acting({option.name: word}).numbers(), kind.choices({option.name: word}))
            assert compiled.inputs


def test_a_parameter_of_an_option_that_is_off_is_told_with_the_option():
    with pytest.raises(ModelError, match="velocity_gain acts only with option loop = velocity or position"):
        DRIVES["dc-servo"].with_values({"velocity_gain": 1.0}, {"loop": "current"})


def test_a_kind_without_options_says_none():
    bare = type(DRIVES["pneumatic-motor"])(
        name="bare", title="Bare", parameters=DRIVES["pneumatic-motor"].parameters, inputs=(), outputs=(),
        build=DRIVES["pneumatic-motor"].build,
    )  # fmt: skip
    with pytest.raises(ModelError, match="bare: no option 'x'; options: none"):
        bare.choices({"x": "on"})
    assert no_loops({}, {}) == no_limits({}, {}) == ()
