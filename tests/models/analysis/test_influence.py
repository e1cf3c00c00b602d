"""Influence coefficients against the closed forms of the pneumatic motor and against differences."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.models.analysis.behaviour import behaviour
from chladni.models.analysis.difference import relative_derivative
from chladni.models.analysis.influence import BEHAVIOUR, PAPER_BEHAVIOUR, influence, strongest
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameters
from chladni.models.core.port_law import PortLaw
from chladni.models.instruments.pneumatic_motor import INSTRUMENT
from chladni.signals.errors import ModelError
from tests.models.analysis.systems import FunctionModel, compiled, oscillator, parameter, state_space

CONSTRUCTION = (
    "active_area",
    "air_volume",
    "reduced_mass",
    "leakage",
    "viscous_loss",
    "adiabatic_exponent",
    "pressure",
)


def closed_form(values: dict[str, complex]) -> np.ndarray:
    """The paper's equation 2: first velocity peak, largest acceleration, damped and critical frequency.

    Analytic in every parameter, so that a complex step differentiates it to the last digit.
    """
    area, volume, mass, leakage, loss, exponent, pressure = (values[name] for name in CONSTRUCTION)
    inertia = volume * mass / (exponent * pressure)
    stiff = area**2 + leakage * loss
    decay = (volume * loss / (exponent * pressure) + mass * leakage) / (2 * inertia)
    critical = np.sqrt(stiff / inertia)
    damped = np.sqrt(critical**2 - decay**2)
    fastest = np.arctan(damped / decay) / damped
    largest = 50e-6 * area / (inertia * damped) * np.exp(-decay * fastest) * np.sin(damped * fastest)
    return np.array([np.pi / damped, largest, damped / (2 * np.pi), critical / (2 * np.pi)])


POINTS = [
    {},
    {"active_area": 60e-4},
    {"active_area": 61e-4, "air_volume": 705e-6, "reduced_mass": 108.0, "viscous_loss": 1780.0, "pressure": 4.1e5},
    {"active_area": 80e-4, "air_volume": 500e-6, "reduced_mass": 600.0, "viscous_loss": 800.0, "leakage": 0.7e-11},
]


@pytest.mark.parametrize("point", POINTS)
def test_behaviour_and_log_derivatives_of_the_pneumatic_motor_are_its_closed_forms(point: dict[str, float]) -> None:
    table = influence(INSTRUMENT, point, parameters=CONSTRUCTION, behaviour_names=PAPER_BEHAVIOUR)

    values = {**INSTRUMENT.parameters.numbers(), **point}
    nominal = closed_form(values)
    np.testing.assert_allclose(table.nominal, nominal, rtol=1e-11)
    for row, name in enumerate(CONSTRUCTION):
        stepped = closed_form({**values, name: values[name] * (1 + 1e-30j)})
        np.testing.assert_allclose(table.log_derivative[row], stepped.imag / 1e-30 / nominal, rtol=1e-9, atol=1e-11)


def test_finite_changes_are_the_papers_definition() -> None:
    changes = {"active_area": -0.15, "air_volume": 0.4, "reduced_mass": 1.0}
    table = influence(INSTRUMENT, parameters=tuple(changes), behaviour_names=PAPER_BEHAVIOUR, changes=changes)

    values = INSTRUMENT.parameters.numbers()
    initial = closed_form(values)
    np.testing.assert_allclose(table.change, [0.15, -0.4, -1.0], rtol=1e-15)
    for row, (name, change) in enumerate(changes.items()):
        final = closed_form({**values, name: values[name] * (1 + change)})
        relative = (initial - final) / initial
        np.testing.assert_allclose(table.relative_change[row], relative, rtol=1e-9)
        np.testing.assert_allclose(table.finite[row], relative / -change, rtol=1e-9)


def test_seed_figures_at_a_damping_ratio_of_0_57() -> None:
    point = {**POINTS[2], "viscous_loss": 2062.0}
    changes = {"active_area": -0.15, "air_volume": 0.4, "reduced_mass": 1.0}
    model = INSTRUMENT.model(point)
    found = behaviour(model, from_input="flow", to_output="velocity").value("damping_ratio")
    assert found == pytest.approx(0.57, abs=0.002)

    table = influence(INSTRUMENT, point, parameters=tuple(changes), behaviour_names=PAPER_BEHAVIOUR, changes=changes)

    expected = [[0.30, 0.08, 0.23, 0.15], [0.32, 0.23, 0.24, 0.15], [0.27, 0.17, 0.21, 0.29]]
    np.testing.assert_allclose(np.abs(table.relative_change), expected, atol=0.006)


def test_what_doesn_t_enter_the_equations_has_no_influence_at_all() -> None:
    table = influence(INSTRUMENT, parameters=("stroke", "active_area"))
    assert np.all(table.log_derivative[0] == 0)
    assert np.all(table.finite[0] == 0)
    assert strongest(table.log_derivative).of_rows[0] is None


def rich_model() -> FunctionModel:
    """A loop of an oscillating plant with a lag, dead time in its input, that follows a command of its own unit."""

    def equations(values) -> CompiledModel:
        m, c, k, t = (values[name] for name in ("m", "c", "k", "t"))
        a = [[0, 1, 0], [-k / m, -c / m, 1 / m], [-k / t, 0, -1 / t]]
        return compiled(state_space(a, [0, 0, k / t], [1, 0, 0], input_unit="m"), input_delays_s=(0.1 * t,))

    values = (("m", 1.0), ("c", 2.2), ("k", 4.0), ("t", 0.3))
    return FunctionModel(
        parameters=Parameters(tuple(parameter(name, value, minimum=1e-3) for name, value in values)),
        equations=equations,
    )


def lead() -> FunctionModel:
    """``(a s + 1)/(b s + 1)``: the greatest value is at the step itself."""

    def equations(values) -> CompiledModel:
        a, b = values["a"], values["b"]
        return compiled(state_space([[-1 / b]], [1.0], [(1 - a / b) / b], a / b, input_unit="1", output_unit="1"))

    return FunctionModel(parameters=Parameters((parameter("a", 2.0), parameter("b", 0.5))), equations=equations)


@pytest.mark.parametrize("model", [rich_model(), oscillator(damping=0.04), oscillator(damping=3.0), lead()])
def test_every_log_derivative_agrees_with_differences_of_the_behaviour(model: FunctionModel) -> None:
    table = influence(model)

    # Central differences of second order with 1e-4: 1e-8 of the third derivative, which a light damping makes large.
    step = 1e-4
    for row, name in enumerate(table.construction):
        value = model.parameters[name].value
        ends = []
        for side in (1 + step, 1 - step):
            found = behaviour(model.with_values({name: value * side}))
            ends.append([np.nan if found.value(key) is None else found.value(key) for key in table.behaviour])
        slope = (np.array(ends[0]) - np.array(ends[1])) / (2 * step) / table.nominal
        # At the step itself the acceleration is largest: its time, 0, has no relative change.
        np.testing.assert_allclose(table.log_derivative[row], slope, rtol=2e-4, atol=2e-6, err_msg=name)


def test_absent_behaviour_is_not_a_number_and_says_why() -> None:
    table = influence(oscillator(damping=8.0), behaviour_names=("answer_time", "resonance_frequency", "rise_time"))
    assert np.isnan(table.nominal[:2]).all()
    assert np.isnan(table.log_derivative[:, :2]).all()
    assert np.isfinite(table.log_derivative[:, 2]).all()
    assert "none here" in table.definitions[0]


def test_by_default_the_papers_four_and_what_exists() -> None:
    names = influence(oscillator()).behaviour
    assert names[:4] == PAPER_BEHAVIOUR
    assert set(names) <= set(BEHAVIOUR)
    assert "tracking_error" not in names


def test_a_parameter_of_zero_has_no_relative_change() -> None:
    table = influence(oscillator(damping=0.4), values={"c": 0.4}, parameters=("c",))
    assert np.isfinite(table.finite).any()
    undamped_row = influence(rich_with_zero(), parameters=("z",))
    assert np.isnan(undamped_row.finite).all()
    assert np.nanmax(np.abs(undamped_row.log_derivative)) == 0


def rich_with_zero() -> FunctionModel:
    def equations(values) -> CompiledModel:
        return compiled(state_space([[0, 1], [-4, -0.4 - values["z"]]], [0, 1], [1, 0]))

    return FunctionModel(parameters=Parameters((parameter("z", 0.0, minimum=0.0),)), equations=equations)


def test_a_change_out_of_what_is_possible_goes_to_the_other_side() -> None:
    model = oscillator()
    parameters = Parameters(tuple(one if one.name != "k" else parameter("k", 4.0, maximum=4.0) for one in
                                  model.parameters.values()))  # fmt: skip
    held = FunctionModel(parameters=parameters, equations=model.equations)
    table = influence(held, parameters=("k",), changes=0.5)
    assert table.change.tolist() == [0.5]
    free = influence(model, parameters=("k",))
    np.testing.assert_allclose(table.log_derivative, free.log_derivative, rtol=1e-8, atol=1e-10)


def test_effects_that_are_left_out_are_told() -> None:
    law = PortLaw(port=0, function=idle)
    plain = oscillator()
    model = FunctionModel(
        parameters=plain.parameters, equations=lambda values: _with_law(plain.equations(values), law)
    )
    assert all("of the linear equations" in text for text in influence(model).definitions)


def idle(_d, _s, _t, _parameters, _state, _rates) -> float:
    return 0.0


def _with_law(model: CompiledModel, law: PortLaw) -> CompiledModel:
    return replace(model, laws=(law,))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"parameters": ("q",)}, "no parameter 'q'"),
        ({"behaviour_names": ("speed",)}, "no behaviour parameter 'speed'"),
        ({"changes": 0.0}, "a relative change of 0.0 is none"),
        ({"changes": -1.0}, "above -1 but not 0"),
        ({"options": {"a": "b"}}, "options belong to an instrument"),
        ({"from_input": "v"}, "no input 'v'"),
    ],
)
def test_wrong_questions_are_refused(asked: dict[str, object], said: str) -> None:
    with pytest.raises(ModelError, match=said):
        influence(oscillator(), **asked)  # type: ignore[arg-type]


def test_a_model_without_construction_is_told() -> None:
    model = oscillator()
    function_only = Parameters(tuple(parameter(name, 1.0, role="function") for name in "mck"))
    with pytest.raises(ModelError, match="no parameter is marked as construction"):
        influence(FunctionModel(parameters=function_only, equations=model.equations))


def test_the_strongest_of_rows_and_columns() -> None:
    marks = strongest(np.array([[1.0, -3.0, np.nan], [0.0, 0.0, 0.0], [2.0, 1.0, np.nan]]))
    assert marks.of_rows == (1, None, 0)
    assert marks.of_columns == (2, 0, None)


@pytest.mark.parametrize("limits", [{}, {"minimum": 2.0}, {"maximum": 2.0}])
def test_derivatives_are_exact_for_products_and_quotients(limits: dict[str, float]) -> None:
    found = relative_derivative(lambda p: np.array([p, p**3, 1 / p, 7.0]), parameter("p", 2.0, **limits))
    np.testing.assert_allclose(found, [2.0, 24.0, -0.5, 0.0], rtol=1e-10 if limits else 1e-12)
    assert found[3] == 0.0
    stuck = relative_derivative(lambda p: np.array([p]), parameter("p", 2.0, minimum=2.0, maximum=2.0))
    assert stuck.tolist() == [0.0]


def test_an_error_that_stays_falls_with_the_gain() -> None:
    # 1/(1 + k): d ln/d ln k = -k/(1 + k).
    def equations(values) -> CompiledModel:
        return compiled(state_space([[-1 - values["g"]]], [values["g"]], [1.0], input_unit="m"))

    model = FunctionModel(parameters=Parameters((parameter("g", 4.0),)), equations=equations)
    table = influence(model, behaviour_names=("steady_state_error", "final_value"))
    np.testing.assert_allclose(table.log_derivative, [[-0.8, 0.2]], rtol=1e-11)


def test_an_integrating_output_is_followed_through_its_rate() -> None:
    table = influence(
        INSTRUMENT, parameters=CONSTRUCTION[:3], behaviour_names=PAPER_BEHAVIOUR, to_output="displacement"
    )
    expected = influence(INSTRUMENT, parameters=CONSTRUCTION[:3], behaviour_names=PAPER_BEHAVIOUR)
    np.testing.assert_allclose(table.nominal, expected.nominal, rtol=1e-11)
    np.testing.assert_allclose(table.log_derivative, expected.log_derivative, rtol=1e-9, atol=1e-11)


def test_an_acceleration_is_as_good_as_the_displacement_behind_it() -> None:
    displacement = oscillator()

    def equations(values) -> CompiledModel:
        m, c, k = values["m"], values["c"], values["k"]
        a = [[0, 1], [-k / m, -c / m]]
        return compiled(state_space(a, [0, 1 / m], a[1], 1 / m, output_unit="m/s^2"))

    accelerated = FunctionModel(parameters=displacement.parameters, equations=equations)
    names = ("answer_time", "overshoot", "settling_time", "rise_time", "resonance_frequency", "critical_frequency")
    found, expected = (influence(one, behaviour_names=names) for one in (accelerated, displacement))
    np.testing.assert_allclose(found.log_derivative, expected.log_derivative, rtol=1e-9, atol=1e-11)
