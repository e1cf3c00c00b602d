"""Best values: closed-form optima, limits, bounds, what can't be met, and where a damper belongs."""

import numpy as np
import pytest

from chladni.models.analysis.damper_placement import Damper, place_damper
from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.optimise import optimise
from chladni.models.analysis.wish import (
    Wish,
    band_magnitude_down,
    damping_ratio_at_least,
    first_resonance_up,
    least_answer_time,
    measured,
    overshoot_at_most,
)
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameters
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.signals.errors import ModelError
from tests.models.analysis.systems import FunctionModel, compiled, oscillator, parameter, pt2, state_space


@pytest.mark.nightly
@pytest.mark.slow
def test_the_least_answer_time_is_the_least_damping_and_mass() -> None:
    best = optimise(oscillator(), ["m", "c"], least_answer_time(), bounds={"m": (0.5, 2.0), "c": (0.1, 0.5)})
    # pi/omega_d, omega_d^2 = k/m - (c/2m)^2: at both lower bounds.
    assert best.values["m"] == pytest.approx(0.5, rel=1e-4)
    assert best.values["c"] == pytest.approx(0.1, rel=1e-3)
    assert best.met
    assert [text.split()[0] for text in best.advice] == ["m", "c"]
    assert all("lies at its lower bound" in text for text in best.advice)
    assert best.wished_after[0].value < best.wished_before[0].value
    assert best.model.parameters["m"].value == best.values["m"]
    assert {one.name for one in best.before} == {one.name for one in best.after}


@pytest.mark.nightly
def test_an_overshoot_is_met_with_the_least_change() -> None:
    best = optimise(oscillator(), ["c"], overshoot_at_most(10.0), bounds={"c": (0.1, 4.0)})
    log = np.log(0.1)
    zeta = -log / np.sqrt(np.pi**2 + log**2)
    assert best.values["c"] == pytest.approx(2 * zeta * 2.0, rel=1e-5)
    assert best.met
    assert best.advice == ()
    # What is met already is left alone.
    kept = optimise(best.model, ["c"], overshoot_at_most(20.0), bounds={"c": (0.1, 4.0)})
    assert kept.values["c"] == pytest.approx(best.values["c"], rel=1e-6)


def test_a_damping_ratio_is_met_by_its_closed_form() -> None:
    best = optimise(oscillator(), ["c"], damping_ratio_at_least(0.5), bounds={"c": (0.1, 9.0)})
    assert best.values["c"] == pytest.approx(2 * 0.5 * 2.0, rel=1e-5)


@pytest.mark.nightly
@pytest.mark.slow
def test_an_aim_is_subject_to_its_limits() -> None:
    wishes = [least_answer_time(), overshoot_at_most(5.0)]
    best = optimise(oscillator(), ["c", "k"], wishes, bounds={"c": (0.1, 4.0), "k": (1.0, 9.0)})
    assert best.met
    assert best.wished_after[1].value == pytest.approx(5.0, abs=0.01)
    log = np.log(0.05)
    zeta = -log / np.sqrt(np.pi**2 + log**2)
    # As stiff as can be until the damper ends: zeta fixed by the limit, omega = c/(2 zeta).
    omega = min(3.0, 4.0 / (2 * zeta))
    assert best.wished_after[0].value == pytest.approx(np.pi / (omega * np.sqrt(1 - zeta**2)), rel=2e-3)


def test_the_first_resonance_goes_up_with_the_stiffness() -> None:
    best = optimise(oscillator(), ["k"], first_resonance_up())
    assert best.values["k"] == pytest.approx(10.0, rel=1e-4)
    assert "k lies at its upper bound, 10" in best.advice[0]


def test_a_magnitude_leaves_a_band() -> None:
    best = optimise(oscillator(), ["k"], band_magnitude_down(0.2, 0.4), bounds={"k": (0.5, 40.0)})
    omega = 2 * np.pi * np.linspace(0.2, 0.4, 4001)
    heights = [np.abs(1 / (k - omega**2 + 0.4j * omega)).max() for k in np.linspace(0.5, 40, 800)]
    assert best.wished_after[0].value == pytest.approx(min(heights), rel=1e-3)


def test_what_can_t_be_met_says_so() -> None:
    best = optimise(oscillator(), ["c"], damping_ratio_at_least(0.9), bounds={"c": (0.1, 1.0)})
    assert not best.met
    assert best.advice[0].startswith("can't be met inside the bounds: damping ratio at least 0.9: 0.25")
    assert best.values["c"] == pytest.approx(1.0, rel=1e-6)


def test_a_quantity_that_doesn_t_exist_says_so() -> None:
    best = optimise(oscillator(), ["c"], least_answer_time(), bounds={"c": (5.0, 9.0)})
    assert not best.met
    assert "there is none" in best.advice[0]


@pytest.mark.nightly
def test_an_instrument_knows_what_steps_and_what_counts() -> None:
    servo = INSTRUMENTS["dc-servo"]
    wish = Wish(quantity="overshoot", sense="at_most", limit=2.0)
    of_page = optimise(servo, ["velocity_gain"], wish)
    of_model = optimise(servo.model(), ["velocity_gain"], wish, from_input="command", to_output="velocity")
    assert of_page.values == of_model.values
    assert of_page.wished_after[0].value == pytest.approx(2.0, rel=1e-3)


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_values() -> None:
    first, second = (optimise(oscillator(), ["c", "m"], damping_ratio_at_least(0.5), seed=3) for _ in range(2))
    assert first.values == second.values


def test_what_grows_never_wins() -> None:
    def equations(values) -> CompiledModel:
        return compiled(state_space([[0, 1], [-4, values["d"]]], [0, 1], [1, 0]))

    model = FunctionModel(parameters=Parameters((parameter("d", -1.0, low=-2.0, high=1.0),)), equations=equations)
    best = optimise(model, ["d"], first_resonance_up())
    assert best.values["d"] < 0


@pytest.mark.parametrize(
    ("names", "wishes", "bounds", "said"),
    [
        (["c"], [least_answer_time(), first_resonance_up()], {}, "no more than one of them an aim"),
        ([], least_answer_time(), {}, "at least one free parameter"),
        (["q"], least_answer_time(), {}, "no parameter 'q'"),
        (["c"], least_answer_time(), {"k": (1, 2)}, "bounds of k are given, but it isn't free"),
        (["c"], least_answer_time(), {"c": (2, 1)}, "must rise"),
        (["c"], least_answer_time(), {"c": (-1, 1)}, "must rise, from 0 or more"),
        (
            ["c"],
            Wish(quantity="speed", sense="least"),
            {},
            "no behaviour quantity 'speed'; there are: band_magnitude",
        ),
    ],
)
def test_wrong_questions_are_refused(names, wishes, bounds, said) -> None:
    with pytest.raises(ModelError, match=said):
        optimise(oscillator(), names, wishes, bounds=bounds)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"quantity": "overshoot", "sense": "at_most"}, "at_most needs a limit"),
        ({"quantity": "overshoot", "sense": "least", "limit": 3.0}, "least takes no limit"),
        ({"quantity": "band_magnitude", "sense": "least"}, "a band belongs to band_magnitude"),
        ({"quantity": "overshoot", "sense": "least", "band_hz": (1.0, 2.0)}, "and to nothing else"),
        ({"quantity": "band_magnitude", "sense": "least", "band_hz": (2.0, 1.0)}, "must rise"),
    ],
)
def test_wrong_wishes_are_refused(fields, said) -> None:
    with pytest.raises(ModelError, match=said):
        Wish(**fields)


def test_wishes_read_as_words() -> None:
    assert str(overshoot_at_most(5)) == "overshoot at most 5"
    assert str(band_magnitude_down(1, 3)) == "least band magnitude from 1 to 3 Hz"


def test_what_doesn_t_oscillate_is_damped_enough() -> None:
    path = linear_path(pt2(2.0, 1.5))
    assert measured(path, damping_ratio_at_least(0.7)).value == 1.0
    assert measured(path, first_resonance_up()).value is None


def chain() -> FunctionModel:
    """Two masses: a stiff joint to the ground and a soft one between them, pushed and read at the second."""

    def equations(values) -> CompiledModel:
        k1, k2, c1, c2 = 400.0, 100.0, values["lower.damping"], values["upper.damping"]
        a = [[0, 0, 1, 0], [0, 0, 0, 1], [-k1 - k2, k2, -c1 - c2, c2], [k2, -k2, c2, -c2]]
        return compiled(state_space(a, [0, 0, 0, 1], [0, 1, 0, 0]))

    names = ("lower.damping", "upper.damping")
    return FunctionModel(
        parameters=Parameters(tuple(parameter(name, 0.1, minimum=0.0) for name in names)), equations=equations
    )


def test_a_damper_belongs_where_the_mode_moves() -> None:
    placed = place_damper(chain(), damping_ratio_at_least(0.1), [Damper(name="viscous", low=0.0, high=20.0)])

    best = placed.best
    assert best is not None
    assert (best.joint, best.met) == ("upper", True)
    assert [one.joint for one in placed.tried] == ["upper", "lower"]
    assert placed.without[0].value < 0.02
    # The least coefficient that does it: with it the ratio is on its limit.
    assert best.wished[0].value == pytest.approx(0.1, rel=1e-4)
    assert best.coefficient < placed.tried[1].coefficient


def test_the_best_size_of_a_damper_may_lie_inside() -> None:
    dampers = [Damper(name="viscous", low=0.0, high=200.0), Damper(name="MR", low=0.5, high=3.0)]
    placed = place_damper(chain(), band_magnitude_down(0.5, 6.0), dampers, joints=["upper"])

    viscous = next(one for one in placed.tried if one.damper == "viscous")
    assert 1.0 < viscous.coefficient < 100.0
    assert viscous.optimum.advice == ()
    assert placed.tried[0] is viscous
    # An infinitely strong damper would only join the masses.
    joined = measured(linear_path(chain().with_values({"upper.damping": 200.0})), band_magnitude_down(0.5, 6.0))
    assert viscous.wished[0].value < 0.5 * joined.value


def test_no_damper_may_do() -> None:
    placed = place_damper(chain(), damping_ratio_at_least(0.9), [Damper(name="small", low=0.0, high=0.1)])
    assert placed.best is None


def test_wrong_dampers_are_refused() -> None:
    viscous = Damper(name="viscous", low=0.0, high=1.0)
    with pytest.raises(ModelError, match="must rise from 0 or more"):
        Damper(name="viscous", low=2.0, high=1.0)
    with pytest.raises(ModelError, match="no joint 'wrist' with damping; joints: lower, upper"):
        place_damper(chain(), least_answer_time(), [viscous], joints=["wrist"])
    with pytest.raises(ModelError, match="nothing to try"):
        place_damper(oscillator(), least_answer_time(), [viscous])


def test_values_that_make_no_model_are_passed_over() -> None:
    def equations(values) -> CompiledModel:
        if values["m"] < 1:
            raise ModelError("too light")
        return oscillator().equations({**values, "c": 0.4, "k": 4.0})

    model = FunctionModel(parameters=Parameters((parameter("m", 2.0),)), equations=equations)
    best = optimise(model, ["m"], first_resonance_up(), bounds={"m": (0.5, 4.0)})
    assert best.values["m"] == pytest.approx(1.0, abs=1e-3)
