"""Modes in universal files: bytes written by hand after the format's description, pyuff as a witness, round trips."""

import shutil
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyuff
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chladni.io.files.uff_modes import UffModes, read_uff_modes, write_uff_modes
from chladni.io.files.uff_nodes import number_points
from chladni.io.log import open_log
from chladni.io.setup import Setup, load_setup
from chladni.signals.channel import AXES, Channel
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry, Point
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance
from chladni.signals.testing import assert_close
from tests import strategies as ours
from tests.io.files.uff_makers import response_set
from tests.modal.mode_makers import mode_set
from tests.modal.shapes.test_joint_treatment import GEOMETRY, arm, scaled_modes

# A file of six digits: half a unit in the last one.
SIX_DIGITS = 5e-6

# Two nodes, a trace line, and a complex mode at -1 + 100j rad/s with modal A 0 + 200j and modal B = -lambda A.
# Node 1 moves by 1 + 0j along x and 0.5 - 0.25j along y, node 2 by 0 + 2j along z.
BY_HAND = """\
    -1
    15
         1         0         0         8  0.00000E+00  0.00000E+00  0.00000E+00
         2         0         0         8  1.00000E+00 -2.50000E-01  3.00000D+00
    -1
    -1
    82
         1         2         8
NONE
         1         2
    -1
    -1
    55
Wing
Ground vibration test
21-Nov-09 12:00:00
NONE
NONE
         1         3         2         8         5         3
         2         6         1         1
 -1.00000E+00  1.00000E+02  0.00000E+00  2.00000E+02  2.00000E+04  2.00000E+02
         1
  1.00000E+00  0.00000E+00  5.00000E-01 -2.50000E-01  0.00000E+00  0.00000E+00
         2
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  2.00000E+00
    -1
"""
UNITS_MM = """\
    -1
   164
         5mm (milli newton)           2
  1.00000000000000000D+03  1.00000000000000000D+03  1.00000000000000000D+00
  2.73149999999999980D+02
    -1
"""


def read(tmp_path: Path, text: str) -> UffModes:
    path = tmp_path / "hand.uff"
    path.write_bytes(text.encode())
    return read_uff_modes(path)


def modes_of(found: UffModes) -> ModeSet:
    assert found.modes is not None
    return found.modes


def test_a_complex_mode_written_by_hand(tmp_path: Path) -> None:
    found = read(tmp_path, BY_HAND)
    modes = modes_of(found)
    omega = np.hypot(1, 100)
    np.testing.assert_allclose(modes.frequency_hz, [omega / (2 * np.pi)], rtol=1e-15)
    np.testing.assert_allclose(modes.damping_ratio, [1 / omega], rtol=1e-15)
    np.testing.assert_allclose(modes.poles, [-1 + 100j], rtol=1e-14)
    assert [(one.name, one.direction) for one in modes.channels] == [
        ("1:+x", AXES["+x"]),
        ("1:+y", AXES["+y"]),
        ("2:+z", AXES["+z"]),
    ]
    # Largest component 1: divided by 2j, and modal A by (2j)^2 with it.
    np.testing.assert_allclose(modes.shapes, [[1 / 2j, (0.5 - 0.25j) / 2j, 1.0]], rtol=1e-15)
    assert modes.scale is not None
    np.testing.assert_allclose(modes.scale.modal_a, [200j / (2j) ** 2], rtol=1e-15)
    assert np.isnan(modes.frequency_std_hz[0])
    assert found.geometry == Geometry(
        points=(Point(name="1", position=(0.0, 0.0, 0.0)), Point(name="2", position=(1.0, -0.25, 3.0))),
        lines=(("1", "2"),),
    )
    assert any("no error bars" in note for note in found.notes)


def test_millimetres_become_metres_and_kilograms_stay(tmp_path: Path) -> None:
    found = read(tmp_path, UNITS_MM + BY_HAND)
    assert found.geometry.position("2") == (0.001, -0.00025, 0.003)
    scale = modes_of(found).scale
    assert scale is not None
    # mN over mm/s^2 is a kilogram.
    np.testing.assert_allclose(scale.modal_a, [200j / (2j) ** 2], rtol=1e-15)


def test_pounds_and_inches_become_kilograms(tmp_path: Path) -> None:
    inches = UNITS_MM.replace(
        "1.00000000000000000D+03  1.00000000000000000D+03", " 3.93700787401574800D+01  2.24808943099710000D-01"
    )
    scale, plain = (modes_of(read(tmp_path, text)).scale for text in (inches + BY_HAND, BY_HAND))
    assert scale is not None
    assert plain is not None
    # lbf s^2/in is 175.127 kg.
    np.testing.assert_allclose(scale.modal_a / plain.modal_a, 175.126835, rtol=1e-6)


def test_the_half_below_the_axis_is_the_same_mode(tmp_path: Path) -> None:
    conjugate = (
        BY_HAND.replace(
            "-1.00000E+00  1.00000E+02  0.00000E+00  2.00000E+02",
            "-1.00000E+00 -1.00000E+02  0.00000E+00 -2.00000E+02",
        )
        .replace("5.00000E-01 -2.50000E-01", "5.00000E-01  2.50000E-01")
        .replace("0.00000E+00  2.00000E+00", "0.00000E+00 -2.00000E+00")
    )
    assert conjugate != BY_HAND
    assert_close(modes_of(read(tmp_path, conjugate)), modes_of(read(tmp_path, BY_HAND)), rtol=1e-15)


def test_columns_that_touch_are_told_apart(tmp_path: Path) -> None:
    touching = BY_HAND.replace("  5.00000E-01 -2.50000E-01  0.0", "-5.00000E-001-2.50000E-001  0.0")
    modes = modes_of(read(tmp_path, touching))
    np.testing.assert_allclose(modes.shapes[0, 1], (-0.5 - 0.25j) / 2j, rtol=1e-15)


def test_six_complex_values_a_node_take_two_lines(tmp_path: Path) -> None:
    start = BY_HAND.index("         1\n  1.00000E+00")
    text = BY_HAND[:start].replace(
        "         2         8         5         3", "         3         8         5         6"
    ) + (
        "         2\n"
        "  1.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00\n"
        "  0.00000E+00  0.00000E+00  5.00000E-01  1.00000E-01  0.00000E+00  0.00000E+00\n"
        "    -1\n"
    )
    modes = modes_of(read(tmp_path, text))
    assert [(one.name, one.unit) for one in modes.channels] == [("2:+x", "m"), ("2:+ry", "rad")]
    np.testing.assert_allclose(modes.shapes, [[1.0, 0.5 + 0.1j]])


def test_a_normal_mode_written_by_hand(tmp_path: Path) -> None:
    text = BY_HAND[BY_HAND.index("    -1\n    55") : BY_HAND.index("         1         3         2")] + (
        "         1         2         2        12         2         3\n"
        "         2         4         1         7\n"
        "  1.25000E+01  3.00000E+00  2.00000E-02  0.00000E+00\n"
        "         5\n"
        "  0.00000E+00  2.00000E+00  0.00000E+00\n"
        "         6\n"
        "  0.00000E+00 -1.00000E+00  0.00000E+00\n"
        "    -1\n"
    )
    modes = modes_of(read(tmp_path, text))
    assert (modes.frequency_hz[0], modes.damping_ratio[0]) == (12.5, 0.02)
    np.testing.assert_array_equal(modes.shapes, [[1.0, -0.5]])
    assert {one.unit for one in modes.channels} == {"m/s^2"}
    assert modes.scale is not None
    # Twice the shape is four times the mass.
    np.testing.assert_allclose(modes.scale.modal_mass, [0.75])
    hysteretic = modes_of(read(tmp_path, text.replace("2.00000E-02  0.00000E+00", "0.00000E+00  2.00000E-02")))
    assert hysteretic.damping_ratio[0] == 0.01


# The same as BY_HAND in datasets 2411 and 2414.
NEWER = """\
    -1
  2411
         1         0         0        11
   0.0000000000000000D+00   0.0000000000000000D+00   0.0000000000000000D+00
         2         0         0        11
   1.0000000000000000D+00  -2.5000000000000000D-01   3.0000000000000000D+00
    -1
    -1
  2414
         1
Mode shape record 1
         1
NONE
NONE
NONE
NONE
NONE
         1         3         2         8         5         3
         0         0         1         0         0         1         0         0
         0         0
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00
 -1.00000E+00  1.00000E+02  0.00000E+00  2.00000E+02  2.00000E+04  2.00000E+02
         1
  1.00000E+00  0.00000E+00  5.00000E-01 -2.50000E-01  0.00000E+00  0.00000E+00
         2
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  2.00000E+00
    -1
"""
NORMAL = (
    NEWER.replace(
        "         1         3         2         8         5         3",
        "         1         2         2        12         4         3",
    )
    .replace(
        "  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00\n -1.0",
        "  0.00000E+00  1.25000E+01  0.00000E+00  3.00000E+00  0.00000E+00  4.00000E-02\n -1.0",
    )
    .replace(
        "  1.00000E+00  0.00000E+00  5.00000E-01 -2.50000E-01  0.00000E+00  0.00000E+00",
        "  0.00000E+00  2.00000E+00  0.00000E+00",
    )
    .replace(
        "  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  2.00000E+00\n    -1",
        "  0.00000E+00 -1.00000E+00  0.00000E+00\n    -1",
    )
)


def test_newer_datasets_say_the_same(tmp_path: Path) -> None:
    older, newer = read(tmp_path, BY_HAND), read(tmp_path, NEWER)
    assert_close(modes_of(newer), modes_of(older), rtol=1e-15)
    assert newer.geometry.points == older.geometry.points
    assert read(tmp_path, NEWER.replace("  2411\n", "   781\n")).geometry == newer.geometry
    millimetres = read(tmp_path, UNITS_MM + NEWER)
    assert millimetres.geometry.position("2") == (0.001, -0.00025, 0.003)


def test_a_normal_mode_of_a_newer_dataset(tmp_path: Path) -> None:
    assert NORMAL.count("E+01") == 1
    modes = modes_of(read(tmp_path, NORMAL))
    # Hysteretic damping of 4 % loses what viscous damping of 2 % does.
    assert (modes.frequency_hz[0], modes.damping_ratio[0]) == (12.5, 0.02)
    np.testing.assert_array_equal(modes.shapes, [[1.0, -0.5]])
    assert {one.unit for one in modes.channels} == {"m/s^2"}
    assert modes.scale is not None
    np.testing.assert_allclose(modes.scale.modal_mass, [0.75])


def test_another_program_writes_newer_datasets(tmp_path: Path) -> None:
    nodes = {
        "type": 2411, "node_nums": [4, 9], "def_cs": [0, 0], "disp_cs": [0, 0], "color": [8, 8],
        "x": [0.1, 0.2], "y": [0.0, 1.0], "z": [-3.0, 4.0],
    }  # fmt: skip
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(nodes, mode="overwrite")
    geometry = read_uff_modes(tmp_path / "a.uff").geometry
    assert [(point.name, point.position) for point in geometry.points] == [
        ("4", (0.1, 0.0, -3.0)),
        ("9", (0.2, 1.0, 4.0)),
    ]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "         1         3         2         8",
            "         1         1         2         8",
            "analysis type 1 is no mode",
        ),
        ("record 1\n         1\n", "record 1\n         2\n", "its data aren't at nodes"),
        ("         8         5         3\n", "         8         5         9\n", "9 values a node"),
    ],
)
def test_newer_data_that_are_no_modes_are_left_out_and_said(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in NEWER
    found = read(tmp_path, NEWER.replace(old, new, 1))
    assert found.modes is None
    assert len(found.geometry.points) == 2
    assert any("a dataset 2414 was left out" in note and words in note for note in found.notes)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("         8         5         3\n", "         8         7         3\n", "data type 7; 2 and 4 are real"),
        ("  1.0000000000000000D+00  -2.5", "  1.00000000000x0000D+00  -2.5", "line 6: dataset 2411 found"),
        (
            "   1.0000000000000000D+00  -2.5000000000000000D-01   3.0000000000000000D+00\n",
            "",
            "coordinates of its last node",
        ),
    ],
)
def test_damage_of_newer_datasets_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in NEWER
    with pytest.raises(LogError, match=words):
        read(tmp_path, NEWER.replace(old, new, 1))


def test_what_is_not_read_is_told(tmp_path: Path) -> None:
    elements = "    -1\n  2412\n         1        11         2         1         7         2\n    -1\n"
    found = read(tmp_path, BY_HAND + elements + elements)
    assert any("left out: datasets 2412 (2)." in note for note in found.notes)


def test_what_is_no_mode_is_left_out_and_said(tmp_path: Path) -> None:
    deflection = BY_HAND[BY_HAND.index("    -1\n    55") :].replace(
        "         1         3         2", "         1         5         2"
    )
    still = BY_HAND[BY_HAND.index("    -1\n    55") :].replace(
        "-1.00000E+00  1.00000E+02", "-1.00000E+00  0.00000E+00"
    )
    scalar = BY_HAND[BY_HAND.index("    -1\n    55") :].replace("         5         3\n", "         5         1\n")
    found = read(tmp_path, BY_HAND + deflection + still + scalar)
    assert modes_of(found).frequency_hz.size == 1
    left_out = [note for note in found.notes if "left out" in note]
    assert len(left_out) == 3
    assert "analysis type 5 is no mode" in left_out[0]
    assert "doesn't oscillate" in left_out[1]
    assert "1 values a node" in left_out[2]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "         2\n  0.00000E+00  0.00000E+00",
            "         9\n  0.00000E+00  0.00000E+00",
            "moves at node 9, which",
        ),
        (
            "         1         2\n    -1",
            "         1         3\n    -1",
            "line through node 3, which dataset 15 doesn't",
        ),
        (
            "         2         0         0         8",
            "         1         0         0         8",
            "node 1 a second posi",
        ),
        ("         1         0         0         8", "        -1         0         0         8", "numbers a node -1"),
        ("3.00000D+00", "nan", "line 4: dataset 15 found"),
        ("1.00000E+02  0.00000E+00  2.0", "1.00000E+02  0.0000xE+00  2.0", "line 21: dataset 55 found"),
        (
            "  1.00000E+00  0.00000E+00  5.00000E-01 -2.5",
            "  1.00000E+00  0.00000E+00  inf -2.5",
            "6 numbers up to 1e100",
        ),
        ("         5         3\n", "         7         3\n", "data type 7; 2 is real and 5 complex"),
        (
            "         2         6         1         1",
            "         2         2         1         1",
            "announces 2 integers",
        ),
        ("         1         2         8\n", "         1 999999999         8\n", "announces 999999999 nodes"),
        (
            "         1         2         8\n",
            "         1        12         8\n",
            "12 nodes, which it can't|integers are due",
        ),
        (
            "         2\n  0.00000E+00  0.0",
            "         1\n  0.00000E+00  0.0",
            "gives node 1, which is no label or came",
        ),
    ],
)
def test_damage_is_named_with_its_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BY_HAND
    with pytest.raises(LogError, match=words) as caught:
        read(tmp_path, BY_HAND.replace(old, new, 1))
    assert "\n" not in str(caught.value)


def test_a_mode_cut_short_is_an_error_and_a_file_cut_off_a_note(tmp_path: Path) -> None:
    lines = BY_HAND.splitlines(keepends=True)
    with pytest.raises(LogError, match="ends before all that it announces"):
        read(tmp_path, "".join(lines[:-2]) + "    -1\n")
    cut = read(tmp_path, "".join(lines[:-1]))
    assert cut.modes is None
    assert len(cut.geometry.points) == 2
    assert any("cut off" in note for note in cut.notes)


def test_files_without_anything_modal(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such file"):
        read_uff_modes(tmp_path / "none.uff")
    with pytest.raises(LogError, match="no whole dataset"):
        read(tmp_path, "nothing")
    with pytest.raises(LogError, match=r"holds no mode, node or frequency response .* but datasets 164"):
        read(tmp_path, UNITS_MM)
    with pytest.raises(LogError, match="factors 0 and 1000 for length and force"):
        read(tmp_path, UNITS_MM.replace("1.00000000000000000D+03", "0.00000000000000000D+00", 1) + BY_HAND)


def test_local_coordinate_systems_are_said(tmp_path: Path) -> None:
    local = BY_HAND.replace("         2         0         0         8", "         2         0        11         8")
    assert any("coordinate systems of their own" in note for note in read(tmp_path, local).notes)


def test_trace_lines_lift_the_pen_at_zero(tmp_path: Path) -> None:
    lifted = BY_HAND.replace(
        "         1         2         8\nNONE\n         1         2",
        "         1         5         8\nNONE\n         1         2         0         2         1",
    )
    assert read(tmp_path, lifted).geometry.lines == (("1", "2"), ("2", "1"))


HAMMER = Channel(name="/hammer.force.x", unit="N", role="reference", point="wrist", direction=AXES["-x"])


def measured_arm() -> tuple[ModeSet, FrequencyResponse]:
    """The arm's modes, scaled by a hammer that hits the wrist against x, and its accelerances in closed form."""
    modes = scaled_modes()
    assert modes.scale is not None
    participation = -modes.shapes[:, 3:4] / modes.scale.modal_a[:, np.newaxis]
    scale = replace(modes.scale, reference=HAMMER.name)
    frequency_hz = np.arange(40, 300) * (400 / 8192)
    values = -arm().accelerance(frequency_hz)[:, 3:4]
    response = FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=0.01 * np.abs(values),
        coherence=np.full((4, frequency_hz.size), 0.99),
        excited=frequency_hz > 3.0,
        responses=modes.channels,
        references=(HAMMER,),
        provenance=Provenance(estimator="H1"),
    )
    return replace(modes, references=(HAMMER,), participation=participation, scale=scale), response


@pytest.mark.parametrize("binary", [True, False])
def test_round_trip(tmp_path: Path, binary: bool) -> None:
    modes, response = measured_arm()
    losses = write_uff_modes(tmp_path / "a.uff", modes, geometry=GEOMETRY, response=response, binary=binary)
    found = read_uff_modes(tmp_path / "a.uff")
    again = modes_of(found)
    assert found.geometry == GEOMETRY
    assert again.channels == modes.channels
    assert again.references == modes.references
    np.testing.assert_array_equal(again.frequency_hz, modes.frequency_hz)
    np.testing.assert_array_equal(again.damping_ratio, modes.damping_ratio)
    np.testing.assert_array_equal(again.frequency_std_hz, modes.frequency_std_hz)
    np.testing.assert_array_equal(again.damping_std, modes.damping_std)
    np.testing.assert_allclose(again.shapes, modes.shapes, rtol=SIX_DIGITS)
    assert again.scale is not None
    assert modes.scale is not None
    assert (again.scale.response, again.scale.reference) == ("/wrist.a", HAMMER.name)
    np.testing.assert_allclose(again.scale.modal_a, modes.scale.modal_a, rtol=SIX_DIGITS)
    np.testing.assert_allclose(again.scale.modal_mass, modes.scale.modal_mass, rtol=2 * SIX_DIGITS)
    np.testing.assert_allclose(again.scale.modal_mass_std, modes.scale.modal_mass_std, rtol=1e-8)
    assert again.participation is not None
    assert modes.participation is not None
    np.testing.assert_allclose(again.participation, modes.participation, rtol=2 * SIX_DIGITS)
    assert np.isnan(again.shape_std[again.shapes != 1]).all()
    keep = response.excited
    assert found.response is not None
    expected = replace(
        response,
        frequency_hz=response.frequency_hz[keep],
        values=response.values[..., keep],
        std=response.std[..., keep],
        coherence=response.coherence[:, keep],
        excited=keep[keep],
    )
    # Binary is exact; text has twelve digits.
    assert_close(found.response, expected, rtol=0.0 if binary else 1e-11)
    assert any("rounded to six digits" in loss for loss in losses)
    assert any("22 lines that the references don't excite" in loss for loss in losses)
    assert binary == (not any("twelve digits" in loss for loss in losses))


@pytest.mark.parametrize("binary", [True, False])
def test_another_program_reads_the_same(tmp_path: Path, binary: bool) -> None:
    modes, response = measured_arm()
    write_uff_modes(tmp_path / "a.uff", modes, geometry=GEOMETRY, response=response, binary=binary)
    sets = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    kinds = [one["type"] for one in sets]
    assert kinds[:4] == [151, 164, 15, 82]
    assert kinds[4:8] == [55] * 4
    assert set(kinds[8:]) == {58}
    assert (sets[1]["length"], sets[1]["force"]) == (1.0, 1.0)
    nodes, trace, shapes, functions = sets[2], sets[3], sets[4:8], sets[8:]
    assert nodes["node_nums"] == [1, 2, 3, 4]
    assert trace["nodes"].tolist() == [1, 2, 3, 4]
    assert modes.scale is not None
    for row, one in enumerate(shapes):
        assert (one["analysis_type"], one["data_type"], one["mode_n"]) == (3, 5, row + 1)
        np.testing.assert_allclose(one["eig"], modes.poles[row], rtol=SIX_DIGITS)
        np.testing.assert_allclose(one["modal_a"], modes.scale.modal_a[row], rtol=SIX_DIGITS)
        np.testing.assert_allclose(one["modal_b"], -modes.poles[row] * modes.scale.modal_a[row], rtol=SIX_DIGITS)
        np.testing.assert_allclose(one["r1"], modes.shapes[row], rtol=SIX_DIGITS)
        assert not one["r2"].any()
    measured = [one for one in functions if one["func_type"] == 4]
    for row, one in enumerate(measured):
        assert (one["rsp_node"], one["rsp_dir"], one["ref_node"], one["ref_dir"]) == (row + 1, 1, 4, -1)
        assert (one["ordinate_axis_units_lab"], one["orddenom_axis_units_lab"]) == ("m/s^2", "N")
        np.testing.assert_allclose(one["data"], response.values[row, 0, response.excited], rtol=1e-11)
    if binary:
        assert {one["n_bytes"] for one in measured} == {16 * int(response.excited.sum())}, "readers go by this size"


def test_the_same_modes_give_the_same_bytes(tmp_path: Path) -> None:
    modes, response = measured_arm()
    for name in ("a.uff", "b.uff"):
        write_uff_modes(tmp_path / name, modes, geometry=GEOMETRY, response=response)
    assert (tmp_path / "a.uff").read_bytes() == (tmp_path / "b.uff").read_bytes()


def test_complex_shapes_and_turned_sensors_keep_their_phase(tmp_path: Path) -> None:
    points = tuple(Point(name=str(node), position=(float(node), 0.0, 0.0)) for node in (3, 7))
    channels = (
        Channel(name="a", unit="m/s^2", point="3", direction=AXES["-x"]),
        Channel(name="b", unit="m/s^2", point="7", direction=AXES["+y"]),
        Channel(name="c", unit="rad/s^2", point="7", direction=AXES["+z"]),
    )
    modes = replace(mode_set([[1.0, 0.5 - 0.25j, 0.125j]]), channels=channels)
    losses = write_uff_modes(tmp_path / "a.uff", modes, geometry=Geometry(points=points))
    found = read_uff_modes(tmp_path / "a.uff")
    assert [(one.name, one.unit) for one in modes_of(found).channels] == [
        ("3:+x", "m/s^2"),
        ("7:+y", "m/s^2"),
        ("7:+rz", "rad/s^2"),
    ]
    np.testing.assert_array_equal(modes_of(found).shapes, [[1.0, -0.5 + 0.25j, -0.125j]])
    assert [point.name for point in found.geometry.points] == ["3", "7"]
    assert any("units of the channels differ" in loss for loss in losses)


def test_channels_without_a_place_are_written_and_said(tmp_path: Path) -> None:
    oblique = Channel(name="o", unit="m", point="q", direction=(0.6, 0.8, 0.0))
    twin = Channel(name="t", unit="m", point="q", direction=AXES["+x"])
    modes = replace(mode_set([[1.0, 0.5, 0.2]]), channels=(Channel(name="n", unit="m"), oblique, twin))
    losses = " ".join(write_uff_modes(tmp_path / "a.uff", modes, geometry=Geometry()))
    for words in ("n: has no direction", "o: its direction is along no axis", "t: left out", "n: without point"):
        assert words in losses
    found = modes_of(read_uff_modes(tmp_path / "a.uff"))
    np.testing.assert_allclose(found.shapes, [[1.0, 0.3, 0.4]], rtol=SIX_DIGITS)
    placed = " ".join(write_uff_modes(tmp_path / "a.uff", modes, geometry=GEOMETRY))
    assert "q: has no position; node 6 was written at the origin." in placed


def test_names_of_points_off_the_lines_are_lost_and_said(tmp_path: Path) -> None:
    geometry = Geometry(
        points=tuple(Point(name=name, position=(0.0, 0.0, 0.0)) for name in ("a", "b", "lone", "9")),
        lines=(("a", "b"),),
    )
    nothing = mode_set(np.zeros((0, 1)), channels=(Channel(name="c", unit="m/s^2", point="a", direction=AXES["+x"]),))
    losses = write_uff_modes(tmp_path / "a.uff", nothing, geometry=geometry)
    assert "lone: the point became node 3; a universal file numbers its points." in losses
    found = read_uff_modes(tmp_path / "a.uff")
    assert found.modes is None
    assert [point.name for point in found.geometry.points] == ["a", "b", "3", "9"]
    assert number_points(["1", "x", "01", "y"]) == {"1": 1, "x": 2, "01": 3, "y": 4}


def test_long_lines_are_cut_where_the_format_ends(tmp_path: Path) -> None:
    names = tuple(str(node) for node in range(1, 601))
    geometry = Geometry(points=tuple(Point(name=name, position=(0.0, 0.0, 0.0)) for name in names), lines=(names,))
    losses = write_uff_modes(tmp_path / "a.uff", mode_set(np.zeros((0, 1))), geometry=geometry)
    lines = read_uff_modes(tmp_path / "a.uff").geometry.lines
    assert max(map(len, lines)) <= 250
    assert [one for line in lines for one in (line if line is lines[0] else line[1:])] == list(names)
    assert any("cut into trace lines" in loss for loss in losses)


def test_modal_a_of_another_excitation_isnt_written_as_kilograms(tmp_path: Path) -> None:
    modes, _ = measured_arm()
    volts = replace(modes, references=(replace(HAMMER, unit="V"),))
    losses = write_uff_modes(tmp_path / "a.uff", volts, geometry=GEOMETRY)
    assert any("modal A, which isn't per newton" in loss for loss in losses)
    assert modes_of(read_uff_modes(tmp_path / "a.uff")).scale is None


def test_modes_of_which_one_is_unscaled(tmp_path: Path) -> None:
    modes, _ = measured_arm()
    assert modes.scale is not None
    modal_a = modes.scale.modal_a.copy()
    modal_a[2] = complex(np.nan, np.nan)
    partly = replace(modes, scale=replace(modes.scale, modal_a=modal_a))
    write_uff_modes(tmp_path / "a.uff", partly, geometry=GEOMETRY)
    found = modes_of(read_uff_modes(tmp_path / "a.uff"))
    assert found.scale is not None
    assert np.isnan(found.scale.modal_mass).tolist() == [False, False, True, False]
    assert found.references == (Channel(name="wrist:-1 (reference)", unit="N", role="reference"),)
    assert found.participation is not None
    np.testing.assert_allclose(found.participation[0], modes.participation[0], rtol=2 * SIX_DIGITS)  # type: ignore[index]


def test_several_references_and_what_doesnt_fit(tmp_path: Path) -> None:
    _, one = measured_arm()
    second = Channel(name="/shaker.force.y" + "y" * 80, unit="N", role="reference", point="arm", direction=AXES["+y"])
    frequency_hz = one.frequency_hz**1.5
    std = np.concatenate([one.std, np.full_like(one.std, np.inf)], axis=1)
    both = replace(
        one,
        frequency_hz=frequency_hz,
        values=np.concatenate([one.values, 2 * one.values], axis=1),
        std=std,
        references=(HAMMER, second),
    )
    losses = " ".join(write_uff_modes(tmp_path / "a.uff", mode_set([[1.0]]), geometry=GEOMETRY, response=both))
    for words in (
        "multiple coherence isn't stored",
        "aren't finite and weren't stored",
        "cut to 80 ASCII characters",
    ):
        assert words in losses
    found = read_uff_modes(tmp_path / "a.uff").response
    assert found is not None
    np.testing.assert_array_equal(found.frequency_hz, frequency_hz[one.excited])
    np.testing.assert_array_equal(found.values, both.values[..., one.excited])
    assert np.isinf(found.std[:, 1]).all()
    assert np.isnan(found.coherence).all()
    text = " ".join(
        write_uff_modes(tmp_path / "t.uff", mode_set([[1.0]]), geometry=GEOMETRY, response=both, binary=False)
    )
    assert "unevenly spaced lines are rounded to six digits" in text


def frf_set(**fields: object) -> dict[str, object]:
    """A function as another tool writes it."""
    base = pyuff.prepare_58(
        binary=0, func_type=4, rsp_node=1, rsp_dir=3, ref_node=2, ref_dir=3, data=np.array([1 + 1j, 2.0, 3j]),
        x=np.array([1.0, 2.0, 3.0]), id1="Frame 1", rsp_ent_name="NONE", ref_ent_name="NONE", abscissa_spacing=1,
        abscissa_spec_data_type=18, ordinate_spec_data_type=12, orddenom_spec_data_type=13,
        ordinate_axis_units_lab="g", orddenom_axis_units_lab="N", return_full_dict=True,
    )  # fmt: skip
    base["ordinate_axis_lab"] = base["orddenom_axis_lab"] = base["abscissa_axis_lab"] = "NONE"
    for key, value in list(base.items()):
        if value is None:
            del base[key]
    return {**base, **fields}


def written(path: Path, *sets: dict[str, object]) -> UffModes:
    pyuff.UFF(str(path)).write_sets(list(sets), mode="overwrite")
    return read_uff_modes(path)


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_functions_of_another_tool(tmp_path: Path) -> None:
    found = written(tmp_path / "a.uff", frf_set(), frf_set(rsp_node=4, data=np.array([1.0 + 0j, 1.0, 1.0])))
    assert found.modes is None
    assert found.response is not None
    assert [one.name for one in found.response.responses] == ["1:+3", "4:+3"]
    assert found.response.references[0].name == "2:+3 (reference)"
    assert found.response.unit(0, 0) == "(m/s^2)/N"
    np.testing.assert_allclose(found.response.values[0, 0], 9.80665 * np.array([1 + 1j, 2, 3j]), rtol=1e-11)
    np.testing.assert_allclose(found.response.frequency_hz, [1, 2, 3])


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_functions_that_make_no_grid_are_left_out_and_said(tmp_path: Path) -> None:
    pairs = [
        frf_set(),
        frf_set(ref_node=5),
        frf_set(rsp_node=4),
        frf_set(),
        frf_set(rsp_node=6, x=np.array([1.0, 1.5, 2.0])),
    ]
    found = written(tmp_path / "a.uff", *pairs)
    assert found.response is not None
    assert found.response.values.shape == (1, 2, 3)
    assert any("2 functions left out: repeated, or of another frequency axis" in note for note in found.notes)
    assert any("1 function left out: not every response has every reference" in note for note in found.notes)
    none = written(tmp_path / "b.uff", frf_set(), frf_set(rsp_node=4, ref_node=5), *nodes_set())
    assert none.response is None


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_functions_with_impossible_axes_are_left_out_and_unknown_units_told(tmp_path: Path) -> None:
    falling = frf_set(abscissa_spacing=0, x=np.array([1.0, 3.0, 2.0]))
    with pytest.raises(LogError, match="dataset 1: its frequencies don't rise"):
        written(tmp_path / "a.uff", falling)
    both = written(tmp_path / "b.uff", falling, frf_set(rsp_node=4, ordinate_axis_units_lab="furlong"))
    assert both.response is not None
    assert both.response.unit(0, 0) == "1/N"
    np.testing.assert_allclose(both.response.values[0, 0], [1 + 1j, 2, 3j], rtol=1e-11)
    told = "\n".join(both.notes)
    assert "its frequencies don't rise; the file is damaged; it was left out" in told
    assert "4:+3: unit 'furlong'" in told


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_values_that_are_no_numbers_are_masked(tmp_path: Path) -> None:
    path = tmp_path / "a.uff"
    written(path, *nodes_set(), frf_set(binary=1, data=np.array([1.0, 12345.0, 1j])))
    # Pyuff writes zero for NaN, other tools don't.
    path.write_bytes(path.read_bytes().replace(struct.pack("<d", 12345.0), struct.pack("<d", np.nan)))
    masked = read_uff_modes(path).response
    assert masked is not None
    assert masked.excited.tolist() == [True, False, True]


def setup_of(tmp_path: Path, text: str) -> Setup:
    (tmp_path / "setup.toml").write_text(f'format = "chladni.setup/1"\n{text}')
    return load_setup(tmp_path / "setup.toml")


LINES = np.exp(1j * np.arange(40) / 7)
PLACED = """
[[point]]
name = "tip"
position = [1.0, 0.0, 0.0]
[[point]]
name = "1"
position = [0.0, 0.0, 0.0]
[[line]]
points = ["1", "tip"]
[[channel]]
path = "1:+3"
unit = "g"
point = "tip"
direction = "-z"
range = "50 g"
[[channel]]
path = "1:+3 (reference)"
unit = "lbf"
"""


def test_a_setup_file_says_what_the_functions_do_not(tmp_path: Path) -> None:
    path = tmp_path / "a.uff"
    path.write_bytes(response_set(LINES, type=0, below_type=0, label="NONE"))
    bare, found = open_log(path), open_log(path, setup=setup_of(tmp_path, PLACED))
    assert bare.functions is not None
    assert bare.functions.unit(0, 0) == "1"
    assert found.functions is not None
    np.testing.assert_allclose(found.functions.values, bare.functions.values * 9.80665 / 4.4482216152605, rtol=1e-15)
    assert found.functions.unit(0, 0) == "(m/s^2)/N"
    (channel,) = found.functions.responses
    assert (channel.name, channel.point, channel.direction) == ("1:+3", "tip", AXES["-z"])
    assert channel.overload == pytest.approx(490.3325)
    assert found.geometry.lines == (("1", "tip"),)


def test_a_setup_file_that_does_not_fit_the_functions_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.uff"
    path.write_bytes(response_set(LINES))
    wrong = setup_of(tmp_path, '[[channel]]\npath = "1:+2"\nunit = "g"\n')
    with pytest.raises(SetupError, match=r"setup.toml:2: .* has no channel '1:\+2'; did you mean 1:\+3"):
        open_log(path, setup=wrong)
    path.write_bytes(response_set(LINES, label="g/N", type=12))
    of_ratio = setup_of(tmp_path, '[[channel]]\npath = "1:+3"\nunit = "g"\n')
    with pytest.raises(SetupError, match="labels the ratio of response and reference; leave it out"):
        open_log(path, setup=of_ratio)
    half = setup_of(tmp_path, '[[channel]]\npath = "1:+3"\nrange = "50 N"\n')
    with pytest.raises(SetupError, match="range: it is in N, the channel in m/s"):
        open_log(path, setup=half)


def nodes_set() -> list[dict[str, object]]:
    return [{"type": 15, "node_nums": [1, 2], "x": [0.0, 1.0], "y": [0.0, 0.0], "z": [0.0, 0.0]}]


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(modes=ours.mode_sets(), geometry=ours.geometries())
def test_any_modes_are_written_and_read(
    tmp_path_factory: pytest.TempPathFactory, modes: ModeSet, geometry: Geometry
) -> None:
    path = tmp_path_factory.mktemp("uff") / "a.uff"
    losses = write_uff_modes(path, modes, geometry=geometry)
    assert all(loss.endswith(".") and "\n" not in loss for loss in losses)
    found = read_uff_modes(path)
    assert len(found.geometry.points) >= len(geometry.points)
    if found.modes is not None:
        assert set(found.modes.frequency_hz) <= set(modes.frequency_hz)
        np.testing.assert_array_equal(np.abs(found.modes.shapes).max(axis=1), 1.0)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_files_are_refused_or_read_and_never_crash(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content = bytearray((UNITS_MM + BY_HAND).encode())
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(content) - 1))
        kind = data.draw(st.sampled_from(("change", "cut", "insert")))
        if kind == "change":
            content[place] = data.draw(st.integers(0, 255))
        elif kind == "cut":
            del content[place : place + data.draw(st.integers(1, 200))]
        else:
            content[place:place] = data.draw(st.binary(min_size=1, max_size=20))
        content = content or bytearray(b" ")
    path = tmp_path_factory.mktemp("damaged") / "a.uff"
    path.write_bytes(content)
    outcome = read_or_error(path)
    assert isinstance(outcome, UffModes) or "\n" not in outcome


def read_or_error(path: Path) -> UffModes | str:
    """What the file holds, or why it's refused; anything else than our own error goes through."""
    try:
        return read_uff_modes(path)
    except ChladniError as error:
        return str(error)


def test_measured_functions_of_other_tools_are_refused_in_one_line(shared_data: Path, tmp_path: Path) -> None:
    files = sorted(shared_data.glob("*.uff"))
    assert files
    for file in files:
        shutil.copy(file, tmp_path / file.name)
        outcome = read_or_error(tmp_path / file.name)
        if isinstance(outcome, UffModes):
            assert outcome.response is not None or outcome.geometry.points
        else:
            assert "holds no mode, node or frequency response" in outcome
