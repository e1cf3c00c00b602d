"""Tables of poles made up with known modes among strays."""

import numpy as np

from chladni.modal.poles.pole_table import PoleTable


def made_table(modes, *, orders=range(2, 32), strays=0, rng=None, scatter=(2e-4, 2e-2), **sigmas):
    """One pole of each ``(frequency_hz, damping, vector)`` at every order, with scatter, and strays anywhere."""
    rng = rng or np.random.default_rng(0)
    rows = []
    for order in orders:
        for frequency_hz, damping, vector in modes:
            off = rng.standard_normal(2) * scatter
            rows.append((order, frequency_hz * (1 + off[0]), damping * (1 + off[1]), vector))
        for _ in range(strays):
            stray = rng.standard_normal(2) + 1j * rng.standard_normal(2)
            rows.append((order, rng.uniform(1, 100), 10 ** rng.uniform(-4, -1), stray))
    return table_of(rows, orders, **sigmas)


def table_of(rows, orders, **sigmas):
    """A table from ``(order, frequency_hz, damping, vector)``."""
    order, frequency_hz, damping, vector = (np.array(column) for column in zip(*rows, strict=True))
    omega = 2 * np.pi * frequency_hz
    vector = vector.astype(complex)
    return PoleTable(
        orders=np.array(orders),
        order=order,
        pole=-damping * omega + 1j * omega * np.sqrt(1 - damping**2),
        vector=vector / np.linalg.norm(vector, axis=1)[:, None],
        **sigmas,
    )


def empty_table():
    """Orders at which there was no oscillating pole."""
    return PoleTable(
        orders=np.arange(1, 5),
        order=np.zeros(0, np.int64),
        pole=np.zeros(0, complex),
        vector=np.zeros((0, 2), complex),
    )
