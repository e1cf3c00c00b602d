import numpy as np
import pytest

from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.elements.catalogue import ELEMENTS
from chladni.models.elements.step_response import step_response
from chladni.models.instruments.elements import ELEMENT_INSTRUMENTS


def test_every_element_has_an_instrument_with_its_own_knobs_only() -> None:
    assert list(ELEMENT_INSTRUMENTS) == [f"element-{kind}" for kind in ELEMENTS]
    for name, instrument in ELEMENT_INSTRUMENTS.items():
        kind = name.removeprefix("element-")
        assert list(instrument.parameters) == [f"{kind}.{parameter}" for parameter in ELEMENTS[kind].parameters]


@pytest.mark.parametrize("name", ELEMENT_INSTRUMENTS)
def test_a_page_shows_the_elements_own_responses(name: str) -> None:
    instrument, kind = ELEMENT_INSTRUMENTS[name], name.removeprefix("element-")
    changed = {parameter: item.value * 1.2 for parameter, item in instrument.parameters.items()}
    model = instrument.model(changed)
    frequency_hz = np.geomspace(0.01, 100, 9)
    transfer = ELEMENTS[kind].transfer({parameter.split(".")[1]: value for parameter, value in changed.items()})
    expected = transfer.frequency_response(frequency_hz)
    np.testing.assert_allclose(model.frequency_response(frequency_hz)[0, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(model.compile().frequency_response(frequency_hz)[0, 0], expected, rtol=1e-9)
    reading = read_instrument(instrument, changed)
    step = next(chart for chart in reading.charts if chart.name == f"step.{kind}").curves[0]
    if transfer.proper:
        exact = step_response(transfer, step.x).values
        seen = step.x > transfer.delay_s
        np.testing.assert_allclose(step.y[seen], exact[seen], rtol=1e-9, atol=1e-9 * np.abs(exact).max())
