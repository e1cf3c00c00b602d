"""Units in universal files: label, type and dataset 164, where they agree and where they don't."""

from pathlib import Path

import numpy as np
import pytest

from chladni.io.files.contents import FileContents
from chladni.io.files.uff import read_uff
from chladni.io.files.uff_modes import UffModes, read_uff_modes
from chladni.signals.errors import LogError
from tests.io.files.uff_makers import function_set, response_set, units_set

G = 9.80665
POUND_FORCE = 0.45359237 * G
WAVE = np.sin(0.22 * np.arange(100)) + 0.3
LINES = np.exp(1j * np.arange(40) / 7)
MILLIMETRES = units_set(1000.0, 1000.0, code=5, description="mm (milli newton)")
INCHES = units_set(1 / 0.0254, 1 / POUND_FORCE, code=7, description="inch (pound f)")


def read(tmp_path: Path, content: bytes) -> FileContents:
    (tmp_path / "a.uff").write_bytes(content)
    return read_uff(tmp_path / "a.uff")


def factor_and_unit(contents: FileContents) -> tuple[float, str]:
    (series,) = contents.series
    # The text holds six digits of the largest number.
    return float(np.max(np.abs(series.values[0])) / np.max(np.abs(WAVE))), series.channels[0].unit


@pytest.mark.parametrize(
    ("kind", "label", "factor", "unit"),
    [
        (12, "ms^-2", 1.0, "m/s^2"),
        (12, "m/s/s", 1.0, "m/s^2"),
        (12, "Gs", G, "m/s^2"),
        (12, "G", G, "m/s^2"),
        (12, "g rms", G, "m/s^2"),
        (12, "m/s\udcb2", 1.0, "m/s^2"),
        (12, "m/s²", 1.0, "m/s^2"),
        (13, "lb", POUND_FORCE, "N"),
        (9, "LBF", POUND_FORCE, "N"),
        (13, "kg m/s^2", 1.0, "N"),
        (13, "Nm", 1.0, "N m"),
        (8, "mils", 2.54e-5, "m"),
        (8, "\udcb5m", 1e-6, "m"),
        (11, "mm/s", 1e-3, "m/s"),
        (12, "rad/s^2", 1.0, "rad/s^2"),
        (15, "psi", POUND_FORCE / 0.0254**2, "Pa"),
        (3, "ue", 1e-6, "1"),
        (0, "RPM", 2 * np.pi / 60, "rad/s"),
        (0, "Volts", 1.0, "V"),
        (21, "Pa", 1.0, "Pa"),
        (1, "m/s^2", 1.0, "m/s^2"),
    ],
)
def test_where_label_and_type_agree_nothing_is_said(
    tmp_path: Path, kind: int, label: str, factor: float, unit: str
) -> None:
    contents = read(tmp_path, function_set(WAVE, type=kind, label=label))
    found = factor_and_unit(contents)
    assert found[1] == unit
    assert found[0] == pytest.approx(factor, rel=1e-5)
    assert contents.notes == ()


@pytest.mark.parametrize(
    ("kind", "label", "axis", "factor", "unit"),
    [
        (0, "G", "Acceleration", G, "m/s^2"),
        (0, "lb", "Force", POUND_FORCE, "N"),
        (0, "NONE", "Acceleration (g)", G, "m/s^2"),
        (12, "", "acc [mm/s^2]", 1e-3, "m/s^2"),
        (12, "-", "NONE", 1.0, "m/s^2"),
    ],
)
def test_the_name_of_the_axis_helps_where_label_or_type_are_silent(
    tmp_path: Path, kind: int, label: str, axis: str, factor: float, unit: str
) -> None:
    contents = read(tmp_path, function_set(WAVE, type=kind, label=label, axis=axis))
    assert factor_and_unit(contents) == (pytest.approx(factor, rel=1e-5), unit)
    assert contents.notes == ()


@pytest.mark.parametrize(
    ("kind", "label", "words"),
    [
        (12, "EU", "whatever unit the sensor was set up in"),
        (0, "G", "it may be g or gauss"),
        (0, "lb", "it may be lbf or lbm"),
        (12, "dB", "logarithmic"),
        (12, "furlong", "'furlong': not known"),
    ],
)
def test_what_is_left_open_costs_only_its_own_unit(tmp_path: Path, kind: int, label: str, words: str) -> None:
    content = function_set(WAVE, type=kind, label=label) + function_set(WAVE, id1="other", label="g")
    contents = read(tmp_path, content)
    (series,) = contents.series
    assert [channel.unit for channel in series.channels] == ["1", "m/s^2"]
    np.testing.assert_allclose(series.values[0], WAVE, rtol=1e-5)
    (note,) = contents.notes
    assert "acc: " in note
    assert words in note
    assert "--read units=NAME:UNIT" in note
    stated = read_uff(tmp_path / "a.uff", units={"acc": "mm/s^2"})
    assert stated.series[0].channels[0].unit == "m/s^2"
    np.testing.assert_allclose(stated.series[0].values[0], 1e-3 * WAVE, rtol=1e-5)


@pytest.mark.parametrize(
    ("kind", "label", "factor", "unit", "words"),
    [
        (12, "V", 1.0, "V", "of type acceleration but labelled 'V', which is in V; the label was taken"),
        (13, "mV", 1e-3, "V", "of type excitation force but labelled 'mV', which is in V; the label was taken"),
        (12, "counts", 1.0, "1", "labelled 'counts', which is without unit; the label was taken"),
        (12, "mm", 1e-3, "m", "of type acceleration but labelled 'mm', which is in m; the label was taken"),
        (13, "g", G, "m/s^2", "of type excitation force but labelled 'g', which is in m/s^2; the label was taken"),
        (13, "kg", G, "N", "of type excitation force but labelled 'kg', which was taken as 9.80665 N"),
    ],
)
def test_where_label_and_type_contradict_each_other_the_label_is_taken_and_told(
    tmp_path: Path, kind: int, label: str, factor: float, unit: str, words: str
) -> None:
    contents = read(tmp_path, function_set(WAVE, type=kind, label=label))
    assert factor_and_unit(contents) == (pytest.approx(factor, rel=1e-5), unit)
    assert words in contents.notes[0]


@pytest.mark.parametrize(
    ("system", "kind", "direction", "factor", "unit"),
    [
        (b"", 12, 1, 1.0, "m/s^2"),
        (b"", 12, 4, 1.0, "rad/s^2"),
        (b"", 16, 1, 1.0, "kg"),
        (MILLIMETRES, 12, 1, 1e-3, "m/s^2"),
        (MILLIMETRES, 12, -5, 1.0, "rad/s^2"),
        (MILLIMETRES, 13, 1, 1e-3, "N"),
        (MILLIMETRES, 13, 6, 1e-6, "N m"),
        (MILLIMETRES, 15, 0, 1e3, "Pa"),
        (MILLIMETRES, 16, 1, 1.0, "kg"),
        (INCHES, 8, 2, 0.0254, "m"),
        (INCHES, 9, 3, POUND_FORCE, "N"),
        (INCHES, 15, 0, POUND_FORCE / 0.0254**2, "Pa"),
        (INCHES, 16, 0, POUND_FORCE / 0.0254, "kg"),
        (MILLIMETRES, 0, 1, 1.0, "1"),
    ],
)
def test_without_a_label_the_type_implies_the_unit_by_dataset_164(
    tmp_path: Path, system: bytes, kind: int, direction: int, factor: float, unit: str
) -> None:
    contents = read(tmp_path, system + function_set(WAVE, type=kind, dir=direction, label="NONE"))
    assert factor_and_unit(contents) == (pytest.approx(factor, rel=1e-5), unit)
    assert contents.notes == ()


def test_dataset_164_holds_for_what_follows_it(tmp_path: Path) -> None:
    records = [function_set(WAVE, id1=name, label="NONE") for name in ("before", "between", "behind")]
    contents = read(tmp_path, records[0] + MILLIMETRES + records[1] + INCHES + records[2])
    (series,) = contents.series
    # What stands before the first is read by it: a file in one system may say so at its end.
    np.testing.assert_allclose(series.values, np.outer([1e-3, 1e-3, 0.0254], WAVE), rtol=1e-5)


def test_a_label_goes_before_dataset_164_and_that_is_told_where_they_differ(tmp_path: Path) -> None:
    contents = read(tmp_path, MILLIMETRES + function_set(WAVE, label="g") + function_set(WAVE, id1="b", label="g"))
    assert factor_and_unit(contents) == (pytest.approx(G, rel=1e-5), "m/s^2")
    (note,) = contents.notes
    assert "acc, b: labelled 'g', where dataset 164 means 0.001 m/s^2; the label was taken" in note
    assert read(tmp_path, MILLIMETRES + function_set(WAVE, label="mm/s^2")).notes == ()
    assert read(tmp_path, INCHES + function_set(WAVE, type=13, label="lb")).notes == ()


def test_a_dataset_164_that_contradicts_itself_gives_no_unit(tmp_path: Path) -> None:
    doubtful = units_set(3.28083989501312334, 0.224808943, code=1, description="SI units")
    contents = read(tmp_path, doubtful + function_set(WAVE, label="NONE") + function_set(WAVE, id1="b", label="g"))
    (series,) = contents.series
    assert [channel.unit for channel in series.channels] == ["1", "m/s^2"]
    np.testing.assert_allclose(series.values[0], WAVE, rtol=1e-5)
    assert "dataset 164 names SI (units code 1), but divides lengths by 3.28084 and forces by 0.224809" in "".join(
        contents.notes
    )
    broken = b"    -1\n   164\n" + b"         1SI\n" + b"       zero      zero\n    -1\n"
    contents = read(tmp_path, broken + function_set(WAVE, label="NONE"))
    assert contents.series[0].channels[0].unit == "1"
    assert "dataset 1 (type 164) can't be read" in "".join(contents.notes)


def test_powers_of_a_general_quantity_are_held_against_its_label(tmp_path: Path) -> None:
    assert read(tmp_path, function_set(WAVE, type=1, powers=(1, 1), label="N m")).notes == ()
    assert read(tmp_path, function_set(WAVE, type=1, powers=(1, 1), label="V")).notes == ()
    contents = read(tmp_path, function_set(WAVE, type=1, powers=(1, 1), label="m/s^2"))
    assert contents.series[0].channels[0].unit == "m/s^2"
    assert "labelled 'm/s^2', but with the exponents length^1 force^1; the label was taken" in contents.notes[0]
    contents = read(tmp_path, function_set(WAVE, type=1, powers=(1, 1), label="NONE"))
    assert contents.series[0].channels[0].unit == "1"
    assert "no unit without a label" in contents.notes[0]


# --- abscissae ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("label", "kind", "axis", "step", "rate_hz"),
    [
        ("s", 17, "Time", 5e-3, 200.0),
        ("ms", 17, "Time", 5.0, 200.0),
        ("msec", 17, "NONE", 5.0, 200.0),
        ("\udcb5s", 17, "Time", 5000.0, 200.0),
        ("us", 0, "Time", 15.2588, 65536.0),
        ("min", 17, "Time", 0.01, 1 / 0.6),
        ("Sec", 17, "Time", 5e-3, 200.0),
        ("NONE", 17, "NONE", 5e-3, 200.0),
        ("NONE", 0, "Time [ms]", 5.0, 200.0),
        ("Time", 17, "s", 5e-3, 200.0),
    ],
)
def test_times_are_in_the_unit_of_their_label(
    tmp_path: Path, label: str, kind: int, axis: str, step: float, rate_hz: float
) -> None:
    contents = read(tmp_path, function_set(WAVE, x_label=label, x_type=kind, x_axis=axis, step=step, least=2 * step))
    (series,) = contents.series
    assert series.sample_rate_hz == pytest.approx(rate_hz, rel=1e-12)
    assert series.start_time_ns == pytest.approx(2 / rate_hz * 1e9, rel=1e-5, abs=0.5)
    assert not [note for note in contents.notes if "label" in note]


def test_uneven_times_are_in_the_unit_of_their_label(tmp_path: Path) -> None:
    rows = np.zeros(100, dtype=[("x", "<f4"), ("y", "<f4")])
    rows["x"], rows["y"] = np.arange(100) * 10.0, WAVE
    content = function_set(WAVE, raw=rows.tobytes(), even=0, x_label="ms")
    (series,) = read(tmp_path, content).series
    assert series.sample_rate_hz == pytest.approx(100.0, rel=1e-9)


@pytest.mark.parametrize(
    ("label", "kind", "words"),
    [
        ("Hz", 17, "is over 'Hz', not over time"),
        ("rev", 0, "is over 'rev', not over time"),
        ("mm", 17, "is over 'mm', not over time"),
        ("orders", 20, "is over 'orders', not over time"),
        ("NONE", 18, "is over frequency, not over time"),
        ("NONE", 8, "is over displacement, not over time"),
        ("ticks", 17, "is over 'ticks', which is no known unit of time"),
    ],
)
def test_a_wrong_time_axis_is_worse_than_none(tmp_path: Path, label: str, kind: int, words: str) -> None:
    record = function_set(WAVE, x_label=label, x_type=kind)
    with pytest.raises(LogError, match=words):
        read(tmp_path, record)
    contents = read(tmp_path, record + function_set(WAVE, id1="other"))
    assert [channel.name for channel in contents.series[0].channels] == ["other"]
    (note,) = contents.notes
    assert words in note
    assert "--read time_unit=ms" in note
    # The advice works.
    both = read_uff(tmp_path / "a.uff", time_unit="ms")
    assert [len(series.channels) for series in both.series] == [2]
    assert both.series[0].sample_rate_hz == 200_000.0


# --- frequency responses -----------------------------------------------------------------------------------------


def modal(tmp_path: Path, content: bytes) -> UffModes:
    (tmp_path / "a.uff").write_bytes(content)
    return read_uff_modes(tmp_path / "a.uff")


def function_of(found: UffModes) -> tuple[float, str, str]:
    assert found.response is not None
    factor = np.abs(found.response.values[0, 0]) / np.abs(LINES)
    assert np.ptp(factor) < 1e-9 * factor[0]
    return float(factor[0]), found.response.responses[0].unit, found.response.references[0].unit


@pytest.mark.parametrize(
    ("types", "labels", "expected"),
    [
        # Numerator and denominator, each with its own label or type.
        ((12, 13), ("m/s^2", "N"), (1.0, "m/s^2", "N")),
        ((12, 13), ("g", "NONE"), (G, "m/s^2", "N")),
        ((12, 13), ("g", "lb"), (G / POUND_FORCE, "m/s^2", "N")),
        ((12, 13), ("NONE", "NONE"), (1.0, "m/s^2", "N")),
        ((0, 0), ("g", "N"), (G, "m/s^2", "N")),
        ((12, 0), ("g", "V"), (G, "m/s^2", "V")),
        # The label of the ratio.
        ((12, 13), ("(m/s^2)/N", "NONE"), (1.0, "m/s^2", "N")),
        ((12, 13), ("m/s\udcb2/N", "NONE"), (1.0, "m/s^2", "N")),
        ((12, 13), ("m/s^2/N", "N"), (1.0, "m/s^2", "N")),
        ((12, 13), ("g/lb", "NONE"), (G / POUND_FORCE, "m/s^2", "N")),
        ((12, 13), ("1/kg", "NONE"), (1.0, "m/s^2", "N")),
        ((8, 13), ("mm/N", "NONE"), (1e-3, "m", "N")),
        ((11, 13), ("in/s/lbf", "NONE"), (0.0254 / POUND_FORCE, "m/s", "N")),
        ((1, 0), ("(1/N)*(m/s\udcb2)", "NONE"), (1.0, "m/s^2", "N")),
        ((0, 0), ("g/N", "NONE"), (G, "m/s^2", "N")),
        ((0, 0), ("g/N", "N"), (G, "m/s^2", "N")),
        ((0, 13), ("g/lbf", "NONE"), (G / POUND_FORCE, "m/s^2", "N")),
        ((12, 0), ("g/N", "NONE"), (G, "m/s^2", "N")),
        ((13, 12), ("N/(m/s^2)", "NONE"), (1.0, "N", "m/s^2")),
        # Nothing known, and a pressure that looks like a ratio.
        ((0, 0), ("NONE", "NONE"), (1.0, "1", "1")),
        ((0, 0), ("N/m^2", "NONE"), (1.0, "N/m^2", "1")),
    ],
)
def test_functions_by_types_and_labels(
    tmp_path: Path, types: tuple[int, int], labels: tuple[str, str], expected: tuple[float, str, str]
) -> None:
    found = modal(tmp_path, response_set(LINES, type=types[0], below_type=types[1], label=labels[0], below=labels[1]))
    factor, response, reference = function_of(found)
    assert (response, reference) == expected[1:]
    assert factor == pytest.approx(expected[0], rel=1e-9)
    assert found.notes == ()


def test_a_function_of_contradicting_units_keeps_its_values_and_says_so(tmp_path: Path) -> None:
    found = modal(tmp_path, response_set(LINES, label="kPa") + response_set(LINES, node=2, label="g"))
    assert function_of(found) == (pytest.approx(1e3), "Pa", "N")
    assert found.response is not None
    assert found.response.responses[1].unit == "m/s^2"
    (note,) = found.notes
    assert "1:+3: of type acceleration but labelled 'kPa'" in note
    assert "--read units=NAME:UNIT" in note


@pytest.mark.parametrize(
    ("label", "kind", "step", "hertz"),
    [
        ("Hz", 18, 0.25, 1.0),
        ("kHz", 18, 0.25, 1e3),
        ("rpm", 18, 15.0, 1 / 60),
        ("RPM", 19, 15.0, 1 / 60),
        ("NONE", 19, 15.0, 1 / 60),
        ("NONE", 18, 0.25, 1.0),
        ("CPM", 18, 15.0, 1 / 60),
        ("rad/s", 18, 1.5, 1 / (2 * np.pi)),
        ("1/s", 0, 0.25, 1.0),
        ("Frequency", 18, 0.25, 1.0),
    ],
)
def test_frequencies_are_in_the_unit_of_their_label(
    tmp_path: Path, label: str, kind: int, step: float, hertz: float
) -> None:
    found = modal(tmp_path, response_set(LINES, x_label=label, x_type=kind, step=step))
    assert found.response is not None
    np.testing.assert_allclose(found.response.frequency_hz, np.arange(40) * step * hertz, rtol=1e-12)
    assert found.notes == ()


@pytest.mark.parametrize(
    ("label", "kind", "words"),
    [
        ("orders", 20, "is over 'orders', not over frequency"),
        ("NONE", 20, "is over order, not over frequency"),
        ("s", 18, "is over 's', not over frequency"),
        ("lines", 18, "is over 'lines', which is no known unit of frequency"),
    ],
)
def test_functions_over_something_else_are_left_out(tmp_path: Path, label: str, kind: int, words: str) -> None:
    other = response_set(LINES, x_label=label, x_type=kind)
    with pytest.raises(LogError, match=words):
        modal(tmp_path, other)
    found = modal(tmp_path, other + response_set(LINES, node=2))
    assert found.response is not None
    assert [channel.name for channel in found.response.responses] == ["2:+3"]
    assert any(words in note and "left out" in note for note in found.notes)


def test_a_label_against_the_type_of_the_abscissa_is_told(tmp_path: Path) -> None:
    found = modal(tmp_path, response_set(LINES, x_label="Hz", x_type=17))
    assert "the type of the abscissa is time, its label 'Hz'; the label was taken" in found.notes[0]


def test_nodes_and_masses_by_a_dataset_164_that_contradicts_itself_are_told(tmp_path: Path) -> None:
    nodes = (
        b"    -1\n    15\n         1         0         0         8  1.00000E+03  0.00000E+00  0.00000E+00\n    -1\n"
    )
    found = modal(tmp_path, units_set(1000.0, 1000.0, code=1, description="SI") + nodes)
    assert found.geometry.position("1") == (1.0, 0.0, 0.0)
    assert any("names SI (units code 1)" in note and "taken by these factors" in note for note in found.notes)
