from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.measuring import matched_log, measurement_of
from chladni.models.core.model import Model
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, ModelError
from chladni.signals.time_series import TimeSeries

ARM = """
format = "chladni.model/1"
name = "arm"
kind = "structure"
body = [{ name = "column", mass = 12.0 }, { name = "wrist", mass = 2.5 }]
joint = [
  { name = "shoulder", between = ["ground", "column"], stiffness = 1.2e6, damping = 200.0 },
  { name = "elbow", between = ["column", "wrist"], stiffness = 6e5, damping = 90.0 },
]
input = [{ name = "hammer", at = "wrist", channel = "/hammer.force" }]
output = [
  { name = "acc_column", measures = "acceleration", at = "column", channel = "/column.accel" },
  { name = "acc_wrist", measures = "acceleration", at = "wrist", channel = "/wrist.accel" },
]
"""
LOOP = """
format = "chladni.model/1"
name = "axis"
kind = "structure"
body = [{ name = "carriage", mass = 95.0 }]
joint = [{ name = "guide", between = ["ground", "carriage"], stiffness = 0.0, damping = 300.0 }]
input = [{ name = "motor", at = "carriage", channel = "/axis.effort" }]
output = [{ name = "position", measures = "displacement", at = "carriage", channel = "/axis.position" }]

[[controller]]
name = "loop"
reference = "/command.position"
feedback = "position"
law = "p-p"
gains = { kp = 160.0, kv = 243.0 }
drives = "motor"
gain = "35.15 N/V"
"""
SAMPLES, RATE_HZ = 1000, 1000.0


def model_of(folder: Path, text: str = ARM) -> Model:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return chladni.load_model(path)


def recording(units: dict[str, str], *, samples: int = SAMPLES, rate_hz: float = RATE_HZ) -> TimeSeries:
    rng = np.random.default_rng(3)
    return TimeSeries(
        values=rng.standard_normal((len(units), samples)),
        sample_rate_hz=rate_hz,
        channels=tuple(Channel(name=name, unit=unit) for name, unit in units.items()),
    )


WHOLE = {"/wrist.accel": "m/s^2", "/other": "V", "/hammer.force": "N", "/column.accel": "m/s^2"}


def with_gap(series: TimeSeries, channel: str, lost: slice) -> TimeSeries:
    valid = np.ones(series.values.shape, dtype=bool)
    valid[series.index(channel), lost] = False
    return TimeSeries(
        values=series.values, sample_rate_hz=series.sample_rate_hz, channels=series.channels, valid=valid
    )


def test_channels_go_to_the_terminals_that_name_them(tmp_path: Path) -> None:
    series = recording(WHOLE)
    found, remarks = measurement_of(model_of(tmp_path), series, log="log.mcap")
    assert found.log == "log.mcap"
    assert found.sample_rate_hz == RATE_HZ
    assert found.input_names == ("hammer",)
    assert found.output_names == ("acc_column", "acc_wrist")
    assert found.output_units == ("m/s^2", "m/s^2")
    np.testing.assert_array_equal(found.inputs, series.values[[2]])
    np.testing.assert_array_equal(found.outputs, series.values[[3, 0]])
    assert remarks == ()


def test_a_channel_with_the_terminals_own_name_will_do(tmp_path: Path) -> None:
    series = recording({"hammer": "N", "acc_wrist": "m/s^2", "/column.accel": "m/s^2"})
    found, _ = measurement_of(model_of(tmp_path), series, log="log.mcap")
    np.testing.assert_array_equal(found.inputs[0], series.values[0])
    np.testing.assert_array_equal(found.outputs[1], series.values[1])


def test_a_model_names_a_channel_by_what_is_shown_of_it(tmp_path: Path) -> None:
    named = {name.replace("/wrist", "/wrist\x1b[2J\n"): unit for name, unit in WHOLE.items()}
    model = model_of(tmp_path, ARM.replace("/wrist", r"/wrist\\x1b[2J\\n"))
    series = recording(named)
    found, _ = measurement_of(model, series, log="log.mcap")
    np.testing.assert_array_equal(found.outputs[1], series.values[0])


def test_a_channel_without_unit_is_taken_and_others_are_converted(tmp_path: Path) -> None:
    series = recording({"/hammer.force": "1", "/wrist.accel": "g", "/column.accel": "m/s2"})
    found, _ = measurement_of(model_of(tmp_path), series, log="log.mcap")
    np.testing.assert_array_equal(found.inputs[0], series.values[0])
    np.testing.assert_allclose(found.outputs[1], 9.80665 * series.values[1], rtol=1e-15)


@pytest.mark.parametrize(
    ("channel", "terminal", "wanted"),
    [("/hammer.force", "input 'hammer'", "N"), ("/wrist.accel", "acc_wrist", "m/s^2")],
)
def test_units_that_do_not_fit_name_both_sides(tmp_path: Path, channel: str, terminal: str, wanted: str) -> None:
    with pytest.raises(ModelError, match="in rad/s") as error:
        measurement_of(model_of(tmp_path), recording({**WHOLE, channel: "rad/s"}), log="log.mcap")
    for part in ("log.mcap", channel, terminal, wanted):
        assert part in str(error.value)


@pytest.mark.parametrize(("measures", "fits"), [("acceleration", False), ("velocity", False), ("displacement", True)])
def test_a_type_s_quantity_must_be_the_terminal_s_while_the_log_gives_no_unit(
    tmp_path: Path, measures: str, fits: bool
) -> None:
    model = model_of(tmp_path, LOOP.split("[[controller]]")[0].replace("displacement", measures))
    series = recording({"/axis.effort": "1", "/axis.position": "1"})
    open_units = (("N", "N m"), ("m", "rad"))
    channels = (replace(one, units_possible=of) for one, of in zip(series.channels, open_units, strict=True))
    series = replace(series, channels=tuple(channels))
    if fits:
        assert measurement_of(model, series, log="log.mcap")[1] == ()
        return
    with pytest.raises(ModelError, match="is in m or rad by its message's type") as error:
        measurement_of(model, series, log="log.mcap")
    for part in ("log.mcap: channel '/axis.position'", "output 'position' of the model in m/s", "setup"):
        assert part in str(error.value)


def test_an_input_that_the_log_lacks_is_an_error_that_says_what_it_holds(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="input 'hammer'") as error:
        measurement_of(model_of(tmp_path), recording({"/wrist.accel": "m/s^2", "/b": "V"}), log="log.mcap")
    for part in ("log.mcap", "/hammer.force", "/wrist.accel, /b"):
        assert part in str(error.value)
    with pytest.raises(LogError, match=r"it holds /axis\.effort, /wrist\.accel; correct"):
        measurement_of(
            model_of(tmp_path), recording({"/wrist.accel": "m/s^2"}), log="log.mcap",
            held=["/axis.effort", "/wrist.accel"],
        )  # fmt: skip


def test_a_model_that_names_no_channel_of_an_input_is_an_error(tmp_path: Path) -> None:
    text = ARM.replace(', channel = "/hammer.force"', "")
    with pytest.raises(ModelError, match="no input names a channel"):
        measurement_of(model_of(tmp_path, text), recording({"/wrist.accel": "m/s^2"}), log="log.mcap")


def test_a_second_input_without_channel_is_zero_and_told(tmp_path: Path) -> None:
    text = ARM.replace("input = [", 'input = [{ name = "fan", at = "column" }, ')
    found, remarks = measurement_of(model_of(tmp_path, text), recording(WHOLE), log="log.mcap")
    assert found.input_names == ("fan", "hammer")
    assert not found.inputs[0].any()
    assert found.inputs[1].any()
    assert any("fan" in remark for remark in remarks)


def test_outputs_that_the_log_lacks_are_left_out_and_told(tmp_path: Path) -> None:
    found, remarks = measurement_of(
        model_of(tmp_path), recording({"/hammer.force": "N", "/wrist.accel": "m/s^2"}), log="log.mcap"
    )
    assert found.output_names == ("acc_wrist",)
    assert [remark for remark in remarks if "'acc_column'" in remark and "/column.accel" in remark]


def test_a_stuck_channel_and_one_that_is_mostly_missing_are_left_out(tmp_path: Path) -> None:
    series = recording(WHOLE)
    values = series.values.copy()
    values[series.index("/wrist.accel")] = 3.5
    stuck = TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=series.channels)
    found, remarks = measurement_of(model_of(tmp_path), stuck, log="log.mcap")
    assert found.output_names == ("acc_column",)
    assert any("never changes from 3.5" in remark for remark in remarks)
    lost = with_gap(series, "/wrist.accel", slice(100, 700))
    found, remarks = measurement_of(model_of(tmp_path), lost, log="log.mcap")
    assert found.output_names == ("acc_column",)
    assert found.samples == SAMPLES
    assert any("misses 60%" in remark for remark in remarks)


def test_no_output_at_all_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="nothing to compare") as error:
        measurement_of(model_of(tmp_path), recording({"/hammer.force": "N"}), log="log.mcap")
    assert "/column.accel" in str(error.value)
    with pytest.raises(LogError, match=r"the log holds /hammer\.force, /tip\.accel; give an"):
        measurement_of(
            model_of(tmp_path), recording({"/hammer.force": "N"}), log="log.mcap",
            held=["/hammer.force", "/tip.accel"],
        )  # fmt: skip


@pytest.mark.parametrize("how", ["valid", "nan", "infinite"])
def test_gaps_leave_the_longest_stretch_and_are_told(tmp_path: Path, how: str) -> None:
    series = recording(WHOLE)
    row, lost = series.index("/hammer.force"), slice(300, 320)
    if how == "valid":
        gappy = with_gap(series, "/hammer.force", lost)
    else:
        values = series.values.copy()
        values[row, lost] = np.nan if how == "nan" else np.inf
        gappy = TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=series.channels)
    found, remarks = measurement_of(model_of(tmp_path), gappy, log="log.mcap")
    np.testing.assert_array_equal(found.inputs[0], series.values[row, 320:])
    assert [remark for remark in remarks if "log.mcap lacks 20 samples" in remark and "0.32 s to 1 s" in remark]
    assert matched_log(model_of(tmp_path), gappy, log="log.mcap").losses == remarks[:1]


def test_one_missing_sample_is_one(tmp_path: Path) -> None:
    gappy = with_gap(recording(WHOLE), "/hammer.force", slice(300, 301))
    _, remarks = measurement_of(model_of(tmp_path), gappy, log="log.mcap")
    assert remarks[0].startswith("log.mcap lacks 1 sample; used is its longest stretch")


def test_a_gap_in_a_channel_that_is_not_used_does_not_matter(tmp_path: Path) -> None:
    found, remarks = measurement_of(
        model_of(tmp_path), with_gap(recording(WHOLE), "/other", slice(300, 320)), log="log.mcap"
    )
    assert found.samples == SAMPLES
    assert remarks == ()


def test_gaps_all_over_are_an_error_that_names_the_worst_channel(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="longest stretch") as error:
        measurement_of(
            model_of(tmp_path), with_gap(recording(WHOLE), "/hammer.force", slice(0, SAMPLES, 100)), log="log.mcap"
        )
    assert "'/hammer.force' lacks 10 samples" in str(error.value)


def test_short_logs_are_told_and_very_short_ones_refused(tmp_path: Path) -> None:
    model = model_of(tmp_path)
    _, remarks = measurement_of(model, recording(WHOLE, samples=150, rate_hz=4000.0), log="log.mcap")
    # Before all else, and once.
    assert remarks[0].startswith(
        "log.mcap is short: 150 samples, where 200 or more tell more; 0.0375 s hold 1.7 cycles"
    )
    assert sum("cycles of the lowest mode" in remark for remark in remarks) == 1
    _, remarks = measurement_of(model, recording(WHOLE, samples=350, rate_hz=4000.0), log="log.mcap")
    assert remarks == ("the log is short: 0.0875 s hold 3.9 cycles of the lowest mode (44 Hz), 4 or more tell more",)
    with pytest.raises(LogError, match="32 samples") as error:
        measurement_of(model, recording(WHOLE, samples=20), log="log.mcap")
    # Nothing is missing in it: to cut it further or to leave a channel out would be false advice.
    assert "0.02 s at 1000 Hz are 20 samples" in str(error.value)
    assert "lacks" not in str(error.value)


def test_a_rate_too_low_for_the_modes_is_told(tmp_path: Path) -> None:
    _, remarks = measurement_of(model_of(tmp_path), recording(WHOLE, rate_hz=100.0), log="log.mcap")
    # They are at 44 and 89 Hz.
    assert "a log at 100 Hz can't follow 2 modes of the model above 40 Hz" in remarks
    _, remarks = measurement_of(model_of(tmp_path), recording(WHOLE, rate_hz=200.0), log="log.mcap")
    assert "a log at 200 Hz can't follow 1 mode of the model above 80 Hz" in remarks


def test_a_closed_loop_is_driven_by_its_reference_and_gives_its_command(tmp_path: Path) -> None:
    series = recording({"/axis.position": "m", "/axis.effort": "N", "/command.position": "m"})
    found, _ = measurement_of(model_of(tmp_path, LOOP), series, log="log.mcap")
    assert found.input_names == ("loop",)
    assert found.output_names == ("position", "motor")
    np.testing.assert_array_equal(found.inputs[0], series.values[2])
    np.testing.assert_array_equal(found.outputs, series.values[:2])
    without = series.select(["/axis.position", "/command.position"])
    found, remarks = measurement_of(model_of(tmp_path, LOOP), without, log="log.mcap")
    assert found.output_names == ("position",)
    assert any("'motor'" in remark for remark in remarks)


def test_an_input_that_never_moves_is_told(tmp_path: Path) -> None:
    series = recording(WHOLE)
    values = series.values.copy()
    values[series.index("/hammer.force")] = 0.0
    still = TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=series.channels)
    _, remarks = measurement_of(model_of(tmp_path), still, log="log.mcap")
    (told,) = [remark for remark in remarks if "no input moves" in remark]
    assert "input 'hammer' ('/hammer.force') is 0 throughout" in told
    # An answer can't be read without it.
    found = matched_log(model_of(tmp_path), still, log="log.mcap")
    assert (found.warnings, told in found.remarks) == ((told,), False)


def test_a_model_without_input_is_told_what_that_means(tmp_path: Path) -> None:
    text = "\n".join(line for line in ARM.splitlines() if not line.startswith("input"))
    found = matched_log(model_of(tmp_path, text), recording(WHOLE), log="log.mcap")
    (told,) = found.warnings
    assert told.startswith("model 'arm' has no [[input]]: in it only what starts in motion moves")
    assert "log.mcap" in told


def test_channels_that_are_apart_in_time_are_told_as_such(tmp_path: Path) -> None:
    series = with_gap(recording(WHOLE), "/wrist.accel", slice(100, SAMPLES))
    apart = with_gap(series, "/hammer.force", slice(0, 400))
    valid = np.asarray(series.valid) & np.asarray(apart.valid)
    _, remarks = measurement_of(model_of(tmp_path), replace(series, valid=valid), log="log.mcap")
    (told,) = [remark for remark in remarks if "acc_wrist" in remark]
    assert "'/wrist.accel' has samples from 0 to 0.1 s only, input channel '/hammer.force' from 0.4 to 1 s" in told


def halved(channel: str) -> TimeSeries:
    """A recording that lacks a fifth of a second of one channel, in its middle."""
    return with_gap(recording(WHOLE), channel, slice(400, 600))


def test_a_damaged_file_is_told_with_the_part_that_is_whole(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="longest stretch") as error:
        matched_log(
            model_of(tmp_path), halved("/hammer.force"), log="log.mcap", begins_s=3.0,
            damage=("Damage at byte 7 (Chunk): not zstd; 200 messages lost.",),
        )  # fmt: skip
    assert "log.mcap: the file is damaged (at byte 7 (Chunk): not zstd; 200 messages lost); the longest" in str(
        error.value
    )
    assert str(error.value).endswith(
        "'/hammer.force' lacks 200 samples; take that stretch alone (--start 3 --end 3.4)"
    )


def test_an_output_with_gaps_may_be_left_out_an_input_may_not(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"\(--end 0\.4\), or leave that output out of the model$"):
        matched_log(model_of(tmp_path), halved("/wrist.accel"), log="log.mcap")
    with pytest.raises(LogError, match=r"\(--end 0\.4\)$"):
        matched_log(model_of(tmp_path), halved("/hammer.force"), log="log.mcap")


def test_measured_axis(shared_data: Path) -> None:
    with chladni.open_log(shared_data / "emps.mcap") as log:
        series = log.read()
    found, remarks = measurement_of(
        chladni.load_model(shared_data / "models" / "emps_closed_loop.toml"), series, log="emps.mcap"
    )
    assert (found.input_names, found.output_names) == (("axis",), ("position", "motor"))
    assert found.output_units == ("m", "N")
    assert found.samples == 24841
    assert remarks == ()
