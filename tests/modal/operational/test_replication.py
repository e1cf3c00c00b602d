"""Poles that come back in the other half of a record, and poles that don't."""

import numpy as np

from chladni.modal.operational.correlation import correlation_functions
from chladni.modal.operational.replication import replication
from chladni.modal.operational.ssi import subspace_poles
from chladni.modal.poles.pole_selection import select_poles
from tests.modal.truth import ambient_record, chain, noise_record

ROWS = 20


def shares_of(record):
    correlations = correlation_functions(record, lags=2 * ROWS)
    table = subspace_poles(correlations, block_rows=ROWS)
    chosen = select_poles(table)
    return chosen, replication(correlations, table, chosen, block_rows=ROWS)


def test_modes_come_back():
    chosen, shares = shares_of(ambient_record(chain(), cycles=3000, rng=np.random.default_rng(0), noise=0.01))
    sure = [np.argmin(np.abs(chosen.pole - pole)) for pole in chain().poles]
    # Each half has 1500 cycles: what it holds of a mode's correlations is known to some percent.
    np.testing.assert_allclose(shares[sure], 1.0, atol=0.4)


def test_poles_of_noise_do_not():
    found = [shares_of(noise_record(10_000, rng=np.random.default_rng(seed)))[1] for seed in range(6)]
    shares = np.concatenate(found)
    # Many orders agree on them all the same.
    assert shares.size > 6
    assert np.all(shares < 0.5)


def test_nothing_chosen_gives_nothing():
    record = noise_record(5000, rng=np.random.default_rng(1))
    correlations = correlation_functions(record, lags=2 * ROWS)
    table = subspace_poles(correlations, block_rows=ROWS)
    chosen = select_poles(table, band_hz=(0.0, 1e-6))
    assert chosen.row.size == 0
    assert replication(correlations, table, chosen, block_rows=ROWS).shape == (0,)
