"""From files at several levels to a place between two sensors."""

from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.apps.level_location import locate_from_levels
from chladni.signals.errors import EstimateError, LogError
from tests.gap.location import made_levels as made

FORCE = "/shaker.force"
SENSORS = {name: f"/{name}.acc" for name in made.OUTPUTS}


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("levels")
    measurements, _ = made.levels("j3", "hardening_stiffness", (("cubic", 1e11),))
    channels = (
        chladni.Channel(name=FORCE, unit="N"),
        *(chladni.Channel(name=name, unit="m/s^2") for name in SENSORS.values()),
    )
    paths = []
    # The loudest first: levels are put in order.
    for place, one in enumerate(measurements[::-1]):
        paths.append(folder / f"{place}.mcap")
        values = np.concatenate([one.inputs, one.outputs])
        series = chladni.TimeSeries(values=values, sample_rate_hz=one.sample_rate_hz, channels=channels)
        chladni.write_mcap(series, paths[-1])
    return paths


def run(files, **options):
    with ExitStack() as opened:
        logs = [opened.enter_context(chladni.open_log(path)) for path in files]
        return locate_from_levels(logs, **{"force": FORCE, "sensors": SENSORS, "driving_point": "a0", **options})


@pytest.mark.nightly
def test_a_place_is_found_from_files(files):
    found = run(files)
    assert found.location.located is not None
    assert found.location.located.names == ("a2", "a3")
    assert found.location.force == FORCE
    assert found.location.level == pytest.approx([2.93, 29.3, 58.6], rel=1e-3)
    assert [one.log for one in found.measurements] == ["2.mcap", "1.mcap", "0.mcap"]
    assert [channel.name for channel in found.modes.channels] == list(made.OUTPUTS)
    assert len(found.responses) == 3


@pytest.mark.parametrize(
    ("count", "options", "kind", "message"),
    [
        (1, {}, EstimateError, "1 log and 3 sensors: a place between sensors takes two levels"),
        (2, {"sensors": {"a0": "/a0.acc"}}, EstimateError, "2 logs and 1 sensor:"),
        (2, {"driving_point": "a9"}, EstimateError, "driving point 'a9' is none of the sensors a0, a2, a3"),
        (2, {"force": "/shaker.torque"}, LogError, "/shaker.torque"),
    ],
)
def test_what_is_missing_is_named(files, count, options, kind, message):
    with pytest.raises(kind, match=message):
        run(files[:count], **options)
