"""Forces of any shape recovered from simulated logs, at the right place and with the right parameters."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.calibration import LAW_ERROR
from chladni.gap.location.profile import Elimination, Projection, bounded_minimum, profile_at, profiled
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines, segment_lines
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure_input import StructureInput
from tests.gap.made_log import RATE_HZ, band_noise, chain, measured

SAMPLES = 3000
#: What noise of a hundredth leaves beside the error of a law that every output is granted.
NOISE_SHARE = 1.0 / (1.0 + (LAW_ERROR / 0.01) ** 2)
JOINTS = [Site(name=f"j{i}", kind="joint") for i in range(4)]


def four_bodies():
    return chain([2.0, 2.5, 3.0, 1.5], [5e5, 6e5, 4e5, 7e5], [40.0, 60.0, 50.0, 30.0], at=3)


def lines_of(segments):
    if segments:
        return segment_lines(500, samples=SAMPLES, sample_rate_hz=RATE_HZ)
    return all_lines(SAMPLES, RATE_HZ)


def problem_of(true, *, segments=False, noise=0.01, signals=None, model=None):
    """The log of `true` beside the plain chain, on its way when the record starts."""
    signals = band_noise(SAMPLES) if signals is None else signals
    initial = np.repeat([1e-4, 2e-2], 4) * np.random.default_rng(7).standard_normal(8)
    log, floor = measured(true, signals, noise=noise, initial=initial)
    model = four_bodies() if model is None else model
    return LinearProblem(model, log, floor, Tunables.of(model), lines_of(segments))


@pytest.mark.parametrize("segments", [False, True])
def test_a_force_at_a_joint_is_found_there_and_nowhere_else(segments):
    """A hardening spring in one joint: the profile of that joint leaves noise, all others leave much more."""
    effect = attached("hardening_stiffness", "j2", {"cubic": 1e11})
    problem = problem_of(four_bodies().with_effects([effect]), segments=segments)
    chi = [profiled(problem, (site,), np.zeros(12)).chi for site in JOINTS]
    # Expected with a spread of 1/sqrt(3 x 1499).
    assert chi[2] == pytest.approx(NOISE_SHARE, abs=0.06)
    assert min(chi[:2] + chi[3:]) > 10


def test_a_known_force_is_recovered_line_by_line():
    """A second input at a joint's body that the model hasn't: its spectrum, to what noise allows."""
    # Long periodic, so that the record ends as it starts: a transient could be the work of a force as well.
    period = np.vstack([band_noise(1000), band_noise(1000, seed=5, rms=60.0)]) * np.hanning(1000)
    true = four_bodies()
    true = replace(true, inputs=(*true.inputs, StructureInput(name="unknown", at="b1", hold="band_limited")))
    log, floor = measured(true, np.tile(period, 15), noise=1e-6)
    unknown = np.tile(period[1], 3)
    log = replace(
        log, inputs=log.inputs[:1, -unknown.size :], outputs=log.outputs[:, -unknown.size :], input_names=("hammer",)
    )
    model = four_bodies()
    problem = LinearProblem(model, log, floor, Tunables.of(model), all_lines(unknown.size, RATE_HZ))
    (found,) = profile_at(problem, (Site(name="b1", kind="body"),), np.zeros(12)).forces
    force = problem.lines.spectrum(unknown[None])[0]
    # Toward 0 Hz accelerometers tell neither a force nor a start: what counts is what they see of it.
    seen = problem.pattern(problem.view(np.zeros(12)), Site(name="b1", kind="body"))
    assert np.linalg.norm(seen * (found - force)) < 1e-4 * np.linalg.norm(seen * force)


@pytest.mark.parametrize("sites", [(), (JOINTS[1],)])
def test_parameters_off_by_one_and_a_half_sigma_are_found(sites):
    """As far as the log tells them: their errors over the spread that Bayes allows are of size one."""
    model = four_bodies()
    tunables = Tunables.of(model)
    z = 1.5 * np.where(np.random.default_rng(3).uniform(size=12) > 0.5, 1.0, -1.0)
    problem = problem_of(model.with_values(tunables.values(z)), segments=True)
    start = profiled(problem, sites, np.zeros(12))
    record = problem.on(lines_of(False))
    found = profiled(record, sites, start.z)
    assert found.chi == pytest.approx(NOISE_SHARE, abs=0.06)
    assert profile_at(record, sites, np.zeros(12)).chi > 10
    slopes = record.slopes(found.z, found.transient, list(zip(found.sites, found.forces, strict=True)))
    view = record.view(found.z)
    rest = Elimination([record.pattern(view, site) for site in sites], record.transients(view)).rest(slopes)
    covariance = np.linalg.inv(2 * rest @ rest.T + np.eye(12))
    # Noise makes 12 squares of mean 1, the prior, 1.5 sigma off in each, at most 27 more: 39, with a spread of 11.5.
    off = found.z - z
    assert off @ np.linalg.solve(covariance, off) < 39 + 4 * 11.5
    assert np.sum(np.sqrt(np.diag(covariance)) < 0.2) >= (6 if sites else 8)


def test_what_is_eliminated_is_orthogonal_to_forces_and_transients():
    problem = problem_of(four_bodies())
    view = problem.view(np.zeros(12))
    patterns = [problem.pattern(view, site) for site in (JOINTS[0], JOINTS[3])]
    transients = problem.transients(view)
    # A state that prints as another does, and one that prints nothing.
    doubled = np.concatenate([transients, 3.0 * transients[:1], 0.0 * transients[:1]])
    rng = np.random.default_rng(0)
    shape = (4, 1, problem.lines.index.size)
    spectra = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    out = Elimination(patterns, doubled)
    force = rng.standard_normal(shape[1:]) + 1j * rng.standard_normal(shape[1:])
    printed = patterns[0] * force + 5 * patterns[1] * force.conj() + 2 * transients[3]
    np.testing.assert_allclose(out.rest(spectra + printed), out.rest(spectra), atol=1e-8 * np.abs(printed).max())
    assert np.abs(out.rest(printed)).max() < 1e-9 * np.abs(printed).max()
    # Two complex numbers of four are left on each line, less the eight states.
    assert np.sum(out.rest(spectra) ** 2) == pytest.approx(2 * (2 * shape[2]) - 8, rel=4 / np.sqrt(4 * shape[2]))
    plain = Elimination(patterns, transients)
    # What transients hardly print is told from the rest to the rounding of its norm over its share, 1e-10 at least:
    # which digits those are differs from one processor's linear algebra to another's.
    rounding = np.finfo(np.float64).eps * np.sqrt(spectra.size) / 1e-10
    np.testing.assert_allclose(plain.rest(spectra), out.rest(spectra), atol=rounding)


def test_transients_and_forces_are_taken_apart():
    problem = problem_of(four_bodies(), segments=True)
    view = problem.view(np.zeros(12))
    pattern, transients = problem.pattern(view, JOINTS[1]), problem.transients(view)
    out = Elimination([pattern], transients)
    rng = np.random.default_rng(1)
    size = 1.0 / np.linalg.norm(transients.reshape(8, -1), axis=1)
    transient = size[:, None] * rng.standard_normal((8, len(problem.lines.starts)))
    force = rng.standard_normal((len(problem.lines.starts), problem.lines.index.size)) + 0j
    residual = np.einsum("sol,sm->oml", transients[:, :, 0], transient) + pattern * force
    found, (recovered,) = out.unknowns(residual)
    left = residual - np.einsum("sol,sm->oml", transients[:, :, 0], found) - pattern * recovered
    assert np.linalg.norm(left) < 1e-3 * np.linalg.norm(residual)


def test_bounds_hold_and_bind_where_the_minimum_lies_outside():
    normal = np.array([[2.0, 1.0], [1.0, 2.0]])
    free = bounded_minimum(normal, np.array([3.0, 3.0]), np.full(2, -9.0), np.full(2, 9.0))
    np.testing.assert_allclose(free, [1.0, 1.0], rtol=1e-12)
    # With the first at its bound of 1/2 the other solves 2 x + 1/2 = 3.
    bound = bounded_minimum(normal, np.array([3.0, 3.0]), np.full(2, -9.0), np.array([0.5, 9.0]))
    np.testing.assert_allclose(bound, [0.5, 1.25], rtol=1e-12)
    assert bounded_minimum(np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0)).size == 0


def test_slopes_that_are_alike_but_for_rounding_still_have_a_minimum():
    # Beside a transient that runs away slopes are of any size: the rounding of their squares takes the prior of 1/2.
    slopes = np.array([[3e9, 4e9], [3e9, 4e9], [0.0, 2.0]])
    normal = slopes @ slopes.T + np.eye(3) / 2
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(normal)
    rest = np.array([3e9, 4e9])
    free = bounded_minimum(normal, slopes @ rest, np.full(3, -9.0), np.full(3, 9.0))
    assert free[:2].sum() == pytest.approx(1.0, rel=1e-6)
    bound = bounded_minimum(normal, slopes @ rest, np.full(3, -9.0), np.array([0.25, 0.5, 9.0]))
    np.testing.assert_allclose(bound[:2], [0.25, 0.5], rtol=1e-9)


@pytest.mark.parametrize("angle", [np.pi / 2, 0.05])
def test_a_force_s_own_energy_is_what_it_prints_alone(angle):
    # Two sensors, two forces that print at an angle, four times and thrice the noise; then both against each other.
    rng = np.random.default_rng(0)
    lines, size = 2000, 1 / np.sqrt(2)
    patterns = np.array([[1.0, 0.0], [np.cos(angle), np.sin(angle)]])[:, :, None, None] * np.ones((1, 2, 1, lines))
    white = (rng.standard_normal((5, lines)) + 1j * rng.standard_normal((5, lines))) * size
    noise, pushes = white[:2], np.array([40.0, 30.0])[:, None] * white[2:4]
    out = Projection(patterns)
    both = np.einsum("sol,sl->ol", patterns[:, :, 0], pushes) + noise
    own = out.shared(both[:, None]).own
    np.testing.assert_allclose(own, [40.0**2 * lines, 30.0**2 * lines], rtol=0.1)
    # What only their difference prints is small beside each of them, where they print almost alike.
    apart = patterns[0, :, 0] - patterns[1, :, 0]
    against = out.shared((600.0 * apart * white[4] + noise)[:, None]).own
    whole = np.sum(np.abs(600.0 * apart * white[4]) ** 2)
    assert (against.sum() > 100.0 * whole) == (angle < 1.0)
    # Noise has neither.
    assert out.shared(noise[:, None]).own.sum() < 0.1 * 2 * lines


def test_what_only_forces_against_each_other_could_print_is_the_rest():
    # The first sensor feels both, the second hardly the one of them: what's there is no force's that the other hides.
    rng = np.random.default_rng(0)
    lines = 2000
    patterns = np.array([[1.0, 0.0], [1.0, 0.02]])[:, :, None, None] * np.ones((1, 2, 1, lines))
    white = (rng.standard_normal((2, 1, lines)) + 1j * rng.standard_normal((2, 1, lines))) / np.sqrt(2)
    out = Projection(patterns)
    hidden = out.shared(np.array([1.0, 3.0])[:, None, None] * white)
    assert hidden.rest - hidden.whole > -0.1 * lines
    assert sum(hidden.taken) < 0.1 * lines
    # One that acts shows on both, and leaves less than noise of the first.
    acting = out.shared(np.array([1.0, 0.02])[:, None, None] * 500.0 * white[0] + white)
    assert acting.rest == pytest.approx(lines, rel=0.1)
    assert sum(acting.taken) == pytest.approx(lines, rel=0.1)


def test_forces_that_print_the_same_share_what_they_print_however_much_it_is():
    # A run that left the machine's: rounding takes the noise of one beside it.
    patterns = np.ones((2, 2, 1, 50)) * np.array([1.0, 0.5])[:, None, None]
    out = Projection(patterns)
    for size in (1e2, 1e9, 1e12):
        own = out.shared(size * patterns[0].astype(complex)).own
        assert own.sum() == pytest.approx(50 * 1.25 * size**2, rel=1e-3)
