"""A model with laws as a fit sees it: free runs, coarse or fine, and their slopes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.gap.plant.free_run import PARTS, FreeRun, initial_states, mapped_outputs
from chladni.gap.plant.law_kernel import March
from chladni.gap.plant.law_run import Equations, equations, new_record, run_laws
from chladni.gap.plant.law_sensitivity import recorded, sensitivities
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.attached_effect import AttachedEffect

Matrix = NDArray[np.float64]
#: Relative change at which a map of samples (a sensor that clips) is told by differences.
_MAP_CHANGE = 1e-6


@dataclass(frozen=True, slots=True)
class Setting:
    """Parameters and effects of one run."""

    z: Matrix
    effects: tuple[AttachedEffect, ...]


@dataclass(frozen=True, slots=True)
class LawRunResult:
    """Outputs ``[output, sample]`` of a run, before and after maps of samples, and what its slopes need."""

    outputs: Matrix
    before_maps: Matrix
    setting: Setting
    compiled: CompiledModel
    equation: Equations
    records: tuple[March, ...]


def coarse_run(run: FreeRun, setting: Setting, initial: Matrix) -> LawRunResult:
    """Run with one step a sample: wrong by about a per cent, in a tenth of the time."""
    compiled = run.compiled(setting.z, setting.effects)
    equation = _equations(run, compiled)
    starts = initial_states(initial, len(run.windows), len(compiled.states))
    marched = run_laws(equation, run.windows, starts, run.measurement.sample_rate_hz)
    outputs = _mapped(run, compiled, marched.outputs)
    return LawRunResult(outputs, marched.outputs, setting, compiled, equation, marched.records)


def fine_run(run: FreeRun, setting: Setting, initial: Matrix) -> LawRunResult:
    """Run as `FreeRun` does."""
    compiled = run.compiled(setting.z, setting.effects)
    equation = _equations(run, compiled)
    marched = run.marched(setting.z, setting.effects, initial)
    if marched is not None:
        pairs = zip(run.windows, marched.records, strict=True)
        records = tuple(_at_samples(equation, window, record) for window, record in pairs)
        return LawRunResult(
            _mapped(run, compiled, marched.outputs), marched.outputs, setting, compiled, equation, records
        )
    made = [integration for _, integration in run.integrations(setting.z, setting.effects, initial)]
    outputs = np.hstack([integration.outputs[run.rows] for integration in made])
    records = recorded(equation, run.windows, made)
    before = outputs
    if compiled.output_maps:
        seen = [np.hstack([record.x, record.rows, record.force]) for record in records]
        before = np.hstack([equation.output @ one.T for one in seen])
    return LawRunResult(outputs, before, setting, compiled, equation, records)


def _at_samples(equation: Equations, window: tuple[int, int], record: March) -> March:
    """A march in finer steps, seen at the samples."""
    every = slice(None, None, PARTS)
    return new_record(equation, *window, record.x[0])._replace(
        x=np.ascontiguousarray(record.x[every]),
        motion=np.ascontiguousarray(record.motion[every]),
        force=np.ascontiguousarray(record.force[every]),
    )


def slopes_of(run: FreeRun, result: LawRunResult, changed: Sequence[tuple[Setting, float]]) -> tuple[Matrix, Matrix]:
    """Slopes of the outputs, ``[parameter, output, sample]`` and ``[state, output, sample]``."""
    others = [run.compiled(setting.z, setting.effects) for setting, _ in changed]
    tables = [(_equations(run, other), by) for other, (_, by) in zip(others, changed, strict=True)]
    rate = run.measurement.sample_rate_hz
    own, starts = sensitivities(result.equation, result.records, run.windows, tables, rate)
    if result.compiled.output_maps:
        for place, (other, (_, by)) in enumerate(zip(others, changed, strict=True)):
            own[place] = _through_maps(run, result, other, own[place], by)
        for place, one in enumerate(starts):
            starts[place] = _through_maps(
                run, result, result.compiled, one, _MAP_CHANGE / max(np.abs(one).max(), 1e-300)
            )
    return own, starts


def _through_maps(run: FreeRun, result: LawRunResult, other: CompiledModel, slope: Matrix, by: float) -> Matrix:
    """Slope behind the maps of samples, which may have changed too."""
    moved = _mapped(run, other, result.before_maps + by * slope)
    return np.asarray((moved - result.outputs) / by)


def _mapped(run: FreeRun, compiled: CompiledModel, outputs: Matrix) -> Matrix:
    return mapped_outputs(compiled, run.rows, outputs, run.measurement.sample_rate_hz)


def _equations(run: FreeRun, compiled: CompiledModel) -> Equations:
    measurement = run.measurement
    return equations(compiled, measurement.inputs, measurement.sample_rate_hz, run.rows, 1)
