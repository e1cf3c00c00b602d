"""Several logs in one command: over one another in pictures, by their names in tables, documents and views."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.apps.show import gather
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.viewers import figures
from chladni.viewers.figures import Album
from tests.cli.conftest import Run

RATE_HZ = 500.0
HEAVY_HZ, LIGHT_HZ = 60.0, 80.0


def write(path: Path, natural_hz: float, *, gain: float = 1.0, start_s: int = 0, tip: str = "/rig.tip") -> Path:
    """Noise through one resonance of 2 % damping."""
    force = gain * np.random.default_rng(3).standard_normal(20_000)
    pole = np.exp((-0.02 + 1j * np.sqrt(1 - 0.02**2)) * 2 * np.pi * natural_hz / RATE_HZ)
    moved = lfilter([1.0, -2.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
    channels = (Channel(name="/rig.force", unit="N"), Channel(name=tip, unit="m/s^2"))
    series = TimeSeries(
        values=np.stack([force, moved]), sample_rate_hz=RATE_HZ, channels=channels, start_time_ns=start_s * 10**9
    )
    write_mcap([series], path)
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("several")
    light = write(folder / "light.mcap", LIGHT_HZ, gain=3.0, start_s=1_000_000)
    return write(folder / "heavy.mcap", HEAVY_HZ), light


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Album]:
    """Albums that commands would save."""
    albums: list[Album] = []
    monkeypatch.setattr(figures, "save_album", lambda album, _: albums.append(album) or [])
    return albums


def curves(album: Album, figure: str, axes: int = 0) -> dict[str, float]:
    """Where each named curve is highest, by its name in the legend."""
    lines = album.figures[figure].axes[axes].get_lines()
    named = [line for line in lines if not str(line.get_label()).startswith("_")]
    return {str(line.get_label()): float(line.get_xdata()[np.nanargmax(line.get_ydata())]) for line in named}


def test_densities_share_a_figure_and_are_named_by_file(
    run: Run, logs: tuple[Path, Path], drawn: list[Album]
) -> None:
    outcome = run("psd", *logs, "--channel", "tip", "--figures", "d", "--json", "-")
    assert outcome.code == 0, outcome.err
    (album,) = drawn
    highest = curves(album, "psd Acceleration")
    assert list(highest) == ["heavy.mcap", "light.mcap"]
    assert list(highest.values()) == pytest.approx([HEAVY_HZ, LIGHT_HZ], abs=1.5)
    for path, one in zip(logs, outcome.document["logs"], strict=True):
        alone = run("psd", path, "--channel", "tip", "--json", "-").document
        assert one == {"log": path.name, **alone}
    assert outcome.err.index("heavy.mcap") < outcome.err.index("Levels") < outcome.err.index("light.mcap")


def test_transfer_functions_too(run: Run, logs: tuple[Path, Path], drawn: list[Album]) -> None:
    assert run("frf", *logs, "--figures", "d").code == 0
    (figure,) = drawn[0].figures
    highest = curves(drawn[0], figure)
    assert list(highest) == ["heavy.mcap", "light.mcap"]
    assert list(highest.values()) == pytest.approx([HEAVY_HZ, LIGHT_HZ], abs=1.5)
    assert [len(axes.get_lines()) for axes in drawn[0].figures[figure].axes] == [2, 2, 2]


def test_what_was_compared_is_drawn(run: Run, logs: tuple[Path, Path], drawn: list[Album], tmp_path: Path) -> None:
    page = tmp_path / "change.html"
    outcome = run("compare", *logs, "--channel", "tip", "--figures", "d", "--report", page)
    assert outcome.code == 0, outcome.err
    assert set(drawn[0].figures) == {"change of psd 1 Acceleration", "psd Acceleration"}
    assert list(curves(drawn[0], "psd Acceleration")) == ["heavy.mcap", "light.mcap"]
    text = page.read_text()
    assert "heavy.mcap and light.mcap" in text
    assert "The level of rig.tip changed by " in text
    assert text.index("<h2>What changed</h2>") < text.index("<h2>Power spectral densities</h2>")


def test_one_channel_each_needs_no_common_name(run: Run, logs: tuple[Path, Path], tmp_path: Path,
                                               drawn: list[Album]) -> None:  # fmt: skip
    other = write(tmp_path / "other.mcap", LIGHT_HZ, tip="/bench/accelerometer.y")
    assert run("psd", logs[0], other, "--channel", "*tip", "--figures", "d").code == 2, "no tip in the second"
    assert run("psd", logs[0], other, "--figures", "d").code == 0
    (album,) = drawn
    assert list(curves(album, "psd Acceleration")) == ["heavy.mcap: rig.tip", "other.mcap: accelerometer.y"]
    assert list(curves(album, "psd Force")) == ["heavy.mcap", "other.mcap"]


def test_a_view_names_channels_by_file_and_lays_logs_over_one_another(logs: tuple[Path, Path]) -> None:
    channel = Channel(name="/a.x", unit="N")
    first, second = (
        Study(title=path.name, series=(TimeSeries(values=np.ones((1, 9)), sample_rate_hz=1.0, channels=(channel,),
                                                  start_time_ns=start),))
        for path, start in zip(logs, (0, 10**15), strict=True)
    )  # fmt: skip
    both = gather(first, second)
    assert both.logs == ("heavy.mcap", "light.mcap")
    assert [one.channels[0].name for one in both.series] == ["heavy.mcap: /a.x", "light.mcap: /a.x"]
    assert [one.start_time_ns for one in both.series] == [0, 0]
    assert "The logs were recorded one after another; each is drawn from its own start." in both.findings
    assert both.log_of(both.series[1].channels[0]) == "light.mcap"
    assert gather(first).series[0].channels[0].name == "/a.x"


def test_logs_of_one_time_keep_it() -> None:
    channel = Channel(name="/a.x", unit="N")
    pair = [
        Study(title=name, series=(TimeSeries(values=np.ones((1, 9)), sample_rate_hz=1.0, channels=(channel,),
                                             start_time_ns=start),))
        for name, start in (("a", 10**15), ("b", 10**15 + 4 * 10**9))
    ]  # fmt: skip
    assert [one.start_time_ns for one in gather(*pair).series] == [10**15, 10**15 + 4 * 10**9]


def test_a_view_has_one_plot_for_all_logs(run: Run, logs: tuple[Path, Path], tmp_path: Path) -> None:
    from rerun.chunk import RrdReader

    target = tmp_path / "both.rrd"
    assert run("view", *logs, "--channel", "tip", "--save", target).code == 0
    reader = RrdReader(target)
    (store,) = reader.blueprints()
    queries = [
        row["ViewContents:query"]
        for chunk in reader.stream(store=store)
        for row in chunk.to_record_batch().to_pylist()
        if row.get("ViewContents:query")
    ]
    for kind in ("waveforms", "density"):
        (shared,) = [query for query in queries if any(f"/{kind}/1" in one for one in query) and len(query) == 2]
        assert any(f"/{kind}/2" in one for one in shared)


def test_the_same_log_twice_is_refused(run: Run, logs: tuple[Path, Path]) -> None:
    outcome = run("psd", logs[0], logs[0])
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "heavy.mcap: is given twice; give each log once" in outcome.err
