from collections.abc import Callable, Mapping

import control
import numpy as np
import pytest

from chladni.models.elements.catalogue import ELEMENTS, element, element_kind
from chladni.models.elements.realization import state_space
from chladni.models.elements.step_response import step_response
from chladni.signals.errors import ModelError

FREQUENCY_HZ = np.geomspace(1e-3, 1e4, 71)
Values = Mapping[str, float]


def parallel(first: complex, second: complex) -> complex:
    return first * second / (first + second)


def lead_lag_network(v: Values, s: complex) -> complex:
    way = parallel(v["resistance_1"], 1 / (s * v["capacitance_1"]))
    across = v["resistance_2"] + 1 / (s * v["capacitance_2"])
    return across / (way + across)


def lead_network(v: Values, s: complex) -> complex:
    way = parallel(v["resistance_1"], 1 / (s * v["capacitance"]))
    return v["resistance_2"] / (way + v["resistance_2"])


def lag_network(v: Values, s: complex) -> complex:
    across = v["resistance_2"] + 1 / (s * v["capacitance"])
    return across / (v["resistance_1"] + across)


def rlc_impedances(v: Values, s: complex) -> tuple[complex, complex, complex]:
    return v["resistance"], s * v["inductance"], 1 / (s * v["capacitance"])


def absorber(v: Values, s: complex) -> complex:
    """Dynamic stiffness of the main mass with that of the absorber, seen through its own spring."""
    joint = v["absorber_damping"] * s + v["absorber_stiffness"]
    hung = parallel(joint, v["absorber_mass"] * s**2)
    return 1 / (v["mass"] * s**2 + v["damping"] * s + v["stiffness"] + hung)


# Written from impedances and textbook forms at one s, not from polynomials.
RESPONSES: dict[str, Callable[[Values, complex], complex]] = {
    "p": lambda v, s: v["gain"] + 0 * s,
    "pt1": lambda v, s: v["gain"] / (1 + s * v["time_constant"]),
    "pt2": lambda v, s: (
        v["gain"] / (1 + 2 * v["damping_ratio"] * s * v["time_constant"] + (s * v["time_constant"]) ** 2)
    ),
    "i": lambda v, s: v["gain"] / s,
    "it1": lambda v, s: v["gain"] / s / (1 + s * v["time_constant"]),
    "d": lambda v, s: v["derivative_time"] * s,
    "dt1": lambda v, s: v["derivative_time"] * s / (1 + s * v["time_constant"]),
    "pd": lambda v, s: v["gain"] * (1 + s * v["derivative_time"]),
    "pdt1": lambda v, s: v["gain"] * (1 + s * v["derivative_time"]) / (1 + s * v["time_constant"]),
    "pd2": lambda v, s: (
        v["gain"] * (1 + 2 * v["damping_ratio"] * s * v["time_constant"] + (s * v["time_constant"]) ** 2)
    ),
    "dead-time": lambda v, s: v["gain"] * np.exp(-s * v["delay"]),
    "all-pass": lambda v, s: v["gain"] * (1 - s * v["time_constant"]) / (1 + s * v["time_constant"]),
    "pi": lambda v, s: v["gain"] * (1 + 1 / (s * v["integral_time"])),
    "pid": lambda v, s: v["gain"] * (1 + 1 / (s * v["integral_time"]) + s * v["derivative_time"]),
    "pidt1": lambda v, s: (
        v["gain"] * (1 + 1 / (s * v["integral_time"]) + s * v["derivative_time"] / (1 + s * v["filter_time"]))
    ),
    "lead": lambda v, s: v["gain"] * (1 + s * v["ratio"] * v["time_constant"]) / (1 + s * v["time_constant"]),
    "lag": lambda v, s: v["gain"] * (1 + s * v["time_constant"]) / (1 + s * v["ratio"] * v["time_constant"]),
    "lead-lag": lambda v, s: (
        v["gain"]
        * ((1 + s * v["lead_time"]) / (1 + s * v["lead_time"] / v["ratio"]))
        * ((1 + s * v["lag_time"]) / (1 + s * v["lag_time"] * v["ratio"]))
    ),
    "notch": lambda v, s: (
        v["gain"]
        * (s**2 + 2 * v["notch_damping"] * s * (2 * np.pi * v["frequency"]) + (2 * np.pi * v["frequency"]) ** 2)
        / (s**2 + 2 * v["damping_ratio"] * s * (2 * np.pi * v["frequency"]) + (2 * np.pi * v["frequency"]) ** 2)
    ),
    "pd2t2": lambda v, s: (
        v["gain"]
        * (1 + 2 * v["derivative_damping"] * s * v["derivative_time"] + (s * v["derivative_time"]) ** 2)
        / (1 + 2 * v["damping_ratio"] * s * v["time_constant"] + (s * v["time_constant"]) ** 2)
    ),
    "rc-low-pass": lambda v, s: 1 / (s * v["capacitance"]) / (v["resistance"] + 1 / (s * v["capacitance"])),
    "rc-high-pass": lambda v, s: v["resistance"] / (v["resistance"] + 1 / (s * v["capacitance"])),
    "rl-low-pass": lambda v, s: v["resistance"] / (v["resistance"] + s * v["inductance"]),
    "rl-high-pass": lambda v, s: s * v["inductance"] / (v["resistance"] + s * v["inductance"]),
    "rl-current": lambda v, s: 1 / (v["resistance"] + s * v["inductance"]),
    "rlc": lambda v, s: rlc_impedances(v, s)[2] / sum(rlc_impedances(v, s)),
    "rlc-band-pass": lambda v, s: rlc_impedances(v, s)[0] / sum(rlc_impedances(v, s)),
    "rlc-band-stop": lambda v, s: sum(rlc_impedances(v, s)[1:]) / sum(rlc_impedances(v, s)),
    "rc-lead": lead_network,
    "rc-lag": lag_network,
    "rc-lead-lag": lead_lag_network,
    "mass-spring-damper": lambda v, s: 1 / (v["mass"] * s**2 + v["damping"] * s + v["stiffness"]),
    "isolator": lambda v, s: (
        (v["damping"] * s + v["stiffness"]) / (v["mass"] * s**2 + v["damping"] * s + v["stiffness"])
    ),
    "spring-damper": lambda v, s: 1 / (v["damping"] * s + v["stiffness"]),
    "inertia": lambda v, s: 1 / (v["inertia"] * s + v["damping"]),
    "shaft": lambda v, s: v["damping"] + v["stiffness"] / s,
    "spring-lead": lambda v, s: (
        (v["damping"] * s + v["stiffness_1"]) / (v["damping"] * s + v["stiffness_1"] + v["stiffness_2"])
    ),
    "spring-lag": lambda v, s: (
        (v["damping_1"] * s + v["stiffness"]) / ((v["damping_1"] + v["damping_2"]) * s + v["stiffness"])
    ),
    "absorber": absorber,
}


def other_values(kind: str) -> dict[str, float]:
    """Values away from the defaults, so that a formula which reads a wrong parameter is seen."""
    parameters = ELEMENTS[kind].parameters
    return {name: item.value * (1.1 + 0.17 * place) for place, (name, item) in enumerate(parameters.items())}


def pt2_step(v: Values, t: np.ndarray) -> np.ndarray:
    zeta, omega = v["damping_ratio"], 1 / v["time_constant"]
    damped = omega * np.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * omega * t)
    return v["gain"] * (1 - decay * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t)))


STEPS: dict[str, Callable[[Values, np.ndarray], np.ndarray]] = {
    "p": lambda v, t: v["gain"] + 0 * t,
    "pt1": lambda v, t: v["gain"] * (1 - np.exp(-t / v["time_constant"])),
    "pt2": pt2_step,
    "i": lambda v, t: v["gain"] * t,
    "it1": lambda v, t: v["gain"] * (t - v["time_constant"] * (1 - np.exp(-t / v["time_constant"]))),
    "dt1": lambda v, t: v["derivative_time"] / v["time_constant"] * np.exp(-t / v["time_constant"]),
    "pdt1": lambda v, t: (
        v["gain"] * (1 + (v["derivative_time"] / v["time_constant"] - 1) * np.exp(-t / v["time_constant"]))
    ),
    "all-pass": lambda v, t: v["gain"] * (1 - 2 * np.exp(-t / v["time_constant"])),
    "pi": lambda v, t: v["gain"] * (1 + t / v["integral_time"]),
    "pidt1": lambda v, t: (
        v["gain"]
        * (1 + t / v["integral_time"] + v["derivative_time"] / v["filter_time"] * np.exp(-t / v["filter_time"]))
    ),
    "lead": lambda v, t: v["gain"] * (1 + (v["ratio"] - 1) * np.exp(-t / v["time_constant"])),
    "lag": lambda v, t: v["gain"] * (1 + (1 / v["ratio"] - 1) * np.exp(-t / (v["ratio"] * v["time_constant"]))),
    "rl-current": lambda v, t: (1 - np.exp(-t * v["resistance"] / v["inductance"])) / v["resistance"],
    "shaft": lambda v, t: v["damping"] + v["stiffness"] * t,
    "inertia": lambda v, t: (1 - np.exp(-t * v["damping"] / v["inertia"])) / v["damping"],
}

PROPER = [name for name in ELEMENTS if element(name).transfer.proper and not element(name).transfer.delay_s]


def test_every_kind_has_its_formula_in_this_file() -> None:
    assert set(RESPONSES) == set(ELEMENTS)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_frequency_response_is_the_textbook_formula(kind: str) -> None:
    values = other_values(kind)
    found = element(kind, **values).transfer.frequency_response(FREQUENCY_HZ)
    expected = np.array([RESPONSES[kind](values, 2j * np.pi * f) for f in FREQUENCY_HZ])
    # Near an antiresonance the difference of large terms is left; 1e-9 of the largest covers it.
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kind", PROPER)
def test_state_space_has_the_same_frequency_response(kind: str) -> None:
    transfer = element(kind, **other_values(kind)).transfer
    found = state_space(transfer).frequency_response(FREQUENCY_HZ)[0, 0]
    expected = transfer.frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kind", PROPER)
def test_python_control_gives_the_same_responses(kind: str) -> None:
    transfer = element(kind, **other_values(kind)).transfer
    oracle = control.tf(list(transfer.num), list(transfer.den))
    expected = oracle(2j * np.pi * FREQUENCY_HZ)
    np.testing.assert_allclose(transfer.frequency_response(FREQUENCY_HZ), expected, rtol=1e-9)
    pace = max((abs(pole) for pole in transfer.poles()), default=1.0) or 1.0
    time_s = np.linspace(0.0, 20.0 / pace, 101)
    stepped = control.step_response(oracle, time_s).outputs
    found = step_response(transfer, time_s).values
    np.testing.assert_allclose(found, stepped, rtol=1e-9, atol=1e-9 * np.abs(stepped).max())


@pytest.mark.parametrize("kind", STEPS)
def test_step_response_is_the_closed_form(kind: str) -> None:
    values = other_values(kind)
    time_s = np.linspace(0.0, 2.0, 101)
    found = step_response(element(kind, **values).transfer, time_s)
    expected = STEPS[kind](values, time_s)
    assert found.impulses.size == 0
    np.testing.assert_allclose(found.values, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ELEMENTS)
def test_defaults_are_usual_and_every_parameter_acts(kind: str) -> None:
    made = element(kind)
    assert not made.parameters.unusual()
    frequency_hz = np.array([0.31, 17.0])
    before = made.transfer.frequency_response(frequency_hz)
    for name, item in made.parameters.items():
        changed = made.with_values({name: item.value * 1.01}).transfer.frequency_response(frequency_hz)
        assert np.max(np.abs(changed / before - 1)) > 1e-9, name


@pytest.mark.parametrize("kind", ELEMENTS)
def test_transfer_functions_exist_at_both_ends_of_what_is_usual(kind: str) -> None:
    parameters = ELEMENTS[kind].parameters
    for end in ("low", "high"):
        made = element(kind, **{name: getattr(item, end) for name, item in parameters.items()})
        assert np.all(np.isfinite(made.transfer.frequency_response(FREQUENCY_HZ)))


def test_the_papers_regulator_and_correction_are_elements() -> None:
    # Equation 4: H_R = 0.9 (9.9 s + 1)/(3 s), H_c = 1/(0.7 s + 1).
    s = 2j * np.pi * FREQUENCY_HZ
    regulator = element("pi", gain=2.97, integral_time=9.9).transfer
    np.testing.assert_allclose(regulator.frequency_response(FREQUENCY_HZ), 0.9 * (9.9 * s + 1) / (3 * s), rtol=1e-12)
    correction = element("pdt1", gain=1.0, derivative_time=0.0, time_constant=0.7).transfer
    np.testing.assert_allclose(correction.frequency_response(FREQUENCY_HZ), 1 / (0.7 * s + 1), rtol=1e-12)


def test_unknown_words_are_named_with_the_nearest() -> None:
    with pytest.raises(ModelError, match=r"no element 'pt'; did you mean pt"):
        element_kind("pt")
    with pytest.raises(ModelError, match=r"no element '%%%'; kinds: p, pt1"):
        element_kind("%%%")
    with pytest.raises(ModelError, match=r"no parameter 'gian'; did you mean gain\?"):
        element("pt1", gian=2.0)
    with pytest.raises(ModelError, match=r"time_constant: 0 s is not possible"):
        element("pt1", time_constant=0.0)


@pytest.mark.parametrize("name", ELEMENTS)
@pytest.mark.parametrize("place", range(4))
def test_the_least_that_a_parameter_may_be_still_gives_numbers(name, place):
    parameters = ELEMENTS[name].parameters
    if place >= len(parameters):
        return
    least = parameters.items_in_order[place]
    smallest = element(name, **{least.name: max(least.minimum, -1e3)})
    # An overflow would warn, and a warning is an error here.
    transfer = smallest.transfer
    response = transfer.frequency_response(np.array([0.1, 1e3]))
    assert not np.isnan(response).any()
    if not transfer.delay_s:
        found = state_space(transfer, filter_time_s=1e-3)
        assert np.isfinite(found.frequency_response(np.array([0.1, 1e3]))).all()


def test_a_time_that_nothing_built_has_is_refused():
    with pytest.raises(ModelError, match="time_constant: 1e-20 s is not possible; give a value from 1e-15"):
        element("pt1", time_constant=1e-20)
