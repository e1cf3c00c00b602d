import re
from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.design.more_sensors import angles_deg
from chladni.gap.design.what_is_missing import what_is_missing
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies, white_floor


def missing(*, outputs=None, sites=(), samples=4096, noise=0.02):
    log, floor = measured(three_bodies(), band_noise(samples), outputs=outputs, noise=noise)
    return what_is_missing(three_bodies(), log, floor, sites=sites)


def test_nothing_is_missing_with_a_sensor_at_each_body():
    assert missing() is None


def test_one_sensor_cannot_locate_and_the_one_that_can_is_named():
    said = missing(outputs=[2], sites=("j0", "j1"))
    assert said.startswith("One sensor can't tell where a force acts: add ")
    assert "j0 and j1" in said
    assert "degrees, now by 0; 90 can't be confused" in said


def test_the_sensor_that_is_named_tells_the_sites_apart():
    # With b0 and b2 measured, b1 is the only body left: two forces further in are told by it.
    said = missing(outputs=[1, 2], sites=("j0", "j1"))
    assert said.startswith("The sensors hardly tell j0 and j1 apart: add an accelerometer at b0")
    assert missing(outputs=[0, 1, 2], sites=("j0", "j1")) is None


def test_a_short_log_is_asked_to_be_longer():
    said = missing(samples=256)
    lowest = three_bodies().modes().frequency_hz.min()
    assert f"{lowest * 256 / RATE_HZ:.2g} cycles of the lowest mode ({lowest:.3g} Hz)" in said
    assert f"record at least {20 / lowest:.2g} s" in said
    assert missing(samples=2048) is None


def test_a_quiet_log_is_asked_to_be_louder():
    said = missing(noise=0.5)
    # 0.5 of the signal is 0.45 of signal and noise; 1.7 times the signal brings it to 0.3.
    assert re.fullmatch(r"Noise is 4[345]% of what .* raise the level 2 times, or average 4 records .*\.", said)


def test_a_sensor_is_not_asked_for_when_nothing_moves():
    # Its noise would follow from its signal, which is zero: it would be taken for infinitely good.
    force = StructureOutput(name="f", measures="force", at="j0")
    model = replace(three_bodies(), outputs=(force,))
    log, _ = measured(model, np.zeros((1, 4096)))
    noise = np.random.default_rng(1).standard_normal((1, 4096))
    assert what_is_missing(model, replace(log, outputs=noise), white_floor([0.1])) is None


def test_angles_are_those_between_patterns():
    patterns = np.array([[[1.0], [0.0], [0.0]], [[1.0], [1.0j], [0.0]], [[1.0j], [0.0], [0.0]]])
    angles = angles_deg(patterns, [0, 1, 2])
    assert angles[0, 1] == pytest.approx(45.0)
    # A force of any shape is free, its phase too.
    assert angles[0, 2] == pytest.approx(0.0, abs=1e-6)
    assert angles_deg(patterns, [0, 2])[0, 1] == pytest.approx(0.0, abs=1e-6)


def test_a_line_on_which_a_site_prints_nothing_tells_nothing():
    patterns = np.array([[[0.0, 1.0], [0.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]]], dtype=np.complex128)
    assert angles_deg(patterns, [0, 1])[0, 1] == pytest.approx(np.degrees(np.arcsin(np.sqrt(0.5))))
