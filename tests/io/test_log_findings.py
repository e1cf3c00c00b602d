"""Findings of logs: each sentence once, and in words that are true."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from chladni.io.log import open_log
from chladni.io.log_findings import damage_finding
from chladni.io.loss import Loss
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.make_logs import START_NS, LogMaker

NOBODY_FILLS = "0 throughout; sensors that aren't connected, or fields that nobody fills"


def findings_of(path: Path, rows: Mapping[str, Sequence[Mapping[str, float | None]]]) -> tuple[str, ...]:
    """Findings of a log of JSON messages, by topic, at 100 Hz."""
    with LogMaker(path) as maker:
        for topic, messages in rows.items():
            channel = maker.json(topic)
            for index, message in enumerate(messages):
                maker.write(
                    channel, {"timestamp": (START_NS + index * 10**7) / 1e9, **message}, START_NS + index * 10**7
                )
    with open_log(path) as log:
        return log.info().findings


def loss(what: str, messages: int | None) -> Loss:
    return Loss(what=what, offset=None, record="Message", lost_messages=messages)


@pytest.mark.parametrize(
    ("lost", "told"),
    [
        ([1], "damage in 1 place, 1 message lost: a"),
        ([None], "damage in 1 place, an unknown number of messages lost: a"),
        ([0, None], "damage in 2 places, an unknown number of messages lost: a; b"),
        ([3, None, 1], "damage in 3 places, at least 4 messages lost: a; b; c"),
        ([1, 1, 1, 1, 1], "damage in 5 places, 5 messages lost: a; b; c; and 2 more"),
    ],
)
def test_damage_in_one_sentence(lost: list[int | None], told: str) -> None:
    assert damage_finding([loss(what, count) for what, count in zip("abcde", lost, strict=False)]) == told


def test_topics_and_channels_that_share_a_sentence_share_a_finding(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).standard_normal((5, 400))
    noise[:, 200] += 90.0
    noise[3:, 300] -= 90.0
    rows = {f"/{name}": [{"x": x, "zero": 0.0, "set": 7.0} for x in noise[row]] for row, name in enumerate("abcde")}
    found = findings_of(tmp_path / "a.mcap", rows)
    leaps = "leaps away and back in 1 to 2 samples each between 2 and 3 s; check connectors and grounding"
    assert found == (
        f"/a.x, /b.x, /c.x and 2 more: {leaps}",
        f"/a.zero, /b.zero, /c.zero and 2 more: {NOBODY_FILLS}",
        "/a.set, /b.set, /c.set and 2 more: constant; settings, fields that aren't measured, or dead sensors",
        "the log gives no unit for /a.x, /a.zero, /a.set and 12 more; a setup file can",
    )


def test_one_constant_channel_is_told_its_level(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).standard_normal(400)
    found = findings_of(tmp_path / "a.mcap", {"/a": [{"x": x, "set": 7.0} for x in noise]})
    assert found[0] == "/a.set: is 7 throughout; check cable and supply, or leave it out"


def test_channels_without_a_number_are_told_as_such(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).standard_normal(400)
    rows = [{"x": x, "y": 1.0 if i == 0 else None, "z": float("nan")} for i, x in enumerate(noise)]
    found = findings_of(tmp_path / "a.mcap", {"/a": rows})
    assert found[:2] == (
        "/a.y: 399 of 400 samples not a number; they count as missing",
        "/a.z: not one sample is a number (all are NaN); nobody fills this field",
    )


def test_true_and_false_under_a_schema_of_numbers_are_no_damage(shared_data: Path) -> None:
    with open_log(shared_data / "json_plc.mcap") as log:
        info = log.info()
    assert info.damage == ()
    assert {channel.samples for channel in info.channels} == {3143}
    # 35 topics that share one clock, one state of it, and a handful of sensors' troubles.
    assert len(info.findings) < 12


def test_a_sensor_at_its_rail_is_told_with_its_span_in_seconds_of_the_log(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).standard_normal(400)
    noise[:150] = 16.0
    rows = {"/a": [{"x": x} for x in np.random.default_rng(2).standard_normal(400)], "/b": [{"x": x} for x in noise]}
    (told,) = [found for found in findings_of(tmp_path / "a.mcap", rows) if "cut off" in found]
    assert told.startswith("/b.x: is cut off at 16 in 150 samples between 0 and 1.49 s;")


def test_samples_of_batch_messages_have_times_of_their_own(tmp_path: Path) -> None:
    # Messages of many samples: the rail ends within one.
    values = np.random.default_rng(1).standard_normal((2, 10_000))
    values[1, 2_000:3_333] = 16.0
    channels = (Channel(name="/daq.a", unit="m/s^2"), Channel(name="/daq.b", unit="m/s^2"))
    write_mcap([TimeSeries(values=values, sample_rate_hz=5000.0, channels=channels)], tmp_path / "a.mcap")
    with open_log(tmp_path / "a.mcap") as log:
        (told,) = [found for found in log.info().findings if "cut off" in found]
    assert told.startswith("/daq.b: is cut off at 16 m/s^2 in 1333 samples between 0.4 and 0.6664 s;")


@pytest.mark.parametrize(
    ("label", "told"), [("furlongs/fortnight", True), ("rust", True), ("mm", False), ("", False)]
)
def test_a_unit_that_no_one_can_read_is_told_with_its_text(tmp_path: Path, label: str, told: bool) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/a", "std_msgs/Float64", "float64 data", {"unit": label})
        for index in range(50):
            maker.write(channel, {"data": float(index % 7)}, START_NS + index * 10**7)
    with open_log(tmp_path / "a.mcap") as log:
        found = log.info().findings
    assert (f"units that can't be read: {label!r} of /a.data; a setup file can give them" in found) == told
    # What is told as unreadable isn't told as none.
    assert ("the log gives no unit for /a.data; a setup file can" in found) == (not label)
