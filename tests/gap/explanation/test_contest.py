"""Held-out blocks, where fits begin their windows, and what states there cost."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.calibration import EFFECTIVE_SAMPLES
from chladni.gap.explanation.contest import Contest, held_gap, training_mask
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.windows import training_in_windows
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, chain, problem_of, white_floor

RUN = 1000
#: ``[window, state]`` displacement and velocity, in m and m/s, that runs of a free axis begin with.
STARTS = np.array([[0.0, 0.0], [0.3, -1.0], [-0.2, 0.5], [0.1, 1.2]])
#: A mass that hangs on the axis, with two states of its own; and teeth, over which another start leads elsewhere.
LACKING = (
    attached("extra_mode", "b0", {"mass": 0.1, "frequency": 8.0, "damping_ratio": 0.3}),
    attached("ripple", "j0", {"amplitude": 3.0, "period": 0.05, "phase": 0.7}),
)


def free_axis():
    """Of 1 kg with 3 N s/m, whose displacement is seen."""
    seen = (StructureOutput(name="d", measures="displacement", at="b0"),)
    return replace(chain([1.0], [0.0], [3.0]), outputs=seen)


def released(push):
    """``[output, sample]`` of runs one after another, each from its own start, the hanging mass's states at zero."""
    machine = Integrator(free_axis().with_effects(LACKING).compile(), RATE_HZ, tolerance=1e-9)
    firsts = np.pad(STARTS, ((0, 0), (0, 2)))
    pushes = np.split(push, len(STARTS), axis=1)
    return np.hstack([machine.run(one, initial=first).outputs for one, first in zip(pushes, firsts, strict=True)])


@pytest.fixture(scope="module")
def runs() -> Contest:
    """Over a log whose windows are such runs, of a model that lacks the mass and the teeth."""
    push = 8.0 * np.sin(2 * np.pi * 0.7 * np.arange(len(STARTS) * RUN) / RATE_HZ)[None]
    outputs = released(push)
    noise = 1e-3 * np.std(outputs)
    log = Measurement(
        log="made", sample_rate_hz=RATE_HZ,
        inputs=push, outputs=outputs + noise * np.random.default_rng(0).standard_normal(outputs.shape),
        input_names=("hammer",), output_names=("d",), output_units=("m",),
    )  # fmt: skip
    windows = [(place * RUN, (place + 1) * RUN) for place in range(len(STARTS))]
    run = FreeRun(free_axis(), log, windows=windows)
    return Contest(run, problem_of(run, white_floor([noise])), training_in_windows(windows))


def test_a_third_is_held_out_in_blocks_over_the_whole_log() -> None:
    mask = training_mask(36_000, 1000.0)
    assert np.mean(~mask) == pytest.approx(1 / 3, abs=0.05)
    edges = np.flatnonzero(np.diff(mask.astype(int)))
    assert edges.size >= 8
    # Both halves hold some: a drift would be all on one side otherwise.
    assert np.mean(~mask[:18_000]) == pytest.approx(np.mean(~mask[18_000:]), abs=0.1)


def test_blocks_do_not_keep_step_with_a_period() -> None:
    period = 3 * 750
    mask = training_mask(10 * period, 1000.0, period)
    phases = {int(start) % period for start in np.flatnonzero(np.diff(mask.astype(int)) == -1)}
    assert len(phases) > 3


def test_a_short_log_has_held_out_blocks_too() -> None:
    mask = training_mask(300, 1000.0)
    assert np.count_nonzero(np.diff(mask.astype(int)) == -1) >= 3


def test_the_gap_is_one_when_nothing_is_simulated() -> None:
    measured = np.random.default_rng(0).standard_normal((2, 5000)) * np.array([[1.0], [100.0]])
    assert held_gap(measured, np.zeros_like(measured), np.ones(5000, dtype=bool)) == pytest.approx(1.0, abs=1e-3)


def test_a_state_pays_by_the_samples_that_tell_it(runs) -> None:
    found = runs.enter(hypothesis_of(LACKING, np.zeros(2)), max_iterations=1, tune=False)
    states, windows = 2, len(STARTS)
    expected = 0.5 * states * (windows - 1) * np.log(EFFECTIVE_SAMPLES / windows)
    assert runs._starts(found.fit) == pytest.approx(expected)
    without = runs.enter(hypothesis_of(LACKING[1:], np.zeros(2)), max_iterations=1, tune=False)
    assert runs._starts(without.fit) == 0.0


@pytest.mark.parametrize("others", [0, 3])
def test_windows_begin_at_a_hypothesis_s_states_and_at_zeros_of_those_that_its_effects_add(runs, others) -> None:
    # States of effects that an earlier fit had stand behind the model's; they are none of these effects'.
    initial = np.pad(STARTS, ((0, 0), (0, others)), constant_values=1.0)
    found = runs.enter(hypothesis_of(LACKING, np.zeros(2), initial=initial))
    assert found.chi < 1.2


def test_windows_that_no_states_are_given_for_lose_the_same_runs(runs) -> None:
    # Or the test above would say nothing of where they begin: a fit would find there from anywhere.
    lost = runs.enter(hypothesis_of(LACKING, np.zeros(2)))
    assert lost is None or lost.chi > 100.0
