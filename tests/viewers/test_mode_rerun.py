"""Modes in a .rrd file: read back by rerun's own reader, value by value."""

import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from chladni.signals.arrays import Real
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.viewers.rerun import movement, write_rrd
from chladni.viewers.rerun.entities import channel_entity
from chladni.viewers.wireframe import DRAWN_SHARE, Wireframe
from tests.viewers import synthetic_modes as made
from tests.viewers.headless import EXECUTABLE
from tests.viewers.rrd import Contents

ARM = made.arm_study()
MODES = made.modes_of(ARM)


@pytest.fixture(autouse=True)
def strict() -> Any:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def contents(study: Study, folder: Path) -> Contents:
    return Contents(write_rrd(study, folder / "study.rrd"))


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Contents:
    return contents(ARM, tmp_path_factory.mktemp("rrd"))


def rows(found: Contents, entity: str, timeline: str) -> list[dict[str, Any]]:
    """Rows of an entity on one timeline, in its order."""
    batches = [batch for batch in found._batches[entity] if timeline in batch.schema.names]
    return sorted((row for batch in batches for row in _plain(batch)), key=lambda row: row[timeline])


def _plain(batch: Any) -> list[dict[str, Any]]:
    import pyarrow as pa

    columns = [column.cast(pa.int64()) if pa.types.is_temporal(column.type) else column for column in batch.columns]
    return pa.table(dict(zip(batch.schema.names, columns, strict=True))).to_pylist()


def drawn_along_x(found: Contents, mode: int, phase_deg: int) -> Real:
    """How far each point of the arm is from rest at one phase."""
    (row,) = (row for row in rows(found, f"/shapes/mode_{mode}/points", "phase") if row["phase"] == phase_deg)
    rest = np.array([point.position for point in ARM.geometry.points])
    return (np.array(row["Points3D:positions"]) - rest)[:, 0]


def test_rerun_verifies_the_file(tmp_path: Path) -> None:
    path = write_rrd(ARM, tmp_path / "arm.rrd")
    outcome = subprocess.run([EXECUTABLE, "rrd", "verify", path], capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr


@pytest.mark.parametrize("mode", [1, 2, 5])
@pytest.mark.parametrize("phase_deg", [0, 60, 180, 270])
def test_points_are_at_the_real_part_of_the_turned_shape(arm: Contents, mode: int, phase_deg: int) -> None:
    shape = MODES.shapes[mode - 1]
    wireframe = Wireframe.of(ARM.geometry, MODES.channels)
    assert wireframe is not None
    expected = (shape * np.exp(1j * np.deg2rad(phase_deg))).real * DRAWN_SHARE * wireframe.size
    # Places are written in single precision, of coordinates up to a metre.
    np.testing.assert_allclose(drawn_along_x(arm, mode, phase_deg), expected, atol=1e-6)


def test_phase_is_a_timeline_of_degrees_that_closes(arm: Contents) -> None:
    phases = [row["phase"] for row in rows(arm, "/shapes/mode_1/points", "phase")]
    assert phases == list(range(0, 361, movement.STEP_DEG))
    np.testing.assert_allclose(drawn_along_x(arm, 1, 0), drawn_along_x(arm, 1, 360), atol=1e-6)


def test_shapes_are_there_on_every_timeline(arm: Contents) -> None:
    first = rows(arm, "/shapes/mode_3/lines", "phase")[0]["LineStrips3D:strips"]
    (still,) = rows(arm, "/shapes/mode_3/lines", "frequency")
    assert still["frequency"] == 0
    assert still["LineStrips3D:strips"] == first
    on_time = rows(arm, "/shapes/mode_3/lines", "time")
    assert on_time[0]["time"] == 0
    # One period of two seconds, at the end of which it stands where it began.
    assert on_time[-1]["time"] == 2_000_000_000
    assert on_time[0]["LineStrips3D:strips"] == on_time[-1]["LineStrips3D:strips"] == first


def test_on_time_the_motion_lasts_as_long_as_the_log(tmp_path: Path) -> None:
    series = TimeSeries(values=np.zeros((1, 701)), sample_rate_hz=100.0, channels=MODES.channels[:1])
    study = replace(ARM, series=(series,), response=None, modes=replace(MODES, fit=None, stabilisation=None))
    times = [row["time"] for row in rows(contents(study, tmp_path), "/shapes/mode_1/points", "time")]
    assert times[-1] == 8_000_000_000
    assert len(times) == len(set(times)) == 4 * 360 // movement.STEP_DEG + 1


def test_a_long_log_does_not_make_a_large_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(movement, "VERTICES_OF_A_STUDY", 0)
    series = TimeSeries(values=np.zeros((1, 101)), sample_rate_hz=0.1, channels=MODES.channels[:1])
    times = rows(contents(replace(ARM, series=(series,)), tmp_path), "/shapes/mode_1/points", "time")
    assert times[-1]["time"] == 2_000_000_000


def test_colour_tells_amplitude(arm: Contents) -> None:
    colours = arm.static("/shapes/mode_1/points")["Points3D:colors"]
    base, tool = (((colours[at] >> 24) & 255, (colours[at] >> 8) & 255) for at in (0, 4))
    # The tool moves most: red; the base hardly: blue.
    assert tool == (250, 40)
    assert base[0] < base[1]


def test_the_structure_at_rest_stays_in_sight(arm: Contents) -> None:
    rest = arm.static("/shapes/rest/names")
    assert rest["Points3D:labels"] == [point.name for point in ARM.geometry.points]
    assert rest["Points3D:show_labels"] == [True]
    (strip,) = arm.static("/shapes/rest/lines")["LineStrips3D:strips"]
    np.testing.assert_allclose(strip, [point.position for point in ARM.geometry.points], rtol=1e-6)


def test_a_wave_that_travels_travels_on_the_screen(tmp_path: Path) -> None:
    found = contents(made.ring_study(), tmp_path)
    crests = []
    for mode in (1, 2):
        heights = {
            row["phase"]: np.array(row["Points3D:positions"])[:, 2]
            for row in rows(found, f"/shapes/mode_{mode}/points", "phase")
        }
        # Every point reaches the same height, which no standing wave does.
        reach = np.max(list(heights.values()), axis=0)
        np.testing.assert_allclose(reach, reach.max(), rtol=0.01)
        before, after = (int(np.argmax(heights[phase][:8])) for phase in (0, 90))
        crests.append((after - before) % 8)
    # exp(j(phase - 2 angle)) has its crest at angle = phase/2, so after 90 degrees an eighth of the ring further: two
    # points of sixteen, and with the other sign as many the other way.
    assert crests == [2, 6]


def test_without_places_a_bar_a_channel_moves_and_the_view_says_why(tmp_path: Path) -> None:
    found = contents(made.without_geometry(), tmp_path)
    assert any("the setup gives no places" in name for name in found.view_names())
    labels = found.static("/shapes/axes/numbers")["Points2D:labels"]
    assert {"base.x", "tool.x", "-1", "1"} <= set(labels)
    zero, one = (found.static("/shapes/axes")["LineStrips2D:strips"][at][0][0] for at in (2, 4))
    for row in rows(found, "/shapes/mode_2/bars", "phase")[::10]:
        strips = np.array(row["LineStrips2D:strips"])
        np.testing.assert_allclose(strips[:, 0, 0], zero, rtol=1e-6)
        drawn = (strips[:, 1, 0] - zero) / (one - zero)
        turned = MODES.shapes[1] * np.exp(1j * np.deg2rad(row["phase"]))
        np.testing.assert_allclose(drawn, turned.real, atol=1e-5)


def test_channels_that_have_no_place_are_told(tmp_path: Path) -> None:
    bare = (replace(MODES.channels[0], point=None), *MODES.channels[1:])
    study = Study(title="part", modes=made.made_modes(MODES.shapes, bare), geometry=ARM.geometry)
    assert "Re(ψ e^jφ), colour |ψ| · press play · 1 channel without a place" in contents(study, tmp_path).view_names()


def test_every_mode_has_a_tab_with_frequency_and_damping(arm: Contents) -> None:
    names = container_names(arm)
    assert {"1: 24.67 Hz, 1.08 %", "5: 169.3 Hz, 1.19 %", "All", "Modes", "Shapes", "Poles and fit"} <= names
    assert "1: 24.67 Hz, 1.08 %" in arm.view_names()


def test_twenty_modes_are_in_rows_of_tabs_that_fit(tmp_path: Path) -> None:
    names = container_names(contents(made.plate_study(4, 3), tmp_path))
    assert {"1–5: 10.00–38.12 Hz", "16–20: 115.5–143.6 Hz", "20: 143.6 Hz, 1.23 %", "All"} <= names


def test_sixty_modes_are_in_rows_of_rows(tmp_path: Path) -> None:
    study = made.plate_study(2, 2, 62)
    assert study.validation is not None
    alike = replace(study.validation, auto_mac=np.ones((62, 62)))
    found = contents(replace(study, validation=alike), tmp_path)
    names = container_names(found)
    assert {"1–11: 10.00–80.30 Hz", "1–6: 10.00–45.15 Hz", "62: 438.8 Hz, 1.23 %"} <= names
    # Too many to be seen together, and too many numbers to leave the cells in sight.
    assert "All" not in names
    assert "/mac/numbers" not in found.entities()


def test_stabilisation_alone_fills_its_page(tmp_path: Path) -> None:
    alone = contents(replace(ARM, modes=replace(MODES, fit=None)), tmp_path)
    frames = [
        np.array(found.static("/stabilisation/axes")["LineStrips2D:strips"][-1])
        for found in (alone, contents(ARM, tmp_path))
    ]
    assert np.ptp(frames[0][:, 1]) > 2 * np.ptp(frames[1][:, 1])


def container_names(found: Contents) -> set[str]:
    key = "ContainerBlueprint:display_name"
    return {row[key][0] for row in found.blueprint if row.get(key)}


def test_time_is_active_unless_only_shapes_were_drawn(arm: Contents, tmp_path: Path) -> None:
    def first(found: Contents) -> tuple[str, int]:
        panel = {key: value for row in found.blueprint for key, value in row.items() if "TimePanelBlueprint" in key}
        return panel["TimePanelBlueprint:timeline"][0], panel["TimePanelBlueprint:loop_mode"][0]

    # Of transfer functions and synthesis nothing would be seen on the phase.
    assert first(arm) == ("time", rr.blueprint.components.LoopMode.All.value)
    assert first(contents(made.one_mode(), tmp_path))[0] == "phase"
    assert first(contents(made.without_modes(), tmp_path))[0] == "time"


def active_page(path: Path) -> str:
    """Name of the page that a file opens with."""
    reader = RrdReader(path)
    (blueprint,) = reader.blueprints()
    rows: dict[str, dict[str, Any]] = {}
    for chunk in reader.stream(store=blueprint):
        rows.setdefault(chunk.entity_path.strip("/"), {}).update(chunk.to_record_batch().to_pylist()[0])
    kind = "ContainerBlueprint:"
    names = {where: row[f"{kind}display_name"][0] for where, row in rows.items() if row.get(f"{kind}display_name")}
    overview = next(where for where, name in names.items() if name == "Overview")
    root = next(row for row in rows.values() if overview in row.get(f"{kind}contents", []))
    return names[root[f"{kind}active_tab"][0]]


def test_the_first_page_is_the_overview_unless_it_has_words_alone(tmp_path: Path) -> None:
    series = TimeSeries(values=np.zeros((1, 50)), sample_rate_hz=100.0, channels=MODES.channels[:1])
    study = replace(made.one_mode(), series=(series,))
    assert active_page(write_rrd(ARM, tmp_path / "a.rrd")) == "Modes"
    assert active_page(write_rrd(study, tmp_path / "b.rrd")) == "Overview"


def test_overview_has_the_modes_in_its_findings(arm: Contents) -> None:
    (text,) = arm.static("/findings")["TextDocument:text"]
    assert "24.6728 ± 0.0049" in text


def test_stabilisation_shows_every_pole_where_it_belongs(arm: Contents) -> None:
    diagram = MODES.stabilisation
    assert diagram is not None
    names = ("new", "frequency_stable", "and_damping", "and_vector")
    left, right = diagram.indicator_hz[0], diagram.indicator_hz[-1]
    for status, name in enumerate(names):
        dots = arm.static(f"/stabilisation/poles/{name}")
        chosen = diagram.status == status
        places = np.array(dots["Points2D:positions"])
        frame = np.array(arm.static("/stabilisation/axes")["LineStrips2D:strips"][-1])
        (x0, top), (_, bottom), (x1, _) = frame
        hertz = left + (places[:, 0] - x0) / (x1 - x0) * (right - left)
        order = (bottom - places[:, 1]) / (bottom - top) * (diagram.order.max() + 1)
        # Places are written in single precision.
        np.testing.assert_allclose(hertz, diagram.frequency_hz[chosen], atol=1e-4)
        np.testing.assert_allclose(order, diagram.order[chosen], atol=1e-4)
        assert dots["Points2D:show_labels"] == [False]
        assert dots["Points2D:labels"][0].endswith(f"order {diagram.order[chosen][0]}")
    rings = arm.static("/stabilisation/taken/and_vector")["LineStrips2D:strips"]
    assert len(rings) == (diagram.mode >= 0).sum()


def test_stabilisation_names_modes_machine_lines_and_axes(arm: Contents) -> None:
    names = arm.static("/stabilisation/names/1")
    assert names["Points2D:labels"] == ["24.67", "47.97", "66.32", "97.79", "169.3", "120.0"]
    assert names["Points2D:colors"][-1] != names["Points2D:colors"][0]
    assert "line of a machine" in arm.static("/stabilisation/legend/names")["Points2D:labels"]
    assert {"Frequency [Hz]", "Model order", "20", "40"} <= set(
        arm.static("/stabilisation/axes/numbers")["Points2D:labels"]
    )
    assert "CMIF [dB re 1 (m/s²)/N]" in arm.static("/stabilisation/indicator/numbers")["Points2D:labels"]


def test_close_modes_are_named_above_one_another(tmp_path: Path) -> None:
    close = replace(MODES, frequency_hz=np.array([24.0, 24.5, 25.0, 97.0, 97.5]), harmonics=())
    found = contents(Study(title="close", modes=close), tmp_path)
    first, second = (found.static(f"/stabilisation/names/{row}") for row in (1, 2))
    assert first["Points2D:labels"] == ["24.00", "97.00"]
    assert second["Points2D:labels"] == ["24.50", "97.50"]
    assert second["Points2D:positions"][0][1] < first["Points2D:positions"][0][1]
    assert "line of a machine" not in found.static("/stabilisation/legend/names")["Points2D:labels"]


def test_stabilisation_of_nothing_is_drawn_all_the_same(tmp_path: Path) -> None:
    diagram = MODES.stabilisation
    assert diagram is not None
    none = {name: getattr(diagram, name)[:0] for name in ("order", "frequency_hz", "damping_ratio", "status", "mode")}
    silent = replace(diagram, **none, indicator=np.zeros_like(diagram.indicator))
    found = contents(Study(title="x", modes=replace(MODES, stabilisation=silent)), tmp_path)
    assert not [entity for entity in found.entities() if entity.startswith("/stabilisation/poles")]


def test_mac_is_a_picture_with_numbers(arm: Contents) -> None:
    assert ARM.validation is not None
    image = arm.static("/mac/cells")
    assert len(image["Image:buffer"][0]) == 5 * 5 * 3
    numbers = arm.static("/mac/numbers")
    assert numbers["Points2D:labels"] == [f"{value:.2f}" for value in ARM.validation.auto_mac.ravel()]
    across = np.array(numbers["Points2D:positions"])[:, 0]
    np.testing.assert_array_equal(across, np.tile(np.arange(5) + 0.5, 5))
    assert "2: 47.97" in arm.static("/mac/names")["Points2D:labels"]


def test_a_large_mac_numbers_only_modes_that_look_alike(tmp_path: Path) -> None:
    study = made.plate_study(4, 3)
    assert study.validation is not None
    mac = study.validation.auto_mac.copy()
    np.fill_diagonal(mac, 1.0)
    mac[mac < 0.99] = 0.1
    mac[2, 7] = 0.98
    found = contents(replace(study, validation=replace(study.validation, auto_mac=mac)), tmp_path)
    assert "0.98" in found.static("/mac/numbers")["Points2D:labels"]
    assert "0.10" not in found.static("/mac/numbers")["Points2D:labels"]


def test_complexity_arrows_are_the_components(arm: Contents) -> None:
    strips = np.array(arm.static("/complexity/mode_2/arrows")["LineStrips2D:strips"])
    np.testing.assert_array_equal(strips[:, 0], 0)
    # The viewer's y axis points down.
    np.testing.assert_allclose(strips[:, 1, 0] - 1j * strips[:, 1, 1], MODES.shapes[1], atol=1e-6)
    assert arm.static("/complexity/mode_2/tips")["Points2D:labels"] == [
        "base.x",
        "column.x",
        "arm.x",
        "wrist.x",
        "tool.x",
    ]
    assert "Complexity · MPC 0.992, MPD 1.3°" in arm.view_names()


def test_synthesis_stands_over_the_measured_function_on_the_frequency_timeline(arm: Contents) -> None:
    assert MODES.fit is not None
    assert ARM.response is not None
    entity = channel_entity("/synthesis/1_acceleration_2_2", MODES.channels[4])
    for what, values in (("synthesised", MODES.fit.synthesised), ("measured", ARM.response.values)):
        np.testing.assert_array_equal(
            arm.times(f"{entity}/{what}", "frequency"), np.rint(ARM.response.frequency_hz * 1e6)
        )
        level = arm.scalars(f"{entity}/{what}")[:, 0]
        np.testing.assert_allclose(level, 20 * np.log10(np.abs(values[4, 0])), rtol=1e-12, atol=1e-12)
    (name,) = arm.static(f"{entity}/synthesised")["SeriesLines:names"]
    assert name == f"tool.x, error {MODES.fit.function_error[4, 0]:.1%}"


def test_text_holds_table_advice_and_relative_motion(arm: Contents) -> None:
    (text,) = arm.static("/modes")["TextDocument:text"]
    for shown in (
        "24.6728 ± 0.0049",
        "1.078 ± 0.016",
        "4.750 ± 0.095",
        "Mode 5 rests on few orders.",
        "0.544 ± 0.010",
    ):
        assert shown in text
    assert "Press play" in text


def test_no_mode_is_an_answer_with_its_reason(tmp_path: Path) -> None:
    found = contents(made.without_modes(), tmp_path)
    (text,) = found.static("/modes")["TextDocument:text"]
    assert "No mode was found." in text
    assert "No pole repeats over the orders." in text
    assert not [entity for entity in found.entities() if entity.startswith(("/shapes", "/mac"))]


def test_one_mode_has_no_mac(tmp_path: Path) -> None:
    assert "/mac/cells" not in contents(made.one_mode(), tmp_path).entities()


def test_modes_without_validation_are_drawn(tmp_path: Path) -> None:
    found = contents(replace(ARM, validation=None), tmp_path)
    assert "Complexity" in found.view_names()
    assert "/complexity/mode_1/mean_phase" not in found.entities()


def test_names_that_try_to_break_paths_and_markup_do_not(tmp_path: Path) -> None:
    path = write_rrd(hostile_modes(), tmp_path / "hostile.rrd")
    (text,) = Contents(path).static("/modes")["TextDocument:text"]
    assert "<script>" not in text


def hostile_modes() -> Study:
    channels = tuple(
        replace(channel, name=name)
        for channel, name in zip(
            MODES.channels, ("/<script>alert(1)</script>.x", "**/+ /a", "$x$", "_h.é\n.y", "|a|"), strict=True
        )
    )
    modes = replace(MODES, channels=channels, scale=None)
    noted = replace(modes, provenance=modes.provenance.with_notes("![x](http://localhost/x.png) <b>bold</b>"))
    return replace(ARM, modes=noted, relative_motion=made.motions(replace(noted, channels=channels)))
