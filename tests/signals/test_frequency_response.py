import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from tests.arm import FORCE, TOOL, WRIST, short_arm


@pytest.fixture(scope="module")
def response():
    from chladni.apps.frf import frf
    from chladni.signals.time_series import TimeSeries

    made = short_arm()
    rows = np.concatenate([one.values[:, :8192] for one in made.series])
    channels = tuple(one.channels[0] for one in made.series)
    return frf(TimeSeries(values=rows, channels=channels, sample_rate_hz=1000.0), references=FORCE)


def test_responses_are_selected_in_the_order_asked_for(response):
    chosen = response.select([WRIST, TOOL])
    assert [channel.name for channel in chosen.responses] == [WRIST, TOOL]
    for name in (WRIST, TOOL):
        row, before = chosen.function(name, FORCE)[0], response.function(name, FORCE)[0]
        np.testing.assert_array_equal(chosen.values[row], response.values[before])
        np.testing.assert_array_equal(chosen.std[row], response.std[before])
        np.testing.assert_array_equal(chosen.coherence[row], response.coherence[before])
    assert chosen.references == response.references


def test_a_response_that_is_not_there_is_named(response):
    with pytest.raises(EstimateError, match="no response '/elbow'"):
        response.select(["/elbow"])
