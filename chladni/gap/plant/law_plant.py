"""A model with laws as a fit sees it: free runs, coarse or fine, and their slopes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import PARTS, UNNOTICED, ZERO
from chladni.gap.plant.free_run import FreeRun, initial_states, mapped_outputs, read_late
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.integrator.slopes import recorded, sensitivities
from chladni.models.integrator.trapezoid_kernel import March
from chladni.models.integrator.trapezoid_march import Equations, new_record, run_laws
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True)
class Setting:
    """Parameters and effects of one run."""

    z: Real
    effects: tuple[AttachedEffect, ...]


@dataclass(frozen=True, slots=True)
class LawRunResult:
    """Outputs ``[output, sample]`` of a run, before late clocks, before maps of samples and behind both.

    What its slopes need is beside them.
    """

    outputs: Real
    before_maps: Real
    in_time: Real
    compiled: CompiledModel
    equation: Equations
    records: tuple[March, ...]


def coarse_run(run: FreeRun, setting: Setting, initial: Real) -> LawRunResult:
    """Run with one step a sample: wrong by about a per cent, in a tenth of the time."""
    compiled = run.compiled(setting.z, setting.effects)
    equation = run.equations(compiled, 1)
    starts = initial_states(initial, len(run.windows), len(compiled.states))
    marched = run_laws(equation, run.windows, starts, run.measurement.sample_rate_hz)
    return _read(run, compiled, equation, marched.outputs, marched.records)


def fine_run(run: FreeRun, setting: Setting, initial: Real) -> LawRunResult:
    """Run as `FreeRun` does."""
    compiled = run.compiled(setting.z, setting.effects)
    equation = run.equations(compiled, 1)
    marched = run.marched(compiled, initial)
    if marched is not None:
        pairs = zip(run.windows, marched.records, strict=True)
        records = tuple(_at_samples(equation, window, record) for window, record in pairs)
        return _read(run, compiled, equation, marched.outputs, records)
    made = run.integrations(setting.z, setting.effects, initial)
    records = recorded(equation, run.windows, made)
    # An integrator reads between samples without a spline.
    outputs = np.hstack([integration.outputs[run.rows] for integration in made])
    late = np.any(run.late_s(compiled))
    if not (compiled.output_maps or late):
        return LawRunResult(outputs, outputs, outputs, compiled, equation, records)
    seen = [np.hstack([record.x, record.rows, record.force]) for record in records]
    read = _read(run, compiled, equation, np.hstack([equation.output @ one.T for one in seen]), records)
    return read if late and len(run.windows) > 1 else replace(read, outputs=outputs)


def _read(
    run: FreeRun, compiled: CompiledModel, equation: Equations, in_time: Real, records: tuple[March, ...]
) -> LawRunResult:
    before = read_late(in_time, run.late_s(compiled), run.measurement.sample_rate_hz)
    return LawRunResult(_mapped(run, compiled, before), before, in_time, compiled, equation, records)


def _at_samples(equation: Equations, window: tuple[int, int], record: March) -> March:
    """A march in finer steps, seen at the samples."""
    every = slice(None, None, PARTS)
    return new_record(equation, *window, record.x[0])._replace(
        x=np.ascontiguousarray(record.x[every]),
        motion=np.ascontiguousarray(record.motion[every]),
        force=np.ascontiguousarray(record.force[every]),
    )


def around(setting: Callable[[Real], Setting], x: Real, steps: Real) -> list[tuple[Setting, float]]:
    """Give what is set a step further along each unknown, ``setting(x [unknown])``, and by how much."""
    return [(setting(x + row), float(by)) for row, by in zip(np.diag(steps), steps, strict=True)]


def differences(run: FreeRun, changed: Sequence[tuple[Setting, float]], initial: Real, outputs: Real) -> Real:
    """``[unknown, output, sample]``: slopes of outputs by runs that are a step further, see `around`."""
    found = np.empty((len(changed), *outputs.shape))
    for place, (there, by) in enumerate(changed):
        found[place] = (run.outputs(there.z, there.effects, initial) - outputs) / by
    return found


def slopes_of(run: FreeRun, result: LawRunResult, changed: Sequence[tuple[Setting, float]]) -> tuple[Real, Real]:
    """Slopes of the outputs, ``[parameter, output, sample]`` and ``[state, output, sample]``."""
    others = [run.compiled(setting.z, setting.effects) for setting, _ in changed]
    tables = [(run.equations(other, 1), by) for other, (_, by) in zip(others, changed, strict=True)]
    rate = run.measurement.sample_rate_hz
    own, starts = sensitivities(result.equation, result.records, run.windows, tables, rate)
    late_s = run.late_s(result.compiled)
    own, starts = read_late(own, late_s, rate), read_late(starts, late_s, rate)
    for place, (other, (_, by)) in enumerate(zip(others, changed, strict=True)):
        if not np.array_equal(run.late_s(other), late_s):
            moved = read_late(result.in_time, run.late_s(other), rate)
            own[place] += (moved - read_late(result.in_time, late_s, rate)) / by
    if result.compiled.output_maps:
        here = _mapped(run, result.compiled, result.before_maps)
        for place, (other, (_, by)) in enumerate(zip(others, changed, strict=True)):
            own[place] = (_mapped(run, other, result.before_maps + by * own[place]) - here) / by
        for place, one in enumerate(starts):
            by = UNNOTICED / max(np.abs(one).max(), ZERO)
            starts[place] = (_mapped(run, result.compiled, result.before_maps + by * one) - here) / by
    return own, starts


def _mapped(run: FreeRun, compiled: CompiledModel, outputs: Real) -> Real:
    return mapped_outputs(compiled, run.rows, outputs, run.measurement.sample_rate_hz)
