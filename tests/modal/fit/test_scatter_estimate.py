"""Error bars of large sets are simpler, and that is said."""

import numpy as np

import chladni.modal.fit.scatter_estimate
from chladni.apps.frf import frf
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.modal.fit.fit_covariance import SIMPLE
from tests.modal import truth


def test_where_leakage_is_too_much_to_follow_error_bars_are_simpler_and_it_is_said(monkeypatch):
    series = truth.record(truth.chain(), cycles=1000, rng=np.random.default_rng(3), noise=0.01)
    response = frf(series, references=truth.FORCE.format(0), resolution_hz=0.008)
    followed = PolyReferenceLeastSquares().identify(response)
    monkeypatch.setattr(chladni.modal.fit.scatter_estimate, "MOST_PRODUCTS", 1000)
    simple = PolyReferenceLeastSquares().identify(response)
    np.testing.assert_allclose(simple.frequency_hz, followed.frequency_hz, rtol=1e-9)
    assert SIMPLE in simple.provenance.notes
    assert SIMPLE not in followed.provenance.notes
    ratio = simple.frequency_std_hz / followed.frequency_std_hz
    assert np.all((ratio > 0.8) & (ratio < 4))
