"""A constant of a sensor: named where nothing else is missing, told where something is."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.catalogue import CATALOGUE
from chladni.viewers.gap_summary import summary
from tests.gap.made_log import band_noise, chain, measured

WORDS = {"offset", "gain_error"}


def machine():
    return chain([2.0, 2.5], [2.6e4, 1.7e4], [5.0, 4.0])


def log(*, constant: float, gain: float = 1.0) -> Measurement:
    """Two sensors, of which the first shows a constant, in units of its noise, and the second has another gain."""
    made, _ = measured(machine(), band_noise(4000, rms=150.0), noise=0.01)
    outputs = made.outputs.copy()
    outputs[0] += constant * 0.01 * np.std(outputs[0])
    outputs[1] *= gain
    return replace(made, outputs=outputs)


def found(made: Measurement, *, words: set[str] = WORDS) -> Diagnosis:
    return diagnose(machine(), [made], leave_out=frozenset(CATALOGUE) - words)


def test_a_constant_alone_is_named_with_its_size() -> None:
    made = log(constant=-30.0)
    answer = found(made)
    assert answer.verdict == "effect"
    (cause,) = answer.causes
    assert (cause.effect, cause.site) == ("offset", made.output_names[0])
    size = -0.3 * float(np.std(made.outputs[0]))
    assert abs(cause.parameters["value"].value / size - 1.0) < 0.01
    assert not any("all the time" in one for one in answer.remarks)
    assert any(one.startswith("Beside it, the model's error is") for one in summary(answer))


def test_one_below_the_noise_is_none() -> None:
    assert found(log(constant=0.5)).verdict == "none"


@pytest.mark.nightly
def test_beside_another_cause_it_is_told_without_a_name() -> None:
    answer = found(log(constant=30.0, gain=1.3))
    assert [one.effect for one in answer.causes] == ["gain_error"]
    assert any("beside the model all the time" in one for one in answer.remarks)


@pytest.mark.nightly
def test_left_out_it_is_told_too() -> None:
    answer = found(log(constant=30.0), words={"gain_error"})
    assert answer.verdict == "none"
    assert any("beside the model all the time" in one for one in answer.remarks)


@pytest.mark.nightly
def test_where_something_unknown_acts_it_is_told_too() -> None:
    made = log(constant=30.0)
    # Nothing of the few words bends a sensor's signal.
    bent = made.outputs[1] + 0.5 * np.abs(made.outputs[1])
    answer = found(replace(made, outputs=np.stack([made.outputs[0], bent])))
    assert answer.verdict == "unknown"
    assert any("beside the model all the time" in one for one in answer.remarks)
