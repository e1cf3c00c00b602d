"""Frequencies of rolling element bearings, beside published ones."""

import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.bearings import Bearing

#: SKF 6205-2RS of the Case Western Reserve bearing data, diameters in inches.
SKF_6205 = Bearing(elements=9, element_diameter=0.3126, pitch_diameter=1.537)


def test_frequencies_of_a_bearing_are_those_its_users_publish():
    # Multiples of the shaft's frequency in the documentation of the data; its "rolling element" is 2 BSF.
    found = SKF_6205.frequencies_hz(1.0)
    assert found["BPFI"] == pytest.approx(5.4152, abs=1e-4)
    assert found["BPFO"] == pytest.approx(3.5848, abs=1e-4)
    assert found["FTF"] == pytest.approx(0.39828, abs=3e-5)
    assert 2 * found["BSF"] == pytest.approx(4.7135, abs=1e-3)
    # What passes the rings together is every element, once a revolution.
    assert found["BPFI"] + found["BPFO"] == pytest.approx(9.0, rel=1e-12)


def test_what_is_no_bearing_and_a_shaft_that_stands_are_refused():
    for values, words in (
        ({"elements": 1}, "2 or more"),
        ({"element_diameter": 2.0}, "smaller than the circle"),
        ({"contact_angle_deg": 90.0}, "from 0 to below 90"),
    ):
        with pytest.raises(EstimateError, match=words):
            Bearing(**{"elements": 9, "element_diameter": 0.3, "pitch_diameter": 1.5} | values)
    with pytest.raises(EstimateError, match="must turn"):
        SKF_6205.frequencies_hz(0.0)
