import numpy as np
import pytest
from scipy.signal import butter, freqs

from chladni.models.effects.anti_alias import response
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.clues import FittedForm
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body, with_loop

FREQUENCY_HZ = np.linspace(0.1, 60.0, 50)


@pytest.mark.parametrize("order", [2, 3, 4, 5, 6, 7, 8])
def test_it_is_butterworths(order: int) -> None:
    way = freqs(*butter(order, 2 * np.pi * 15.0, analog=True), worN=2 * np.pi * FREQUENCY_HZ)[1]
    filtered = attached("anti_alias", "acc", {"corner": 15.0, "order": order}).attach(one_body())
    ratio = filtered.frequency_response(FREQUENCY_HZ) / one_body().frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(ratio[0, 0], way, rtol=1e-8)
    np.testing.assert_allclose(ratio[1:, 0], 1.0, rtol=1e-12)
    # What the screen tries is the same.
    np.testing.assert_allclose(response(2j * np.pi * FREQUENCY_HZ, 15.0, order), way, rtol=1e-8)


def test_at_an_input_all_outputs_pass_it() -> None:
    filtered = attached("anti_alias", "motor", {"corner": 15.0}).attach(one_body())
    ratio = filtered.frequency_response(FREQUENCY_HZ) / one_body().frequency_response(FREQUENCY_HZ)
    way = response(2j * np.pi * FREQUENCY_HZ, 15.0, 4)
    np.testing.assert_allclose(ratio[:, 0], np.broadcast_to(way, (3, way.size)), rtol=1e-8)


def test_a_controller_sees_what_its_filtered_sensor_sees() -> None:
    filtered = with_loop(attached("anti_alias", "place", {"corner": 30.0}).attach(one_body(), in_loop=True))
    assert not np.allclose(np.linalg.eigvals(filtered.a)[:2], np.linalg.eigvals(with_loop(one_body()).a))


@pytest.mark.parametrize(("order", "words"), [(2.5, "must be a whole number"), (9.0, "give a value from 2 to 8")])
def test_there_are_two_to_eight_poles(order: float, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        attached("anti_alias", "acc", {"corner": 15.0, "order": order})


@pytest.mark.parametrize(("corner", "degenerate"), [(50.0, False), (150.0, True)])
def test_a_filter_that_lets_all_pass_is_a_delay(corner, degenerate):
    judge = CATALOGUE["anti_alias"].clues.is_degenerate
    # At 100 Hz one of order 4 takes 99.6 % of the power with its corner at 50 Hz, 3.8 % at 150 Hz.
    fitted = FittedForm(
        variant="butterworth",
        values={"corner": corner, "order": 4.0},
        duration_s=10.0,
        band_hz=(1.0, 100.0),
        motion=lambda: (np.zeros(0), np.zeros(0)),
    )
    assert judge(fitted) is degenerate
