"""What holds for every instrument, whoever wrote it."""

import math

import numpy as np
import pytest

from chladni.models.analysis.influence import influence
from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.core.reading import InstrumentReading
from chladni.models.instruments.catalogue import INSTRUMENTS
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
