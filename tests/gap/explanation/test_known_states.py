import numpy as np

from chladni.gap.explanation.known_states import KnownStates


def test_windows_begin_at_known_states_and_others_at_rest() -> None:
    known = KnownStates(names=("x", "v"), values=np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]]))
    found = known.at_starts(((0, 2), (2, 4)), ("v", "filter", "x"))
    np.testing.assert_array_equal(found, [[4.0, 0.0, 0.0], [6.0, 0.0, 2.0]])
