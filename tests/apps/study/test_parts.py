"""A log that many workers share: the rows of the study are those of one worker."""

from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chladni
from chladni.apps.study import study
from chladni.apps.study.parts import LARGE_BYTES, PART_BYTES, PartTask, Sums, parts_of, sum_part
from chladni.io.study.logs import LogAddress
from chladni.io.study.recipe import Recipe, load_recipe
from chladni.signals.errors import LogError
from tests.apps.study.logs import write_log

pytest.importorskip("distributed")
pytest.importorskip("duckdb")

# Steps that are sums, and two that one worker does alone.
RECIPE = """\
format = "chladni.study/1"
[info]
[psd]
resolution_hz = 2.0
[frf]
references = ["/root.x"]
[modes]
operational = true
channels = ["/tip.x", "/root.x"]
band_hz = [60, 120]
[levels]
bands_hz = [[20, 60]]
"""


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    from distributed import Client

    quiet: dict[str, Any] = {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
    with Client(n_workers=1, threads_per_worker=1, processes=False, **quiet) as client:
        yield client


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_log(tmp_path / "long.mcap", seconds=12.0)


@pytest.fixture
def recipe(tmp_path: Path) -> Recipe:
    path = tmp_path / "recipe.toml"
    path.write_text(RECIPE)
    return load_recipe(path)


def values(row: Any) -> tuple[list[float], list[Any]]:
    """Part a table's cells in numbers and words."""
    if isinstance(row, float):
        return [row], []
    if not isinstance(row, dict | list):
        return [], [row]
    inside = [values(one) for one in (row.values() if isinstance(row, dict) else row)]
    return [one for numbers, _ in inside for one in numbers], [one for _, words in inside for one in words]


def test_rows_of_a_shared_log_are_those_of_one_worker(
    client: Any, log: Path, recipe: Recipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    summed = []
    share = study.share
    monkeypatch.setattr(study, "share", lambda *words: summed.append(share(*words)) or summed[-1])
    for name, parts in (("one", 1), ("three", 3)):
        monkeypatch.setattr(study, "parts_of", lambda *_, parts=parts: parts)
        report = study.run_study(recipe, [str(log)], tmp_path / name, connect=partial(nullcontext, client))
        assert (report.done, report.failures) == (1, [])
    [parts] = summed
    assert [len(one.told) for one in parts] == [3, 3, 3]
    one, three = chladni.results(tmp_path / "one"), chladni.results(tmp_path / "three")
    for table in ("logs", "channels", "peaks", "modes", "levels", "findings"):
        numbers, words = values(one.table(table).to_pylist())
        found, told = values(three.table(table).to_pylist())
        assert told == words, table
        # A mean of what a filter passed is rounding beside its RMS.
        np.testing.assert_allclose(found, numbers, rtol=1e-12, atol=1e-14, err_msg=table)


def test_a_log_that_changed_while_it_was_shared_is_done_by_one(
    client: Any, log: Path, recipe: Recipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    share = study.share

    def then_changed(*words: Any) -> tuple[Sums, ...]:
        sums: tuple[Sums, ...] = share(*words)
        write_log(log, seconds=8.0, seed=3)
        return sums

    monkeypatch.setattr(study, "parts_of", lambda *_: 2)
    monkeypatch.setattr(study, "share", then_changed)
    run = partial(study.run_study, recipe, [str(log)], connect=partial(nullcontext, client))
    assert not run(tmp_path / "out").failures
    monkeypatch.undo()
    assert not run(tmp_path / "whole").failures
    files = [{path.relative_to(out): path.read_bytes() for path in out.glob("*/day=*/*")}
             for out in (tmp_path / "out", tmp_path / "whole")]  # fmt: skip
    assert files[0] == files[1]


def test_a_log_is_shared_by_workers_that_came_after_the_start(
    client: Any, log: Path, recipe: Recipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = write_log(tmp_path / "short.mcap", seconds=4.0)
    monkeypatch.setattr("chladni.apps.study.parts.LARGE_BYTES", log.stat().st_size)
    monkeypatch.setattr("chladni.apps.study.parts.PART_BYTES", 1)
    monkeypatch.setattr("chladni.apps.study.engine.ASK_EVERY_S", 0.0)
    asked, shared = iter([{}]), []
    monkeypatch.setattr(client, "nthreads", lambda: next(asked, {"a worker": 2}))
    share = study.share
    monkeypatch.setattr(study, "share", lambda *words: shared.append(words[2:]) or share(*words))
    report = study.run_study(recipe, [str(short), str(log)], tmp_path / "out", connect=partial(nullcontext, client))
    assert (report.done, report.failures) == (2, [])
    assert shared == [(str(log), 2)]


def test_why_a_log_cant_be_shared_is_told(recipe: Recipe, tmp_path: Path) -> None:
    sums = Sums.of(sum_part(recipe.to_json(), [PartTask(str(tmp_path / "none.mcap"), 0, 2)]))
    assert "none.mcap" in sums.why_whole


def test_large_logs_are_shared_and_others_arent() -> None:
    log = partial(LogAddress, url="/data/a.mcap")
    assert parts_of(log(size_bytes=LARGE_BYTES - 1), ["psd"], 8) == 1
    assert parts_of(log(size_bytes=LARGE_BYTES), ["psd"], 8) == LARGE_BYTES // PART_BYTES
    assert parts_of(log(size_bytes=100 * LARGE_BYTES), ["info", "levels"], 8) == 8
    assert parts_of(log(size_bytes=100 * LARGE_BYTES), ["info", "modes"], 8) == 1
    assert parts_of(LogAddress(url="/data/a.csv", size_bytes=100 * LARGE_BYTES), ["psd"], 8) == 1


def test_damaged_sums_are_refused(recipe: Recipe, log: Path) -> None:
    content = sum_part(recipe.to_json(), [PartTask(str(log), 0, 2)])
    assert set(Sums.of(content).told) == {"psd//tip.x", "frf//tip.x", "levels//tip.x"}
    for damaged in (b"", content[:100], content[: len(content) // 2], b"PK" + content[3:]):
        with pytest.raises(LogError, match="sums of a part are damaged"):
            Sums.of(damaged)


def test_sums_of_another_kind_are_refused() -> None:
    file = BytesIO()
    np.savez(file, np.frombuffer(b'{"names": [], "told": {"psd//tip.x": {"samples": 8}}}', np.uint8))
    with pytest.raises(LogError, match="sums of a part are damaged"):
        Sums.of(file.getvalue())
