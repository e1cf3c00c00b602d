"""A log is short when it shows less than the model does of itself."""

import numpy as np
import pytest

from chladni.gap.comparison.short_log import modes_of, shortness
from chladni.gap.records.measurement import Measurement
from chladni.models.structures.structure_model import StructureModel
from tests.gap.made_log import chain, damper, three_bodies

#: One body of 95 kg on a free guide of 300 N s/m.
AXIS = chain([95.0], [0.0], [300.0])


def log_of(model: StructureModel, samples: int, rate_hz: float) -> Measurement:
    compiled = model.compile()
    return Measurement(
        log="log", sample_rate_hz=rate_hz,
        inputs=np.zeros((len(compiled.inputs), samples)), outputs=np.zeros((len(compiled.outputs), samples)),
        input_names=tuple(one.name for one in compiled.inputs),
        output_names=tuple(one.name for one in compiled.outputs),
        output_units=tuple(one.unit for one in compiled.outputs),
    )  # fmt: skip


def told(model: StructureModel, samples: int, rate_hz: float) -> str | None:
    return shortness(model.compile(), log_of(model, samples, rate_hz))


@pytest.mark.parametrize(
    ("samples", "rate_hz", "words"),
    [
        (940, 1000.0, "0.94 s, where the model shows what it does of itself in 0.95 s"),
        (960, 1000.0, None),
        (190, 100.0, "190 samples, where 200 or more tell more;"),
    ],
)
def test_a_free_axis_takes_three_times_its_decay(samples: int, rate_hz: float, words: str | None) -> None:
    found = told(AXIS, samples, rate_hz)
    assert found is None if words is None else words in str(found)


@pytest.mark.parametrize("damping", [0.0, 0.1, 30.0])
def test_an_axis_that_hardly_decays_takes_a_second(damping: float) -> None:
    model = chain([95.0], [0.0], [damping])
    assert "in 1 s;" in str(told(model, 990, 1000.0))
    assert told(model, 1010, 1000.0) is None


def test_a_structure_takes_three_cycles_of_its_lowest_mode() -> None:
    model = three_bodies()
    lowest_hz = float(modes_of(model.compile()).min())
    assert told(model, round(3.1 / lowest_hz * 5000.0), 5000.0) is None
    assert f"2.9 cycles of the lowest mode ({lowest_hz:.3g} Hz)" in str(
        told(model, round(2.9 / lowest_hz * 5000.0), 5000.0)
    )


def test_what_has_no_motion_of_its_own_takes_samples_only() -> None:
    assert modes_of(damper().compile()).size == 0
    assert told(damper(), 200, 1e5) is None
    assert told(damper(), 199, 1e5) is not None
