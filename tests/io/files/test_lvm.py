"""LabVIEW measurement files as LabVIEW writes them."""

from pathlib import Path

import numpy as np
import pytest

from chladni.io.files.lvm import read_lvm
from chladni.signals.errors import ChladniError, LogError, SetupError

SAMPLES = 60
SIGNAL = np.round(np.sin(np.arange(SAMPLES)), 6)
START_NS = 1_471_949_147_035_255_731  # 2016-08-23T10:45:47.0352557312499836422Z
OF_FILE = {
    "Writer_Version": "2",
    "Reader_Version": "2",
    "Separator": "Tab",
    "Decimal_Separator": ".",
    "Multi_Headings": "Yes",
    "X_Columns": "One",
    "Time_Pref": "Absolute",
    "Date": "2016/08/23",
    "Time": "10:45:47.0352557312499836422",
}
END = "***End_of_Header***"


def lvm(path: Path, *segments: list[list[str]], of_file: dict[str, str] | None = None, mark: str = "\t") -> Path:
    tags = OF_FILE | (of_file or {})
    head = ["LabVIEW Measurement", *(f"{tag}{mark}{text}" for tag, text in tags.items()), END, ""]
    lines = [mark.join(row) for segment in segments for row in [*segment, [""]]]
    text = "\r\n".join([*head, *lines])
    path.write_bytes((text.replace(".", ",") if tags["Decimal_Separator"] == "," else text).encode("cp1252"))
    return path


def segment(
    step: str, *, axis: np.ndarray | None = None, start: str = "10:45:47.0352557312499836422", **tags: list[str]
) -> list[list[str]]:
    """Two channels, their axis written to six decimals as LabVIEW does."""
    described = {
        "Channels": ["2"],
        "Samples": ["1"] * 2,
        "Date": ["2016/08/23"] * 2,
        "Time": [start] * 2,
        "Y_Unit_Label": ["g", "kN"],
        "X_Dimension": ["Time"] * 2,
        "X0": ["0.0000000000000000E+0"] * 2,
        "Delta_X": [step] * 2,
    } | tags
    rows = [
        ["" if axis is None else f"{axis[index]:.6f}", f"{SIGNAL[index]:.6f}", f"{2 * SIGNAL[index]:.6f}"]
        for index in range(SAMPLES)
    ]
    head = [[tag, *texts] for tag, texts in described.items()]
    return [*head, [END], ["X_Value", "acc", "Kraft (kN)", "Comment"], *rows]


def test_an_axis_of_times(tmp_path: Path) -> None:
    path = lvm(tmp_path / "a.lvm", segment("0.005000", axis=np.arange(SAMPLES) / 200))
    contents = read_lvm(path)
    (series,) = contents.series
    assert [(channel.name, channel.unit) for channel in series.channels] == [("acc", "m/s^2"), ("Kraft", "N")]
    assert series.sample_rate_hz == pytest.approx(200.0, rel=1e-9)
    assert series.start_time_ns == pytest.approx(START_NS, abs=2)
    np.testing.assert_allclose(series.values, [SIGNAL * 9.80665, SIGNAL * 2000], rtol=1e-15)
    assert contents.notes == (f"{path}: its dates are without zone, taken as UTC.",)
    assert contents.unread == ()


def test_the_axis_beats_a_step_that_is_wrong(tmp_path: Path) -> None:
    path = lvm(tmp_path / "a.lvm", segment("1.000000", axis=np.arange(SAMPLES) / 200))
    assert read_lvm(path).series[0].sample_rate_hz == pytest.approx(200.0, rel=1e-9)


@pytest.mark.parametrize(
    ("step", "rate_hz"),
    [
        ("1.953125E-5", 51200.0),
        ("3.906250E-5", 25600.0),
        ("0.001000", 1000.0),
        ("0.000333", 3000.0),
        ("0.005000", 200.0),
    ],
)
@pytest.mark.parametrize("decimal", [".", ","])
def test_a_step_alone_makes_a_round_rate(tmp_path: Path, step: str, rate_hz: float, decimal: str) -> None:
    path = lvm(tmp_path / "a.lvm", segment(step), of_file={"X_Columns": "No", "Decimal_Separator": decimal})
    contents = read_lvm(path)
    (series,) = contents.series
    assert (series.sample_rate_hz, series.start_time_ns) == (rate_hz, START_NS)
    np.testing.assert_allclose(series.values[1], SIGNAL * 2000, rtol=1e-15)
    assert f"the sample rate is {rate_hz:g} Hz by its step of {step.replace('.', decimal)}" in contents.notes[1]


def test_a_step_of_too_few_digits_is_asked_about(tmp_path: Path) -> None:
    # 0.000020 s is 48 kHz as well as 51.2 kHz.
    path = lvm(tmp_path / "a.lvm", segment("0.000020"), of_file={"X_Columns": "No"})
    with pytest.raises(SetupError, match=r"the step '0.000020' has too few digits to tell the rate.*--rate HZ"):
        read_lvm(path)
    assert read_lvm(path, sample_rate_hz=51200.0).series[0].sample_rate_hz == 51200.0


@pytest.mark.parametrize(
    "number", [f"{sign}1.000000E{power}" for sign in ("", "-") for power in ("-315", "-400", "-99999999999999999999")]
)
def test_a_number_that_a_double_does_not_tell_from_zero_is_zero(tmp_path: Path, number: str) -> None:
    path = lvm(tmp_path / "a.lvm", segment(number), of_file={"X_Columns": "No"})
    with pytest.raises(SetupError, match="to tell the rate"):
        read_lvm(path)
    path = lvm(tmp_path / "a.lvm", segment("0.0050000000", X0=[number] * 2), of_file={"X_Columns": "No"})
    (series,) = read_lvm(path).series
    assert (series.sample_rate_hz, series.start_time_ns) == (200.0, START_NS)


@pytest.mark.parametrize("columns", ["One", "No"])
def test_segments_follow_one_another_in_time(tmp_path: Path, columns: str) -> None:
    axis = None if columns == "No" else np.arange(SAMPLES) / 200
    # The second begins where the first ends, the third 50 ms later.
    starts = ("10:45:47.000", "10:45:47.300", "10:45:47.650")
    parts = [segment("0.005000", axis=axis, start=start) for start in starts]
    (series,) = read_lvm(lvm(tmp_path / "a.lvm", *parts, of_file={"X_Columns": columns})).series
    assert series.sample_rate_hz == pytest.approx(200.0, rel=1e-9)
    gap = np.zeros(3 * SAMPLES + 10, dtype=bool)
    gap[2 * SAMPLES : 2 * SAMPLES + 10] = True
    np.testing.assert_array_equal(series.valid, [~gap] * 2)
    np.testing.assert_allclose(series.values[0][~gap], np.tile(SIGNAL, 3) * 9.80665, rtol=1e-15)


def test_an_axis_for_each_channel(tmp_path: Path) -> None:
    fast, slow = np.arange(SAMPLES) / 200, np.arange(SAMPLES) / 100
    described = segment("0.005000")[:-SAMPLES]
    head = [[tag, texts[0], "", texts[-1]] for tag, *texts in described[:-2]]
    rows = [[f"{fast[i]:.6f}", f"{SIGNAL[i]:.6f}", f"{slow[i]:.6f}", f"{SIGNAL[i]:.6f}"] for i in range(SAMPLES)]
    titles = ["X_Value", "acc", "X_Value", "force", "Comment"]
    path = lvm(tmp_path / "a.lvm", [*head, [END], titles, *rows], of_file={"X_Columns": "Multi"})
    first, second = read_lvm(path).series
    assert (first.channels[0].name, first.channels[0].unit) == ("acc", "m/s^2")
    assert (second.channels[0].name, second.channels[0].unit) == ("force", "N")
    assert first.sample_rate_hz == pytest.approx(200.0, rel=1e-9)
    assert second.sample_rate_hz == pytest.approx(100.0, rel=1e-9)
    same = [[row[0], row[1], row[0], row[3]] for row in rows]
    path = lvm(tmp_path / "a.lvm", [*head, [END], titles, *same], of_file={"X_Columns": "Multi"})
    assert len(read_lvm(path).series) == 1


def test_absolute_times_count_from_1904(tmp_path: Path) -> None:
    axis = 2_082_844_800 + 1_714_564_800 + np.arange(SAMPLES) / 200
    (series,) = read_lvm(lvm(tmp_path / "a.lvm", segment("0.005000", axis=axis))).series
    assert series.start_time_ns == pytest.approx(1_714_564_800 * 10**9, abs=2)


def test_what_is_no_signal_costs_nothing_else(tmp_path: Path) -> None:
    rows = segment(
        "0.005000", axis=np.arange(SAMPLES) / 200, X_Dimension=["Time", "Frequency"], Y_Unit_Label=["EUs", "V"]
    )
    rows[-3].append("LOST COMMUNICATION")
    contents = read_lvm(lvm(tmp_path / "a.lvm", rows))
    assert [channel.name for channel in contents.series[0].channels] == ["acc"]
    assert contents.unread == (("Kraft", "against Frequency, not time"), ("Comment", "text"))
    assert any(
        "'acc': its unit can't be read, and its numbers are taken without one: unit 'EUs'" in note
        for note in contents.notes
    )


def test_a_comma_between_cells(tmp_path: Path) -> None:
    rows = segment("0.005000", axis=np.arange(SAMPLES) / 200)
    path = lvm(tmp_path / "a.lvm", rows, of_file={"Separator": "Comma"}, mark=",")
    assert read_lvm(path).series[0].samples == SAMPLES


def test_a_file_without_header_is_a_table(tmp_path: Path) -> None:
    rows = "".join(f"{index / 200:.6f}\t{SIGNAL[index]:.6f}\n" for index in range(SAMPLES))
    (tmp_path / "a.lvm").write_text(rows)
    (series,) = read_lvm(tmp_path / "a.lvm", time_unit="s").series
    assert series.sample_rate_hz == pytest.approx(200.0, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda raw: raw[:60], "its header has no end"),
        (lambda raw: raw[: raw.rindex(END.encode())], "holds a header and no rows"),
        (lambda raw: raw[: raw.index(b"X_Value")], "holds a header and no rows"),
        (lambda raw: raw[: raw.index(b"X_Value") + 30], "holds no channel over time"),
    ],
)
def test_damaged_files_are_told_in_one_line(tmp_path: Path, change: object, match: str) -> None:
    path = lvm(tmp_path / "a.lvm", segment("0.005000"))
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(LogError, match=match):
        read_lvm(path)


@pytest.mark.nightly
def test_wrong_bytes_never_crash(tmp_path: Path) -> None:
    path = lvm(tmp_path / "a.lvm", segment("0.005000", axis=np.arange(SAMPLES) / 200), segment("0.005000"))
    raw = path.read_bytes()
    rng = np.random.default_rng(2)
    refused = 0
    for number in range(80):
        changed = bytearray(raw)
        for place in rng.integers(0, 900 if number % 2 else len(raw), 4):
            changed[place] = rng.choice(list(b'0123456789-.eE \n,\t"\x00\xff'))
        path.write_bytes(changed[: rng.integers(1, len(raw))] if number % 5 == 0 else changed)
        try:
            read_lvm(path)
        except ChladniError:
            refused += 1
    assert refused > 10
