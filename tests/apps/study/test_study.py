"""Studies against the single commands: the same documents, the same rows, whatever goes wrong on the way."""

import os
import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import chladni
from chladni.apps.study.study import run_study
from chladni.cli.main import main
from chladni.io.study.logs import find_logs
from chladni.io.study.recipe import load_recipe
from chladni.signals.errors import SetupError
from tests.apps.study.logs import DAY_NS, START_NS, write_log

pytest.importorskip("distributed")
pytest.importorskip("duckdb")

RECIPE = """\
format = "chladni.study/1"
documents = true
[info]
[psd]
resolution_hz = 2.0
[frf]
references = ["/root.x"]
responses = ["/tip.x"]
[modes]
operational = true
channels = ["/tip.x", "/root.x"]
band_hz = [60, 120]
[levels]
channels = ["/tip.x"]
"""


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of one day and one of the next; one that was cut, one that is none."""
    folder = tmp_path_factory.mktemp("logs")
    for number, start_ns in enumerate((START_NS, START_NS + 3600 * 10**9, START_NS + DAY_NS)):
        write_log(folder / f"run{number}.mcap", seed=number, start_ns=start_ns)
    (folder / "cut.mcap").write_bytes((folder / "run0.mcap").read_bytes()[:300])
    (folder / "words.csv").write_text("no numbers\n")
    return folder


@pytest.fixture(scope="module")
def recipe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recipe") / "recipe.toml"
    path.write_text(RECIPE)
    return path


@pytest.fixture(scope="module")
def found(client: Any, logs: Path, recipe: Path, tmp_path_factory: pytest.TempPathFactory) -> "chladni.StudyResults":
    out = tmp_path_factory.mktemp("study") / "out"
    report = run_study(load_recipe(recipe), [str(logs)], out, connect=partial(nullcontext, client))
    assert (report.logs, report.done, report.there) == (5, 5, 0)
    assert (report.unread, report.damaged) == (1, 1)
    return chladni.results(out)


def rows(found: "chladni.StudyResults", table: str, log: Path) -> list[dict[str, Any]]:
    return [row for row in found.table(table).to_pylist() if row["log"] == str(log)]


COMMANDS = {
    "info": [],
    "psd": ["--resolution", "2.0"],
    "frf": ["--reference", "/root.x", "--response", "/tip.x"],
    "modes": ["--operational", "--channel", "/tip.x", "--channel", "/root.x", "--band", "60-120"],
    "levels": ["--channel", "/tip.x"],
}


@pytest.mark.parametrize("step", COMMANDS)
def test_a_document_is_the_commands_to_the_byte(
    step: str, found: "chladni.StudyResults", logs: Path, tmp_path: Path
) -> None:
    log, target = logs / "run1.mcap", tmp_path / "single.json"
    assert main([step, str(log), *COMMANDS[step], "--json", str(target)]) == 0
    [document] = [row["document"] for row in rows(found, "documents", log) if row["step"] == step]
    assert document == target.read_text()


def test_rows_are_the_numbers_of_single_verbs(found: "chladni.StudyResults", logs: Path) -> None:
    log = logs / "run2.mcap"
    modes = chladni.identify_modes(
        chladni.open(log), operational=True, responses=["/tip.x", "/root.x"], band_hz=(60, 120)
    )
    told = rows(found, "modes", log)
    assert [row["frequency_hz"] for row in told] == modes.frequency_hz.tolist()
    assert [row["shape_real"] for row in told] == modes.shapes.real.tolist()
    assert any(abs(row["frequency_hz"] - 90) < 1 for row in told)
    peaks = chladni.find_peaks(chladni.psd(log, resolution_hz=2.0, channels="/tip.x"))
    told = [row for row in rows(found, "peaks", log) if (row["step"], row["channel"]) == ("psd", "/tip.x")]
    assert [(row["frequency_hz"], row["height"]) for row in told] == [(one.frequency_hz, one.height) for one in peaks]
    levels = chladni.levels(log, channels="/tip.x")
    assert [row["rms"] for row in rows(found, "levels", log)] == levels.rms[:, 0].tolist()


def test_a_bad_log_is_a_row_with_its_reason(found: "chladni.StudyResults", logs: Path) -> None:
    status = {Path(row["log"]).name: row["status"] for row in found.table("logs").to_pylist()}
    assert status == {"run0.mcap": "done", "run1.mcap": "done", "run2.mcap": "done", "cut.mcap": "partly",
                      "words.csv": "failed"}  # fmt: skip
    [row] = rows(found, "failures", logs / "words.csv")
    assert (row["step"], row["kind"]) == ("open", "log")
    assert "words.csv" in row["reason"]


def test_what_opens_data_files_leaves_other_logs_alone_and_advice_names_keys(
    client: Any, logs: Path, tmp_path: Path
) -> None:
    folder, recipe = tmp_path / "logs", tmp_path / "recipe.toml"
    folder.mkdir()
    shutil.copy(logs / "run0.mcap", folder)
    (folder / "table.csv").write_text("clock,x\n" + "".join(f"{n / 100:g},{n % 7}\n" for n in range(500)))
    recipe.write_text('format = "chladni.study/1"\n[info]\n')
    first = run_study(load_recipe(recipe), [str(folder)], tmp_path / "first", connect=partial(nullcontext, client))
    [(_, step, reason)] = first.failures
    assert step == "open"
    assert "[open] time" in reason
    assert "--" not in reason
    assert (first.done, first.unread, first.damaged) == (2, 1, 0)
    recipe.write_text('format = "chladni.study/1"\n[open]\ntime = "clock"\ntime_unit = "s"\n[info]\n')
    assert not run_study(
        load_recipe(recipe), [str(folder)], tmp_path / "second", connect=partial(nullcontext, client)
    ).failures
    rates = {row["rate_hz"] for row in chladni.results(tmp_path / "second").table("channels").to_pylist()}
    assert {round(rate) for rate in rates} == {100, 400}


def test_tables_are_parted_by_day(found: "chladni.StudyResults") -> None:
    days = {path.parent.name for path in (found.path / "modes").glob("*/*.parquet")}
    assert days == {"day=2023-11-14", "day=2023-11-15"}
    # DuckDB on its own, without our help, as a user's notebook would.
    import duckdb

    logs = duckdb.read_parquet(f"{found.path}/logs/*/*.parquet", hive_partitioning=True)
    told = logs.filter("status = 'done'").aggregate("day, count(distinct log)").order("day").fetchall()
    assert [(str(day), count) for day, count in told] == [("2023-11-14", 2), ("2023-11-15", 1)]


def test_a_study_that_is_begun_again_does_what_is_new_alone(
    client: Any, recipe: Path, logs: Path, tmp_path: Path
) -> None:
    folder, out = tmp_path / "logs", tmp_path / "out"
    shutil.copytree(logs, folder)
    loaded = load_recipe(recipe)
    whole = run_study(loaded, [str(folder)], tmp_path / "whole", connect=partial(nullcontext, client))
    assert whole.done == 5
    assert run_study(loaded, [str(folder / "run0.mcap")], out, connect=partial(nullcontext, client)).done == 1
    again = run_study(loaded, [str(folder)], out, connect=partial(nullcontext, client))
    # The text without numbers was read, and says the same as ever: it isn't tried again.
    assert (again.there, again.done) == (1, 4)
    assert files(out) == files(tmp_path / "whole")
    last = run_study(loaded, [str(folder)], out, connect=partial(nullcontext, client))
    assert (last.there, last.done, last.unchanged) == (5, 0, 0)
    # Written anew with the same content: read, and found to be known.
    content = (folder / "run1.mcap").read_bytes()
    (folder / "run1.mcap").write_bytes(content)
    touched = run_study(loaded, [str(folder)], out, connect=partial(nullcontext, client))
    assert (touched.there, touched.done, touched.unchanged) == (4, 0, 1)
    # Another content of the same name: its old rows go, from the old day, too.
    write_log(folder / "run1.mcap", seed=9, start_ns=START_NS + 5 * DAY_NS)
    assert run_study(loaded, [str(folder)], out, connect=partial(nullcontext, client)).done == 1
    [row] = rows(chladni.results(out), "logs", folder / "run1.mcap")
    assert str(row["day"]) == "2023-11-19"
    assert {row["day"] for row in rows(chladni.results(out), "peaks", folder / "run1.mcap")} == {row["day"]}


def files(out: Path) -> dict[str, bytes]:
    return {str(path.relative_to(out)): path.read_bytes() for path in out.glob("*/day=*/*.parquet")}


def test_what_a_crash_left_in_the_journal_is_in_the_tables_afterwards(
    client: Any, recipe: Path, logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from chladni.io.study.folder import StudyFolder

    loaded, out = load_recipe(recipe), tmp_path / "out"

    class Killed(BaseException):
        pass

    def die(*_: Any, **__: Any) -> None:
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(StudyFolder, "_rewrite_day", die)
        with pytest.raises(Killed):
            run_study(loaded, [str(logs)], out, connect=partial(nullcontext, client))
    assert not list(out.glob("logs/*/*.parquet"))
    again = run_study(loaded, [str(logs)], out, connect=partial(nullcontext, client))
    # Stamps were lost with the crash: the logs are read, and found to be what was done.
    assert again.done == 0
    assert len(chladni.results(out).table("logs")) == 5
    assert not list((out / ".study" / "journal").iterdir())


def test_paths_that_arent_there_are_refused_before_anything_is_done(
    recipe: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, names = tmp_path / "out", [str(logs / f"{name}.mcap") for name in ("run9", "run1", "rnu0")]
    assert main(["study", str(recipe), *names, "--out", str(out)]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert f"{names[0]}, {names[2]}: no such file or folder" in line
    assert not out.exists()


def test_a_link_to_nothing_in_a_folder_of_logs_is_a_row(
    client: Any, recipe: Path, logs: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    (folder / "run1.mcap").symlink_to(logs / "run1.mcap")
    (folder / "gone.mcap").symlink_to(logs / "gone.mcap")
    report = run_study(load_recipe(recipe), [str(folder)], tmp_path / "out", connect=partial(nullcontext, client))
    assert (report.done, report.unread) == (2, 1)
    [(log, step, reason)] = report.failures
    assert (log, step) == (str(folder / "gone.mcap"), "read")
    assert "no such file" in reason


def test_a_folder_belongs_to_one_recipe(client: Any, found: "chladni.StudyResults", tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text(RECIPE.replace("2.0", "4.0"))
    with pytest.raises(SetupError, match="holds results of another recipe"):
        run_study(load_recipe(other), [], found.path, connect=partial(nullcontext, client))
    # How results are followed decides no row.
    followed = tmp_path / "followed.toml"
    followed.write_text(RECIPE + "[trend]\nleast_mac = 0.9\n")
    run_study(load_recipe(followed), [], found.path, connect=partial(nullcontext, client))


def test_logs_come_out_of_any_store(client: Any, recipe: Path, logs: Path, tmp_path: Path) -> None:
    fsspec = pytest.importorskip("fsspec")
    store = fsspec.filesystem("memory")
    store.pipe("/bridge/run1.mcap", (logs / "run1.mcap").read_bytes())
    store.pipe("/bridge/read.me", b"no log")
    words = ["memory://bridge/*.mcap", "memory://bridge"]
    assert [one.url for one in find_logs(words)] == ["memory://bridge/run1.mcap"]
    run_study(load_recipe(recipe), words, tmp_path / "out", connect=partial(nullcontext, client))
    stored = chladni.results(tmp_path / "out")
    run_study(load_recipe(recipe), [str(logs / "run1.mcap")], tmp_path / "disk", connect=partial(nullcontext, client))
    disk = chladni.results(tmp_path / "disk")
    for table in ("channels", "peaks", "modes", "documents", "findings"):
        assert stored.table(table).drop_columns("log").equals(disk.table(table).drop_columns("log"))


def test_a_store_that_is_gone_is_a_row_and_tried_again(client: Any, recipe: Path, logs: Path, tmp_path: Path) -> None:
    fsspec = pytest.importorskip("fsspec")
    store = fsspec.filesystem("memory")
    store.pipe("/fleet/run1.mcap", (logs / "run1.mcap").read_bytes())
    words = ["memory://fleet/run1.mcap"]

    @contextmanager
    def too_late() -> Iterator[Any]:
        # Workers are asked for when the logs have been listed.
        store.rm("/fleet/run1.mcap")
        yield client

    first = run_study(load_recipe(recipe), words, tmp_path / "out", connect=too_late)
    assert [(step, "can't be fetched" in why) for _, step, why in first.failures] == [("read", True)]
    store.pipe("/fleet/run1.mcap", (logs / "run1.mcap").read_bytes())
    second = run_study(load_recipe(recipe), words, tmp_path / "out", connect=partial(nullcontext, client))
    assert (second.done, second.failures) == (1, [])
    assert not len(chladni.results(tmp_path / "out").table("failures"))


def test_withheld_cases_run_on_the_same_cluster(client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from chladni.apps import blind
    from chladni_withheld.campaign import make_cases

    make_cases(tmp_path, count=2, seed=3, kinds=["none=1"])

    def judged(model: Path, logs: Any, *, leave_out: frozenset[str], seed: int) -> dict[str, object]:
        assert model.is_file()
        return {"format": "chladni.gap/1", "seed": seed, "logs": len(logs), "without": sorted(leave_out)}

    monkeypatch.setattr(blind, "diagnosis_json", judged)
    report = blind.run_campaign(tmp_path, seed=5, connect=partial(nullcontext, client))
    assert (report.done, report.there, report.failed) == (2, 0, ())
    assert len(list((tmp_path / "results").glob("case-*.json"))) == 2
    assert blind.run_campaign(tmp_path, connect=partial(nullcontext, client)).there == 2


@pytest.mark.nightly
def test_a_worker_that_was_ended_is_started_again() -> None:
    from chladni.apps.study.cluster import cluster

    with cluster(workers=1) as own:
        [first] = own.run(os.getpid).values()
        os.kill(first, 9)
        deadline = time.monotonic() + 120
        # The scheduler needs a moment to see that it's gone.
        time.sleep(2)
        while not own.nthreads() and time.monotonic() < deadline:
            time.sleep(0.5)
        [second] = own.run(os.getpid).values()
        assert second != first
        # It's a fork of what has imported all that work takes: none of it is imported again.
        [loaded] = own.run(lambda: "chladni.apps.study.work" in sys.modules).values()
        assert loaded
