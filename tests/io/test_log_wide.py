"""Logs of many channels and fields: the work follows what the log holds, and too long a list is cut with a word."""

import json
import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any
from unittest.mock import Mock, patch

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

import chladni
from chladni.io import catalog, shared_grid, stream, topic
from chladni.io.decoding.decoder import make_decoder
from chladni.io.log import open_log
from chladni.signals.errors import EstimateError, LogError
from chladni.signals.testing import assert_close
from tests.make_logs import START_NS, LogMaker

PERIOD_NS = 1_000_000


def write_wide(path: Path, fields: dict[str, int], *, messages: int = 20) -> None:
    """Topics of so many numbers each, all of one writer's schema where they have as many."""
    with LogMaker(path) as maker:
        channels = {
            name: maker.ros2(name, f"t/msg/A{many}", "\n".join(f"float64 f{field}" for field in range(many)))
            for name, many in fields.items()
        }
        for place in range(messages):
            for name, channel in channels.items():
                message = {f"f{field}": float(place % 7 + field) for field in range(fields[name])}
                maker.write(channel, message, START_NS + place * PERIOD_NS)


def test_a_schema_that_channels_share_is_read_once(tmp_path: Path) -> None:
    write_wide(tmp_path / "a.mcap", {f"/c{number}": 1 for number in range(50)})
    with patch.object(topic, "make_decoder", side_effect=make_decoder) as made:
        with open_log(tmp_path / "a.mcap") as log:
            assert len(log.channels) == 50
            assert log.read().values.shape == (50, 20)
        assert made.call_count == len({call.kwargs["schema_data"] for call in made.call_args_list})


def test_a_schema_that_channels_share_is_kept_once(tmp_path: Path) -> None:
    text = b"float64 x\n" + b"# comment\n" * 50_000
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "test")
        schema = writer.register_schema("t/msg/A", "ros2msg", text)
        channels = [writer.register_channel(f"/c{number}", "cdr", schema) for number in range(60)]
        for place in range(4):
            for channel in channels:
                content = b"\0\1\0\0" + struct.pack("<d", place)
                writer.add_message(channel, START_NS + place * PERIOD_NS, content, START_NS + place * PERIOD_NS)
        writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it unannotated
    tracemalloc.start()
    with open_log(tmp_path / "a.mcap") as log:
        info = log.info()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert [one.samples for one in info.channels] == [4] * 60
    # A copy a channel would take sixty.
    assert peak < 12 * len(text)


@pytest.mark.parametrize("most", [1, 5, 12, 30, 31])
def test_the_narrowest_topics_are_listed_and_the_others_told(
    tmp_path: Path, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "MOST_LISTED", most)
    fields = {"/wide": 18, "/imu": 3, "/one": 1, "/mid": 9}
    write_wide(tmp_path / "a.mcap", fields)
    room, listed = most, set[str]()
    for name in sorted(fields, key=lambda name: fields[name]):
        if fields[name] <= room:
            room, listed = room - fields[name], listed | {name}
    with open_log(tmp_path / "a.mcap") as log:
        found = [channel.name for channel in log.channels]
        assert found == [f"{name}.f{field}" for name in fields if name in listed for field in range(fields[name])]
        told = {one.name: one.reason for one in log.unread}
        assert told == {
            name: f"{many} fields are too many for a list of {most} channels; single ones can be read by path"
            for name, many in fields.items()
            if name not in listed
        }
        assert sum("too many for a list" in finding for finding in log.info().findings) == len(told)
        np.testing.assert_array_equal(log.read(["/wide.f7"]).values[0], np.arange(20) % 7 + 7)


@given(
    contents=st.lists(
        st.dictionaries(
            st.sampled_from([f"f{field}" for field in range(40)]),
            st.one_of(st.floats(-1e6, 1e6), st.integers(-5, 5), st.booleans(), st.none()),
            max_size=6,
        ),
        min_size=2,
        max_size=30,
    )
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_json_messages_that_hold_few_of_their_fields(tmp_path: Path, contents: list[dict[str, Any]]) -> None:
    schema = {"type": "object", "properties": {f"f{field}": {"type": "number"} for field in range(40)}}
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.json("/j", schema)
        for place, content in enumerate(contents):
            maker.write(channel, content, START_NS + place * PERIOD_NS)
    expected = np.array(
        [
            [np.nan if content.get(f"f{n}") is None else float(content[f"f{n}"]) for content in contents]
            for n in range(40)
        ]
    )
    with open_log(tmp_path / "a.mcap") as log:
        for number in (0, 7, 39):
            pieces = log.read_groups([f"/j.f{number}"])
            np.testing.assert_array_equal(pieces[0].values[0], expected[number])


@pytest.mark.parametrize("at_once", [1, 37, 400])
def test_parts_of_a_batch_give_what_the_batch_gives(
    tmp_path: Path, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_wide(tmp_path / "a.mcap", {"/a": 12, "/b": 2}, messages=50)
    with open_log(tmp_path / "a.mcap") as log:
        whole, told = log.read(), log.info().to_json()
    monkeypatch.setattr(stream, "VALUES_AT_ONCE", at_once)
    with open_log(tmp_path / "a.mcap") as log:
        assert_close(log.read(), whole, rtol=0, atol=0)
        blocks = list(log.blocks(seconds=0.013))
        np.testing.assert_array_equal(np.concatenate([block.values for block in blocks], axis=1), whole.values)
        assert json.dumps(log.info().to_json()) == json.dumps(told)


@pytest.mark.nightly
def test_fields_times_messages_take_bounded_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A few bytes a message name thousands of fields, of which each would be a column of NaN."""
    fields, messages = 1000, 1000
    schema = {"type": "object", "properties": {f"f{field}": {"type": "number"} for field in range(fields)}}
    with LogMaker(tmp_path / "a.mcap", chunk_size=1 << 20) as maker:
        channel = maker.json("/j", schema)
        for place in range(messages):
            maker.write(channel, {f"f{place % fields}": 1.0}, START_NS + place * PERIOD_NS)
    monkeypatch.setattr(stream, "VALUES_AT_ONCE", 1 << 17)
    tracemalloc.start()
    with open_log(tmp_path / "a.mcap") as log:
        samples = sum(int(np.isfinite(block.values).sum()) for block in log.blocks(seconds=0.1))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert samples == messages
    assert peak < 8 * fields * messages


def test_an_average_of_too_many_pairs_is_refused_before_any_sample_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_wide(tmp_path / "a.mcap", {"/a": 40})
    monkeypatch.setattr("chladni.spectral.products.MOST_RESULT_BYTES", 16 * 30**2 * 3)
    monkeypatch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
    with open_log(tmp_path / "a.mcap") as log:
        # Powers alone fit.
        assert chladni.psd(log).values.shape[0] == 40
        monkeypatch.setattr(type(log), "blocks", lambda *_, **__: iter([pytest.fail("read")] for _ in "1"))
        with pytest.raises(EstimateError, match=r"40 channels x 3 lines would take .* fewer channels"):
            chladni.frf(log, references="/a.f0")


def test_many_streams_of_one_grid_are_one_series(tmp_path: Path) -> None:
    write_wide(tmp_path / "a.mcap", {f"/c{number}": 1 for number in range(300)}, messages=8)
    with open_log(tmp_path / "a.mcap") as log:
        (series,) = log.read_groups()
    assert [channel.name for channel in series.channels] == [f"/c{number}.f0" for number in range(300)]
    np.testing.assert_array_equal(series.values, np.tile(np.arange(8) % 7, (300, 1)))


def test_a_field_that_isnt_listed_and_isnt_there_is_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "MOST_LISTED", 2)
    write_wide(tmp_path / "a.mcap", {"/wide": 9})
    with open_log(tmp_path / "a.mcap") as log:
        with pytest.raises(LogError, match="9 fields are too many for a list of 2 channels"):
            log.read()
        with pytest.raises(LogError, match="f12"):
            log.read(["/wide.f12"])


@pytest.mark.parametrize("apart", ["rates", "hours"])
def test_streams_of_other_grids_are_not_compared_with_each_other(
    tmp_path: Path, apart: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    streams = 40
    with LogMaker(tmp_path / "a.mcap") as maker:
        for number in range(streams):
            channel = maker.ros2(f"/c{number}", "t/msg/A", "float64 x")
            period_ns = round(PERIOD_NS * 1.05**number) if apart == "rates" else PERIOD_NS
            begin_ns = number * 3_600_000_000_000 if apart == "hours" else 0
            for place in range(8):
                maker.write(channel, {"x": float(place % 3)}, START_NS + begin_ns + place * period_ns)
    compared = Mock(side_effect=shared_grid._moved_onto)
    monkeypatch.setattr(shared_grid, "_moved_onto", compared)
    with open_log(tmp_path / "a.mcap") as log:
        assert len(log.grids()) == streams
    # All with all would be 780.
    assert compared.call_count < streams


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is read from /proc")
def test_samples_of_many_fields_are_held_once(tmp_path: Path) -> None:
    """Pieces of the log go as their samples are laid out; of the process, since pages count when written to."""
    fields, messages = 10_000, 1500
    schema = {"type": "object", "properties": {f"f{field}": {"type": "number"} for field in range(fields)}}
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.json("/j", schema)
        for place in range(messages):
            maker.write(channel, {f"f{place % fields}": 1.0}, START_NS + place * PERIOD_NS)
    program = (
        "import re, sys\nfrom pathlib import Path\nfrom chladni.io.log import open_log\n"
        "def peak(): return 1024 * int(re.search(r'VmHWM:\\s+(\\d+)', Path('/proc/self/status').read_text())[1])\n"
        "log = open_log(sys.argv[1])\nlog.channels\nbefore = peak()\nvalues = log.read().values\n"
        "print(peak() - before, values.nbytes)"
    )
    told = subprocess.run([sys.executable, "-c", program, str(tmp_path / "a.mcap")], capture_output=True, check=True)
    taken, held = map(int, told.stdout.split())
    assert held == 8 * fields * messages
    # The samples, an eighth as much that says which are valid, a piece, and a page ahead in each row.
    assert taken < 1.75 * held
