"""Findings of an analysis in words."""

import pytest

from chladni.apps.findings import damage_sentences
from chladni.io.loss import Loss


@pytest.mark.parametrize(
    ("lost", "told"),
    [(1, "1 message lost."), (2, "2 messages lost."), (None, "an unknown number of messages lost.")],
)
def test_damage_is_counted_in_words(lost: int | None, told: str) -> None:
    (sentence,) = damage_sentences([Loss(what="a bad checksum", offset=7, record="Chunk", lost_messages=lost)])
    assert sentence == f"Damage at byte 7 (Chunk): a bad checksum; {told}"
