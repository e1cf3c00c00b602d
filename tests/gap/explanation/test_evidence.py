"""Evidence: the likelihood of what a fit leaves, a discrepancy of free scale in it, and what its numbers cost."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from chladni.gap.calibration import DETAILS, ELSEWHERE, SIZE, SLIP
from chladni.gap.explanation.contest import Contest, training_mask
from chladni.gap.explanation.evidence import Left, doubt_of, freedom_nats, left_of
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import band_noise, measured, problem_of, three_bodies, white_floor

LAG = attached("lag", "hammer", {"time_constant": 1e-3})
#: What noise leaves, of which nobody doubts anything.
NOISE = Left(along=300.0, along_expected=300.0, across=900.0, across_expected=900.0, force=1e7, doubt=0.0)


def discrepancy(energy: float, numbers: float) -> float:
    """Log of a Gaussian density of complex numbers whose variance is integrated out, against that of zero energy.

    The variance s has the prior exp(-numbers/s)/s: of any size, but for less than a number's own noise.
    """

    def integral(of: float) -> float:
        total = numbers + of
        peak = np.log(total / numbers)
        top = -numbers * peak - numbers
        found, _ = quad(
            lambda u: np.exp(-numbers * u - total * np.exp(-u) - top), peak - 5.0, peak + 12.0, points=[peak]
        )
        return float(np.log(found) + top)

    return integral(energy) - integral(0.0)


def test_noise_alone_is_the_zero_of_the_scale() -> None:
    assert NOISE.log_likelihood == 0.0
    assert NOISE.over_noise == 1.0
    assert NOISE.unexplained == NOISE.beyond == NOISE.details == 0.0


@pytest.mark.parametrize("energy", [0.01, 3.0, 50.0, 4e3])
def test_what_is_beyond_noise_is_a_gaussian_discrepancy_whose_scale_is_integrated_out(energy: float) -> None:
    across = replace(NOISE, across=NOISE.across + energy)
    along = replace(NOISE, along=NOISE.along + energy)
    assert across.log_likelihood == pytest.approx(discrepancy(energy, ELSEWHERE), rel=1e-6)
    assert along.log_likelihood == pytest.approx(discrepancy(energy, DETAILS), rel=1e-6)
    # A law's own details are forgiven, what no force at its site could print isn't.
    assert along.log_likelihood > across.log_likelihood
    assert across.beyond == along.beyond == pytest.approx(energy)


def test_a_little_more_than_noise_is_its_misfit() -> None:
    assert replace(NOISE, across=NOISE.across + 1e-3).log_likelihood == pytest.approx(-1e-3, rel=1e-4)


def test_both_parts_add() -> None:
    more = replace(NOISE, along=NOISE.along + 40.0, across=NOISE.across + 70.0)
    assert more.log_likelihood == pytest.approx(discrepancy(40.0, DETAILS) + discrepancy(70.0, ELSEWHERE), rel=1e-6)


def test_a_lower_noise_is_what_energy_is_beyond_of() -> None:
    half = replace(NOISE, along=150.0, across=450.0)
    assert half.log_likelihood == half.at(0.5).log_likelihood == 0.0
    assert half.at(1 / 3).log_likelihood == pytest.approx(
        discrepancy(50.0, DETAILS) + discrepancy(150.0, ELSEWHERE), rel=1e-6
    )
    assert half.at(1 / 3).beyond == pytest.approx(200.0)


def test_a_floor_that_is_too_high_on_one_output_hides_nothing_and_accuses_nobody() -> None:
    # A force at a site prints on the first of two sensors alone, whose noise has half of its floor.
    one = Left(
        along=150.0, along_expected=300.0, across=300.0, across_expected=300.0, force=1e7, doubt=0.0,
        outputs=(0.5, 1.0), along_outputs=(300.0, 0.0),
    )  # fmt: skip
    assert one.at(one.outputs).beyond == 0.0
    assert one.at(one.outputs).log_likelihood == 0.0
    # One share for both would miss a quarter of the second's.
    assert one.at(0.75).beyond == pytest.approx(75.0)
    # Where forces at as many sites print as there are sensors, both are the same.
    two = replace(one, along=450.0, along_expected=600.0, across=0.0, across_expected=0.0, along_outputs=(300.0,) * 2)
    assert two.at(one.outputs).beyond == two.at(0.75).beyond == 0.0


def test_what_a_floor_is_uncertain_by_says_little_and_far_more_says_all() -> None:
    unsure = replace(NOISE, doubt=0.1)
    little, much = (replace(unsure, across=unsure.across + more) for more in (3.0, 3e5))
    assert little.log_likelihood == pytest.approx(-3.0 * 3.0 / (3.0 + 90.0), rel=0.01)
    assert much.log_likelihood == pytest.approx(discrepancy(3e5 - 90.0, ELSEWHERE), rel=1e-3)
    quarter = white_floor([1.0, 1.0])
    assert doubt_of(replace(quarter, std=np.array([0.02, 0.25]))) == pytest.approx(0.55)


def test_details_are_a_share_of_the_law_s_own_force() -> None:
    tenth = replace(NOISE, along=NOISE.along + 0.01 * (NOISE.force - NOISE.along_expected))
    assert tenth.details == pytest.approx(0.1)
    # A right law leaves a tenth: nothing that another cause would be looked for.
    assert tenth.unexplained == pytest.approx(0.0, abs=1.0)
    half = replace(NOISE, along=NOISE.along + 0.25 * NOISE.force)
    assert half.unexplained > 30.0
    # Elsewhere no details of a law excuse anything.
    assert replace(NOISE, across=NOISE.across + 0.01 * NOISE.force).unexplained > 100.0
    # Of a force of any shape nothing is unusual.
    anything = replace(half, force=np.inf)
    assert anything.log_likelihood == pytest.approx(discrepancy(0.25 * NOISE.force, DETAILS), rel=1e-6)
    assert half.log_likelihood < anything.log_likelihood - 20.0


def test_each_law_differs_from_the_machine_s_in_its_own_way() -> None:
    more = replace(NOISE, along=NOISE.along + 200.0)
    assert replace(more, sites=2).log_likelihood == pytest.approx(discrepancy(200.0, 2 * DETAILS), rel=1e-6)


def test_laws_whose_details_work_against_each_other_are_not_excused_by_the_force_of_both() -> None:
    # A tenth of what both laws do, as a share of the RMS: usual, unless each is to err by all of its own force.
    more = replace(NOISE, along=NOISE.along + 0.01 * NOISE.force, sites=2)
    against = replace(more, own=(40.0, 60.0), own_force=(0.5, 0.5))
    assert more.unexplained < 5.0
    assert against.unexplained > 100.0
    assert against.log_likelihood < more.log_likelihood - 100.0
    # Nor is a small law excused by a large one's.
    small = replace(more, own=(0.01, 0.99), own_force=(0.99, 0.01))
    assert small.unexplained > 30.0
    assert replace(more, own=(0.99, 0.01), own_force=(0.99, 0.01)).unexplained < 5.0
    # With nothing but noise there is nothing to excuse.
    assert replace(NOISE, sites=2, own=(40.0, 60.0)).log_likelihood == 0.0


def beside_a_spring(*known):
    """Three bodies with a spring between two of them that hardens, beside the fit that knows of all but that."""
    spring = attached("hardening_stiffness", "j1", {"cubic": 2e12})
    log, floor = measured(three_bodies().with_effects((spring, *known)), band_noise(4096, rms=150.0), noise=0.01)
    run = FreeRun(three_bodies(), log)
    problem = problem_of(run, floor)
    contest = Contest(run, problem, training_mask(log.samples, log.sample_rate_hz))
    fit = contest.enter(Hypothesis(effects=known, start_z=np.zeros(len(run.tunables.names))), tune=False).fit
    return problem, run, fit


@pytest.fixture(scope="module")
def sprung():
    return beside_a_spring()


def test_a_force_at_a_site_prints_along_it_and_nowhere_else(sprung) -> None:
    there = left_of(*sprung, ["j1"])
    # Without its law the force is all that is left.
    assert there.along > 100.0 * there.along_expected
    assert there.force == pytest.approx(there.along, rel=0.02)
    assert there.across == pytest.approx(there.across_expected, rel=0.1)
    elsewhere = left_of(*sprung, ["j2"])
    assert elsewhere.across > 10.0 * elsewhere.across_expected


def test_what_an_exact_word_explains_is_no_force_of_a_law_beside_it() -> None:
    # A gain of three makes a sensor miss twice its signal: of that no details of a spring are a share.
    there = left_of(*beside_a_spring(attached("gain_error", "a1", {"gain": 3.0})), ["j1"])
    assert there.force == pytest.approx(there.along, rel=0.02)


def test_laws_that_print_alike_leave_the_details_of_one_force(sprung) -> None:
    # Between the ground and the first body, and at that body: sensors feel the same.
    one, both = (left_of(*sprung, sites) for sites in (["j0"], ["j0", "b0"]))
    assert both == one
    assert left_of(*sprung, ["j0", "j1"]).sites == 2


def test_what_is_left_is_split_without_a_rest(sprung) -> None:
    lines, sensors = sprung[0].lines.index.size, 3
    whole = left_of(*sprung, [])
    assert (whole.along, whole.along_expected, whole.across_expected) == (0.0, 0.0, sensors * lines)
    for sites in (["j1"], ["j0", "j2"], ["j0", "j1", "j2"]):
        parts = left_of(*sprung, sites)
        assert parts.along + parts.across == pytest.approx(whole.across)
        # Forces that do nothing take no noise.
        assert 0.99 * lines < parts.along_expected < 1.001 * len(sites) * lines
        assert parts.along_expected + parts.across_expected == pytest.approx(sensors * lines)


def fit_of(covariance: np.ndarray, *effects) -> SimpleNamespace:
    return SimpleNamespace(covariance=covariance, effects=effects)


RUN = SimpleNamespace(tunables=Tunables.of(three_bodies()))


def test_numbers_cost_what_the_exact_evidence_of_a_linear_model_says() -> None:
    # Samples y = slope x + noise of one, slope ~ normal with `SIZE`: the density of y is known.
    x = np.linspace(0.0, 2.0, 50)
    y = 1.3 * x + np.random.default_rng(0).standard_normal(x.size)
    exact = multivariate_normal(np.zeros(x.size), np.eye(x.size) + SIZE**2 * np.outer(x, x)).logpdf(y)
    variance = 1.0 / (x @ x + 1.0 / SIZE**2)
    slope = variance * (x @ y)
    at_best = multivariate_normal(slope * x, np.eye(x.size)).logpdf(y) - 0.5 * (slope / SIZE) ** 2
    told = freedom_nats(RUN, fit_of(np.array([[variance]]), LAG), (("time_constant",),), (), NOISE)
    assert at_best + told == pytest.approx(exact, rel=1e-9)


def test_a_wrong_value_costs_by_how_far_it_may_be_wrong() -> None:
    tunables = RUN.tunables
    covariance = np.diag(np.full(len(tunables.names), 1e-4))
    place = tunables.names.index("j1.stiffness")
    expected = np.log(0.01 * tunables.tolerance[place] / SLIP)
    assert freedom_nats(RUN, fit_of(covariance), (), ["j1.stiffness"], NOISE) == pytest.approx(expected)
    # Of what stays within its tolerance the prior pays.
    assert freedom_nats(RUN, fit_of(covariance), (), (), NOISE) == 0.0


def test_where_more_than_noise_is_left_numbers_are_narrowed_down_less() -> None:
    # Of D ln(1 + m/D) with m quadratic in a number: the curvature at its least, by differences.
    numbers, least, curvature, step = DETAILS, 700.0, 1e4, 1e-4

    def misfit(x: float) -> float:
        return numbers * np.log1p((least + 0.5 * curvature * x**2) / numbers)

    seen = (misfit(step) - 2.0 * misfit(0.0) + misfit(-step)) / step**2
    more = replace(NOISE, along=NOISE.along + least)
    assert more.flatness == (pytest.approx(curvature / seen, rel=1e-3), 1.0)
    fit = fit_of(np.array([[1.0 / curvature]]), LAG)
    told = freedom_nats(RUN, fit, (("time_constant",),), (), more)
    assert told == pytest.approx(0.5 * np.log(1.0 / seen / SIZE**2), rel=1e-3)
    # What noise alone is left of narrows them down as noise does.
    assert told > freedom_nats(RUN, fit, (("time_constant",),), (), NOISE) + 1.0


def test_a_number_that_the_log_does_not_narrow_down_costs_nothing() -> None:
    wide = fit_of(np.array([[(3.0 * SIZE) ** 2]]), LAG)
    assert freedom_nats(RUN, wide, (("time_constant",),), (), NOISE) == 0.0
