"""What a second effect must bring: little beside a number that leaves more than noise, much beside a law."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.price import leaves_for_sure, price_among
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.models.effects.attached_effect import attached

GAIN = attached("gain_error", "a", {"gain": 2.0})
DRAG = attached("quadratic_damping", "b", {"coefficient": 2.0})


def contestant(*effects, held: float = 1.0, log_evidence: float = 0.0) -> Contestant:
    """Three outputs, of which one hears what is left."""
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    alone = Contestant(hypothesis=hypothesis, fit=None, held=np.array([1.0, held, 1.0]), gap=0.0, prior=0.0)
    return replace(alone, log_evidence=log_evidence)


@pytest.mark.parametrize(
    ("lead", "held", "asked"), [(GAIN, 2.0, 12.0), (GAIN, 1.1, 100.0), (DRAG, 2.0, 100.0)]
)  # fmt: skip
def test_beside_a_number_that_leaves_more_than_noise_a_second_effect_needs_less(lead, held, asked) -> None:
    first, both = contestant(lead, held=held, log_evidence=-50.0), contestant(GAIN, DRAG)
    assert leaves_for_sure(first) is (asked == 12.0)
    price = price_among([first, both], 100.0)
    assert price.paid(first) - first.log_evidence == pytest.approx(-6.0)
    assert price.paid(both) == pytest.approx(-6.0 - asked)


def test_a_third_effect_needs_as_much_as_a_second_beside_a_law_however_little_the_second_does() -> None:
    three = contestant(GAIN, DRAG, attached("delay", "c", {"delay": 1e-3}))
    assert price_among([three], 12.0).paid(three) == pytest.approx(-6.0 - 12.0 - 100.0)


def test_a_number_that_is_not_the_best_single_cause_makes_nothing_sure() -> None:
    number, law = contestant(GAIN, held=2.0, log_evidence=-50.0), contestant(DRAG, log_evidence=-10.0)
    assert price_among([number, law], 100.0).sure is None


def test_nothing_asks_for_more_than_is_asked_everywhere() -> None:
    both = contestant(GAIN, DRAG)
    assert price_among([contestant(GAIN, held=2.0), both], 5.0).paid(both) == pytest.approx(-11.0)
