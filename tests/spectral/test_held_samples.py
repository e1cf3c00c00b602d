"""The queue of samples that wait."""

import numpy as np

from chladni.spectral.held_samples import HeldSamples


def test_pieces_come_back_in_order_and_belong_to_the_queue():
    block = np.arange(6.0).reshape(2, 3)
    held = HeldSamples()
    held.append(block[:, :2])
    held.append(block[:, :0])
    held.append(block[:, 2:])
    twin = held.copy()
    block[:] = -1
    held.replace(np.zeros((2, 1)))
    np.testing.assert_array_equal(twin.joined(np.full((2, 1), 9.0)), [[0, 1, 2, 9], [3, 4, 5, 9]])
    assert (twin.samples, held.samples) == (3, 1)


def test_emptied_it_holds_nothing():
    held = HeldSamples()
    held.append(np.ones((1, 4)))
    held.replace(np.ones((1, 0)))
    assert held.samples == 0
