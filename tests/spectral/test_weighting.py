"""Weightings of sound level meters against the table of the standard."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.octaves import octave_bands
from chladni.spectral.weighting import weighting_db


def test_weightings_are_those_of_the_table():
    # IEC 61672-1:2013, table 3, at exact third-octave frequencies, to the tenth of a decibel that it gives.
    table = {
        10: (-70.4, -14.3), 20: (-50.5, -6.2), 31.5: (-39.4, -3.0), 63: (-26.2, -0.8), 125: (-16.1, -0.2),
        250: (-8.6, 0.0), 500: (-3.2, 0.0), 1000: (0.0, 0.0), 2000: (1.2, -0.2), 4000: (1.0, -0.8),
        8000: (-1.1, -3.0), 16_000: (-6.6, -8.5), 20_000: (-9.3, -11.2),
    }  # fmt: skip
    exact = {band.nominal_hz: band.mid_hz for band in octave_bands(8, 23_000)}
    for nominal_hz, (a, c) in table.items():
        at = np.array([exact[nominal_hz]])
        assert weighting_db(at, "A")[0] == pytest.approx(a, abs=0.051)
        assert weighting_db(at, "C")[0] == pytest.approx(c, abs=0.051)
    assert weighting_db(np.array([0.0]), "A")[0] == -np.inf
    with pytest.raises(EstimateError, match="'B' is none of A, C"):
        weighting_db(np.array([1.0]), "B")
