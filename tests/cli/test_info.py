import json

import numpy as np
import pytest

from tests.make_logs import START_NS, with_strange_topics, write_stored

CHANNEL_KEYS = {
    "name", "unit", "encoding", "rate_hz", "samples", "stamp", "stamp_reason", "jitter_s",
    "gaps", "duplicates", "clipped", "untimed", "publishers", "rate_std_hz", "breaks", "longest_stretch_s",
}  # fmt: skip


def test_the_document_holds_what_was_promised(run, arm_log):
    document = run("info", arm_log, "--json", "-").document
    assert set(document) == {
        "format",
        "start_time_ns",
        "duration_s",
        "channels",
        "damage",
        "findings",
        "unread",
    }
    assert document["format"] == "chladni.info/1"
    assert document["duration_s"] == pytest.approx(25.0)
    assert [set(channel) for channel in document["channels"]] == [CHANNEL_KEYS] * 6
    assert document["damage"] == []
    force = document["channels"][0]
    assert (force["name"], force["unit"], force["rate_hz"]) == ("/shaker.wrench.force.x", "N", 1000.0)
    assert (force["samples"], force["stamp"], force["gaps"]) == (25_000, "header", [])
    (wrist,) = [channel for channel in document["channels"] if channel["name"].startswith("/wrist")]
    assert wrist["samples"] == 25_000 - 250
    assert wrist["gaps"] == [[pytest.approx(19.999), pytest.approx(20.25)]]


def test_the_table_goes_to_standard_error_when_json_takes_standard_output(run, arm_log):
    outcome = run("info", arm_log, "--json", "-")
    assert "/tool.accel.linear.x" in outcome.err
    assert outcome.document


def test_people_get_a_table_and_findings(run, arm_log, tmp_path):
    outcome = run("info", arm_log, "--json", tmp_path / "info.json")
    assert "/tool.accel.linear.x" in outcome.out
    assert "250 samples missing" in outcome.out
    assert outcome.err == ""
    assert json.loads((tmp_path / "info.json").read_text())["format"] == "chladni.info/1"


def test_a_damaged_log_is_read_as_far_as_it_is_whole(run, arm_log, tmp_path):
    whole = arm_log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) // 2])
    outcome = run("info", cut, "--json", "-")
    assert outcome.code == 0
    document = outcome.document
    assert document["damage"]
    assert all(set(one) == {"what", "where", "lost_messages"} for one in document["damage"])
    assert 5_000 < document["channels"][0]["samples"] < 20_000
    assert "bytes are missing" in outcome.err


def test_the_stamp_can_be_forced(run, arm_log):
    document = run("info", arm_log, "--stamp", "log", "--json", "-").document
    assert {channel["stamp"] for channel in document["channels"]} == {"log"}


def test_a_json_file_that_cannot_be_written_is_told(run, arm_log, tmp_path):
    outcome = run("info", arm_log, "--json", tmp_path / "no-folder" / "info.json")
    assert outcome.code == 2
    assert "no-folder" in outcome.err


def test_many_channels_are_grouped_in_the_table_and_listed_in_the_document(run, tmp_path):
    columns = ",".join(f"a{number} [N]" for number in range(20))
    rows = "".join(f"{row / 100}," + ",".join(f"{(row * 7 + n) % 11}" for n in range(20)) + "\n" for row in range(50))
    (tmp_path / "wide.csv").write_text(f"time [s],{columns}\n{rows}")
    assert run("convert", tmp_path / "wide.csv", tmp_path / "wide.mcap").code == 0
    outcome = run("info", tmp_path / "wide.mcap", "--json", "-")
    assert [channel["name"] for channel in outcome.document["channels"]] == [f"/daq.a{n}" for n in range(20)]
    assert "/daq.{a0..19} " in outcome.err


def test_topics_without_channels_are_in_the_table_and_in_the_document(run, tmp_path):
    log = with_strange_topics(tmp_path / "a.mcap")
    outcome = run("info", log, "--json", "-")
    assert outcome.code == 0
    assert [one["name"] for one in outcome.document["channels"]] == ["/good.x"]
    assert [(one["name"], one["messages"]) for one in outcome.document["unread"]] == [("/bad", 100), ("/text", 100)]
    assert all(set(one) == {"name", "reason", "messages"} for one in outcome.document["unread"])
    table = outcome.err.splitlines()
    assert any(line.startswith("/bad ") and line.endswith("100 messages, not read") for line in table)
    assert any(line.startswith("/text ") and line.endswith("100 messages, no signal") for line in table)
    assert any(line.startswith("- /bad (100 messages): can't be decoded: ") for line in table)


def test_breaks_of_the_clock_are_counted_and_the_longest_stretch_is_told(run, tmp_path):
    number = np.arange(720)
    write_stored(tmp_path / "a.mcap", (number % 12 + 1) * 100_000_000, np.sin(0.2 * np.pi * number))
    outcome = run("info", tmp_path / "a.mcap", "--json", "-")
    (channel,) = outcome.document["channels"]
    assert len(channel["breaks"]) == 59
    # Twelve samples, one that is left out where the clock was set, and the next stretch begins.
    assert channel["breaks"][:2] == [pytest.approx(1.3), pytest.approx(2.6)]
    assert (channel["rate_hz"], channel["longest_stretch_s"]) == (10.0, pytest.approx(1.2))
    assert (channel["gaps"], channel["duplicates"], channel["jitter_s"]) == ([], 0, pytest.approx(0.0, abs=1e-9))
    assert outcome.document["duration_s"] == pytest.approx(72.0)
    assert "59 breaks" in outcome.err
    assert "the longest stretch is 1.2 s" in outcome.err


def test_ticks_coarser_than_the_sampling_cost_no_sample(run, tmp_path):
    number = np.arange(6240)
    when = START_NS + np.floor(number / 1.04).astype(np.int64) * 10_000_000
    write_stored(tmp_path / "a.mcap", when, np.sin(2 * np.pi * 10 / 104 * number))
    outcome = run("info", tmp_path / "a.mcap", "--json", "-")
    (channel,) = outcome.document["channels"]
    assert (channel["rate_hz"], channel["duplicates"], channel["samples"]) == (104.0, 0, 6240)
    # A tick of 10 ms, white over 6240 samples.
    assert channel["rate_std_hz"] == pytest.approx(104**2 * 0.01 / 6240**1.5, rel=0.2)
    assert "their rate is 104 Hz, give or take" in outcome.err


def test_a_rate_that_stamps_dont_tell_can_be_stated(run, tmp_path):
    lost = np.flatnonzero(np.random.default_rng(1).random(5000) > 0.02)
    write_stored(tmp_path / "a.mcap", START_NS + lost // 10 * 10_000_000, lost * 1.0)
    refused = run("info", tmp_path / "a.mcap", "--json", "-")
    assert refused.document["channels"][0]["longest_stretch_s"] is None
    assert "--rate HZ" in refused.err
    stated = run("info", tmp_path / "a.mcap", "--rate", 1000, "--json", "-")
    assert stated.document["channels"][0]["rate_hz"] == 1000.0
    assert run("info", tmp_path / "a.mcap", "--rate", -3).code == 2
