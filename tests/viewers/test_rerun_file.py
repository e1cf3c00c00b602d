"""A study in a .rrd file: read back by rerun's own reader, value by value."""

import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.arrays import Bytes
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.geometry import Geometry
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.viewers.drawing import block_maximum, colour_range, decibels_of_power
from chladni.viewers.rerun import waterfall as waterfall_module
from chladni.viewers.rerun import waveforms, write_rrd
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.tensors import TensorColumn
from chladni.viewers.style import level_colours
from tests.viewers import synthetic
from tests.viewers.headless import EXECUTABLE
from tests.viewers.rrd import Contents


@pytest.fixture(autouse=True)
def strict() -> Any:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rrd(synthetic.study(), tmp_path_factory.mktemp("rrd") / "arm.rrd")


@pytest.fixture(scope="module")
def arm(written: Path) -> Contents:
    return Contents(written)


def test_rerun_verifies_the_file(written: Path) -> None:
    outcome = subprocess.run([EXECUTABLE, "rrd", "verify", written], capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    assert "without error" in outcome.stderr + outcome.stdout


def test_waveform_samples_come_back_bit_for_bit(arm: Contents) -> None:
    series = synthetic.time_series()
    for row, channel in enumerate(series.channels):
        quantity = "force" if channel.unit == "N" else "acceleration"
        entity = channel_entity(f"/waveforms/1/{quantity}", channel)
        np.testing.assert_array_equal(arm.scalars(entity)[:, 0], series.values[row])
        expected = np.rint(np.arange(series.samples) / series.sample_rate_hz * 1e9).astype(np.int64)
        np.testing.assert_array_equal(arm.times(entity, "time"), expected)


def test_waveforms_keep_extremes_when_zoomed_out(arm: Contents) -> None:
    look = arm.static(channel_entity("/waveforms/1/force", synthetic.FORCE))
    assert look["SeriesLines:names"] == ["hammer.x"]
    assert look["SeriesLines:aggregation_policy"] == [rr.components.AggregationPolicy.MinMax.value]


def test_density_is_written_in_decibels_at_one_millisecond_a_hertz(arm: Contents) -> None:
    density = synthetic.density()
    entity = channel_entity("/density/1/acceleration", synthetic.RESPONSES[2])
    ticks = arm.times(entity, "frequency")
    np.testing.assert_array_equal(ticks, np.rint(density.frequency_hz * 1e6))
    np.testing.assert_array_equal(arm.times(entity, "time"), ticks)
    level = arm.scalars(entity)[1:, 0]
    np.testing.assert_allclose(level, 10 * np.log10(density.values[3, 1:]), rtol=1e-14)
    peak = ticks[1:][np.where(ticks[1:] < 20e6, level, -np.inf).argmax()]
    assert peak == synthetic.PEAK_HZ * 1e6


def test_density_of_nothing_is_a_gap_not_minus_infinity(arm: Contents) -> None:
    assert np.isnan(arm.scalars(channel_entity("/density/1/acceleration", synthetic.RESPONSES[2]))[0, 0])


def test_density_band_is_one_sigma(arm: Contents) -> None:
    density = synthetic.density()
    entity = channel_entity("/density/1/force", synthetic.FORCE) + "/band"
    bounds = 10 ** (arm.scalars(entity) / 10)
    np.testing.assert_allclose(bounds[:, 1] - bounds[:, 0], 2 * density.std[0], rtol=1e-12)


def test_only_excited_lines_of_a_response_are_written(arm: Contents) -> None:
    response = synthetic.frequency_response()
    entity = channel_entity("/magnitude/reference_1/acceleration", synthetic.RESPONSES[1])
    np.testing.assert_array_equal(
        arm.times(entity, "frequency"), np.rint(response.frequency_hz[response.excited] * 1e6)
    )
    expected = 20 * np.log10(np.abs(response.values[1, 0, response.excited]))
    np.testing.assert_allclose(arm.scalars(entity)[:, 0], expected, rtol=1e-13)


def test_phase_is_in_degrees_and_broken_where_it_wraps(arm: Contents) -> None:
    response = synthetic.frequency_response()
    entity = channel_entity("/phase/reference_1/acceleration", synthetic.RESPONSES[2])
    phase = arm.scalars(entity)[:, 0]
    expected = np.angle(response.values[2, 0, response.excited], deg=True)
    np.testing.assert_allclose(phase[~np.isnan(phase)], expected, rtol=1e-12)
    jumps = np.abs(np.diff(phase))
    assert np.nanmax(jumps) <= 180


def test_coherence_is_between_nothing_and_one(arm: Contents) -> None:
    response = synthetic.frequency_response()
    entity = channel_entity("/coherence/reference_1/acceleration", synthetic.RESPONSES[0])
    np.testing.assert_array_equal(arm.scalars(entity)[:, 0], response.coherence[0, response.excited])


def test_nyquist_points_are_real_and_negated_imaginary_parts(arm: Contents) -> None:
    response = synthetic.frequency_response()
    entity = channel_entity("/nyquist/reference_1/acceleration", synthetic.RESPONSES[0]) + "/cursor"
    points = np.array([row[0] for row in arm.column(entity, "Points2D:positions")])
    value = response.values[0, 0, response.excited]
    np.testing.assert_allclose(points[:, 0], value.real, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(points[:, 1], -value.imag, rtol=1e-6, atol=1e-6)


def test_deflection_shape_at_the_first_peak_is_the_first_mode(arm: Contents) -> None:
    ticks = arm.times("/deflection/reference_1/moved/arrows", "frequency")
    line = int(np.flatnonzero(ticks == synthetic.PEAK_HZ * 1e6)[0])
    vectors = np.array(arm.column("/deflection/reference_1/moved/arrows", "Arrows3D:vectors")[line])
    shape = vectors[:, 0] / vectors[2, 0]
    # The second mode adds a share of about twice the damping ratio to what the first does alone.
    np.testing.assert_allclose(shape, synthetic.SHAPES[:, 0], atol=0.02)
    np.testing.assert_array_equal(vectors[:, 1:], 0)


def test_deflection_goes_back_to_rest_after_the_band(arm: Contents) -> None:
    entity = "/deflection/reference_1/moved/points"
    assert arm.times(entity, "frequency")[-1] == (100 + 1 / synthetic.SEGMENT_S) * 1e6
    assert arm.column(entity, "Clear:is_recursive")[-1] == [False]
    assert arm.column(entity, "Points3D:positions")[-1] is None


def picture_of(contents: Contents, entity: str) -> Bytes:
    """``[row, column, rgb]`` of an image."""
    buffer = contents.static(entity)["Image:buffer"][0]
    pixels = np.frombuffer(buffer, dtype=np.uint8) if isinstance(buffer, bytes) else np.array(buffer, dtype=np.uint8)
    return pixels.reshape(waterfall_module.HEIGHT, waterfall_module.WIDTH, 3)


def test_waterfall_is_an_image_of_its_decibels_on_axes_with_numbers(arm: Contents) -> None:
    waterfall = synthetic.waterfall()
    entity = channel_entity("/waterfall/1", synthetic.RESPONSES[2])
    picture = picture_of(arm, entity)
    # Ten slices of 64 pixels each; frequencies in blocks that hold the greatest, the lowest at the bottom.
    greatest, _ = block_maximum(waterfall.values[3], axis=1, limit=waterfall_module.HEIGHT)
    level = decibels_of_power(greatest)
    low, high = colour_range([level], most_db=80.0)
    row = 30
    cell = (waterfall_module.HEIGHT - 1 - row) * level.shape[1] // waterfall_module.HEIGHT
    wanted = level_colours((level[:, cell] - low) / (high - low))
    np.testing.assert_array_equal(picture[row, 32::64], wanted)
    numbers = arm.static(f"{entity}/axes/numbers")["Points2D:labels"]
    assert {"20", "100", "Hz", "s"} <= set(numbers)


def test_the_cursor_in_the_waterfall_is_where_its_slice_is(arm: Contents) -> None:
    waterfall = synthetic.waterfall()
    entity = channel_entity("/waterfall/1", synthetic.RESPONSES[2])
    np.testing.assert_array_equal(
        arm.times(f"{entity}/cursor", "time"),
        arm.times(channel_entity("/spectrum/1", synthetic.RESPONSES[2]), "time"),
    )
    strips = np.array(arm.column(f"{entity}/cursor", "LineStrips2D:strips"))[:, 0]
    middles = (np.arange(waterfall.time_s.size) + 0.5) / waterfall.time_s.size * waterfall_module.WIDTH
    np.testing.assert_allclose(strips[:, :, 0], np.column_stack([middles, middles]), rtol=1e-6)


def test_where_the_cursor_is_at_first_there_is_a_spectrum_and_a_shape(tmp_path: Path) -> None:
    waterfall = synthetic.waterfall()
    # As of segments that overlap: half of the first lies before the first slice's part.
    late = replace(waterfall, time_s=waterfall.time_s + 7.0)
    contents = Contents(write_rrd(replace(synthetic.study(), waterfalls=(late,)), tmp_path / "late.rrd"))
    assert contents.times(channel_entity("/spectrum/1", synthetic.FORCE), "time")[0] == 0
    moved = "/deflection/reference_1/moved/arrows"
    ticks = contents.times(moved, "time")
    vectors = contents.column(moved, "Arrows3D:vectors")
    assert ticks[0] == 0
    assert vectors[0] == vectors[int(np.flatnonzero(ticks == synthetic.PEAK_HZ * 1e6)[0])]


def test_spectrum_under_the_cursor_is_the_nearest_slice(arm: Contents) -> None:
    waterfall = synthetic.waterfall()
    entity = channel_entity("/spectrum/1", synthetic.RESPONSES[2])
    np.testing.assert_array_equal(arm.times(entity, "time"), np.arange(10) * 4_000_000_000)
    bars = arm.column(entity, "BarChart:values")[3][0]["buffer"]
    np.testing.assert_allclose(bars, np.sqrt(waterfall.values[3, 3]), rtol=1e-6)
    abscissa = arm.static(entity)["BarChart:abscissa"][0]["buffer"]
    np.testing.assert_array_equal(abscissa, waterfall.frequency_hz)


def test_a_slice_with_missing_samples_clears_the_spectrum(tmp_path: Path) -> None:
    waterfall = synthetic.waterfall()
    values = waterfall.values.copy()
    values[:, 4] = np.nan
    path = write_rrd(Study(title="gap", waterfalls=(replace(waterfall, values=values),)), tmp_path / "gap.rrd")
    entity, contents = channel_entity("/spectrum/1", synthetic.FORCE), Contents(path)
    assert contents.times(entity, "time")[4] == 16_000_000_000
    bars = contents.column(entity, "BarChart:values")
    assert [len(slices) for slices in bars] == [1, 1, 1, 1, 0, 1, 1, 1, 1, 1]


def test_vectors_at_once_are_what_rerun_makes_of_them_one_by_one() -> None:
    vectors = np.arange(12, dtype=np.float32).reshape(3, 4)
    together = TensorColumn(vectors).as_arrow_array()
    together.validate(full=True)
    for row, vector in enumerate(vectors):
        alone = rr.components.TensorDataBatch(rr.encodings.TensorData(array=vector)).as_arrow_array()
        assert together.type == alone.type
        assert together.slice(row, 1).equals(alone)


def test_findings_hold_peaks_and_advice(arm: Contents) -> None:
    (text,) = arm.static("/findings")["TextDocument:text"]
    assert "12.500 ± 0.021" in text
    assert "Two resonances stand out" in text
    assert "H1" in text


def test_blueprint_shows_every_part_and_chooses_nothing_by_itself(arm: Contents) -> None:
    names = arm.view_names()
    assert "Acceleration [m/s²]" in names
    assert "Acceleration PSD [dB re 1 (m/s²)²/Hz] · 1 ms = 1 Hz" in names
    assert "Accelerance |H| to hammer.x [dB re 1 (m/s²)/N] · H1 · 1 ms = 1 Hz" in names
    assert "Phase [deg] · H = Y/X, exp(+jωt)" in names
    # Findings, two groups of waveforms and densities, five plots of responses, three a channel.
    assert len(names) == 1 + 2 * 2 + 5 + 3 * 4
    flags = {key: row[key] for row in arm.blueprint for key in row if key.startswith("ViewportBlueprint:auto_")}
    assert set(flags) == {"ViewportBlueprint:auto_layout", "ViewportBlueprint:auto_views"}
    assert all(value == [False] for value in flags.values())


def test_gaps_break_the_line_and_are_not_filled(tmp_path: Path) -> None:
    valid = np.ones((1, 100), dtype=np.bool_)
    valid[0, 40:60] = False
    channel = Channel(name="/a.x", unit="V")
    series = TimeSeries(values=np.ones((1, 100)), sample_rate_hz=100.0, channels=(channel,), valid=valid)
    path = write_rrd(Study(title="gap", series=(series,)), tmp_path / "gap.rrd")
    written = Contents(path).scalars(channel_entity("/waveforms/1/voltage", channel))[:, 0]
    # 80 good samples and one NaN, which is what breaks the line.
    assert written.size == 81
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(written)), [40])


def test_a_series_too_long_for_a_viewer_keeps_its_extremes_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waveforms, "ROWS_OF_A_CHANNEL", 300)
    values = np.zeros((1, 100_000))
    values[0, 77_777], values[0, 12_345] = 9.0, -7.0
    channel = Channel(name="/a.x", unit="V")
    series = TimeSeries(values=values, sample_rate_hz=1000.0, channels=(channel,))
    path = write_rrd(Study(title="long", series=(series,)), tmp_path / "long.rrd")
    entity = channel_entity("/waveforms/1/voltage", channel)
    written, ticks = Contents(path).scalars(entity)[:, 0], Contents(path).times(entity, "time")
    assert written.size <= 300
    assert ticks[written.argmax()] == 77_777_000_000
    assert ticks[written.argmin()] == 12_345_000_000
    assert "Voltage [V] · least and greatest of every 1000 samples" in Contents(path).view_names()


def test_a_waterfall_too_large_for_a_screen_keeps_its_peaks_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waterfall_module, "HEIGHT", 100)
    path = write_rrd(Study(title="large", waterfalls=(synthetic.waterfall(),)), tmp_path / "large.rrd")
    contents = Contents(path)
    assert any(name.endswith("greatest of every 6 lines") for name in contents.view_names())
    level = decibels_of_power(synthetic.waterfall().values[3])
    slice_, line = np.unravel_index(int(np.nanargmax(level)), level.shape)
    picture = picture_of(contents, channel_entity("/waterfall/1", synthetic.RESPONSES[2]))
    row = 99 - round((int(line) // 6 + 0.5) * 100 / 86)
    np.testing.assert_array_equal(picture[row, int(slice_) * 64 + 32], level_colours(np.array([1.0]))[0])


def test_names_that_try_to_break_paths_come_back_whole(tmp_path: Path) -> None:
    path = write_rrd(synthetic.hostile_study(), tmp_path / "hostile.rrd")
    found = Contents(path).entities()
    for place, channel in enumerate(synthetic.hostile_study().series[0].channels):
        assert channel_entity(folder("waveforms", "1", f"Acceleration {1 + place // 4}/2"), channel) in found


@given(names=st.sets(st.text(min_size=1), min_size=2, max_size=2))
def test_no_two_channels_share_a_path(names: set[str]) -> None:
    paths = {channel_entity("/waveforms", Channel(name=name)) for name in names}
    assert len(paths) == 2


def test_several_references_have_a_page_and_a_shape_each(tmp_path: Path) -> None:
    response = synthetic.frequency_response()
    second = Channel(name="/shaker.force.z", unit="N", role="reference")
    double = replace(
        response,
        values=np.concatenate([response.values, 2 * response.values], axis=1),
        std=np.concatenate([response.std, response.std], axis=1),
        references=(*response.references, second),
    )
    contents = Contents(write_rrd(replace(synthetic.study(), response=double), tmp_path / "two.rrd"))
    first, other = (
        contents.scalars(channel_entity(f"/magnitude/reference_{place}/acceleration", synthetic.RESPONSES[0]))
        for place in (1, 2)
    )
    np.testing.assert_allclose(other - first, 20 * np.log10(2), rtol=1e-12)
    names = contents.view_names()
    assert names.count("Multiple coherence γ² [1]") == 2
    shapes = [name for name in names if name.startswith("Deflection shape to ")]
    # Views come in the order of their random names.
    assert sorted(name.split()[3] for name in shapes) == ["hammer.x,", "shaker.z,"]


def test_series_of_one_quantity_are_told_apart(tmp_path: Path) -> None:
    series = synthetic.time_series()
    slower = replace(series, values=series.values[:, ::2], sample_rate_hz=128.0)
    path = write_rrd(Study(title="two", series=(series, slower)), tmp_path / "two.rrd")
    assert {"Force [N] · series 1, 256 Hz", "Force [N] · series 2, 128 Hz"} <= set(Contents(path).view_names())


def test_waterfall_of_missing_samples_alone_is_drawn(tmp_path: Path) -> None:
    waterfall = synthetic.waterfall()
    empty = replace(waterfall, values=np.full_like(waterfall.values, np.nan))
    path = write_rrd(Study(title="gap", waterfalls=(empty,)), tmp_path / "gap.rrd")
    assert channel_entity("/waterfall/1", synthetic.FORCE) in Contents(path).entities()


def test_an_empty_study_is_a_page_of_findings(tmp_path: Path) -> None:
    path = write_rrd(Study(title="nothing", findings=("no channel",)), tmp_path / "empty.rrd")
    assert "/findings" in Contents(path).entities()


def test_without_geometry_there_is_no_deflection(tmp_path: Path) -> None:
    path = write_rrd(replace(synthetic.study(), geometry=Geometry()), tmp_path / "plain.rrd")
    assert not [entity for entity in Contents(path).entities() if entity.startswith("/deflection")]


def test_a_response_that_nothing_excites_is_left_out(tmp_path: Path) -> None:
    response = synthetic.frequency_response()
    silent = replace(response, excited=np.zeros_like(response.excited))
    path = write_rrd(replace(synthetic.study(), response=silent), tmp_path / "silent.rrd")
    assert not [entity for entity in Contents(path).entities() if entity.startswith(("/magnitude", "/nyquist"))]


def test_a_folder_that_is_not_there_is_told_and_nothing_is_left(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="folder"):
        write_rrd(synthetic.study(), tmp_path / "missing" / "arm.rrd")
    assert list(tmp_path.iterdir()) == []


def test_an_old_file_survives_a_failure(tmp_path: Path) -> None:
    path = tmp_path / "arm.rrd"
    path.write_bytes(b"old")
    broken = replace(synthetic.study(), title=7)  # type: ignore[arg-type]
    with pytest.raises((TypeError, AttributeError, ValueError)):
        write_rrd(broken, path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
