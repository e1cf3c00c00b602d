"""A hidden cause in a small machine is named, at its site, with its size; where there's none, none is named."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.apps.diagnose import diagnose_gap
from chladni.apps.gap_document import gap_document
from chladni.gap.comparison.levels import compare_levels
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.viewers.gap_summary import summary
from tests.gap.arm import RATE_HZ, all_but, among_few, arm, measured, with_outputs

FRICTION = chladni.attached("coulomb_friction", "elbow", {"force": 20.0})
PERIOD, PERIODS = 2000, 3


# Among the whole catalogue an example names it.
@pytest.fixture(
    scope="module", params=[pytest.param((), marks=pytest.mark.nightly), all_but()], ids=["catalogue", "few"]
)
def friction(request: pytest.FixtureRequest) -> Diagnosis:
    return diagnose(arm(), [measured((FRICTION,), seconds=3.0)], leave_out=frozenset(request.param))


@pytest.mark.slow
def test_friction_is_named_with_its_force(friction: Diagnosis) -> None:
    assert friction.verdict == "effect"
    (cause,) = friction.causes
    assert (cause.effect, cause.site) == ("coulomb_friction", "elbow")
    assert cause.probability > 0.9
    assert cause.parameters["force"].value == pytest.approx(20.0, rel=0.05)


@pytest.mark.slow
def test_the_gap_closes_to_the_noise(friction: Diagnosis) -> None:
    assert friction.gap.before > 0.1
    # One per cent of noise was added; its estimate before may hold what friction did beyond a linear response.
    assert friction.gap.after == pytest.approx(0.01, rel=0.1)
    assert friction.gap.after < friction.gap.noise < 0.015
    assert friction.gap.noise_at_most
    assert friction.gap.closed is not None
    assert friction.gap.closed > 0.98
    low, high = friction.gap.interval or (0.0, 0.0)
    assert low <= friction.gap.closed <= high
    # The only cause, so that all is its share: of power, which is more than of the error itself.
    assert friction.causes[0].share == friction.gap.explained
    assert friction.gap.explained is not None
    assert 0.999 < friction.gap.explained <= 1.0


@pytest.mark.nightly
def test_what_one_log_told_closes_the_gap_on_another() -> None:
    # The same machine: the first log's seed draws its parameters.
    off = {"elbow.stiffness": 1.04, "column.mass": 0.97, "hand.damping": 1.1}
    first, other = (measured((FRICTION,), seed=seed, off=off, seconds=4.0) for seed in (3, 4))
    found = diagnose(arm(), [first, replace(other, log="other.mcap")], leave_out=all_but())
    (gap,) = found.elsewhere
    assert {one.log for one in gap.held_out} == {"other.mcap"}
    assert gap.before > 0.1
    assert gap.after == pytest.approx(0.01, rel=0.15)
    assert gap.tuned > 3 * gap.after


@pytest.mark.slow
def test_the_recovered_force_follows_the_law(friction: Diagnosis) -> None:
    found = friction.restoring_force
    assert found is not None
    assert found.site == "elbow"
    assert found.law_force is not None
    inside = slice(500, -500)
    assert np.corrcoef(found.force[inside], found.law_force[inside])[0, 1] > 0.8


@pytest.mark.nightly
def test_the_same_input_gives_the_same_document_on_any_number_of_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    log = measured((chladni.attached("saturation", "shaker", {"limit": 120.0}),), seconds=2.0)
    found, out = [], frozenset(CATALOGUE) - {"saturation", "coulomb_friction"}
    for cores in (1, 3):
        monkeypatch.setattr("chladni.gap.side_by_side.threads", lambda cores=cores: cores)
        found.append(json.dumps(gap_document(diagnose(arm(), [log], leave_out=out))))
    assert found[0] == found[1]


@among_few("delay", "clipping", "softening_stiffness")
@pytest.mark.parametrize(
    ("effect", "site", "values"),
    [
        pytest.param("hardening_stiffness", "hand", {"cubic": 3e10}, marks=pytest.mark.nightly),
        pytest.param("saturation", "shaker", {"limit": 120.0}, marks=pytest.mark.nightly),
        pytest.param("delay", "shaker", {"delay": 2.3e-3}, marks=pytest.mark.nightly),
        pytest.param("gain_error", "acc_arm", {"gain": 1.2}, marks=pytest.mark.nightly),
        pytest.param("time_offset", "acc_column", {"offset": 1.4e-3}, marks=pytest.mark.nightly),
    ],
)
def test_each_kind_of_site(effect: str, site: str, values: dict[str, float], out: frozenset[str]) -> None:
    found = diagnose(arm(), [measured((chladni.attached(effect, site, values),), seed=3, seconds=5.0)], leave_out=out)
    assert [(one.effect, one.site) for one in found.causes] == [(effect, site)]
    for name, value in values.items():
        assert found.causes[0].parameters[name].value == pytest.approx(value, rel=0.1)


@pytest.mark.nightly
@among_few("added_mass", "extra_mode")
def test_a_body_that_is_too_heavy_carries_something(out: frozenset[str]) -> None:
    log = measured((chladni.attached("added_mass", "arm", {"mass": 2.0}),), seed=3, off={})
    found = diagnose(arm(), [log], leave_out=out)
    assert [(one.effect, one.site) for one in found.causes] == [("added_mass", "arm")]
    # What is carried and what the body may weigh within its tolerance are one number to any sensor.
    assert found.causes[0].parameters["mass"].value + found.tuned_parameters["arm.mass"].value == pytest.approx(
        6.0, rel=0.02
    )


@pytest.mark.parametrize("colour", [0.0, pytest.param(0.9, marks=pytest.mark.nightly)])
def test_noise_alone_names_nothing(colour: float) -> None:
    found = diagnose(arm(), [measured(seed=5, colour=colour, seconds=4.0)])
    assert found.verdict == "none"
    assert not found.causes
    assert found.gap.explained is None
    assert found.gap.tuned == pytest.approx(found.gap.noise, rel=0.1)


@pytest.mark.nightly
@among_few()
def test_a_stiffness_far_outside_its_tolerance_is_a_parameter(out: frozenset[str]) -> None:
    found = diagnose(arm(), [measured(off={"elbow.stiffness": 1.5}, seed=6, seconds=4.0)], leave_out=out)
    assert found.verdict == "parameters"
    assert [(one.effect, one.site) for one in found.causes] == [("parameter", "elbow.stiffness")]
    assert found.tuned_parameters["elbow.stiffness"].value == pytest.approx(3e5, rel=0.02)
    # Its picture is the spring that the nominal joint lacks.
    assert found.restoring_force is not None
    assert found.restoring_force.site == "elbow"
    assert found.restoring_force.law_force is None


@pytest.mark.nightly
def test_two_causes_at_once_are_both_named() -> None:
    spring = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
    sensor = chladni.attached("gain_error", "acc_column", {"gain": 1.3})
    # Words of two kinds of site: more of them would only make it slower.
    out = frozenset(CATALOGUE) - {"hardening_stiffness", "coulomb_friction", "gain_error"}
    found = diagnose(arm(), [measured((spring, sensor), seed=9, seconds=5.0)], leave_out=out)
    assert {(one.effect, one.site) for one in found.causes} == {
        ("hardening_stiffness", "hand"), ("gain_error", "acc_column")
    }  # fmt: skip
    shares = {one.site: one.share for one in found.causes}
    assert found.gap.explained == pytest.approx(1.0, abs=1e-3)
    assert shares["hand"] == pytest.approx(1.0, abs=1e-3)
    # A sensor's error of 30 % is little where another is off by half of what it measures, but it isn't nothing.
    assert shares["acc_column"] == pytest.approx(0.03, abs=0.01)


@pytest.mark.nightly
@among_few("clipping")
def test_a_sensor_that_clips_hard_is_named_although_it_looks_noisy(out: frozenset[str]) -> None:
    log = measured(seconds=5.0, seed=8)
    outputs = log.outputs.copy()
    limit = 1.5 * np.std(outputs[0])
    outputs[0] = np.clip(outputs[0], -limit, limit)
    found = diagnose(arm(), [replace(log, outputs=outputs)], leave_out=out)
    assert [(one.effect, one.site) for one in found.causes] == [("clipping", "acc_column")]
    assert found.causes[0].parameters["limit"].value == pytest.approx(limit, rel=0.01)
    # What the clipping hid in the noise's estimate isn't told as noise.
    assert found.where.channels[0].noise < 0.1


@pytest.mark.nightly
@pytest.mark.slow
def test_a_floor_that_shakes_is_told_and_its_sensors_foretell_each_other() -> None:
    floor = chladni.attached("base_vibration", "ground", {"level": 8.0, "band": 120.0, "band_start": 5.0})
    # A few words beside it: all of them would only make it slower.
    out = frozenset(CATALOGUE) - {"base_vibration", "gain_error"}
    log = with_outputs(measured((floor,), seconds=4.0), ["acc_column", "acc_wrist"])
    found = diagnose(arm(), [log], leave_out=out)
    (cause,) = found.causes
    assert (cause.effect, cause.site) == ("base_vibration", "ground")
    assert found.gap.by == "cross_sensor"
    # Where a sensor is still and the others hardly feel the floor, a tenth of the gap stays their noise.
    assert found.gap.closed is not None
    assert found.gap.closed > 0.9
    assert cause.share == found.gap.explained
    assert found.gap.explained is not None
    assert found.gap.explained > 0.9


@pytest.mark.nightly
@among_few("clipping")
def test_a_sensor_s_square_passes_for_no_noise(out: frozenset[str]) -> None:
    log = measured(seconds=5.0, seed=12)
    outputs = log.outputs.copy()
    scale = np.std(outputs[1])
    # Three times the noise, and with a floor that is what no linear model explains it looks like noise.
    outputs[1] += 0.03 / np.sqrt(2.0) * ((outputs[1] / scale) ** 2 - 1.0) * scale
    found = diagnose(arm(), [replace(log, outputs=outputs)], leave_out=out)
    assert found.verdict == "unknown"
    assert found.left is not None
    assert found.left.bands != found.where.bands
    assert any(remark.startswith("acc_arm: what is left follows its own signal") for remark in found.remarks)


@pytest.mark.nightly
def test_without_its_word_the_cause_is_unknown_or_of_its_family() -> None:
    stop = chladni.attached("one_sided_stop", "hand", {"stiffness": 5e5, "clearance": 1e-4})
    found = diagnose(arm(), [measured((stop,), seed=7, seconds=5.0)], leave_out=frozenset({"one_sided_stop"}))
    siblings = {"hardening_stiffness", "softening_stiffness", "backlash", "varying_stiffness"}
    assert found.verdict == "unknown" or {one.effect for one in found.causes} <= siblings


@pytest.mark.slow
def test_one_sensor_is_said_to_limit_the_answer() -> None:
    found = diagnose(arm(), [with_outputs(measured(seconds=4.0), ["acc_wrist"])], leave_out=all_but())
    assert any("one output only" in remark for remark in found.remarks)
    assert found.where.sites == ()


def test_windows_are_told_once() -> None:
    # Free to move away, so that no free run holds: mass and damping are all there is.
    axis = StructureModel(
        name="axis",
        structure=Structure(
            bodies=(Body(name="carriage", mass=95.0),),
            joints=(Joint(name="guide", between=("ground", "carriage"), stiffness=0.0, damping=300.0),),
        ),
        inputs=(StructureInput(name="shaker", at="carriage"),),
        outputs=(StructureOutput(name="position", measures="displacement", at="carriage"),),
    )
    found = diagnose(axis, [measured(model=axis, seconds=4.0)], leave_out=frozenset(CATALOGUE))
    told = [sentence for sentence in (*summary(found), *found.remarks) if "windows of" in sentence]
    assert len(told) == 1
    assert found.where.sites == ()


def repeated(rms: float, seed: int = 0) -> Measurement:
    """Periods of a multisine from 5 to 80 Hz on an arm whose hand hardens, an odd law between arm and wrist."""
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=np.complex128)
    spectrum[10:160] = np.exp(2j * np.pi * rng.random(150))
    one = np.fft.irfft(spectrum, PERIOD)
    force = np.tile(rms / one.std() * one, PERIODS + 1)
    channel = Channel(name="shaker", unit="N", role="reference")
    real = arm().with_effects((chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10}),))
    driven = TimeSeries(values=force[None], sample_rate_hz=RATE_HZ, channels=(channel,))
    # The first period is its transient.
    outputs = chladni.simulate(real, driven).outputs.values[:, PERIOD:]
    noise = 2e-4 * outputs.std(axis=1, keepdims=True) * rng.standard_normal(outputs.shape)
    return Measurement(
        log=f"{rms:g} N.mcap",
        sample_rate_hz=RATE_HZ,
        inputs=force[None, PERIOD:],
        outputs=outputs + noise,
        input_names=("shaker",),
        output_names=tuple(one.name for one in arm().outputs),
        output_units=("m/s^2",) * 3,
    )


@pytest.mark.nightly
def test_what_a_period_tells_of_distortion_is_told() -> None:
    # Not a single effect is weighed: of the cause nothing is asked here.
    found = diagnose(arm(), [repeated(200.0)], leave_out=frozenset(CATALOGUE))
    assert any("excite odd lines only" in remark for remark in found.remarks)
    (outside,) = (remark for remark in found.remarks if "above the excited band" in remark)
    assert "between acc_arm and acc_wrist" in outside
    assert outside.endswith("(odd told from chance)")


def test_distortion_of_each_level_is_told() -> None:
    levels = compare_levels([with_period(one) for one in (repeated(100.0), repeated(200.0, seed=1))])
    told = [level for level in levels if "above the excited band" in level]
    assert [level.split(" RMS ")[0] for level in told] == ["at 100", "at 200"]
    assert all("between acc_arm and acc_wrist" in level for level in told)


@pytest.mark.nightly
def test_distortion_of_a_level_is_told_once() -> None:
    found = diagnose(arm(), [repeated(100.0), repeated(200.0, seed=1)], leave_out=frozenset(CATALOGUE))
    assert sum("above the excited band" in level for level in found.levels) == 2
    assert not any("above the excited band" in remark for remark in found.remarks)


def test_no_measurement_is_refused() -> None:
    with pytest.raises(EstimateError, match="no measurement"):
        diagnose(arm(), [])


@pytest.mark.slow
@pytest.mark.parametrize("end_s", [5.05, 5.3])
def test_a_moment_of_a_measured_axis_names_nothing_for_sure(shared_data: Path, end_s: float) -> None:
    model, log = shared_data / "models" / "emps.toml", shared_data / "emps.mcap"
    found = diagnose_gap(model, log, start_s=5.0, end_s=end_s)
    assert all(cause.probability <= 0.5 for cause in found.causes)
    assert found.remarks[0].startswith("emps.mcap is short")
    assert found.used[0].warnings == found.remarks[:1]
