"""An answer that rests on too little to be believed."""

from dataclasses import replace

from chladni.gap.records.diagnosis import Diagnosis

#: Of every probability: that it's something else is then at least as probable as all names together.
_EVEN = 0.5


def at_even_odds(found: Diagnosis) -> Diagnosis:
    """Give the same answer with half of each probability: what fits so few samples best may be anything."""
    return replace(
        found,
        causes=tuple(replace(one, probability=_EVEN * one.probability) for one in found.causes),
        ranking=tuple(replace(one, probability=_EVEN * one.probability) for one in found.ranking),
    )
