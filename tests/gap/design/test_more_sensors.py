import numpy as np
import pytest

from chladni.gap.design.more_sensors import more_sensors, sensor_words, with_noise_of, with_sensors
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from tests.gap.made_log import band_noise, measured, three_bodies, white_floor


def words(outputs, suspects=()):
    log, _ = measured(three_bodies(), band_noise(512), outputs=outputs)
    return [sensor_words(one) for one in more_sensors(three_bodies(), log, suspects)]


def test_bodies_without_an_accelerometer_in_the_log_may_get_one():
    assert words([2]) == ["an accelerometer at b0", "an accelerometer at b1"]
    assert words([0, 1, 2]) == []


def test_suspected_joints_may_get_an_encoder_and_a_force_sensor():
    assert words([0, 1, 2], {"j1", "b0"}) == ["an encoder across j1", "a force sensor in j1"]


def test_a_suspected_sensor_may_get_a_second_one_beside_it():
    assert words([0, 1, 2], {"a1"}) == ["an accelerometer at b1"]


def test_new_sensors_come_behind_the_models_own():
    model = three_bodies()
    log, _ = measured(model, band_noise(512), outputs=[2])
    more = with_sensors(model, more_sensors(model, log)).compile()
    names = [one.name for one in more.outputs]
    assert names == ["a0", "a1", "a2", "acceleration_of_b0", "acceleration_of_b1"]
    # The same body, so the same row of the equations.
    np.testing.assert_array_equal(more.c[0], more.c[3])


def test_a_sensor_of_a_known_unit_is_as_noisy_as_those_there_are():
    signals = np.random.default_rng(0).standard_normal((4, 1000)) * np.array([[1.0], [10.0], [5.0], [3.0]])
    floor = with_noise_of(white_floor([0.1, 1.0]), ["m/s^2", "m"], ["m/s^2", "N"], signals)
    assert floor.rms[:3].tolist() == [0.1, 1.0, 0.1]
    # Of another unit: a tenth of its signal, as both others are.
    assert floor.rms[3] == pytest.approx(0.1 * signals[3].std(), rel=0.1)
    white = floor.whitened(signals)
    np.testing.assert_allclose(white[3], signals[3] / floor.rms[3])


def test_only_structures_have_places_for_sensors():
    log, _ = measured(three_bodies(), band_noise(512))
    drive = drive_model(DRIVES["dc-servo"])
    assert more_sensors(drive, log) == ()
    assert with_sensors(drive, ()) is drive
