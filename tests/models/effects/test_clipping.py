import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from tests.models.effects.motions import force
from tests.models.effects.small_models import one_body, with_loop

SAMPLES = np.array([-9.0, -2.0, 0.3, 2.1])
CLIPPED = np.array([-2.0, -2.0, 0.3, 2.0])


def test_recorded_samples_end_at_the_range() -> None:
    ((row, action),) = attached("clipping", "speed", {"limit": 2.0}).attach(one_body()).output_maps
    assert row == 1
    np.testing.assert_array_equal(action(SAMPLES, 100.0), CLIPPED)


def test_a_controller_sees_the_end_of_the_range() -> None:
    sensor = attached("clipping", "place", {"limit": 2.0}).attach(one_body(), in_loop=True)
    assert not sensor.output_maps
    (law,) = sensor.laws
    for sample, seen in zip(SAMPLES, CLIPPED, strict=True):
        assert sample + force(law, d=sample) == pytest.approx(seen, abs=1e-15)
    closed = with_loop(sensor, gain=300.0)
    # What is clipped away from the output doesn't reach the motor either.
    assert closed.h[2, law.port] == 1.0
    assert closed.g[1, law.port] == pytest.approx(-300.0 / 2.0)


def test_a_round_end_is_that_of_an_actuators_limit() -> None:
    values = {"limit": 2.0, "knee": 0.2}
    ((_, seen),) = attached("clipping", "speed", values, variant="rounded").attach(one_body()).output_maps
    ((_, acts),) = attached("saturation", "motor", values, variant="rounded").attach(one_body()).input_maps
    np.testing.assert_array_equal(seen(SAMPLES, 100.0), acts(SAMPLES, 100.0))
    (law,) = attached("clipping", "place", values, variant="rounded").attach(one_body(), in_loop=True).laws
    for sample, wanted in zip(SAMPLES, seen(SAMPLES, 100.0), strict=True):
        assert sample + force(law, d=sample) == pytest.approx(wanted, rel=1e-12)


def test_a_model_that_has_a_port_at_an_output_says_that_it_is_in_a_loop() -> None:
    with_port = attached("gain_error", "place", {"gain": 1.0}).attach(one_body(), in_loop=True)
    assert with_port.ports[-1].kind == "output"
    assert attached("clipping", "place", {"limit": 2.0}).attach(with_port).laws


def test_a_sensor_does_not_record_what_lies_far_beyond_its_range() -> None:
    signal = np.sin(np.linspace(0.0, 60.0, 3000)) + 0.02 * np.random.default_rng(1).standard_normal(3000)
    possible = CATALOGUE["clipping"].clues.possible
    assert possible is not None
    assert possible(
        np.clip(signal, -0.7, 0.7) + 0.02 * np.random.default_rng(2).standard_normal(3000), {"limit": 0.7}
    )
    # A force that grows on, if slower: no end of a range.
    assert not possible(np.clip(signal, -0.7, 0.7) + 0.4 * signal, {"limit": 0.7})
