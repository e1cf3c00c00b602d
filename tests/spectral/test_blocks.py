"""Series and streams seen in one way."""

import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.blocks import leading_part, samples_known
from tests.spectral.made_signals import blocks, noise, series


def test_the_lead_is_taken_and_nothing_is_lost():
    whole = series(noise(1, 100))
    lead, everything = leading_part(blocks(whole, [30, 30, 30]), 50)
    assert [block.samples for block in lead] == [30, 30]
    assert [block.samples for block in everything] == [30, 30, 30, 10]
    assert samples_known(iter(()), lead, 50) is None


def test_a_series_is_one_block_of_known_length():
    whole = series(noise(1, 100))
    lead, everything = leading_part(whole, 50)
    assert [*everything] == [*lead] == [whole]
    assert samples_known(whole, lead, 50) == 100


def test_a_stream_that_ends_early_is_known():
    lead, _ = leading_part(blocks(series(noise(1, 40)), [30]), 50)
    assert samples_known(iter(()), lead, 50) == 40


@pytest.mark.parametrize("source", [[], [series(noise(1, 0))]])
def test_nothing_is_refused(source):
    with pytest.raises(EstimateError, match="no sample"):
        leading_part(source, 10)
