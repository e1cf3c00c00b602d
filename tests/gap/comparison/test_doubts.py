"""A model that runs away by itself is told before any answer; one that is only free isn't."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.apps.diagnose import diagnose_gap
from chladni.gap.comparison.doubts import instability, instability_found, modes_of, scale_doubt, shortness
from chladni.gap.comparison.measuring import matched_log
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.gap.arm import arm, measured
from tests.gap.design.close_candidates import axis
from tests.gap.made_log import chain, damper, three_bodies

#: Of ``10 s^3 + 30 s^2 + 2000 s + ki``: at 6000 two poles lie on the imaginary axis, at 200 rad^2/s^2 (Routh).
EDGE = 6000.0


def loop(ki: float) -> StructureModel:
    """The carriage of 10 kg and 30 N s/m under a PI controller of its position."""
    controller = Controller(
        name="loop", reference="/ref", feedback="position", drives="motor", law="pi", gains={"kp": 2000.0, "ki": ki},
        gain=1.0,
    )  # fmt: skip
    return replace(axis(), controllers=(controller,))


def test_a_loop_beyond_its_edge_is_told_with_pole_and_growth() -> None:
    assert instability("axis", loop(0.95 * EDGE).compile()) is None
    unstable = loop(1.2 * EDGE).compile()
    told = instability("axis", unstable)
    worst = max(np.linalg.eigvals(unstable.a), key=lambda pole: (pole.real, pole.imag))
    assert told is not None
    assert told.startswith(
        f"model 'axis' is unstable: a pole at {worst.real:.4g} ± {worst.imag:.4g}j rad/s, so that any error grows "
        f"e-fold in {1 / worst.real:.2g} s; "
    )
    assert "check the gains, signs and units of its loops" in told


def test_what_is_only_free_is_not_unstable() -> None:
    free = three_bodies().structure
    loose = replace(three_bodies(), structure=replace(free, joints=free.joints[1:]))
    assert np.sum(np.abs(np.linalg.eigvals(loose.compile().a)) < 1e-3) == 2
    for model in (axis(), loose, chain([1.0], [1e4], [0.0])):
        assert instability("free", model.compile()) is None


def test_a_late_loop_is_unstable_too() -> None:
    late = loop(0.5 * EDGE).with_effects([attached("delay", "motor", {"delay": 0.1})])
    assert "unstable" in (instability("axis", late.compile()) or "")


def test_stability_that_what_was_found_changes_is_told() -> None:
    stable, unstable = loop(0.5 * EDGE).compile(), loop(1.2 * EDGE).compile()
    assert "model is unstable: a pole at " in (instability_found(stable, unstable) or "")
    assert (instability_found(unstable, stable) or "").endswith("found the model is stable")
    assert instability_found(stable, stable) is None
    # That was said before the answer.
    assert instability_found(unstable, unstable) is None


def test_it_is_said_before_the_answer() -> None:
    channels = (
        Channel(name="/ref", unit="m"),
        Channel(name="position", unit="m"),
        Channel(name="speed", unit="m/s"),
    )
    values = np.random.default_rng(0).standard_normal((3, 2000))
    log = TimeSeries(values=values, sample_rate_hz=500.0, channels=channels)
    (told,) = matched_log(loop(1.2 * EDGE), log, log="log.mcap").warnings
    assert told == instability("axis", loop(1.2 * EDGE).compile())
    assert matched_log(loop(0.5 * EDGE), log, log="log.mcap").warnings == ()


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


RNG = np.random.default_rng(0)
SIGNALS = RNG.standard_normal((2, 400))


def test_what_agrees_within_a_factor_is_not_doubted() -> None:
    assert scale_doubt(SIGNALS, SIGNALS * [[0.1], [10.0]], ["a", "b"]) is None


def test_the_output_that_differs_most_is_named_with_its_factor() -> None:
    found = scale_doubt(SIGNALS, SIGNALS * [[50.0], [0.001]], ["a", "b"])
    assert found is not None
    assert found.startswith("At b the model as it is gives 0.001 times what was measured")


def test_another_signal_tells_nothing() -> None:
    assert scale_doubt(SIGNALS, 1e3 * SIGNALS[::-1], ["a", "b"]) is None


def test_what_stands_still_is_told_elsewhere() -> None:
    assert scale_doubt(SIGNALS * 0.0, SIGNALS, ["a", "b"]) is None
    assert scale_doubt(SIGNALS, SIGNALS * 0.0, ["a", "b"]) is None


@pytest.mark.parametrize(("factor", "words"), [(700.0, "mm for m"), (1 / 1500, "mm for m"), (1e6, "um for m")])
def test_what_is_about_a_prefix_is_told_as_one(factor: float, words: str) -> None:
    found = scale_doubt(SIGNALS, factor * SIGNALS, ["a", "b"])
    assert found is not None
    assert f"; about the factor of a prefix such as {words}" in found


@pytest.mark.nightly
def test_a_log_in_millimetres_is_told_in_the_advice() -> None:
    log = measured(seconds=3.0)
    found = diagnose(arm(), [replace(log, outputs=1e3 * log.outputs)], leave_out=frozenset(CATALOGUE))
    assert found.advice is not None
    assert found.advice.startswith("At acc_")
    assert "times what was measured: check its channel and unit" in found.advice


def emps(tmp_path: Path, shared_data: Path, *, mass: str = "95.0", scale: Sequence[float] = (1.0, 1.0)) -> str:
    """Advice on six seconds of a free axis, whose position and force are read in other units."""
    text = (shared_data / "models" / "emps.toml").read_text(encoding="utf-8")
    model = tmp_path / "axis.toml"
    model.write_text(text.replace("mass = 95.0", f"mass = {mass}"), encoding="utf-8")
    with chladni.open_log(shared_data / "emps.mcap") as log:
        series = log.read(["/axis.position[0]", "/axis.effort[0]"], end_s=6.0)
    scaled = replace(series, values=series.values * np.array(scale)[:, None])
    # What is told rests on no search for a second cause.
    return diagnose_gap(model, scaled, leave_out=sorted(CATALOGUE.keys() - {"gain_error", "added_mass"})).advice or ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "times"),
    [
        pytest.param((1e3, 1.0), "0.0014", marks=pytest.mark.nightly),
        pytest.param((1.0, 1e3), "1400", marks=pytest.mark.nightly),
        pytest.param((1.0, 1e-3), "0.0014", marks=pytest.mark.nightly),
    ],
)
def test_a_free_axis_in_another_unit_is_told_first(
    tmp_path: Path, shared_data: Path, scale: tuple[float, float], times: str
) -> None:
    found = emps(tmp_path, shared_data, scale=scale)
    assert found.startswith(f"At position the model as it is gives {times}")


@pytest.mark.nightly
@pytest.mark.slow
def test_a_free_axis_in_its_own_units_is_not_doubted(tmp_path: Path, shared_data: Path) -> None:
    found = emps(tmp_path, shared_data)
    assert "unit" not in found


@pytest.mark.nightly
@pytest.mark.slow
def test_a_mass_a_thousand_times_too_small_is_told(tmp_path: Path, shared_data: Path) -> None:
    found = emps(tmp_path, shared_data, mass="0.095")
    assert found.startswith("What is added at carriage is ")
    assert "the 0.095 kg that the model has there: check that number and its unit" in found
