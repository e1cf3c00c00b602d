import numpy as np
import pytest

import chladni
from chladni.cli.convert import parse_options
from tests.arm import TOOL


def test_there_and_back(run, arm_log, tmp_path):
    table, again = tmp_path / "tool.csv", tmp_path / "again.mcap"
    written = run("convert", arm_log, table, "--channel", TOOL, "--end", 2)
    assert written.out.startswith(f"wrote {table}: 1 channel, samples: 2 000, 2 s")
    document = run("convert", table, again, "--json", "-").document
    assert document["format"] == "chladni.convert/1"
    assert document["samples"] == 2000
    with chladni.open_log(arm_log) as first, chladni.open_log(again) as second:
        np.testing.assert_array_equal(second.read().values, first.read([TOOL], end_s=2).values)


def test_an_existing_file_is_kept_unless_told(run, arm_log, tmp_path):
    target = tmp_path / "a.csv"
    target.write_text("mine")
    outcome = run("convert", arm_log, target, "--channel", TOOL)
    assert outcome.code == 2
    assert "exists already" in outcome.err
    assert target.read_text() == "mine"
    assert run("convert", arm_log, target, "--channel", TOOL, "--end", 1, "--overwrite").code == 0
    assert target.read_text() != "mine"


def test_options_of_the_file_kinds(run, tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("0,1.5\n1,2.5\n2,3.5\n3,2.5\n")
    outcome = run("convert", table, tmp_path / "a.mcap", "--time-unit", "ms", "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["duration_s"] == pytest.approx(0.004)


@pytest.mark.parametrize("text", ["unit", "=3", "a b=3"])
def test_an_option_that_is_no_pair_is_told(run, arm_log, tmp_path, text):
    outcome = run("convert", arm_log, tmp_path / "a.csv", "--read", text)
    assert outcome.code == 2
    assert "NAME=VALUE" in outcome.err


def test_values_are_read_as_what_they_look_like():
    assert parse_options(["a=1.5", "b=TRUE", "c=10 V"], "--read") == {"a": 1.5, "b": True, "c": "10 V"}


def test_columns_of_a_table_without_titles_get_names_and_units(run, tmp_path):
    table, target = tmp_path / "a.csv", tmp_path / "a.mcap"
    table.write_text("0,1.5,7\n1,2.5,8\n2,3.5,9\n3,2.5,8\n")
    refused = run("convert", table, target)
    assert refused.code == 2
    assert "--time NAME --time-unit s" in refused.err
    options = ("--time-unit", "ms", "--read", "names=t,force, tip", "--read", "units=force:N,tip:g")
    assert run("convert", table, target, *options).code == 0
    with chladni.open_log(target) as log:
        assert [(channel.name, channel.unit) for channel in log.channels] == [
            ("/daq.force", "N"),
            ("/daq.tip", "m/s^2"),
        ]
        np.testing.assert_allclose(log.read().values[1], np.array([7, 8, 9, 8]) * 9.80665)


def test_what_is_not_read_is_told(run, tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("n,state,a\n" + "".join(f"{index * 5},on,{index % 7}\n" for index in range(60)))
    outcome = run("convert", table, tmp_path / "a.npz", "--time", "n", "--time-unit", "ms")
    assert outcome.code == 0, outcome.err
    assert "state: not read: text, such as 'on'" in outcome.out
    document = run("convert", table, tmp_path / "b.npz", "--time", "n", "--time-unit", "ms", "--json", "-").document
    assert document["unread"] == [{"name": "state", "reason": "not read: text, such as 'on'", "messages": None}]
    # The advice of a refusal, followed.
    assert run("convert", table, tmp_path / "c.npz").code == 2
    assert run("convert", table, tmp_path / "c.npz", "--time", "none", "--rate", 200).code == 0


def test_units_that_are_no_pairs_are_told(run, tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("t [s],a\n0,1\n1,2\n")
    outcome = run("convert", table, tmp_path / "a.mcap", "--read", "units=N,m")
    assert outcome.code == 2
    assert "COLUMN:UNIT" in outcome.err
    assert outcome.err.count("\n") == 1
