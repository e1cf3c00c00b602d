"""What holds for every instrument, whoever wrote it."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest

from chladni.models.analysis.influence import influence
from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.core.reading import InstrumentReading
from chladni.models.excitations.step import Step
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.models.integrator.simulate import simulate
from chladni.signals.errors import ModelError


def require_sound(reading: InstrumentReading) -> None:
    assert reading.charts
    for chart in reading.charts:
        assert chart.title
        assert chart.x_label
        assert chart.y_label
        assert chart.curves
        for curve in chart.curves:
            assert not np.isinf(curve.y).any(), (chart.name, curve.label)
            # An element whose gain is turned to nothing has no decibels.
            assert np.isfinite(curve.y).any() or curve.points or chart.name.startswith("bode"), chart.name
    for quantity in reading.quantities:
        assert quantity.definition
        assert quantity.value is None or math.isfinite(quantity.value), quantity


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_an_instrument_reads_at_its_defaults_and_at_both_ends_of_every_knob(name: str) -> None:
    instrument = INSTRUMENTS[name]
    require_sound(read_instrument(instrument))
    for parameter in instrument.parameters.items_in_order:
        for end in (parameter.low, parameter.high):
            try:
                require_sound(read_instrument(instrument, {parameter.name: end}))
            except ModelError as refused:
                # Two knobs may contradict each other (a start beyond the stroke); the page says which.
                assert parameter.name in str(refused)  # noqa: PT017  # both outcomes are allowed


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_an_instrument_reads_with_every_word_of_every_option(name: str) -> None:
    instrument = INSTRUMENTS[name]
    for option in instrument.options:
        for word in option.choices:
            require_sound(read_instrument(instrument, options={option.name: word}))


@pytest.mark.parametrize("name", [name for name, one in INSTRUMENTS.items() if "influence" in one.views])
def test_influence_is_finite_or_missing_and_its_words_say_why(name: str) -> None:
    table = influence(INSTRUMENTS[name])
    assert len(table.definitions) == len(table.behaviour)
    assert not np.isinf(table.log_derivative).any()
    assert not np.isinf(table.finite).any()


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_names_units_and_ranges_of_knobs_are_what_a_page_needs(name: str) -> None:
    instrument = INSTRUMENTS[name]
    model = instrument.model()
    for parameter in instrument.parameters.items_in_order:
        assert parameter.low < parameter.high, parameter.name
        assert parameter.usual, f"{parameter.name} starts outside its own usual range"
        assert parameter.minimum <= parameter.low, parameter.name
        assert parameter.high <= parameter.maximum, parameter.name
    compiled = model.compile()
    assert not instrument.views or instrument.step_input in {terminal.name for terminal in compiled.inputs}
    if instrument.load_input:
        assert instrument.load_input in {terminal.name for terminal in compiled.inputs}


@pytest.mark.parametrize(
    ("name", "rated"),
    [
        ("pneumatic-motor", lambda p: p["rated_load"]),
        ("hydraulic-motor", lambda p: p["rated_load"]),
        ("dc-servo", lambda p: p["torque_constant"] * p["rated_current"]),
    ],
)
def test_the_load_of_a_drive_is_one_that_it_is_built_for(
    name: str, rated: Callable[[Mapping[str, float]], float]
) -> None:
    instrument = INSTRUMENTS[name]
    share = instrument.load_size / rated(instrument.parameters.numbers())
    assert 0.05 < share < 0.5
    compiled = instrument.model().compile()
    # Small enough, too, that no flag goes up.
    flags = simulate(
        instrument.model(),
        {instrument.load_input: Step(size=instrument.load_size)},
        duration_s=0.1,
        sample_rate_hz=1e4,
    ).flags
    idle = ", ".join(one.name for one in compiled.inputs if one.name != instrument.load_input)
    assert flags == (f"not driven, taken as zero: {idle}",)
