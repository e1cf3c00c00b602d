import numpy as np
import pytest

from chladni.models.schemes.loops import loops_of, require_well_posed
from chladni.signals.errors import ModelError

# a -> b -> c -> b, and d onto itself.
LINKS = np.zeros((4, 4))
LINKS[1, 0] = LINKS[2, 1] = 1.0
LINKS[1, 2] = -1.0
LINKS[3, 3] = 1.0


def test_loops_are_groups_of_blocks() -> None:
    assert sorted(loops_of(LINKS)) == [[1, 2], [3]]
    assert loops_of(LINKS, through=np.array([True, True, False, False])) == []


@pytest.mark.parametrize("size", [1.0, 1e9])
def test_gain_one_without_lag_is_refused_whatever_the_units(size: float) -> None:
    direct = np.array([1.0, -2.0 * size, 0.5 / size, 0.0])
    with pytest.raises(ModelError, match="the loop of b -> c has gain one and no lag"):
        require_well_posed(direct, LINKS, "abcd")
    require_well_posed(direct * np.array([1, 1, 1.001, 1]), LINKS, "abcd")


def test_an_open_chain_of_large_gains_is_no_loop() -> None:
    chain = np.eye(6, k=-1)
    require_well_posed(np.full(6, 1e12), chain, "abcdef")


def test_a_block_that_feeds_itself_with_gain_one() -> None:
    with pytest.raises(ModelError, match="the loop of d has gain one"):
        require_well_posed(np.array([0, 0, 0, 1.0]), LINKS, "abcd")
