"""A stand-in for the diagnosis itself, which takes seconds: it remembers what it was asked, and answers at once."""

import sys
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import pytest

from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.measurement import Measurement
from chladni.models.core.model import Model


class StandIn:
    """Called as `chladni.gap.diagnosis.diagnose.diagnose`."""

    def __init__(self, answer: Diagnosis) -> None:
        self.answer = answer
        self.model: Model | None = None
        self.measurements: Sequence[Measurement] = ()
        self.options: dict[str, Any] = {}

    def __call__(
        self,
        model: Model,
        measurements: Sequence[Measurement],
        *,
        progress: Callable[[str, float], None] | None = None,
        **options: Any,
    ) -> Diagnosis:
        self.model, self.measurements, self.options = model, measurements, options
        if progress is not None:
            progress("explaining", 0.5)
        return self.answer


def put_in_place(monkeypatch: pytest.MonkeyPatch, answer: Diagnosis) -> StandIn:
    """Let `answer` be what every diagnosis finds."""
    stand_in = StandIn(answer)
    module = ModuleType("chladni.gap.diagnosis.diagnose")
    module.diagnose = stand_in  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return stand_in
