"""``chladni query``: answers as tables, JSON and CSV; what it refuses, in one line."""

import json
from pathlib import Path

import pytest

from chladni.cli.main import main
from tests.apps.study.test_trends import write_year

pytest.importorskip("duckdb")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("study") / "out"
    write_year(out, days=2)
    return out


def test_text_begins_at_the_left_and_numbers_end_at_the_right(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sql = "select 1000 * row_number() over (order by log) as n, log, status from logs order by log"
    written, table = tmp_path / "answer.json", tmp_path / "answer.csv"
    assert main(["query", str(study), sql, "--json", str(written), "--csv", str(table)]) == 0
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert lines[0] == "2 rows"
    assert lines[1] == "   n  log               status"
    assert lines[3:5] == ["1000  /bridge/000.mcap  done", "2000  /bridge/001.mcap  done"]
    document = json.loads(written.read_text())
    assert document["rows"][0] == {"n": 1000, "log": "/bridge/000.mcap", "status": "done"}
    assert table.read_text().splitlines()[1].split(",") == ["1000", "/bridge/000.mcap", "done"]


@pytest.mark.parametrize(
    ("sql", "words"),
    [
        ("select * from nope", "Table with name nope does not exist"),
        ("copy logs to 'x.csv'", "file system operations are disabled"),
        ("select * from read_csv('/etc/passwd')", "file system operations are disabled"),
    ],
)
def test_what_a_question_may_not_do_is_one_line(
    study: Path, capsys: pytest.CaptureFixture[str], sql: str, words: str
) -> None:
    assert main(["query", str(study), sql]) != 0
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("chladni: the question can't be answered: ")
    assert words in line
