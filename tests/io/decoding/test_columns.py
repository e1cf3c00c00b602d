"""Columns: choosing messages, and refusing one kind of values where the other is meant."""

import numpy as np
import pytest

from chladni.io.decoding import Column, Strings
from chladni.signals.errors import LogError

WORDS = Strings(codes=np.array([0, 1, 0], np.int32), table=("a", "b"))


def test_numbers_and_strings_are_not_mistaken_for_each_other() -> None:
    with pytest.raises(LogError, match="numeric field"):
        _ = Column(values=WORDS).numbers
    with pytest.raises(LogError, match="string field"):
        _ = Column(values=np.arange(3)).strings
    assert Column(values=WORDS).strings[1] == "b"
    assert len(WORDS) == 3


@pytest.mark.parametrize(
    ("values", "counts", "flat", "each"),
    [
        (np.arange(3), None, [0, 1, 2], [1, 1, 1]),
        (np.arange(6).reshape(3, 2), None, [0, 1, 2, 3, 4, 5], [2, 2, 2]),
        (np.arange(3), np.array([2, 0, 1]), [0, 1, 2], [2, 0, 1]),
    ],
)
def test_elements_are_given_one_message_after_another(values, counts, flat, each) -> None:
    found, per_message = Column(values=values, counts=counts).per_message()
    assert found.tolist() == flat
    assert per_message.tolist() == each


def test_messages_are_selected_from_every_form() -> None:
    chosen = np.array([True, False, True])
    assert Column(values=np.arange(3)).select(chosen).numbers.tolist() == [0, 2]
    assert Column(values=WORDS).select(chosen).strings.codes.tolist() == [0, 0]
    ragged = Column(values=np.arange(5), counts=np.array([2, 1, 2])).select(chosen)
    assert ragged.counts is None
    assert ragged.numbers.tolist() == [[0, 1], [3, 4]]
    uneven = Column(values=np.arange(3), counts=np.array([2, 1, 0])).select(chosen)
    assert uneven.counts is not None
    assert uneven.counts.tolist() == [2, 0]
    words = Column(values=WORDS, counts=np.array([1, 1, 1])).select(chosen)
    assert words.strings.codes.tolist() == [[0], [0]]
    nothing = Column(values=np.arange(3), counts=np.array([2, 1, 0])).select(np.zeros(3, np.bool_))
    assert nothing.numbers.size == 0
