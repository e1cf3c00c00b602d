"""What a set of modes says of itself."""

import numpy as np

from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from tests.modal.truth import chain, noisy_response


def test_few_lines_of_whole_periods_ask_for_longer_periods():
    response = noisy_response(chain(), np.linspace(0.25, 8, 300), (0,), noise=0.01, rng=np.random.default_rng(1))
    modes = PolyReferenceLeastSquares(max_order=20).identify(response)
    (note,) = [note for note in modes.provenance.notes if "lines wide at half power" in note]
    assert "few lines carry their damping; a period" in note
    assert "window" not in note
