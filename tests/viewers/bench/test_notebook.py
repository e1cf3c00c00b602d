"""The same page without a server, where everything happens at once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.signals.errors import ModelError
from chladni.viewers.bench import instrument_panel
from chladni.viewers.bench.curve_points import straightened
from chladni.viewers.bench.toolkit import load_toolkit
from tests.viewers.bench.stand_in import OSCILLATOR, read, tools

load_toolkit()

from chladni.viewers.bench.dropper import MOST_BYTES, Dropper  # noqa: E402  # needs Panel's settings
from chladni.viewers.bench.instrument_page import VIEWS, InstrumentPage  # noqa: E402


@pytest.fixture
def page() -> Any:
    made = InstrumentPage(OSCILLATOR, tools())
    yield made
    made.close()


def first_curve(page: Any) -> np.ndarray:
    return np.array(page.board.slots[0].tile.lines.data["ys"][0])


def test_a_panel_object_that_renders() -> None:
    import panel as pn

    shown = instrument_panel(OSCILLATOR, tools(), ground="dark")
    assert isinstance(shown, pn.viewable.Viewable)
    models = shown.get_root().references()
    assert sum(type(model).__name__ == "figure" for model in models) == 5
    assert sum(type(model).__name__ == "Slider" for model in models) == 3


def test_a_knob_moves_the_curves(page: Any) -> None:
    before = first_curve(page)
    page.knobs["mass"].slider.value = 4.0
    after = first_curve(page)
    expected = read(OSCILLATOR, {**OSCILLATOR.parameters.numbers(), "mass": 4.0}, page.desk.good.options)
    assert not np.array_equal(before, after)
    curve = expected.charts[0].curves[0]
    np.testing.assert_array_equal(after, straightened(curve.x, curve.y)[1])
    assert page.knobs["mass"].entry.value == "4"


def test_an_entry_moves_slider_and_curves(page: Any) -> None:
    page.knobs["stiffness"].entry.value = "50"
    assert page.desk.good.values["stiffness"] == 5e4
    assert page.knobs["stiffness"].slider.value == pytest.approx(np.log10(50))


def test_an_impossible_entry_is_refused(page: Any) -> None:
    before = first_curve(page)
    page.knobs["mass"].entry.value = "0"
    assert "mass = 0 kg is not possible" in page.words.object
    assert page.knobs["mass"].entry.value == "2"
    np.testing.assert_array_equal(first_curve(page), before)


def test_a_value_outside_the_usual_range_is_shown_and_flagged(page: Any) -> None:
    page.knobs["mass"].entry.value = "9"
    assert page.desk.good.values["mass"] == 9.0
    assert page.knobs["mass"].slider.value == 5.0
    assert "mass is outside its usual range" in page.words.object


def test_options_are_switches_and_lists(page: Any) -> None:
    page.options["load"].value = True
    assert page.desk.good.options["load"] == "on"
    page.options["correction"].value = "pd"
    assert page.desk.good.options["correction"] == "pd"


def test_an_unstable_setting_keeps_the_last_good_one(page: Any) -> None:
    page.options["correction"].value = "unstable"
    assert page.options["correction"].value == "none"
    assert "a pole at +3 rad/s" in page.words.object
    page.knobs["mass"].slider.value = 3.0
    assert "pole" not in page.words.object


def test_a_defect_is_told_as_one(caplog: pytest.LogCaptureFixture) -> None:
    def broken(*_: Any) -> Any:
        raise ValueError("off by one")

    page = InstrumentPage(OSCILLATOR, tools(read=broken))
    assert "defect of chladni (ValueError): off by one" in page.words.object
    assert "off by one" in caplog.text
    page.exports[0]._pressed(None)
    assert "nothing to save" in page.words.object
    page.close()


def test_ranges_do_not_report_to_the_server(page: Any) -> None:
    for slot in page.board.slots:
        assert slot.tile.figure.x_range.syncable is False
        assert slot.tile.figure.y_range.syncable is False


def test_a_slot_shows_another_chart(page: Any) -> None:
    slot = page.board.slots[0]
    slot.select.value = "nyquist"
    assert slot.tile.figure.match_aspect
    assert len(slot.tile.lines.data["ys"]) == 2
    page.knobs["mass"].slider.value = 4.0
    assert slot.name == "nyquist"


def test_charts_that_disappear_make_room(page: Any) -> None:
    reading = read(OSCILLATOR, OSCILLATOR.parameters.numbers(), page.desk.good.options)
    page.board.show(reading.charts[:2])
    assert [slot.name for slot in page.board.slots] == ["step.position", "bode.magnitude"]
    page.board.show(reading.charts[2:4])
    assert [slot.name for slot in page.board.slots] == ["bode.phase", "bode.phase"]


def test_variants_are_kept_and_removed(page: Any) -> None:
    page.variants.keep.clicks += 1
    page.knobs["mass"].slider.value = 4.0
    page.variants.keep.clicks += 1
    assert [one.variant.label for one in page.variants.kept] == ["as declared", "m 4 kg"]
    tile = page.board.slots[0].tile
    assert len(tile.ghost_lines.data["ys"]) == 2
    assert len(set(tile.ghost_lines.data["colour"])) == 2
    assert len(page.board.shown()[0].curves) == 3
    page.variants.chips.objects[0].clicks += 1
    assert [one.variant.label for one in page.variants.kept] == ["m 4 kg"]
    assert len(tile.ghost_lines.data["ys"]) == 1


def test_the_table_of_variants_follows(page: Any) -> None:
    page.views.value = VIEWS[2]
    assert "Keep variants to see them" in page.variants._table.object
    page.variants.keep.clicks += 1
    page.knobs["mass"].slider.value = 4.0
    assert "now: m 4 kg" in page.variants._table.object
    assert "as declared" in page.variants._table.object


def test_rows_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "masses.txt"
    path.write_text("".join(f"{mass}\n" for mass in range(1, 31)))
    page = InstrumentPage(OSCILLATOR, tools(), variants=path)
    assert len(page.variants.kept) == 24
    assert "The first 24 of 30 rows are drawn." in page.variants._words.object
    page.variants.chips.objects[0].clicks += 1
    assert len(page.variants.kept) == 24
    page.close()


def test_a_row_without_a_reading_is_named_and_the_others_stay(tmp_path: Path) -> None:
    def picky(instrument: Any, values: Any, options: Any, charts: Any) -> Any:
        if values["mass"] == 3:
            raise ModelError("too heavy")
        return read(instrument, values, options, charts)

    path = tmp_path / "masses.txt"
    path.write_text("3\n4\n")
    page = InstrumentPage(OSCILLATOR, tools(read=picky), variants=path)
    assert [one.variant.label for one in page.variants.kept] == ["row m 4"]
    assert "row m 3: too heavy" in page.variants._words.object
    page.close()


def test_a_file_of_rows_that_is_not_there_is_told(tmp_path: Path) -> None:
    def watch(*_: Any) -> Any:
        def look() -> Any:
            raise ModelError("rows.csv: is not there")

        return look

    page = InstrumentPage(OSCILLATOR, tools(watch=watch), variants=tmp_path / "rows.csv")
    assert "rows.csv: is not there" in page.variants._words.object
    page.close()


def test_influence_follows_while_it_is_looked_at() -> None:
    asked: list[float] = []

    def influence(instrument: Any, values: Any, options: Any) -> Any:
        asked.append(values["mass"])
        raise ModelError("no construction parameter")

    page = InstrumentPage(OSCILLATOR, tools(influence=influence))
    page.knobs["mass"].slider.value = 3.0
    assert asked == []
    page.views.value = VIEWS[1]
    page.knobs["mass"].slider.value = 4.0
    assert asked == [3.0, 4.0]
    assert "no construction parameter" in page.influence._pane.object
    page.close()


def test_a_log_named_at_the_start(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_text("log\n/cell.force\n/rod.position")
    page = InstrumentPage(OSCILLATOR, tools(), log=path)
    assert page.views.value == VIEWS[3]
    assert "NRMSE position" in page.log._scores.object
    assert "2 %" in page.log._scores.object
    assert len(page.log.board.slots) == 1
    assert page.log.span.value == 5.0
    page.knobs["mass"].slider.value = 4.0
    assert "4 %" in page.log._scores.object
    page.log.selects["position"].value = page.log.selects["position"].values[0]
    assert "no output is measured" in page.log._words.object
    assert "4 %" in page.log._scores.object
    page.views.value = VIEWS[0]
    page.views.value = VIEWS[3]
    page.close()
    assert path.exists()


def test_a_log_that_fits_no_signal_waits_for_choices(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_text("log\n/other")
    page = InstrumentPage(OSCILLATOR, tools(), log=path)
    assert "no output is measured" in page.log._words.object
    page.log.selects["position"].value = "/other"
    assert "NRMSE" in page.log._scores.object
    page.close()


def test_private_copies_are_removed(page: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    page.log.show(True)
    drop(page, "one.mcap", b"log\n/a\n/b")
    (first,) = tmp_path.iterdir()
    assert first.stat().st_mode & 0o077 == 0
    drop(page, "two.mcap", b"log\n/a\n/b")
    (second,) = tmp_path.iterdir()
    assert second != first
    drop(page, "bad.mcap", b"rubbish")
    assert "bad.mcap: is no log" in page.log._words.object
    # Neither that one nor the one before it, whose comparison is gone.
    assert list(tmp_path.iterdir()) == []
    drop(page, "three.mcap", b"log\n/a\n/b")
    page.close()
    assert list(tmp_path.iterdir()) == []


class Upload:
    """An event as Panel makes it of a piece of a file."""

    event_name = "upload_event"

    def __init__(self, content: bytes, chunk: int, total: int, name: str = "a.mcap") -> None:
        self.data = {"name": name, "chunk": chunk, "total_chunks": total, "data": content, "type": ""}


def drop(page: Any, name: str, content: bytes) -> None:
    page.log.dropper._process_event(Upload(content, 1, 1, name))


class Dropped:
    """A dropper, and what it gave: names with contents, and refusals."""

    def __init__(self) -> None:
        self.taken: list[tuple[str, bytes, str]] = []
        self.refused: list[str] = []
        self.dropper = Dropper(taken=self._take, refused=self.refused.append)

    def _take(self, name: str, path: Path) -> None:
        self.taken.append((name, path.read_bytes(), path.suffix))
        path.unlink()

    def send(self, *pieces: tuple[bytes, int], total: int, name: str = "a.mcap") -> None:
        for content, number in pieces:
            self.dropper._process_event(Upload(content, number, total, name))


@pytest.fixture
def dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dropped:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return Dropped()


def test_no_room_for_a_private_copy_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, dropped: Dropped
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    dropped.send((b"a", 1), (b"b", 2), total=2)
    assert dropped.taken == []
    assert dropped.refused == ["the dropped log can't be kept: No such file or directory; free space or use --log"]


def test_a_disk_that_fills_up_is_told_and_nothing_stays(tmp_path: Path, dropped: Dropped) -> None:
    dropped.send((b"a", 1), total=3)

    class Full:
        name = dropped.dropper._copy.name  # type: ignore[union-attr]

        def write(self, _: bytes) -> int:
            raise OSError(28, "No space left on device")

        def close(self) -> None: ...

    dropped.dropper._copy = Full()  # type: ignore[assignment]
    dropped.send((b"b", 2), (b"c", 3), total=3)
    assert dropped.taken == []
    assert dropped.refused == ["the dropped log can't be kept: No space left on device; free space or use --log"]
    assert list(tmp_path.iterdir()) == []


def test_pieces_are_joined(dropped: Dropped, tmp_path: Path) -> None:
    dropped.send((b"ab", 1), (b"cd", 2), (b"e", 3), total=3)
    assert dropped.taken == [("a.mcap", b"abcde", ".mcap")]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["a.../../x", "a.m\x1b[2J", "a.\u202e", "a", "", ".", "..", "a.\n", "../../etc/a.$(x)", "a.\u00b2"]
)
def test_nothing_of_a_name_but_a_plain_suffix_goes_to_the_disk(dropped: Dropped, name: str) -> None:
    dropped.send((b"x", 1), total=1, name=name)
    assert dropped.taken == [(name, b"x", "")]


@pytest.mark.parametrize("numbers", [(1, 3), (1, 1, 3), (1, 2, 2), (2, 3), (0, 1, 3), (1, -2), (1, 2, 4)])
def test_pieces_in_another_order_make_no_log(dropped: Dropped, tmp_path: Path, numbers: tuple[int, ...]) -> None:
    dropped.send(*((b"x", number) for number in numbers), total=3)
    assert dropped.taken == []
    dropped.dropper.close()
    assert list(tmp_path.iterdir()) == []


def test_a_log_that_is_still_on_its_way_goes_with_the_page(page: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    page.log.dropper._process_event(Upload(b"x", 1, 2))
    assert len(list(tmp_path.iterdir())) == 1
    page.close()
    assert list(tmp_path.iterdir()) == []


def test_a_piece_that_takes_it_beyond_the_bound_is_refused_once(dropped: Dropped, tmp_path: Path) -> None:
    quarter = bytes(MOST_BYTES // 4)
    dropped.send(*((quarter, number) for number in range(1, 8)), total=7)
    assert dropped.taken == []
    assert len(dropped.refused) == 1
    assert "larger than 64 MB" in dropped.refused[0]
    assert "--log FILE" in dropped.refused[0]
    assert list(tmp_path.iterdir()) == []


def test_taking_a_file_away_again_changes_nothing(dropped: Dropped) -> None:
    event = Upload(b"", 1, 1)
    event.event_name = "delete_event"
    dropped.send((b"a", 1), total=2)
    dropped.dropper._process_event(event)
    dropped.send((b"b", 2), total=2)
    assert dropped.taken == [("a.mcap", b"ab", ".mcap")]
    assert dropped.refused == []


def test_a_model_that_cannot_be_built_for_a_log_is_told(tmp_path: Path) -> None:
    def terminals(_: Any) -> Any:
        raise ModelError("an algebraic loop")

    path = tmp_path / "a.mcap"
    path.write_text("log\n/a\n/b")
    page = InstrumentPage(OSCILLATOR, tools(terminals=terminals), log=path)
    assert "an algebraic loop" in page.log._words.object
    page.close()


def test_only_charts_on_the_page_are_computed_and_others_when_they_are_chosen() -> None:
    asked: list[Any] = []

    def noted(instrument: Any, values: Any, options: Any, charts: Any) -> Any:
        asked.append(charts)
        return read(instrument, values, options, charts)

    page = InstrumentPage(OSCILLATOR, tools(read=noted))
    # Nobody knows before the first reading which charts there are.
    assert asked == [None]
    slot = page.board.slots[0]
    slot.select.value = "poles"
    assert len(asked) == 1
    page.knobs["mass"].slider.value = 3.0
    assert "step.position" not in asked[-1]
    page.variants.keep.clicks += 1
    # A kept variant has all, whatever is chosen later.
    assert asked[-1] is None
    assert {chart.name for chart in page.variants.kept[0].reading.charts} >= {"step.position", "poles"}
    readings = len(asked)
    slot.select.value = "step.position"
    assert "step.position" in asked[-1]
    assert len(asked) == readings + 1
    assert slot.tile.key[0] == "step.position"
    assert [len(one.ghost_lines.data["xs"]) for one in (slot.tile,)] == [1]
