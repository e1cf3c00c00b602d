import copy
import pickle
from dataclasses import replace
from math import factorial

import control
import numpy as np
import pytest

from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.elements.rational import rational
from chladni.models.excitations.step import Step
from chladni.models.integrator.simulate import simulate
from chladni.models.schemes.block import Block, element_block
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.schemes.scheme_output import SchemeOutput
from chladni.models.schemes.wiring import MAX_BLOCKS
from chladni.signals.errors import ModelError

FREQUENCY_HZ = np.geomspace(1e-3, 30.0, 40)
S = 2j * np.pi * FREQUENCY_HZ
R, L = Terminal(name="r", unit="V"), Terminal(name="load", unit="N m")


def scheme(*blocks: Block, inputs: tuple[Terminal, ...] = (R,), **more: object) -> SchemeModel:
    return SchemeModel(name="test", blocks=blocks, inputs=inputs, **more)


def at(model: SchemeModel, point: str, entry: int = 0) -> np.ndarray:
    """Exact response at a point, and that of the compiled equations, which must be the same."""
    names = [one.terminal.name for one in model.points]
    exact = model.frequency_response(FREQUENCY_HZ)[names.index(point), entry]
    compiled = model.compile()
    assert [terminal.name for terminal in compiled.outputs] == names
    found = compiled.frequency_response(FREQUENCY_HZ)[names.index(point), entry]
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-11 * np.abs(exact).max())
    return exact


def loop() -> SchemeModel:
    """PI and plant with a load, and a lagging sensor."""
    return scheme(
        element_block("regulator", "pi", "+r", "-sensor", gain=2.0, integral_time=0.5),
        element_block("plant", "pt1", "+regulator", "-disturbance", gain=3.0, time_constant=0.7),
        element_block("disturbance", "p", "load", gain=0.25, when_off="cut"),
        element_block("sensor", "pt1", "plant", gain=1.0, time_constant=0.02),
        inputs=(R, L),
    )


def test_a_loop_follows_masons_rule_at_every_point() -> None:
    model = loop()
    g, p, d, h = 2 * (1 + 1 / (0.5 * S)), 3 / (1 + 0.7 * S), 0.25, 1 / (1 + 0.02 * S)
    turn = 1 + g * p * h
    np.testing.assert_allclose(at(model, "plant"), g * p / turn, rtol=1e-9)
    np.testing.assert_allclose(at(model, "regulator"), g / turn, rtol=1e-9)
    np.testing.assert_allclose(at(model, "regulator.input"), 1 / turn, rtol=1e-9)
    np.testing.assert_allclose(at(model, "plant", 1), -d * p / turn, rtol=1e-9)
    np.testing.assert_allclose(at(model, "sensor", 1), -d * p * h / turn, rtol=1e-9)
    np.testing.assert_allclose(at(model, "plant.input", 1), -d / turn, rtol=1e-9)


def test_nested_and_crossing_loops_follow_masons_rule() -> None:
    # A ladder with three loops: two touch, and two don't touch each other.
    a, b, c = rational((2.0,), (1, 1)), rational((3.0,), (1, 2)), rational((5.0,), (1, 3))
    model = scheme(
        Block(name="a", content=a, inputs=("+r", "-fa")),
        Block(name="b", content=b, inputs=("+a", "-fb")),
        Block(name="c", content=c, inputs=("+b", "-fc")),
        element_block("fa", "p", "a", gain=0.5),
        element_block("fb", "p", "c", gain=0.25),
        element_block("fc", "p", "c", gain=0.125),
    )
    ga, gb, gc = 2 / (S + 1), 3 / (S + 2), 5 / (S + 3)
    first, second, third = -0.5 * ga, -0.25 * gb * gc, -0.125 * gc
    delta = 1 - (first + second + third) + first * second + first * third
    np.testing.assert_allclose(at(model, "c"), ga * gb * gc / delta, rtol=1e-9)
    np.testing.assert_allclose(at(model, "a"), ga * (1 - second - third) / delta, rtol=1e-9)


def test_python_control_agrees_on_a_loop_in_time_and_frequency() -> None:
    model = loop()
    pieces = [
        control.ss(control.tf([2 * 0.5, 2], [0.5, 0]), name="g", inputs="e", outputs="u"),
        control.ss(control.tf([3], [0.7, 1]), name="p", inputs="m", outputs="y"),
        control.ss(control.tf([1], [0.02, 1]), name="h", inputs="y", outputs="f"),
        control.summing_junction(["r", "-f"], "e", name="s1"),
        control.summing_junction(["u", "-d"], "m", name="s2"),
    ]
    oracle = control.interconnect(pieces, inputs=["r", "d"], outputs=["y", "u"])
    time_s = np.linspace(0, 5, 501)
    answer = control.step_response(oracle, time_s, input=0).outputs[:, 0]
    compiled = model.compile()
    ours = control.ss(compiled.a, compiled.b, compiled.c, compiled.d)
    rows = [[terminal.name for terminal in compiled.outputs].index(name) for name in ("plant", "regulator")]
    found = control.step_response(ours, time_s, input=0).outputs[rows, 0]
    np.testing.assert_allclose(found, answer, rtol=1e-9, atol=1e-9)
    expected = oracle(S)[:, 0]
    np.testing.assert_allclose(np.array([at(model, "plant"), at(model, "regulator")]), expected, rtol=1e-9)


def test_an_algebraic_loop_is_solved() -> None:
    model = scheme(
        element_block("a", "p", "+r", "+b", gain=3.0),
        element_block("b", "p", "-a", gain=2.0),
        Block(name="c", content=rational((1, 2), (1, 1)), inputs=("+b", "-c")),
    )
    np.testing.assert_allclose(at(model, "a"), np.full(S.shape, 3 / 7), rtol=1e-12)
    h = (S + 2) / (S + 1)
    np.testing.assert_allclose(at(model, "c"), -6 / 7 * h / (1 + h), rtol=1e-12)


@pytest.mark.parametrize(
    "blocks",
    [
        (element_block("a", "p", "+r", "+b"), element_block("b", "p", "a")),
        (element_block("a", "lead", "+r", "-b", ratio=4.0), element_block("b", "p", "a", gain=-0.25)),
    ],
)
def test_a_loop_without_an_answer_is_refused_by_its_blocks(blocks: tuple[Block, ...]) -> None:
    with pytest.raises(ModelError, match=r"the loop of a -> b has gain one and no lag.*put a lag such as pt1"):
        scheme(*blocks).compile()


def test_a_derivative_in_parallel_can_give_a_loop_its_answer() -> None:
    # a = r + a - T s a: gain one at once, and yet a = r/(T s).
    model = scheme(
        element_block("a", "p", "+r", "+b", "-d"),
        element_block("b", "p", "a"),
        element_block("d", "d", "a", derivative_time=0.1),
    )
    np.testing.assert_allclose(at(model, "a"), 1 / (0.1 * S), rtol=1e-9)


def test_a_loop_of_gain_one_beside_a_derivative_is_named_alone() -> None:
    model = scheme(
        element_block("a", "p", "+r", "+b", "-d"),
        element_block("b", "p", "a"),
        element_block("d", "d", "lag"),
        element_block("lag", "pt2", "a"),
    )
    with pytest.raises(ModelError, match=r"the loop of a -> b has gain one"):
        model.compile()


def test_an_improper_loop_without_an_answer_is_refused_by_its_blocks() -> None:
    # d(pt1(.)) has direct gain 1; fed back with + its loop has no answer, though neither block alone tells.
    model = scheme(
        Block(name="lag", content=rational((1,), (0.5, 1)), inputs=("+r", "+ahead")),
        Block(name="ahead", content=rational((0.5, 2), (1,)), inputs=("lag",)),
    )
    with pytest.raises(ModelError, match=r"loop of lag, ahead: the equations do not determine every signal"):
        model.compile()


def test_an_improper_block_in_a_proper_series_is_exact_in_time() -> None:
    model = scheme(
        element_block("ahead", "pd", "lag", gain=2.0, derivative_time=0.3),
        element_block("lag", "pt1", "r", time_constant=0.1),
    )
    compiled = model.compile()
    assert not compiled.derivatives
    assert compiled.state_space().poles() == pytest.approx([-10.0])
    np.testing.assert_allclose(at(model, "ahead"), 2 * (1 + 0.3 * S) / (1 + 0.1 * S), rtol=1e-12)
    assert model.remarks() == ()


def test_the_order_of_a_series_does_not_matter_behind_it() -> None:
    # The derivative before the lag: its own signal is improper, what the lag makes of it isn't.
    model = scheme(
        element_block("ahead", "pd2", "r", gain=2.0, time_constant=0.3, damping_ratio=0.4),
        element_block("lag", "pt2", "ahead", time_constant=0.1, damping_ratio=0.8),
    )
    compiled = model.compile()
    expected = 2 * (0.09 * S**2 + 0.24 * S + 1) / (0.01 * S**2 + 0.16 * S + 1)
    np.testing.assert_allclose(at(model, "lag"), expected, rtol=1e-9)
    row = [terminal.name for terminal in compiled.outputs].index("lag")
    in_time = compiled.state_space().frequency_response(FREQUENCY_HZ)[row, 0]
    np.testing.assert_allclose(in_time, expected, rtol=1e-9)
    (told,) = model.remarks()
    assert told.startswith(
        "ahead: a step of r comes through as an impulse; in time it is computed through a lag of 0.001 s"
    )


def test_a_lone_derivative_is_filtered_in_time_and_exact_in_frequency() -> None:
    model = scheme(element_block("d", "d", "r", derivative_time=0.5), derivative_filter_s=0.02)
    np.testing.assert_allclose(at(model, "d"), 0.5 * S, rtol=1e-12)
    in_time = model.compile().state_space().frequency_response(FREQUENCY_HZ)[0, 0]
    np.testing.assert_allclose(in_time, 0.5 * S / (0.02 * S + 1), rtol=1e-10)
    assert "0.02 s" in model.remarks()[0]


def test_a_pd_loop_closes_without_filter() -> None:
    # PD regulator on a double integrator: y/r = (Td s + 1)/(s^2 + Td s + 1) is proper, the regulator's signal isn't.
    model = scheme(
        element_block("pd", "pd", "+r", "-y", gain=1.0, derivative_time=0.8),
        Block(name="y", content=rational((1,), (1, 0, 0)), inputs=("pd",)),
        outputs=(SchemeOutput(name="y"),),
    )
    np.testing.assert_allclose(at(model, "y"), (0.8 * S + 1) / (S**2 + 0.8 * S + 1), rtol=1e-9)
    np.testing.assert_allclose(at(model, "pd"), S**2 * (0.8 * S + 1) / (S**2 + 0.8 * S + 1), rtol=1e-9, atol=1e-9)
    poles = model.compile().state_space().poles()
    # The loop's own two, and that of the lag through which the regulator's impulse is computed.
    np.testing.assert_allclose(
        np.sort_complex(poles), np.sort_complex([-0.4 + 1j * 0.84**0.5, -0.4 - 1j * 0.84**0.5, -1e3])
    )


def test_dead_time_in_a_loop_is_exact_in_frequency() -> None:
    model = scheme(
        element_block("plant", "it1", "+r", "-late", gain=0.8, time_constant=0.3),
        element_block("late", "dead-time", "plant", delay=0.4),
    )
    g = 0.8 / S / (1 + 0.3 * S)
    np.testing.assert_allclose(at(model, "plant"), g / (1 + g * np.exp(-0.4 * S)), rtol=1e-9)
    np.testing.assert_allclose(at(model, "late"), g * np.exp(-0.4 * S) / (1 + g * np.exp(-0.4 * S)), rtol=1e-9)


def test_a_derivative_of_what_is_delayed_is_told() -> None:
    model = scheme(
        element_block("late", "dead-time", "+lag", delay=0.2),
        element_block("lag", "pt1", "+r", "-ahead", time_constant=0.3),
        element_block("ahead", "pd2", "late", gain=0.5, time_constant=0.1, damping_ratio=0.5),
    )
    p, late = 0.5 * (0.01 * S**2 + 0.1 * S + 1), np.exp(-0.2 * S)
    np.testing.assert_allclose(at(model, "lag"), 1 / (1 + 0.3 * S + p * late), rtol=1e-9)
    assert model.remarks()[-1].startswith(
        "what late delays is differentiated behind it; in time through a lag of 0.001 s"
    )


def test_a_dead_time_does_not_determine_a_loop_of_gain_one() -> None:
    model = scheme(element_block("echo", "p", "+r", "+late"), element_block("late", "dead-time", "echo", delay=0.1))
    with pytest.raises(ModelError, match=r"the loop of echo -> late has gain one.*a dead time alone is not enough"):
        model.compile()
    # In frequency nothing is wrong with it.
    found = model.frequency_response(np.array([3.0]))[0, 0, 0]
    np.testing.assert_allclose(found, 1 / (1 - np.exp(-0.6j * np.pi)), rtol=1e-12)


def test_dead_time_in_a_loop_follows_the_method_of_steps() -> None:
    # y' = K (1 - y(t - tau)): on each interval of tau one power more (Bellman & Cooke 1963, section 3.4).
    gain, delay_s = 2.0, 0.3
    model = scheme(
        element_block("plant", "i", "+r", "-late", gain=gain),
        element_block("late", "dead-time", "plant", delay=delay_s),
    )
    found = simulate(model, Step(), duration_s=3.0, sample_rate_hz=100.0)
    time_s = np.arange(found.outputs.values.shape[1]) / 100.0
    expected = np.zeros_like(time_s)
    for power in range(1, 12):
        since = np.maximum(time_s - (power - 1) * delay_s, 0.0)
        expected -= (-gain * since) ** power / factorial(power)
    # The integrator's tolerance of 1e-7 on a signal of size 2.
    np.testing.assert_allclose(found.outputs.values[0], expected, atol=2e-7)


def test_dead_time_in_a_loop_without_lag_makes_a_staircase() -> None:
    model = scheme(
        element_block("gain", "p", "+r", "-late", gain=0.5), element_block("late", "dead-time", "gain", delay=0.25)
    )
    found = simulate(model, Step(), duration_s=2.0, sample_rate_hz=100.0).outputs.values[0]
    steps = np.cumsum(0.5 * (-0.5) ** np.arange(8))
    for number, level in enumerate(steps):
        np.testing.assert_allclose(found[25 * number + 1 : 25 * number + 24], level, rtol=1e-9)


def test_dead_time_that_feeds_nothing_is_only_read_later() -> None:
    model = scheme(
        element_block("lag", "pt1", "r", time_constant=0.2), element_block("late", "dead-time", "lag", delay=0.4)
    )
    compiled = model.compile()
    assert compiled.delays == ()
    assert dict(zip([one.name for one in compiled.outputs], compiled.output_offsets_s, strict=True))["late"] == 0.4
    np.testing.assert_allclose(at(model, "late"), np.exp(-0.4 * S) / (1 + 0.2 * S), rtol=1e-12)


def test_a_state_space_is_a_block_like_others() -> None:
    content = StateSpace(
        a=np.array([[0.0, 1.0], [-4.0, -0.4]]),
        b=np.array([[0.0], [1.0]]),
        c=np.array([[1.0, 0.0]]),
        d=np.zeros((1, 1)),
        inputs=(Terminal(name="force", unit="N"),),
        outputs=(Terminal(name="shift", unit="m"),),
        states=("x", "v"),
    )
    model = scheme(
        Block(name="plant", content=content, inputs=("+r", "-back")), element_block("back", "p", "plant", gain=2.0)
    )
    np.testing.assert_allclose(at(model, "plant"), 1 / (S**2 + 0.4 * S + 6), rtol=1e-9)
    assert list(model.parameters) == ["back.gain"]


def test_blocks_are_switched_on_and_off() -> None:
    off = loop().switched({"regulator": False, "disturbance": False})
    p, h = 3 / (1 + 0.7 * S), 1 / (1 + 0.02 * S)
    np.testing.assert_allclose(at(off, "plant"), p / (1 + p * h), rtol=1e-9)
    assert np.all(at(off, "plant", 1) == 0)
    assert off.remarks()[:2] == (
        "block regulator is off: it passes what enters it on",
        "block disturbance is off: it gives zero",
    )
    assert off.switched({"regulator": True, "disturbance": True}) == loop()
    with pytest.raises(ModelError, match="block 'regulatorr' is unknown; did you mean regulator"):
        loop().switched({"regulatorr": False})


def test_integral_action_rejects_a_load_and_without_it_the_load_stays() -> None:
    at_rest = np.array([0.0])
    names = [point.terminal.name for point in loop().points]
    with_pi = loop().frequency_response(at_rest)[names.index("plant"), :, 0]
    np.testing.assert_allclose(with_pi, [1.0, 0.0], atol=1e-12)
    without = loop().switched({"regulator": False}).frequency_response(at_rest)[names.index("plant"), :, 0]
    np.testing.assert_allclose(without, [3 / 4, -0.75 / 4], rtol=1e-12)


def test_only_what_lies_behind_a_pole_is_infinite() -> None:
    model = scheme(
        element_block("gain", "p", "r", gain=2.0),
        element_block("sum", "i", "gain"),
        element_block("after", "p", "+sum", "-gain"),
        element_block("beside", "p", "-gain", gain=3.0),
    )
    found = dict(
        zip([p.terminal.name for p in model.points], model.frequency_response(np.zeros(1))[:, 0, 0], strict=True)
    )
    assert (found["gain"], found["beside"]) == (2.0, -6.0)
    assert np.isinf(found["sum"])
    assert not np.isfinite(found["after"])
    assert not np.isfinite(found["after.input"])


def test_parameters_are_those_of_the_blocks() -> None:
    model = loop()
    assert list(model.parameters)[:3] == ["regulator.gain", "regulator.integral_time", "plant.gain"]
    changed = model.with_values({"plant.gain": 5.0, "sensor.time_constant": 0.1})
    assert changed.parameters["plant.gain"].value == 5.0
    np.testing.assert_allclose(at(changed, "plant"), loop_response(5.0, 0.1), rtol=1e-9)
    with pytest.raises(ModelError, match=r"no parameter 'plant.gian'; did you mean plant.gain\?"):
        model.with_values({"plant.gian": 1.0})
    with pytest.raises(ModelError, match=r"^plant\.time_constant: -1 s is not possible"):
        model.with_values({"plant.time_constant": -1.0})
    assert model.with_tolerances({"plant.gain": 0.3}).parameters["plant.gain"].tolerance == 0.3


def loop_response(gain: float, lag_s: float) -> np.ndarray:
    g, p, h = 2 * (1 + 1 / (0.5 * S)), gain / (1 + 0.7 * S), 1 / (1 + lag_s * S)
    return g * p / (1 + g * p * h)


def test_declared_outputs_come_first_under_their_own_names() -> None:
    model = SchemeModel(
        name="named",
        blocks=loop().blocks,
        inputs=loop().inputs,
        outputs=(
            SchemeOutput(name="speed", at="plant", unit="rad/s", channel="/joint.velocity"),
            SchemeOutput(name="sensor"),
        ),
    )
    outputs = model.compile().outputs
    assert [one.name for one in outputs] == [
        *("speed", "sensor", "regulator", "plant", "disturbance"),
        *("regulator.input", "plant.input"),
    ]
    assert (outputs[0].unit, outputs[0].channel) == ("rad/s", "/joint.velocity")
    np.testing.assert_allclose(at(model, "speed"), at(model, "plant"), rtol=1e-12)


def test_an_effect_at_a_block_acts_on_what_enters_it_inside_the_loop() -> None:
    limited = loop().with_effects([attached("saturation", "plant", {"limit": 0.5})])
    found = simulate(limited, {"r": Step(size=4.0)}, duration_s=8.0, sample_rate_hz=200.0)
    names = [channel.name for channel in found.outputs.channels]
    # What enters the plant is limited to 0.5, so the plant can't come above 3 times that.
    plant, regulator = (found.outputs.values[names.index(name)] for name in ("plant", "regulator"))
    assert regulator.max() > 5.0
    assert plant.max() <= 1.5 + 1e-6
    np.testing.assert_allclose(plant[-1], 1.5, rtol=1e-3)
    free = simulate(loop(), {"r": Step(size=4.0)}, duration_s=8.0, sample_rate_hz=200.0)
    np.testing.assert_allclose(free.outputs.values[names.index("plant")][-1], 4.0, rtol=1e-3)


def test_an_effect_at_what_leaves_a_block_goes_round_the_loop() -> None:
    wrong = loop().with_effects([attached("gain_error", "sensor", {"gain": 0.8})])
    at_rest = wrong.frequency_response(np.array([1e-6]))
    names = [one.name for one in wrong.compile().outputs]
    # The integral action makes the reading follow the reference, so the plant is at 1/0.8 of it.
    np.testing.assert_allclose(np.abs(at_rest[names.index("plant"), 0]), 1.25, rtol=1e-4)


def test_an_effect_behind_the_last_block_touches_nothing_else() -> None:
    model = scheme(element_block("plant", "pt1", "r", time_constant=0.2), element_block("sensor", "p", "plant"))
    clipped = model.with_effects([attached("clipping", "sensor", {"limit": 0.5})])
    found = simulate(clipped, Step(), duration_s=2.0, sample_rate_hz=100.0).outputs.values
    assert found[1].max() == 0.5
    assert found[0].max() > 0.99


def test_an_effect_before_a_block_that_differentiates_finds_its_port() -> None:
    model = scheme(
        element_block("pd", "pd", "+r", "-plant", derivative_time=0.1),
        Block(name="plant", content=rational((1,), (1, 1, 0)), inputs=("pd",)),
    )
    assert "pd" not in {port.name for port in model.compile().ports if port.kind == "input"}
    wrong = model.with_effects([attached("gain_error", "plant", {"gain": 0.5})])
    h = (1 + 0.1 * S) / (S * (S + 1))
    names = [one.name for one in wrong.compile().outputs]
    found = wrong.frequency_response(FREQUENCY_HZ)[names.index("plant"), 0]
    np.testing.assert_allclose(found, 0.5 * h / (1 + 0.5 * h), rtol=1e-9)
    late = model.with_effects([attached("lag", "pd", {"time_constant": 0.05})]).frequency_response(FREQUENCY_HZ)
    lagged = h / (1 + 0.05 * S)
    np.testing.assert_allclose(late[names.index("plant"), 0], lagged / (1 + lagged), rtol=1e-9)


def test_what_is_unconnected_is_told() -> None:
    model = scheme(
        element_block("alone", "p"),
        element_block("plant", "pt1", "r"),
        element_block("loose", "p", "plant"),
        inputs=(R, L),
        outputs=(SchemeOutput(name="plant"),),
    )
    assert model.remarks() == (
        "block alone has no input: its signal is zero",
        "block loose feeds nothing",
        "input load feeds nothing",
    )
    assert model.flags(simulate(model, Step(), duration_s=0.1, sample_rate_hz=10.0)) == model.remarks()


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"blocks": ()}, f"1 to {MAX_BLOCKS} blocks, this one has 0"),
        ({"blocks": (element_block("a", "p"), element_block("a", "p"))}, "the name 'a' is taken"),
        ({"blocks": (element_block("r", "p"),)}, "the name 'r' is taken"),
        ({"blocks": (element_block("a", "p", "rr"),)}, "block 'a': input 'rr' is unknown; did you mean r"),
        ({"outputs": (SchemeOutput(name="y", at="b"),)}, "output 'y': block 'b' is unknown; there are: a"),
        ({"outputs": (SchemeOutput(name="r", at="a"),)}, "the name 'r' is taken"),
        ({"outputs": (SchemeOutput(name="a"), SchemeOutput(name="a"))}, "the name 'a' is taken"),
        ({"inputs": (Terminal(name="r", unit="m", derivatives=2),)}, "input 'r': a scheme takes signals without"),
        ({"inputs": (Terminal(name="2r", unit="m"),)}, "input '2r': a name is a letter"),
        ({"derivative_filter_s": 0.0}, "derivative_filter_s = 0; it must be finite and above zero"),
        ({"blocks": tuple(element_block(f"b{n}", "p") for n in range(MAX_BLOCKS + 1))}, "this one has 1001"),
    ],
)
def test_impossible_schemes_are_refused(parts: dict[str, object], words: str) -> None:
    whole = {"name": "x", "blocks": (element_block("a", "p", "r"),), "inputs": (R,)} | parts
    with pytest.raises(ModelError, match=words):
        SchemeModel(**whole)


def test_a_named_block_is_found_or_its_neighbour_named() -> None:
    assert loop().block("plant").unit == "1"
    with pytest.raises(ModelError, match="block 'plan' is unknown; did you mean plant"):
        loop().block("plan")


def test_schemes_travel_between_processes() -> None:
    again = copy.deepcopy(loop())
    assert pickle.dumps(again)
    np.testing.assert_array_equal(again.frequency_response(FREQUENCY_HZ), loop().frequency_response(FREQUENCY_HZ))
    assert again == loop()


def test_a_loop_that_grows_is_told_with_its_dead_time() -> None:
    # x' = -k x(t - 0.1 s) is stable below k = half pi over 0.1 s = 15.7.
    for gain, told in ((15.0, False), (16.5, True)):
        model = scheme(
            element_block("plant", "i", "+r", "-late", gain=gain),
            element_block("late", "dead-time", "plant", delay=0.1),
        )
        flags = simulate(model, Step(), duration_s=0.5, sample_rate_hz=100.0).flags
        assert any(flag.startswith("unstable: poles at ") for flag in flags) == told


def test_what_effects_say_is_said() -> None:
    def far(port, values, _simulation):
        return (f"far at {port.name} with {values['gain']:g}",)

    own = replace(CATALOGUE["gain_error"], name="own", flags=far)
    model = loop().with_effects([attached(own, "plant", {"gain": 2.0}), attached("delay", "r", {"delay": 0.1})])
    assert simulate(model, {"r": Step(), "load": Step()}, duration_s=0.1, sample_rate_hz=10.0).flags == (
        "far at plant with 2",
    )
