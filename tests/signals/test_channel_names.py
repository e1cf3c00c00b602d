"""Which channels a word names."""

import time

import numpy as np
import pytest

import chladni
from chladni.signals.channel_names import places_of
from chladni.signals.errors import ChladniError, EstimateError
from chladni.signals.time_series import TimeSeries

NAMES = (
    "/base/imu.accel.x",
    "/base/imu.accel.y",
    "/tip/imu.accel.x",
    "/daq.payload_rail",
    "/daq.ch1",
    "ch11",
    "what?",
)


def told(word: str) -> list[str]:
    return [NAMES[place] for place in places_of(word, NAMES)]


@pytest.mark.parametrize(
    ("word", "names"),
    [
        ("/daq.ch1", ["/daq.ch1"]),
        ("ch1", ["/daq.ch1"]),
        (".ch1", ["/daq.ch1"]),
        ("payload_rail", ["/daq.payload_rail"]),
        ("rail", ["/daq.payload_rail"]),
        ("_rail", ["/daq.payload_rail"]),
        ("tip/imu.accel.x", ["/tip/imu.accel.x"]),
        # Nothing begins within a word, and nothing ends before the name does.
        ("ail", []),
        ("h1", []),
        ("imu.accel", []),
        ("", []),
        ("*/imu.accel.x", ["/base/imu.accel.x", "/tip/imu.accel.x"]),
        ("imu.accel.?", ["/base/imu.accel.x", "/base/imu.accel.y", "/tip/imu.accel.x"]),
        ("*base*", ["/base/imu.accel.x", "/base/imu.accel.y"]),
        ("*", list(NAMES)),
        ("*z", []),
        # A name wins over what it would mean as a pattern.
        ("what?", ["what?"]),
    ],
)
def test_words_name_channels(word: str, names: list[str]) -> None:
    assert told(word) == names


@pytest.mark.parametrize(
    ("word", "places"),
    [
        ("/motor/force", (0,)),
        ("force", (0,)),
        ("motor/force", (0,)),
        # Of a topic of several channels, and of two topics that end so, none is meant; nor is part of a field's path.
        ("imu", ()),
        ("current", ()),
        ("orce", ()),
        ("nested.field", ()),
    ],
)
def test_a_topic_of_one_channel_names_it(word: str, places: tuple[int, ...]) -> None:
    names = ["/motor/force.value", "/imu.x", "/imu.y", "/a/current.data", "/b/current.data"]
    assert places_of(word, [*names, "/nested.field.x"]) == places


def test_a_dot_in_a_pattern_is_a_dot() -> None:
    assert places_of("*a.x", ["/a.x", "/a_x", "/abx"]) == (0,)


def test_an_ending_of_several_is_refused_with_them() -> None:
    with pytest.raises(EstimateError) as caught:
        places_of("accel.x", NAMES)
    message = str(caught.value)
    assert message == (
        "'accel.x' is the end of 2 channels: /base/imu.accel.x, /tip/imu.accel.x; give more of one name, "
        "or '*accel.x' for all of them"
    )
    assert told("*accel.x") == ["/base/imu.accel.x", "/tip/imu.accel.x"], "the advice works"


def test_a_pattern_of_many_stars_takes_no_time() -> None:
    begun = time.process_time()
    assert places_of("*a" * 40 + "b", ["a" * 5000]) == ()
    # Backtracking would take longer than anybody lives; this is no measure of speed.
    assert time.process_time() - begun < 5


@pytest.fixture(scope="module")
def series() -> TimeSeries:
    rng = np.random.default_rng(1)
    common = rng.standard_normal(4096)
    return TimeSeries.from_arrays({name: common + rng.standard_normal(4096) for name in NAMES}, sample_rate_hz=100.0)


def test_every_verb_takes_words(series: TimeSeries) -> None:
    assert series.select(["*accel.x", "base/imu.accel.x"]).channels == series.select([NAMES[0], NAMES[2]]).channels
    density = chladni.psd(series, channels="payload_rail")
    assert [channel.name for channel in density.channels] == ["/daq.payload_rail"]
    response = chladni.frf(series, references="daq.ch1", responses="*accel.x")
    assert [channel.name for channel in response.references] == ["/daq.ch1"]
    assert [channel.name for channel in response.responses] == [NAMES[0], NAMES[2]]
    whole = chladni.frf(series, references="daq.ch1")
    assert len(whole.responses) == len(NAMES) - 1, "the reference is no response"
    assert [one.name for one in whole.select("*accel.y").responses] == [NAMES[1]]
    two = chladni.frf(series, references=["*accel.x"], responses="ch11")
    assert [channel.name for channel in two.references] == [NAMES[0], NAMES[2]]
    passed = chladni.transmissibility(series, references="ch11")
    assert "ch11" not in [channel.name for channel in passed.responses]
    assert [one.name for one in chladni.coherence(series, references="ch11", responses="rail").responses] == [
        NAMES[3]
    ]
    assert chladni.time_delay(series, references="rail", responses="ch11").reference.name == "/daq.payload_rail"
    assert [one.name for one in chladni.waterfall(series, channels="*accel*").channels] == list(NAMES[:3])


def test_one_channel_is_asked_for(series: TimeSeries) -> None:
    with pytest.raises(ChladniError, match=r"'\*accel\.x' means 2 channels: /base/imu\.accel\.x, /tip/imu"):
        chladni.time_delay(series, references="*accel.x")
    with pytest.raises(ChladniError, match=r"no channel 'accel'; 3 names hold that: /base/imu\.accel\.x"):
        chladni.psd(series, channels="accel")
