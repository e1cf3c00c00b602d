"""Tables on the wire, and SQL that sees the tables of a study and nothing else."""

import json
from pathlib import Path

import pyarrow as pa
import pytest

from chladni.io.study.folder import opened_folder
from chladni.io.study.results import StudyResults, plain_rows, results, write_answer
from chladni.io.study.tables import SCHEMAS, packed, table_of, tables_of, unpacked
from chladni.signals.errors import EstimateError, LogError, SetupError

pytest.importorskip("duckdb")


@pytest.fixture
def found(tmp_path: Path) -> StudyResults:
    rows = [{"log": f"run{number}", "content": "ab", "status": "done"} for number in range(3)]
    with opened_folder(tmp_path / "out", "id", "recipe") as folder:
        folder.take(packed(tables_of({"logs": rows})), {}, source="a test")
        folder.settle()
    return results(tmp_path / "out")


def test_sql_reads_the_tables(found: StudyResults, tmp_path: Path) -> None:
    answer = found.query("select log, status from logs where log > 'run0' order by log")
    assert plain_rows(answer) == [{"log": "run1", "status": "done"}, {"log": "run2", "status": "done"}]
    assert write_answer(tmp_path / "a.csv", answer).read_text().split() == ["log,status", "run1,done", "run2,done"]
    # A table that nothing was asked for is there, and empty.
    assert found.query("select count(*) as n from modes").to_pylist() == [{"n": 0}]


@pytest.mark.parametrize(
    "sql",
    [
        "select * from read_text('{path}')",
        "select * from read_parquet('{path}/logs/*/*.parquet')",
        "select * from '{path}/study.json'",
        "copy logs to '{path}/stolen.csv'",
        "attach '{path}/other.db'",
        "install httpfs",
        "load httpfs",
        "set enable_external_access = true",
        "set lock_configuration = false",
        "set allowed_directories = ['/']",
        "select * from secret",
        "export database '{path}/all'",
    ],
)
def test_sql_reaches_nothing_else(sql: str, found: StudyResults) -> None:
    # A variable of this name is what DuckDB would take for a table.
    secret = pa.table({"key": ["hidden"]})
    before = sorted(found.path.rglob("*"))
    with pytest.raises(SetupError, match="the question can't be answered"):
        found.query(sql.format(path=found.path))
    assert sorted(found.path.rglob("*")) == before
    assert secret.num_rows == 1


def test_an_answer_whose_columns_would_hide_each_other_is_refused(found: StudyResults) -> None:
    with pytest.raises(EstimateError, match="two columns of the answer have one name"):
        plain_rows(found.query("select a.log, b.log from logs a, logs b"))


def test_tables_come_back_from_the_wire() -> None:
    sent = tables_of({"failures": [{"log": "a", "step": "open", "kind": "log", "reason": "\ud800 broken"}]})
    [got] = unpacked(packed(sent), source="a test")["failures"].to_pylist()
    assert got == {"log": "a", "day": None, "step": "open", "kind": "log", "reason": "\\ud800 broken"}


@pytest.mark.parametrize("content", [b"", b"no tables", b"\xff" * 64])
def test_what_is_no_answer_is_refused(content: bytes) -> None:
    with pytest.raises(LogError, match="a test: holds no tables of a study"):
        unpacked(content, source="a test")


def test_a_damaged_answer_is_refused_or_is_sound_tables() -> None:
    whole = packed(tables_of({"logs": [{"log": "a" * 50, "content": "b", "status": "done"}]}))
    refused, tried = 0, range(0, len(whole), 7)
    for place in tried:
        broken = whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :]
        try:
            found = unpacked(broken, source="a test")
        except LogError:
            refused += 1
            continue
        # Another letter is still text; what is read must be whole for all that.
        for name, table in found.items():
            assert table.schema.equals(SCHEMAS[name])
            table.validate(full=True)
            table.to_pylist()
    assert len(tried) / 10 < refused < len(tried)


def test_a_column_that_a_table_lacks_is_refused() -> None:
    with pytest.raises(KeyError, match="has no column colour"):
        table_of("logs", [{"log": "a", "colour": "red"}])


def test_one_program_at_a_time_writes(tmp_path: Path) -> None:
    with (
        opened_folder(tmp_path / "out", "id", "recipe"),
        pytest.raises(SetupError, match="another program is at work"),
        opened_folder(tmp_path / "out", "id", "recipe"),
    ):
        pass


def test_a_folder_of_other_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.doc").write_text("years of work")
    with pytest.raises(SetupError, match="holds files, and no study"), opened_folder(tmp_path, "id", "recipe"):
        pass
    assert [one.name for one in tmp_path.iterdir()] == ["thesis.doc"]
    (tmp_path / "study.json").write_text(json.dumps({"format": "other/1"}))
    with pytest.raises(SetupError, match=r"isn't of format chladni\.study-results/1"):
        results(tmp_path)
    with pytest.raises(SetupError, match="is no folder of a study"):
        results(tmp_path / "none")
