"""What instruments show: every chart finite and labelled, the numbers those of the analysis, laws simulated."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.models.analysis.behaviour import behaviour
from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.analysis.step_simulation import needs_simulation, step_simulation
from chladni.models.analysis.variants import Variant, one_at_a_time, require_possible
from chladni.models.core.instrument import Instrument, Option
from chladni.models.core.reading import Chart, Curve, InstrumentReading
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.models.instruments.pneumatic_motor import INSTRUMENT
from chladni.signals.errors import ModelError
from tests.models.analysis.systems import FunctionModel, compiled, gain_only, oscillator, pt2, state_space
from tests.models.analysis.test_frequency_curve import loop_with_dead_time


def instrument_of(model: FunctionModel, **changes: object) -> Instrument:
    declared = Instrument(
        name="made",
        title="Made",
        parameters=model.parameters,
        build=lambda values, _: model.with_values(values),
        step_input="u",
        step_output="y",
        views=("step", "bode", "nyquist", "poles", "root-locus"),
    )
    return replace(declared, **changes)  # type: ignore[arg-type]


def named(reading: InstrumentReading) -> dict[str, Chart]:
    return {chart.name: chart for chart in reading.charts}


def value(reading: InstrumentReading, name: str) -> float | None:
    return next(one.value for one in reading.quantities if one.name == name)


def test_a_linear_instrument_shows_every_view() -> None:
    reading = read_instrument(instrument_of(oscillator()))

    charts = named(reading)
    expected = "step.y impulse.y bode.magnitude bode.phase nyquist poles root-locus precision-stability"
    assert list(charts) == expected.split()
    for chart in charts.values():
        assert chart.title
        assert chart.x_label
        assert chart.y_label
        # A plain number has no unit to tell.
        assert "[1]" not in chart.x_label + chart.y_label
        assert any(np.isfinite(curve.y).all() for curve in chart.curves)
    exact = behaviour(oscillator())
    assert value(reading, "overshoot") == exact.value("overshoot")
    assert reading.flags == ()


def test_charts_are_computed_only_where_asked_for() -> None:
    every = read_instrument(INSTRUMENT)
    wanted = ("bode.phase", "load.velocity", "no-such-chart")
    some = read_instrument(INSTRUMENT, charts=wanted)
    assert [chart.name for chart in some.charts] == ["load.velocity", "bode.phase"]
    for chart in some.charts:
        same = named(every)[chart.name]
        np.testing.assert_array_equal(chart.curves[0].y, same.curves[0].y)
    assert some.offered == every.offered == tuple((chart.name, chart.title) for chart in every.charts)
    assert (some.quantities, some.flags) == (every.quantities, every.flags)


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_titles_offered_are_those_of_the_charts(name) -> None:
    reading = read_instrument(INSTRUMENTS[name])
    assert reading.offered == tuple((chart.name, chart.title) for chart in reading.charts)
    # A title must tell its chart from the others.
    assert len({title for _, title in reading.offered}) == len(reading.offered)


def test_a_chart_of_its_own_is_computed_only_where_asked_for() -> None:
    asked: list[object] = []

    def own(model):
        asked.append(model)
        return (Chart(name="own", title="Own", x_label="x", y_label="y", curves=()),)

    told = instrument_of(oscillator(), extra_charts=own, extra_titles=(("own", "Own"),))
    assert ("own", "Own") in read_instrument(told, charts=("poles",)).offered
    assert asked == []
    assert [chart.name for chart in read_instrument(told, charts=("own",)).charts] == ["own"]
    # Without titles only the charts themselves say what there is.
    untold = replace(told, extra_titles=())
    reading = read_instrument(untold, charts=("poles",))
    assert [chart.name for chart in reading.charts] == ["poles"]
    assert reading.offered[-1] == ("own", "Own")


def test_a_load_steps_by_its_declared_size() -> None:
    small, large = (
        named(read_instrument(replace(INSTRUMENT, load_size=size), charts=("load.velocity",)))["load.velocity"]
        for size in (1.0, 500.0)
    )
    np.testing.assert_allclose(large.curves[0].y, 500 * small.curves[0].y, rtol=1e-9)
    assert large.title == "velocity: load +500 N"


def test_the_point_of_instability_stands_only_where_it_is_near() -> None:
    near, far = (replace(pt2(2.0, 0.1), c=np.array([[size, 0.0]])) for size in (1.0, 1e-6))
    labels = []
    for system in (near, far):
        model = FunctionModel(parameters=oscillator().parameters, equations=lambda _, it=system: compiled(it))
        (chart,) = read_instrument(instrument_of(model), charts=("nyquist",)).charts
        labels.append([curve.label for curve in chart.curves])
        # Round: no corner of the locus turns by more than some degrees.
        locus = chart.curves[0].x + 1j * chart.curves[0].y
        steps = np.diff(locus)
        large = np.abs(steps) > 1e-3 * np.abs(locus).max()
        turns = np.abs(np.degrees(np.angle(steps[1:] / steps[:-1])))[large[1:] & large[:-1]]
        assert turns.max() < 6
    assert labels == [["now", "-1"], ["now"]]


def test_the_pneumatic_motor_shows_its_outputs_and_its_load() -> None:
    charts = named(read_instrument(INSTRUMENT))
    assert {"step.displacement", "step.velocity", "step.acceleration", "step.pressure_drop"} <= set(charts)
    load = charts["load.velocity"].curves[0]
    # A load slows the piston, by the leakage alone in the long run.
    assert load.y.min() < 0
    assert "5e-05 m^3/s" in charts["step.velocity"].title


def test_numbers_are_those_of_the_output_asked_for() -> None:
    reading = read_instrument(INSTRUMENT, output="pressure_drop")
    assert next(one for one in reading.quantities if one.name == "final_value").unit == "Pa"
    assert "pressure drop" in named(reading)["bode.magnitude"].title


def test_variants_are_laid_over() -> None:
    kept = one_at_a_time(INSTRUMENT.parameters, "active_area", [60e-4, 80e-4])
    charts = named(read_instrument(INSTRUMENT, variants=kept))
    labels = [curve.label for curve in charts["step.velocity"].curves]
    assert labels == ["now", "active_area = 0.006 m^2", "active_area = 0.008 m^2"]
    now, small, _ = charts["step.velocity"].curves
    assert small.y[-1] / now.y[-1] == pytest.approx(70 / 60, rel=0.01)
    assert len(charts["poles"].curves) == 3


def test_a_closed_loop_is_asked_about_what_it_controls() -> None:
    def equations(values):
        a = [[0, 1], [-values["k"], -2.0]]
        model = state_space(a, [0, values["k"]], [[0, 1], [1, 0]], input_unit="m")
        outputs = (replace(model.outputs[0], name="speed", unit="m/s"), replace(model.outputs[1], name="place"))
        return compiled(replace(model, outputs=outputs))

    model = FunctionModel(parameters=oscillator().parameters, equations=equations)
    reading = read_instrument(instrument_of(model, step_output="speed"))
    assert value(reading, "steady_state_error") == 0.0
    assert "place over u" in named(reading)["bode.magnitude"].title


def test_flags_say_what_is_wrong() -> None:
    def equations(values):
        return compiled(pt2(2.0, -0.1))

    unstable = FunctionModel(
        parameters=oscillator(stiffness=50.0).parameters, equations=equations, said=("beyond the stroke",)
    )
    flags = read_instrument(instrument_of(unstable)).flags
    assert any("k = 50 lies outside its usual range, 0.1 to 10" in flag for flag in flags)
    assert any("unstable" in flag for flag in flags)
    assert any("the response grows" in flag for flag in flags)
    assert "beyond the stroke" in flags


def test_an_unusual_value_is_told_once_in_the_unit_of_its_knob() -> None:
    from chladni.models.instruments.pneumatic_motor import INSTRUMENT as MOTOR
    from chladni.models.instruments.robot_arm import INSTRUMENT as ARM

    (flag,) = read_instrument(MOTOR, {"active_area": 9e-3}, charts=()).flags
    assert flag == "active_area = 90 cm^2 lies outside its usual range, 50 to 80 cm^2"
    # A structure tells it of its own accord too.
    told = [flag for flag in read_instrument(ARM, {"arm.mass": 48.0}, charts=()).flags if "arm.mass" in flag]
    assert told == ["arm.mass = 48 kg lies outside its usual range, 1.5 to 24 kg"]


def test_limits_that_the_step_breaks_are_flagged() -> None:
    calm, hard = INSTRUMENT, replace(INSTRUMENT, step_size=1e-3)
    assert read_instrument(calm).flags == ()
    assert any("stroke" in flag for flag in read_instrument(hard).flags)


def test_stops_that_aren_t_touched_change_nothing() -> None:
    free, stopped = read_instrument(INSTRUMENT), read_instrument(INSTRUMENT, options={"end_stops": "on"})
    exact, simulated = (named(one)["step.velocity"].curves[0] for one in (free, stopped))
    # The integrator is exact for linear parts; straight lines between 500 points miss 5e-4 of the swing.
    ours = np.interp(simulated.x, exact.x, exact.y)
    np.testing.assert_allclose(simulated.y, ours, atol=1e-3 * np.abs(exact.y).max())
    assert any("simulated with the laws" in flag for flag in stopped.flags)
    overshoot = value(free, "overshoot")
    assert value(stopped, "overshoot") == pytest.approx(overshoot, rel=0.01)
    words = next(one for one in stopped.quantities if one.name == "overshoot").definition
    assert "simulation with laws" in words


def test_the_exact_simulation_of_a_step_is_its_response() -> None:
    model = oscillator()
    found = step_simulation(model, model.compile(), from_input="u", size=2.0)
    t = np.arange(found.outputs.samples) / found.outputs.sample_rate_hz
    damped = np.sqrt(4 - 0.04)
    exact = 2 / 4 * (1 - np.exp(-0.2 * t) * (np.cos(damped * t) + 0.2 / damped * np.sin(damped * t)))
    np.testing.assert_allclose(found.outputs.values[0], exact, atol=1e-13)
    np.testing.assert_allclose(found.states[0], exact, atol=1e-13)
    assert not needs_simulation(model.compile())


@pytest.mark.nightly
def test_a_dead_time_inside_a_loop_is_simulated() -> None:
    model = FunctionModel(parameters=oscillator().parameters, equations=lambda _: loop_with_dead_time(2.0, 0.3))
    reading = read_instrument(instrument_of(model))

    curve = named(reading)["step.y"].curves[0]
    t = curve.x
    # y' = 2 (1 - y(t - 0.3)): 2 t until 0.3 s, then 2 t - 2 (t - 0.3)^2 until 0.6 s.
    early = t <= 0.6
    exact = 2 * t - 2 * np.maximum(t - 0.3, 0) ** 2
    np.testing.assert_allclose(curve.y[early], exact[early], atol=1e-6)
    assert "root-locus" not in named(reading)
    assert value(reading, "gain_margin") is None or np.isfinite(value(reading, "gain_margin"))


def test_an_instrument_without_linear_views_shows_only_its_own() -> None:
    loops = Chart(
        name="force-loop", title="Loop", x_label="x [m]", y_label="F [N]",
        curves=(Curve(label="1 A", x=np.zeros(2), y=np.ones(2)),),
    )  # fmt: skip
    own = instrument_of(oscillator(), views=("influence",), extra_charts=lambda _: (loops,))
    reading = read_instrument(own)
    assert reading.charts == (loops,)
    assert reading.quantities == ()


def test_a_gain_can_be_shown() -> None:
    model = FunctionModel(parameters=oscillator().parameters, equations=lambda _: compiled(gain_only(2.0)))
    reading = read_instrument(instrument_of(model))
    assert value(reading, "final_value") == 2.0


def test_an_integrating_nyquist_plot_is_cut() -> None:
    integrating = FunctionModel(
        parameters=oscillator().parameters,
        equations=lambda _: compiled(state_space([[0, 1], [0, -1]], [0, 1], [1, 0])),
    )
    curve = named(read_instrument(instrument_of(integrating)))["nyquist"].curves[0]
    assert np.isnan(curve.x).any()
    assert np.nanmax(np.hypot(curve.x, curve.y)) < 1e3


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"values": {"q": 1.0}}, "no parameter 'q'"),
        ({"values": {"m": -1.0}}, "is not possible"),
        ({"options": {"q": "on"}}, "option q"),
        ({"output": "z"}, "no output 'z'"),
    ],
)
def test_wrong_settings_are_refused(asked, said) -> None:
    with pytest.raises(ModelError, match=said):
        read_instrument(instrument_of(oscillator()), **asked)


def test_variants_are_checked() -> None:
    parameters = oscillator().parameters
    options = (Option(name="load"),)
    require_possible(Variant(name="a", values={"m": 2.0}, options={"load": "on"}), parameters, options)
    for variant, said in (
        (Variant(name="a", values={"q": 2.0}), "no parameter"),
        (Variant(name="a", values={"m": -2.0}), "not possible"),
        (Variant(name="a", options={"load": "maybe"}), "there are: off, on"),
        (Variant(name="a", options={"lead": "on"}), "there are: load"),
    ):
        with pytest.raises(ModelError, match=said):
            require_possible(variant, parameters, options)
