import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.harmonics import bent, bent_samples
from tests.models.effects.small_models import one_body, with_loop


def test_a_tone_gets_the_harmonics_of_its_powers() -> None:
    size, second, third, scale = 30.0, 0.05, -0.08, 20.0
    angle = 2 * np.pi * 5 * np.arange(1000) / 1000
    lines = 2 * np.fft.rfft(bent_samples(size * np.cos(angle), 1000.0, second, third, scale)) / 1000
    # cos^2 = (1 + cos 2a)/2, cos^3 = (3 cos a + cos 3a)/4.
    assert lines[10].real == pytest.approx(second * size**2 / scale / 2)
    assert lines[15].real == pytest.approx(third * size**3 / scale**2 / 4)
    assert lines[5].real == pytest.approx(size + 0.75 * third * size**3 / scale**2)


def test_in_a_loop_the_law_bends_as_samples_are_bent() -> None:
    values = {"second": 0.05, "third": -0.08, "scale": 20.0}
    (law,) = attached("harmonics", "motor", values).attach(with_loop(one_body())).laws
    for command in (-31.0, 0.0, 4.0):
        shaped = bent_samples(np.array([command]), 1.0, *law.parameters)[0]
        assert command + bent(command, 0.0, 0.0, law.parameters, [], []) == pytest.approx(shaped)
