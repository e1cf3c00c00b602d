import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.effect_kind import Site
from chladni.models.effects.signal_path import (
    has_own_samples,
    input_row,
    is_in_loop,
    output_row,
    takes_own_samples,
    with_samples_mapped,
)
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body, with_loop

MOTOR = Site(effect="saturation", name="motor", kind="input")
PLACE = Site(effect="clipping", name="place", kind="output")


def test_an_input_is_in_a_loop_when_its_force_comes_back_to_it() -> None:
    assert not is_in_loop(one_body(), MOTOR)
    assert is_in_loop(with_loop(one_body()), MOTOR)
    lagged = attached("lag", "motor", {"time_constant": 0.1}).attach(one_body())
    # States behind a filter are no loop: nothing that is added behind the lag reaches it.
    assert not is_in_loop(lagged, MOTOR)
    assert is_in_loop(one_body(), Site(effect="saturation", name="motor", kind="input", in_loop=True))


def test_only_what_is_made_of_its_own_samples_can_be_mapped() -> None:
    assert has_own_samples(one_body(), MOTOR)
    assert has_own_samples(one_body(), PLACE)
    assert not has_own_samples(with_loop(one_body()), MOTOR)
    closed = with_loop(one_body())
    with pytest.raises(ModelError, match=r"saturation at 'motor': the command there is not made of"):
        with_samples_mapped(closed, MOTOR, lambda samples, _rate: samples)


def test_an_input_takes_its_own_samples_until_something_else_joins() -> None:
    assert takes_own_samples(one_body(), "motor")
    assert not takes_own_samples(with_loop(one_body()), "motor")
    assert takes_own_samples(with_loop(one_body()), "reference")
    assert takes_own_samples(attached("lag", "motor", {"time_constant": 0.1}).attach(one_body()), "motor")


def test_names_that_are_not_there_are_told() -> None:
    with pytest.raises(ModelError, match=r"input 'motor' takes no samples of its own: a controller drives it"):
        input_row(with_loop(one_body()), "motor")
    with pytest.raises(ModelError, match=r"no output 'nowhere'; outputs: acc, speed, place"):
        output_row(one_body(), "nowhere")


def test_a_map_behind_a_gain_acts_on_what_the_gain_gives() -> None:
    louder = attached("gain_error", "motor", {"gain": 4.0}).attach(one_body())
    mapped = with_samples_mapped(louder, MOTOR, lambda samples, _rate: samples**2)
    np.testing.assert_allclose(mapped.input_maps[0][1](np.array([3.0]), 1.0), [36.0])
