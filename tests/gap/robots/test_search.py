"""What a search looks at, and where it ends."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.row import Moments, Row, columns_of_rows, parts_of
from chladni.gap.robots.search import alternatives, searched
from chladni.gap.robots.solved import Solved, solved
from chladni.gap.robots.torques import ALL_COMMANDS, torques_of
from chladni.robots.machine import Machine, Transmission, as_described
from chladni.robots.robot import Robot
from tests.robots.machines import RATE_HZ, arm, changed, commands, course, joint_log_of, run_native

pytest.importorskip("mujoco")

SECONDS = 12.0


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> tuple[Contest, Fit]:
    """A spring between motor and link of the shoulder, and friction at the elbow."""
    robot, command = arm(tmp_path_factory.mktemp("arm")), commands(SECONDS)
    spring = Transmission(stiffness=400.0, gap=0.0, inertia=0.2, logs_motor=False)
    machine = changed(changed(as_described(robot), 0, transmission=spring), 1, friction=1.0)
    position = course(machine, command)
    position += 1e-5 * np.random.default_rng(0).standard_normal(position.shape)
    contest = Contest(torques_of(robot, joint_log_of(robot, position, command=command)))
    return contest, searched(contest)


def test_both_are_found(elastic: tuple[Contest, Fit]) -> None:
    _, best = elastic
    assert {("joint_elasticity", "shoulder"), ("coulomb_friction", "elbow")} <= {one.key for one in best.terms}


def test_it_ends_where_nothing_in_place_of_any_term_is_better(elastic: tuple[Contest, Fit]) -> None:
    contest, best = elastic
    for place in range(len(best.terms)):
        # Three are tried in place of each while it searches.
        assert all(one.nats <= best.nats + 1e-6 for one in alternatives(contest, best, place, 3))


def test_words_that_take_most_of_it_are_told_apart_as_what_explains_it_is_weighed(
    elastic: tuple[Contest, Fit],
) -> None:
    contest, best = elastic
    rest = contest.fit([one for one in best.terms if one.site != "shoulder"], best)

    def lead(fit: Fit) -> float:
        """Nats by which the spring promises more than the best other word at its joint."""
        there = [(nats, term.word) for nats, term in contest.promise(fit) if term.site == "shoulder"]
        return next(nats for nats, word in there if word == "joint_elasticity") - next(
            nats for nats, word in there if word not in ("joint_elasticity", "backlash")
        )

    assert lead(contest.weighed_as(rest, best.weight)) > 10.0 * lead(rest) > 0.0


def test_weights_of_its_own_change_no_number(elastic: tuple[Contest, Fit]) -> None:
    contest, best = elastic
    again = contest.weighed_as(best, best.weight)
    np.testing.assert_allclose(again.numbers, best.numbers, atol=0.05)
    assert again.nats == best.nats


def test_a_promise_is_what_a_term_brings_where_rows_are_weighed_so(elastic: tuple[Contest, Fit]) -> None:
    contest, best = elastic
    rest = contest.weighed_as(contest.fit(best.terms[:1], best), best.weight)

    def worth(fit: Fit) -> float:
        """Nats of numbers without bounds: half their squares and the logarithm of their information's root."""
        return 0.5 * float(np.sum((fit.root.T @ fit.numbers) ** 2)) - float(np.sum(np.log(np.diag(fit.root))))

    tried = 0
    for nats, term in contest.promise(rest):
        both = contest.weighed_as(contest.fit([*rest.terms, term], best), best.weight)
        # Bounds aren't in a promise.
        if np.all(both.numbers[rest.numbers.size :] > term.least / term.scale):
            brought = worth(both) - worth(rest) - 0.5 * np.sum((term.about / term.scale) ** 2)
            assert brought == pytest.approx(nats, abs=1e-3)
            tried += 1
    # Some act at one row, some at both.
    assert tried > 20


def without_noise(robot: Robot, machine: Machine, late: int = 0) -> Solved:
    """What a log of a machine whose commands come so many samples late is explained by."""
    command = commands(SECONDS)
    position = course(machine, np.roll(command, late, axis=1))
    position = 2.0 * np.pi / 2**16 * np.rint(position / (2.0 * np.pi / 2**16))
    return solved(torques_of(robot, joint_log_of(robot, position, command=command)), frozenset(), lambda _: None)


def test_a_dead_zone_takes_all_so_that_its_width_is_told(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    (found,) = without_noise(robot, changed(as_described(robot), 0, dead=1.0)).best.terms
    assert found.key == ("dead_zone", "shoulder")
    # Wider, and a part of it, would fit as well.
    assert found.form_value == pytest.approx(1.0, rel=0.03)


def test_about_a_delay_that_was_found_only_its_slope_is_left(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    found = without_noise(robot, as_described(robot), late=7)
    common, own = (
        {term.variant for term in found.contest.terms if term.word == "delay" and term.site == site}
        for site in (ALL_COMMANDS, "shoulder")
    )
    assert common == {None}
    assert len(own) > 1
    assert [term.key for term in found.best.terms] == [("delay", ALL_COMMANDS)]
    assert found.best.values(0)[0][0] == pytest.approx(7 / RATE_HZ, abs=5e-4)
    # Waiting for the loop's turn takes no part of it.
    assert abs(found.contest.tolerances(found.best)["turn"][0]) < 0.5


@pytest.mark.parametrize("samples", [1.1, 1.25, 1.75, 1.9])
def test_of_delays_that_leave_efforts_as_they_are_the_motion_tells_which(tmp_path: Path, samples: float) -> None:
    command, late_s = commands(6.0), samples / RATE_HZ
    position = run_native(arm(tmp_path, "machine/arm.xml", servo=f' delay="{late_s}" nsample="40"'), command)
    held = np.concatenate([command[:, :1], command[:, :1], command[:, :-2]], axis=1)
    effort = np.array([[120.0], [60.0]]) * (held - position)
    effort -= np.array([[8.0], [3.0]]) * np.gradient(position, 1.0 / RATE_HZ, axis=1)
    robot = arm(tmp_path)
    alone = torques_of(robot, joint_log_of(robot, position, command=command))
    assert alone.same_commands(late_s) == (late_s, late_s)
    beside = torques_of(robot, joint_log_of(robot, position, command=command, effort=effort))
    # Any delay between one and two samples takes the same command.
    assert beside.same_commands(late_s) == pytest.approx((1.0 / RATE_HZ, 2.0 / RATE_HZ), abs=1e-6)
    found = solved(beside, frozenset(), lambda _: None)
    place = next(at for at, term in enumerate(found.best.terms) if term.word == "delay")
    value, deviation, _ = found.numbers(place)["delay"]
    # A sample's interval has a deviation of more.
    assert deviation < 1.0 / RATE_HZ / np.sqrt(12.0)
    assert value == pytest.approx(late_s, abs=2e-4)


@given(seed=st.integers(0, 2**32 - 1), acting=st.lists(st.booleans(), min_size=2, max_size=8))
def test_moments_of_a_row_are_those_of_all_its_columns(seed: int, acting: list[bool]) -> None:
    random = np.random.default_rng(seed)
    scale = random.uniform(0.5, 2.0, len(acting))
    # The last row has no columns at all, as those of loops.
    block = random.standard_normal((len(acting), 2, 16)) * np.array(acting)[:, None, None]
    whiten, missing = random.uniform(0.5, 2.0, 16), random.standard_normal(16)
    rows = [
        Row.of(numbers, columns, whiten, missing)
        for numbers, columns in columns_of_rows((3, 16), [(parts_of(block), scale)])
    ]
    for place, row in enumerate(rows):
        whole = block[:, place] * scale[:, None] if place < 2 else np.zeros((len(acting), 16))
        chosen = random.permutation(len(acting))[: max(len(acting) // 2, 1)]
        places, here = row.held(chosen)
        gram, right = np.zeros((chosen.size, chosen.size)), np.zeros(chosen.size)
        gram[np.ix_(places, places)], right[places] = row.gram[np.ix_(here, here)], row.right[here]
        np.testing.assert_allclose(gram, (whole[chosen] * whiten**2) @ whole[chosen].T, atol=1e-12)
        np.testing.assert_allclose(right, (whole[chosen] * whiten**2) @ missing, atol=1e-12)
        weight = random.uniform(0.5, 2.0, 3)
        moments = Moments.of(rows, chosen)
        wholes = [block[:, each] * scale[:, None] for each in (0, 1)]
        dense = [(one[chosen] * whiten**2) @ one[chosen].T for one in wholes]
        information = weight[0] * dense[0] + weight[1] * dense[1]
        np.testing.assert_allclose(moments.information(weight), information, atol=1e-12)
        toward = sum(each * (one[chosen] * whiten**2) @ missing for each, one in zip(weight[:2], wholes, strict=True))
        np.testing.assert_allclose(moments.toward(weight), toward, atol=1e-12)
        numbers = random.standard_normal(chosen.size)
        power = [numbers @ one @ numbers for one in dense] + [0.0]
        np.testing.assert_allclose(moments.power(moments.at_rows(numbers)), power, atol=1e-12)
        few = row.among(chosen)
        np.testing.assert_array_equal(few.gram, row.gram[np.ix_(here, here)])
        assert all(np.array_equal(few.column(n), whole[chosen[n]]) for n in few.numbers)
