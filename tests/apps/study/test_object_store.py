"""Studies out of an object store that speaks S3, on this machine."""

from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import chladni
from chladni.apps.study.study import run_study
from chladni.io.study.logs import StoreError
from chladni.io.study.recipe import load_recipe
from chladni.signals.errors import SetupError
from tests.apps.study.logs import write_log

pytestmark = pytest.mark.nightly
moto = pytest.importorskip("moto.server")
s3fs = pytest.importorskip("s3fs")
distributed = pytest.importorskip("distributed")
pytest.importorskip("duckdb")

BUCKET = "bridge"


@pytest.fixture
def store(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Serve buckets on 127.0.0.1, to this process alone, by the variables that a user sets."""
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    address = f"http://127.0.0.1:{server.get_host_and_port()[1]}"
    for name, value in {
        "AWS_ENDPOINT_URL": address, "AWS_ACCESS_KEY_ID": "none", "AWS_SECRET_ACCESS_KEY": "none",
        "AWS_DEFAULT_REGION": "us-east-1", "AWS_REGION": "us-east-1",
    }.items():  # fmt: skip
        monkeypatch.setenv(name, value)
    s3fs.S3FileSystem.clear_instance_cache()
    files = s3fs.S3FileSystem()
    files.mkdir(BUCKET)
    yield files
    files.rm(BUCKET, recursive=True)
    s3fs.S3FileSystem.clear_instance_cache()
    server.stop()


@pytest.fixture
def client() -> Iterator[Any]:
    quiet: dict[str, Any] = {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
    with distributed.Client(n_workers=1, threads_per_worker=1, processes=False, **quiet) as client:
        yield client


def test_logs_of_a_bucket_give_the_rows_of_those_on_disk(store: Any, client: Any, tmp_path: Path) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('format = "chladni.study/1"\n[info]\n[psd]\n[levels]\n')
    local = [write_log(tmp_path / f"run{number}.mcap", seed=number) for number in range(3)]
    for number, path in enumerate(local):
        store.put(str(path), f"{BUCKET}/2026-05/day {number}/{path.name}")
    store.pipe(f"{BUCKET}/2026-05/read.me", b"no log")
    run = partial(run_study, load_recipe(recipe), connect=partial(nullcontext, client))

    first = run([f"s3://{BUCKET}/2026-05"], tmp_path / "store")
    assert (first.done, first.failures) == (3, [])
    disk = run([str(path) for path in local], tmp_path / "disk")
    assert (disk.done, disk.failures) == (3, [])
    sql = "select regexp_extract(log, 'run.') as run, channel, rms, kurtosis from levels order by all"
    asked = [chladni.results(tmp_path / name).query(sql).to_pylist() for name in ("store", "disk")]
    assert asked[0] == asked[1]
    assert len(asked[0]) == 9

    # What is as it was isn't fetched again; what was written anew is, and a pattern finds it.
    assert run([f"s3://{BUCKET}/2026-05/*/*.mcap"], tmp_path / "store").there == 3
    store.put(str(local[2]), f"{BUCKET}/2026-05/day 0/run0.mcap")
    again = run([f"s3://{BUCKET}/2026-05"], tmp_path / "store")
    assert (again.there, again.done) == (2, 1)


def test_what_a_store_refuses_is_told_with_its_address(store: Any, client: Any, tmp_path: Path) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('format = "chladni.study/1"\n[info]\n')
    run = partial(run_study, load_recipe(recipe), connect=partial(nullcontext, client))
    with pytest.raises(SetupError, match=r"s3://nowhere/a\.mcap: no such log"):
        run(["s3://nowhere/a.mcap"], tmp_path / "none")
    with pytest.raises((SetupError, StoreError), match=rf"s3://{BUCKET}/\*\.mcap"):
        run([f"s3://{BUCKET}/*.mcap"], tmp_path / "none")
