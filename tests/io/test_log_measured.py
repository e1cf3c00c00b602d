"""Measured logs against the mcap library's reader: the same samples, bit for bit, at the same times."""

import json
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from chladni.io.log import open_log


def messages(path: Path, topic: str, *, end_ns: int | None = None) -> list[Any]:
    """Messages of a topic logged before `end_ns`, decoded one by one by the mcap library."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = reader.iter_decoded_messages(topics=[topic])
        wanted = takewhile(lambda one: end_ns is None or one.message.log_time < end_ns, decoded)
        return [one.decoded_message for one in wanted]


def stamp_ns(message: Any) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_f16_is_read_bit_for_bit(shared_data: Path) -> None:
    path = shared_data / "f16_level1.mcap"
    names = ["/payload_rail.accel.linear.z", "/shaker.wrench.force.z"]
    with open_log(path) as log:
        series = log.read(names, end_s=5.0)
    assert (series.sample_rate_hz, series.samples) == (400.0, 2000)
    assert [(channel.unit, channel.role) for channel in series.channels] == [
        ("m/s^2", "response"),
        ("N", "reference"),
    ]
    end_ns = series.start_time_ns + 5 * 10**9
    rail = messages(path, "/payload_rail", end_ns=end_ns)
    shaker = messages(path, "/shaker", end_ns=end_ns)
    np.testing.assert_array_equal(series.values[0], [message.accel.linear.z for message in rail])
    np.testing.assert_array_equal(series.values[1], [message.wrench.force.z for message in shaker])


# Of the long log the first messages, in two chunks: the peer takes 0.1 ms a message.
@pytest.mark.parametrize(("name", "topic", "seconds"), [("emps", "/axis", 6), ("mr_0A", "/damper", 25)])
def test_joint_states_are_read_bit_for_bit(shared_data: Path, name: str, topic: str, seconds: int) -> None:
    path = shared_data / f"{name}.mcap"
    with open_log(path) as log:
        series = log.read([f"{topic}.position[0]", f"{topic}.effort[0]"])
    expected = messages(path, topic, end_ns=series.start_time_ns + seconds * 10**9)
    assert len(expected) == min(seconds * round(series.sample_rate_hz), series.samples)
    np.testing.assert_array_equal(series.values[0, : len(expected)], [message.position[0] for message in expected])
    np.testing.assert_array_equal(series.values[1, : len(expected)], [message.effort[0] for message in expected])
    assert series.start_time_ns == stamp_ns(expected[0])
    assert series.valid is None


@pytest.mark.parametrize(
    ("name", "rate_hz", "samples"), [("palisaden", 100.0, 540_000), ("hammer", 51_200.0, 256_000)]
)
def test_batch_messages_are_read_bit_for_bit(shared_data: Path, name: str, rate_hz: float, samples: int) -> None:
    path = shared_data / f"{name}.mcap"
    # The whole of the short log, ten minutes of the long one: the peer takes its time.
    blocks = messages(path, "/daq", end_ns=1_700_000_600_000_000_000)
    expected = np.concatenate(
        [np.array(block.samples, np.float32).reshape(len(block.channel_names), -1) for block in blocks], axis=1
    )
    with open_log(path) as log:
        series = log.read()
        np.testing.assert_array_equal(series.values[:, : expected.shape[1]], expected)
        assert [channel.name for channel in series.channels] == [f"/daq.{one}" for one in blocks[0].channel_names]
        assert (series.sample_rate_hz, series.samples) == (rate_hz, samples)
        # The header's stamp, not the log time 3 ms later.
        assert series.start_time_ns == stamp_ns(blocks[0]) == 1_700_000_000_000_000_000
        info = log.info()
    assert info.channels[0].stamp == "header"
    assert info.duration_s == pytest.approx(samples / rate_hz, abs=1e-9)
    assert info.to_json()["channels"][0]["gaps"] == []


def test_hour_long_log_block_by_block(shared_data: Path) -> None:
    with open_log(shared_data / "palisaden.mcap") as log:
        whole = log.read()
        # No block is as long as a message or a multiple of it.
        blocks = list(log.blocks(seconds=47.11))
        np.testing.assert_array_equal(np.concatenate([block.values for block in blocks], axis=1), whole.values)
        times = np.concatenate([block.times_ns() for block in blocks])
        np.testing.assert_allclose(times, whole.times_ns(), atol=1)


def test_overloaded_hits_of_the_hammer_are_noticed(shared_data: Path) -> None:
    with open_log(shared_data / "hammer.mcap") as log:
        clipped = {one.channel.name: one.clipped for one in log.info().channels}
    # Record one has three samples at the top of the range.
    assert clipped == {"/daq.hammer": 3, "/daq.response": 0}


def test_silverbox_json(shared_data: Path) -> None:
    path = shared_data / "silverbox.mcap"
    with open_log(path) as log:
        series = log.read(["/output.value"], end_s=20.0)
    end_ns = series.start_time_ns + 20 * 10**9
    with path.open("rb") as file:
        found = (message for _, _, message in make_reader(file).iter_messages(topics=["/output"]))
        raw = [json.loads(message.data) for message in takewhile(lambda one: one.log_time < end_ns, found)]
    np.testing.assert_array_equal(series.values[0], [message["value"] for message in raw])
    assert series.start_time_ns == raw[0]["timestamp"]["sec"] * 10**9 + raw[0]["timestamp"]["nsec"]
    # 10^7/2^14 Hz: the clock of the instrument.
    assert series.sample_rate_hz == pytest.approx(1e7 / 2**14, rel=1e-6)


def test_header_stamps_that_stand_still(shared_data: Path) -> None:
    path = shared_data / "real_ros2_bag.mcap"
    name = "/coug2/modem_imu.linear_acceleration.x"
    expected = np.array([message.linear_acceleration.x for message in messages(path, "/coug2/modem_imu")])
    with open_log(path) as log:
        info = next(one for one in log.info().channels if one.channel.name == name)
        series = log.read([name])
    assert (info.stamp, info.samples) == ("log", expected.size)
    assert "stands still" in info.stamp_reason
    assert series.sample_rate_hz == pytest.approx(10.0, rel=0.01)
    measured = series.values[0][np.isfinite(series.values[0])]
    # Log times scatter, so a few samples may meet on one place of the grid; those that stay keep their order.
    assert measured.size >= 0.99 * expected.size
    places = np.flatnonzero(np.isin(expected, measured))
    assert np.count_nonzero(np.diff(places) < 1) == 0


def test_clocks_that_differ_by_days_are_brought_together(shared_data: Path) -> None:
    path = shared_data / "real_ros2_bag.mcap"
    with open_log(path) as log, path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        info = log.info()
        log_time_s = (summary.statistics.message_end_time - summary.statistics.message_start_time) / 1e9
    # Header stamps are six days before the log times; the log lasted two minutes all the same.
    assert info.duration_s == pytest.approx(log_time_s, abs=10.0)
    assert abs(info.start_time_ns - summary.statistics.message_start_time) < 10e9


def test_json_plant_log_tells_what_is_no_number(shared_data: Path) -> None:
    with open_log(shared_data / "json_plc.mcap") as log:
        temperature = log.read(["/eip/temperature.value"])
        assert len(log.channels) == 35
    assert temperature.sample_rate_hz == pytest.approx(2.548, abs=0.01)
    assert temperature.values[0][0] == 77.22000122070312


def test_every_measured_log_has_an_info_without_nan(shared_data: Path) -> None:
    for name in ("emps", "mr_1A", "palisaden", "real_ros2_bag"):
        with open_log(shared_data / f"{name}.mcap") as log:
            content = log.info().to_json()
        text = json.dumps(content, allow_nan=False)
        assert json.loads(text)["format"] == "chladni.info/1"
        keys = (
            "name,unit,encoding,rate_hz,rate_std_hz,samples,stamp,stamp_reason,jitter_s,gaps,breaks,longest_stretch_s,"
            "duplicates,clipped,untimed,publishers"
        )
        assert all(",".join(channel) == keys for channel in content["channels"])
