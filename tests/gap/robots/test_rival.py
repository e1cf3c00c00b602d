"""Of two answers the likelier one stands, by torques and simulation together."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.calibration import DETAILS
from chladni.gap.robots.rival import likelier


def answer(*, after: float | None, confirmed: bool = True, nats: float = 0.0, first: float = 0.0) -> SimpleNamespace:
    """What simulation leaves, and the evidence of its torques; `first` is that of the other answer at its noise."""
    return SimpleNamespace(
        simulated=None if after is None else SimpleNamespace(after=after),
        is_confirmed=lambda: confirmed,
        named=("a word",),
        solved=SimpleNamespace(
            best=SimpleNamespace(nats=nats, terms=()), contest=SimpleNamespace(nats_of=lambda _terms: first)
        ),
    )


def test_torques_that_say_more_than_runs_keep_the_first() -> None:
    # Half of the error is worth 2 D ln 2 nats, torques say 14 against it.
    one, other = answer(after=2.0), answer(after=1.0, nats=-14.0)
    stands, rival = likelier(one, other)
    assert stands is one
    assert rival is not None
    assert rival.answer is other
    assert rival.behind == pytest.approx(14.0 - 2.0 * DETAILS * np.log(2.0))


def test_runs_that_say_more_than_torques_put_the_second_first() -> None:
    one, other = answer(after=2.0), answer(after=1.0, nats=-4.0)
    stands, rival = likelier(one, other)
    assert stands is other
    assert rival is not None
    assert rival.answer is one
    assert rival.behind == pytest.approx(2.0 * DETAILS * np.log(2.0) - 4.0)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (answer(after=2.0), answer(after=1.0, confirmed=False)),
        (answer(after=None), answer(after=1.0)),
        (answer(after=2.0), answer(after=None)),
    ],
)
def test_what_no_run_confirms_is_no_rival(one: SimpleNamespace, other: SimpleNamespace) -> None:
    stands, rival = likelier(one, other)
    assert stands is one
    assert rival is None
