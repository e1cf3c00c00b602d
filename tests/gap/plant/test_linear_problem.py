"""Slopes of the response against differences, for all that a parameter can move."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from chladni.gap.plant import linear_problem
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines, segment_lines
from chladni.gap.plant.tunable import Tunables
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

SAMPLES = 600


def controlled():
    outputs = (StructureOutput(name="x2", measures="displacement", at="b2"), *three_bodies().outputs)
    law = Controller(name="axis", feedback="x2", drives="hammer", law="pd", gains={"kp": 3e4, "kd": 120.0})
    return replace(three_bodies(), outputs=outputs, controllers=(replace(law, rate_of="feedback"),))


def with_force_sensor():
    """A sensor of what a joint resists with: the outputs' own rows move with the parameters."""
    return replace(three_bodies(), outputs=(StructureOutput(name="f1", measures="force", at="j1"),))


MODELS = {
    "chain": (three_bodies, [Site(name="j1", kind="joint")]),
    "two forces": (three_bodies, [Site(name="j1", kind="joint"), Site(name="b2", kind="body")]),
    "change of an input": (three_bodies, [Site(name="hammer", kind="input")]),
    "error of a sensor": (three_bodies, [Site(name="a1", kind="output")]),
    "shaken ground": (three_bodies, [Site(name="ground", kind="ground")]),
    "controller": (controlled, [Site(name="hammer", kind="input")]),
    "sensor of force": (with_force_sensor, [Site(name="j1", kind="joint")]),
    "late by a fraction": (
        lambda: three_bodies().with_effects([attached("delay", "hammer", {"delay": 2.37 / RATE_HZ})]),
        [Site(name="j2", kind="joint")],
    ),
    "prescribed displacement": (
        lambda: replace(three_bodies(), inputs=(StructureInput(name="shaker", kind="displacement", at="b0"),)),
        [Site(name="j2", kind="joint")],
    ),
    "band-limited": (
        lambda: three_bodies().with_holds({"hammer": "band_limited"}),
        [Site(name="hammer", kind="input"), Site(name="b2", kind="body")],
    ),
    "held": (lambda: three_bodies().with_holds({"hammer": "zoh"}), [Site(name="hammer", kind="input")]),
    "drive": (lambda: drive_model(DRIVES["dc-servo"]), []),
}


def problem_of(model, *, segments=False):
    compiled = model.compile()
    signals = np.concatenate([band_noise(SAMPLES, seed=seed) for seed in range(len(compiled.inputs))])
    log, noise = measured(model, signals)
    lines = (
        segment_lines(150, samples=SAMPLES, sample_rate_hz=RATE_HZ)
        if segments
        else all_lines(SAMPLES, sample_rate_hz=RATE_HZ)
    )
    return LinearProblem(model, log, noise, Tunables.of(model), lines)


def drawn(problem, sites, seed=0):
    """Parameters, transients and forces, all of a size that shows in the outputs."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(-1.5, 1.5, len(problem.tunables.names))
    printed = np.sqrt(np.mean(np.abs(problem.transients(problem.view(z))) ** 2, axis=(1, 2, 3)))
    size = np.sqrt(np.mean(np.abs(problem.measured * problem.weight) ** 2))
    shape = (len(problem.lines.starts), problem.lines.index.size)
    transient = rng.standard_normal((printed.size, shape[0])) * (size / np.maximum(printed, 1e-300))[:, None]
    forces = []
    for site in sites:
        strength = size / np.sqrt(np.mean(np.abs(problem.pattern(problem.view(z), site)) ** 2))
        forces.append((site, strength * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))))
    return z, transient, forces


def central(problem, z, transient, forces, step=1e-2):
    """Differences of the fourth order: their error is beyond the fifth derivative times step^4."""

    def at(steps, one):
        return problem.response(z + steps * step * one, transient, forces)

    found = [8 * (at(1, one) - at(-1, one)) - (at(2, one) - at(-2, one)) for one in np.eye(z.size)]
    return np.array(found) / (12 * step)


# In the gate each model over one of the two kinds of lines.
@pytest.mark.parametrize(
    ("name", "segments"),
    [
        pytest.param(name, segments, marks=() if place % 2 == segments else pytest.mark.nightly)
        for place, name in enumerate(MODELS)
        for segments in (False, True)
    ],
)
def test_slopes_are_the_limit_of_differences(name, segments):
    make, sites = MODELS[name]
    problem = problem_of(make(), segments=segments)
    z, transient, forces = drawn(problem, sites)
    slopes = problem.slopes(z, transient, forces)
    wanted = central(problem, z, transient, forces)
    size = np.abs(wanted).max(axis=(1, 2, 3))
    error = np.abs(slopes - wanted).max(axis=(1, 2, 3))
    # Differences know a slope to the rounding of the response (1e-10 near a resonance) over their step.
    rounding = 1e-10 / 1e-2 * np.abs(problem.response(z, transient, forces)).max()
    assert np.all(error <= 1e-5 * size + rounding)
    assert np.sum(size > 1e3 * rounding) >= 3


@dataclass
class Late:
    """A model that compiles a parameter into the delay of its input."""

    model: Any

    def with_values(self, values):
        return Late(self.model.with_values(values))

    def compile(self):
        delay = 1e-8 * self.model.parameters["j0.stiffness"].value
        return replace(self.model.compile(), input_delays_s=(delay,))


def test_a_parameter_that_is_a_dead_time_has_a_slope_too():
    problem = problem_of(three_bodies())
    late = Late(problem.model)
    problem = LinearProblem(late, problem.measurement, problem.noise, problem.tunables, problem.lines)
    z, transient, forces = drawn(problem, [])
    found = problem.slopes(z, transient, forces)
    wanted = central(problem, z, transient, forces)
    error = np.abs(found - wanted).max(axis=(1, 2, 3)) / np.abs(wanted).max(axis=(1, 2, 3))
    # One is a one-sided difference: first order in its step of 1e-4.
    assert np.all(error < 1e-3)
    plain = LinearProblem(late.model, problem.measurement, problem.noise, problem.tunables, problem.lines)
    place = problem.tunables.names.index("j0.stiffness")
    assert np.abs(plain.slopes(z, transient, forces)[place] - wanted[place]).max() > 0.1 * np.abs(wanted[place]).max()


def test_without_parameters_there_are_no_slopes():
    model = three_bodies()
    log, noise = measured(model, band_noise(SAMPLES))
    none = Tunables(names=(), nominal=np.zeros(0), tolerance=np.zeros(0), units=())
    problem = LinearProblem(model, log, noise, none, all_lines(SAMPLES, sample_rate_hz=RATE_HZ))
    found = problem.slopes(np.zeros(0), np.zeros((6, 1)), ())
    assert found.shape == (0, *problem.measured.shape)


def test_a_view_is_kept_for_its_parameters_and_no_others():
    problem = problem_of(three_bodies())
    z = np.zeros(len(problem.tunables.names))
    first = problem.view(z)
    assert problem.view(z.copy()) is first
    other = problem.view(z + np.arange(z.size))
    assert not np.allclose(other.compiled.a, first.compiled.a)
    np.testing.assert_array_equal(problem.view(z).compiled.a, first.compiled.a)
    # The same problem elsewhere starts anew.
    assert problem.on(segment_lines(150, samples=SAMPLES, sample_rate_hz=RATE_HZ)).view(z).lines.samples == 150


def test_many_parameters_are_taken_some_at_a_time(monkeypatch):
    """A model too large for all at once has the same slopes."""
    problem = problem_of(three_bodies())
    z, transient, forces = drawn(problem, [Site(name="j1", kind="joint")])
    wanted = problem.slopes(z, transient, forces)
    asked = []
    plain = linear_problem.view_slopes

    def counted(view, changed, *others):
        asked.append(len(changed))
        return plain(view, changed, *others)

    monkeypatch.setattr(linear_problem, "view_slopes", counted)
    monkeypatch.setattr(linear_problem, "_AT_ONCE", 4 * 6 * problem.lines.index.size)
    np.testing.assert_allclose(
        problem.slopes(z, transient, forces), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max()
    )
    assert asked == [4, 4, 1]
