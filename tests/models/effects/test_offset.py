import numpy as np

from chladni.models.effects.attached_effect import attached
from tests.models.effects.small_models import one_body, with_loop


def test_every_sample_is_lifted() -> None:
    compiled = attached("offset", "speed", {"value": -0.4}).attach(one_body())
    ((row, action),) = compiled.output_maps
    assert compiled.outputs[row].name == "speed"
    np.testing.assert_allclose(action(np.arange(4.0), 10.0), np.arange(4.0) - 0.4)


def test_a_controller_feels_it() -> None:
    compiled = with_loop(attached("offset", "place", {"value": 0.1}).attach(one_body(), in_loop=True))
    (law,) = compiled.laws
    assert law.function(3.0, 1.0, 0.0, law.parameters, [], []) == 0.1
    assert compiled.ports[law.port].kind == "output"
