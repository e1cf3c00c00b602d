"""Labels, colours and groups: the same in every picture of a study."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.viewers.groups import LINES_IN_A_PLOT, groups
from chladni.viewers.panels import panels
from chladni.viewers.style import ON_DARK, ON_LIGHT, Style
from tests.viewers import synthetic


def many(count: int) -> Study:
    channels = tuple(Channel(name=f"/ch{number}.v", unit="V" if number % 3 else "N") for number in range(count))
    return Study(
        title="many", series=(TimeSeries(values=np.zeros((count, 4)), sample_rate_hz=1.0, channels=channels),)
    )


@pytest.mark.parametrize("count", [1, 7, 12, 40])
def test_channels_drawn_together_have_different_colours(count: int) -> None:
    study = many(count)
    style = Style.of(study)
    for group in groups(study.series[0].channels):
        channels = [study.series[0].channels[row] for row in group.rows]
        assert len({style.on_dark(channel) for channel in channels}) == len(channels)
        assert len({style.on_light(channel) for channel in channels}) == len(channels)


@pytest.mark.parametrize("count", [1, 7, 12, 13, 40])
def test_groups_hold_every_channel_once_and_few_of_one_unit(count: int) -> None:
    channels = many(count).series[0].channels
    found = groups(channels)
    assert sorted(row for group in found for row in group.rows) == list(range(count))
    assert all(len(group.rows) <= LINES_IN_A_PLOT for group in found)
    assert all(channels[row].unit == group.unit for group in found for row in group.rows)
    assert len({group.title for group in found}) == len(found)


def test_pages_of_a_unit_are_even() -> None:
    channels = [Channel(name=str(number), unit="V") for number in range(7)]
    assert [len(group.rows) for group in groups(channels)] == [4, 3]
    assert [group.title for group in groups(channels)] == ["Voltage 1/2 [V]", "Voltage 2/2 [V]"]


def test_palettes_are_of_one_length_and_all_different() -> None:
    assert len(ON_DARK) == len(ON_LIGHT) == len(set(ON_DARK)) == len(set(ON_LIGHT))


def test_second_zero_is_the_earliest_start() -> None:
    series = synthetic.time_series()
    later = replace(series, start_time_ns=series.start_time_ns + 5)
    assert Style.of(Study(title="two", series=(later, series))).origin_ns == series.start_time_ns
    assert Style.of(Study(title="none")).origin_ns == 0


def test_panels_are_by_reference_and_unit_on_excited_lines() -> None:
    response = synthetic.frequency_response()
    (panel,) = panels(response)
    assert panel.quantity == "Accelerance"
    assert panel.unit == "(m/s²)/N"
    assert panel.frequency_hz().min() == 2.0
    assert panel.frequency_hz().max() == 100.0
    for values in (panel.function(0), panel.deviation(0), panel.coherence(0)):
        assert values.shape == panel.frequency_hz().shape
    assert np.abs(panel.function(2)).max() < 1e6
    assert panels(replace(response, excited=np.zeros_like(response.excited))) == []


def test_importing_the_viewers_imports_no_library_that_is_slow_to_start() -> None:
    modules = "chladni.viewers, chladni.viewers.style, chladni.viewers.drawing, chladni.viewers.panels"
    heavy = "{'matplotlib', 'rerun', 'scipy', 'pint', 'pydantic'}"
    program = f"import sys, {modules}; print(sorted({heavy} & set(sys.modules)))"
    outcome = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert outcome.stdout.strip() == "[]"
