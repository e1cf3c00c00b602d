"""Which pairs of places are searched first."""

from types import SimpleNamespace

import numpy as np

from chladni.gap.explanation.candidates import promised


def form(site: str, cost: float) -> tuple[SimpleNamespace, None]:
    return SimpleNamespace(cost=cost, trial=SimpleNamespace(site=SimpleNamespace(name=site))), None


def pair(*names: tuple[str, ...]) -> SimpleNamespace:
    return SimpleNamespace(places=tuple(SimpleNamespace(names=one) for one in names))


def test_a_pair_promises_no_more_than_its_worse_place() -> None:
    forms = [form("elbow", 3.0), form("elbow", 8.0), form("arm", 5.0), form("hand", 20.0)]
    assert promised(pair(("elbow", "arm"), ("hand",)), forms) == 20.0
    assert promised(pair(("elbow",), ("arm", "hand")), forms) == 5.0


def test_a_place_where_no_law_acts_promises_nothing() -> None:
    assert promised(pair(("elbow",), ("acc_arm",)), [form("elbow", 3.0)]) == np.inf
