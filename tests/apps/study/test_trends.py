"""Trends of a made-up bridge: temperature, a loss of stiffness, a louder machine; limits and baselines."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chladni
from chladni.apps.study.limits import judge
from chladni.apps.study.trends import Trends, follow, trend_sentences, trends_document
from chladni.cli.main import main
from chladni.io.study.folder import opened_folder
from chladni.io.study.recipe import load_recipe
from chladni.io.study.recipe_file import LimitTable, TrendTable
from chladni.io.study.tables import packed, tables_of
from tests.apps.study.logs import START_NS

pytest.importorskip("duckdb")

Made = Callable[..., Trends]
DAYS, DAMAGED, LOUD = 200, 120, 160
# Hours stand for days: files of fewer days are sooner written.
HOUR_NS = 3600 * 10**9


def write_year(
    out: Path, *, seed: int = 0, damage: float = 0.006, louder: float = 0.6, shift: float = 0.0, days: int = DAYS
) -> None:
    """Write the tables of a study of a log a day: two modes near each other, one of them often missed."""
    rng = np.random.default_rng(seed)
    rows: dict[str, list[dict[str, Any]]] = {"logs": [], "modes": [], "levels": [], "peaks": []}
    for day in range(days):
        begins = START_NS + day * HOUR_NS
        start = {"log": f"/bridge/{day:03d}.mcap", "day": datetime.fromtimestamp(begins / 1e9, UTC).date()}
        warm = 12 * np.sin(2 * np.pi * day / DAYS) + 3 * rng.standard_normal()
        rows["logs"].append({**start, "content": str(day), "status": "done", "begins": begins})
        rows["levels"].append(
            {**start, "channel": "/air.t", "unit": "K", "low_hz": 0.0, "high_hz": 50.0, "mean": 283 + warm}
        )
        loud = 1 + (louder if day >= LOUD else 0.0) + 0.05 * rng.standard_normal()
        rows["levels"].append(
            {**start, "channel": "/tip.x", "unit": "m/s^2", "low_hz": 0.5, "high_hz": 20.0, "mean": 0.0, "rms": loud,
             "rms_std": 0.05}
        )  # fmt: skip
        rows["peaks"].append(
            {**start, "step": "psd", "channel": "/tip.x", "rank": 1,
             "frequency_hz": 50 + 0.01 * rng.standard_normal(), "frequency_std_hz": 0.01}
        )  # fmt: skip
        for mode, (frequency_hz, shape) in enumerate(((4.0 + shift, [1.0, 0.5]), (4.3, [1.0, -0.6]))):
            if mode == 1 and rng.random() < 0.3:
                continue
            damaged = 1 - (damage if mode == 0 and day >= DAMAGED else 0.0)
            now_hz = frequency_hz * (1 - 0.002 * warm) * damaged + 0.003 * rng.standard_normal()
            rows["modes"].append(
                {**start, "mode": mode, "frequency_hz": now_hz, "frequency_std_hz": 0.003, "damping_ratio": 0.01,
                 "damping_std": 0.001, "channels": ["/tip.x", "/root.x"], "shape_real": shape,
                 "shape_imag": [0.0, 0.0]}
            )  # fmt: skip
    with opened_folder(out, "made", "made") as folder:
        folder.take(packed(tables_of(rows)), {}, source="a test")
        folder.settle()


@pytest.fixture(scope="module")
def year(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bridge") / "year"
    write_year(out)
    return out


@pytest.fixture(scope="module")
def followed(year: Path) -> Trends:
    return follow(chladni.results(year), TrendTable(covariates=["/air.t"]))


def one(found: Trends, kind: str, name: str) -> Any:
    [trend] = [trend for trend in found.trends if (trend.kind, trend.name) == (kind, name)]
    return trend


def test_a_mode_is_followed_through_the_seasons_and_its_change_is_dated(followed: Trends) -> None:
    mode = one(followed, "mode", "mode 1")
    [change] = mode.changes
    assert change.first <= DAMAGED <= change.last
    assert abs(change.step + 4.0 * 0.006) < 4 * change.step_std
    [effect] = mode.covariates
    assert abs(effect.slope + 4.0 * 0.002) < 4 * effect.slope_std
    assert effect.unit == "Hz per K"
    other = one(followed, "mode", "mode 2")
    assert not other.changes
    assert 100 < len(other.logs) < DAYS
    assert np.allclose(other.values - other.explained, 4.3, atol=0.05)


def test_levels_and_lines_are_followed(followed: Trends) -> None:
    [change] = one(followed, "level", "/tip.x, 0.5 to 20 Hz").changes
    assert change.first <= LOUD <= change.last
    assert not one(followed, "line", "/tip.x, line at 50 Hz").changes
    said = trend_sentences(followed.trends)
    assert len(said) == 2
    assert "mode 1 (3.994 Hz) changed by -0.025" in " ".join(said)
    document = trends_document(followed)
    assert document["format"] == "chladni.trends/1"
    assert document["findings"] == list(said)


def test_a_covariate_that_nobody_measured_is_told(year: Path) -> None:
    found = follow(chladni.results(year), TrendTable(covariates=["/wind.v"]))
    assert found.notes == (
        "covariate /wind.v is left out: no log has a mean of it; let [levels] measure it, without bands",
    )


def test_a_limit_tells_each_value_beyond_it(followed: Trends) -> None:
    limit = LimitTable(of="level", channel="/tip.x", high=1.3)
    verdict = judge(followed, [limit])
    assert {row.log for row in verdict.outside} == {f"/bridge/{day:03d}.mcap" for day in range(LOUD, DAYS)}
    assert not judge(followed, [LimitTable(of="level", channel="/tip.x", high=3.0)]).outside
    [sentence] = judge(followed, [LimitTable(of="mode", near_hz=17.0, low=1.0)]).missing
    assert "mode near 17 Hz" in sentence


def test_limits_hold_for_what_too_few_logs_show_to_be_followed(tmp_path: Path) -> None:
    write_year(tmp_path / "two", days=2)
    found = follow(chladni.results(tmp_path / "two"), TrendTable())
    assert not found.trends
    limits = [
        LimitTable(of="level", channel="/tip.x", high=0.5),
        LimitTable(of="mode", near_hz=4.0, low=4.1),
        LimitTable(of="damping", near_hz=4.0, high=0.005),
        LimitTable(of="line", channel="/tip.x", near_hz=50.0, high=60.0),
    ]
    verdict = judge(found, limits)
    assert not verdict.missing
    told = {(row.what, row.log) for row in verdict.outside}
    for what in ("RMS of /tip.x, 0.5 to 20 Hz", "mode (", "damping of mode ("):
        assert {log for said, log in told if said.startswith(what)} == {"/bridge/000.mcap", "/bridge/001.mcap"}
    assert not [said for said, _ in told if "line" in said]


def test_an_equal_baseline_is_within_its_band_and_another_isnt(followed: Trends, tmp_path: Path) -> None:
    asked = TrendTable(covariates=["/air.t"])
    write_year(tmp_path / "same", seed=7)
    assert not judge(followed, [], follow(chladni.results(tmp_path / "same"), asked)).outside
    write_year(tmp_path / "stiff", seed=8, shift=0.08)
    stiff = follow(chladni.results(tmp_path / "stiff"), asked)
    assert {row.what.partition(" (")[0] for row in judge(followed, [], stiff).outside} == {"mode 1"}
    # 2 % of 4 Hz is 0.08 Hz: just allowed.
    assert not judge(followed, [LimitTable(of="mode", near_hz=4.0, change_percent=2.5)], stiff).outside


@pytest.mark.nightly
def test_the_command_ends_with_3_when_something_left_its_band(
    year: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(
        'format = "chladni.study/1"\n[levels]\n[trend]\ncovariates = ["/air.t"]\n'
        '[[limit]]\nof = "level"\nchannel = "/tip.x"\nhigh = 1.3\n'
    )
    out = tmp_path / "out"
    loaded = load_recipe(recipe)
    (tmp_path / "logs").mkdir()
    log = tmp_path / "logs" / "none.mcap"
    with opened_folder(out, loaded.identity, "made") as folder:
        folder.take(year_bytes(year), {}, source="a test")
        # A log that is done: no cluster is begun.
        log.write_bytes(b"")
        stamp = f"0 {log.stat().st_mtime_ns}"
        content = packed(tables_of({"logs": [{"log": str(log), "content": "x", "status": "failed"}]}))
        folder.take(content, {str(log): stamp}, source="a test")
        folder.settle()
    page, recording = tmp_path / "page.html", tmp_path / "months.rrd"
    words = ["study", str(recipe), str(log), "--out", str(out), "--html", str(page), "--save", str(recording)]
    assert main(words) == 3
    said = capsys.readouterr().out
    assert "1 was done already" in said
    assert "Outside the band: 40 values" in said
    html = page.read_text()
    assert "Outside the band" in html
    assert "mode 1 (3.994 Hz) changed by" in html
    # Sentences, tables and pictures write one unit in one way.
    assert "RMS of /tip.x, 0.5 to 20 Hz changed by" in html
    assert "m/s²" in html
    assert "m/s^2" not in html
    assert recording.stat().st_size > 10_000
    recipe.write_text(recipe.read_text().replace("1.3", "3.0"))
    assert main(words[:5]) == 0
    assert "all within their bands" in capsys.readouterr().out


def year_bytes(year: Path) -> bytes:
    found = chladni.results(year)
    return packed({name: found.table(name) for name in ("logs", "modes", "levels", "peaks")})
