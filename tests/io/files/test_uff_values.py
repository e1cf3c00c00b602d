"""Values of universal files: number formats by their definition, sizes by the header, text of Fortran."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from chladni.io.files.uff import read_uff
from chladni.io.files.uff_values import binary_values, layout_of, text_values
from chladni.signals.errors import LogError
from tests.io.files.uff_makers import function_set, ibm, units_set, vax_f

# A measured vibration: a tone, an offset, and the noise of a converter.
WAVE = (0.3 + np.sin(0.22 * np.arange(300)) + 1e-3 * np.random.default_rng(5).standard_normal(300)).astype(np.float32)
LITTLE, BIG = WAVE.astype("<f4").tobytes(), WAVE.astype(">f4").tobytes()
DEC, IEEE, IBM = 1, 2, 3


def decoded(raw: bytes, *, order: int, form: int, kind: int = 2, count: int = 300, even: bool = True) -> NDArray:
    layout = layout_of(kind, count, even=even)
    assert layout is not None
    return binary_values(raw, layout, byte_order=order, number_format=form).data


@pytest.mark.parametrize(
    ("raw", "order", "form", "rtol"),
    [
        (LITTLE, 1, IEEE, 0.0),
        (BIG, 2, IEEE, 0.0),
        (vax_f(WAVE), 1, DEC, 0.0),
        (vax_f(WAVE), 0, DEC, 0.0),
        # Six hexadecimal digits, of which the first may be 1: 21 bits.
        (ibm(WAVE), 2, IBM, 2.0**-20),
    ],
)
def test_numbers_are_read_in_the_stated_format(raw: bytes, order: int, form: int, rtol: float) -> None:
    np.testing.assert_allclose(decoded(raw, order=order, form=form), WAVE, rtol=rtol, atol=0)


def test_double_precision_of_each_format() -> None:
    wave = WAVE.astype(np.float64) * np.pi
    for raw, order, form, rtol in (
        (wave.astype("<f8").tobytes(), 1, IEEE, 0.0),
        (wave.astype(">f8").tobytes(), 2, IEEE, 0.0),
        (ibm(wave, 14), 2, IBM, 2.0**-52),
    ):
        np.testing.assert_allclose(decoded(raw, order=order, form=form, kind=4), wave, rtol=rtol, atol=0)
    # Of DEC's two formats of eight bytes the header tells neither.
    with pytest.raises(LogError, match="D or G floating; export it as text"):
        decoded(wave.astype("<f8").tobytes(), order=1, form=DEC, kind=4)


def test_numbers_of_old_machines_by_the_examples_of_their_manuals() -> None:
    # VAX: 1.0 is 0x4080 in its first word. System/370: -118.625 is C276A000.
    assert vax_f([1.0]) == bytes.fromhex("80400000")
    assert ibm([-118.625]) == bytes.fromhex("c276a000")
    layout = layout_of(2, 1, even=True)
    assert layout is not None
    assert binary_values(bytes.fromhex("80400000"), layout, byte_order=1, number_format=DEC).data == [1.0]
    assert binary_values(bytes.fromhex("c276a000"), layout, byte_order=2, number_format=IBM).data == [-118.625]


@pytest.mark.parametrize("raw", [LITTLE, BIG, vax_f(WAVE)])
def test_an_open_format_is_told_by_the_values(raw: bytes) -> None:
    layout = layout_of(2, 300, even=True)
    assert layout is not None
    values = binary_values(raw, layout, byte_order=0, number_format=0)
    np.testing.assert_array_equal(values.data, WAVE)
    assert "doesn't state the number format" in values.notes[0]


@pytest.mark.parametrize(
    ("raw", "count"),
    [
        # A System/370 number may be an IEEE one of half the binary exponent; a constant is anything.
        (ibm(WAVE), 300),
        (np.ones(300, dtype=">f4").tobytes(), 300),
        (np.random.default_rng(1).bytes(1200), 300),
    ],
)
def test_an_open_format_that_values_leave_open_is_refused_with_what_to_do(raw: bytes, count: int) -> None:
    with pytest.raises(LogError, match=r"they may be .*columns 8 to 19 of its line 58b.*or export it as text"):
        decoded(raw, order=0, form=0, count=count)


@pytest.mark.parametrize(("order", "form"), [(2, IEEE), (1, DEC), (2, IBM), (2, 0)])
def test_a_format_in_which_values_cannot_be_measured_is_doubted(order: int, form: int) -> None:
    layout = layout_of(2, 300, even=True)
    assert layout is not None
    values = binary_values(LITTLE, layout, byte_order=order, number_format=form)
    np.testing.assert_array_equal(values.data, WAVE)
    assert "read as IEEE little endian, in which alone they can be" in values.notes[0]


def test_values_that_are_no_numbers_are_no_reason_to_doubt_a_format() -> None:
    wave = WAVE.copy()
    wave[7] = np.nan
    found = decoded(wave.astype("<f4").tobytes(), order=1, form=IEEE)
    np.testing.assert_array_equal(found, wave)


@given(
    values=st.lists(st.floats(-1e6, 1e6, width=32, allow_subnormal=False), min_size=1, max_size=40),
    order=st.sampled_from((1, 2)),
)
def test_any_finite_numbers_come_back_from_the_format_they_were_written_in(values: list[float], order: int) -> None:
    sizes = np.abs(np.array(values)[np.array(values) != 0.0])
    # Wider spans are those of a wrong format, and refused.
    assume(not sizes.size or sizes.max() < 2.0**64 * np.median(sizes))
    raw = np.array(values, dtype="<f4" if order == 1 else ">f4").tobytes()
    layout = layout_of(2, len(values), even=True)
    assert layout is not None
    found = binary_values(raw, layout, byte_order=order, number_format=IEEE)
    # A format is doubted only where the values can't be measured ones: a millionth of the smallest number among them.
    if not found.notes:
        np.testing.assert_array_equal(found.data, np.array(values, dtype=np.float32))


def read_one(tmp_path: Path, content: bytes) -> tuple[NDArray, tuple[str, ...]]:
    (tmp_path / "a.uff").write_bytes(content)
    contents = read_uff(tmp_path / "a.uff")
    (series,) = contents.series
    return series.values[0], contents.notes


def test_a_line_of_minus_one_among_the_values_ends_nothing(tmp_path: Path) -> None:
    raw = bytearray(LITTLE)
    raw[40:52] = b"\n    -1\n    "
    (tmp_path / "a.uff").write_bytes(
        function_set(WAVE, raw=bytes(raw)) + function_set(WAVE[:3], id1="next", step=1.0)
    )
    contents = read_uff(tmp_path / "a.uff")
    assert contents.notes == ()
    np.testing.assert_array_equal(contents.series[0].values[0], np.frombuffer(bytes(raw), dtype="<f4"))
    assert [series.channels[0].name for series in contents.series] == ["acc", "next"]


@pytest.mark.parametrize("size", [0, 600, 99999, -1])
def test_a_wrong_size_in_the_header_gives_way_to_where_the_dataset_ends(tmp_path: Path, size: int) -> None:
    values, _ = read_one(tmp_path, function_set(WAVE, raw=LITTLE, bytes=size) + units_set(1.0, 1.0))
    np.testing.assert_array_equal(values, WAVE)


@pytest.mark.parametrize("before_end", [b"\n", b"\r\n"])
def test_the_end_may_stand_on_a_line_of_its_own(tmp_path: Path, before_end: bytes) -> None:
    content = function_set(WAVE, raw=LITTLE, before_end=before_end, newline=b"\r\n")
    values, notes = read_one(tmp_path, content)
    assert notes == ()
    np.testing.assert_array_equal(values, WAVE)


def test_uneven_abscissae_are_single_or_as_wide_as_the_values(tmp_path: Path) -> None:
    times = np.arange(300) * 5e-3
    for width in ("<f4", "<f8"):
        rows = np.zeros(300, dtype=[("x", width), ("y", "<f8")])
        rows["x"], rows["y"] = times, WAVE
        values, _ = read_one(tmp_path, function_set(WAVE, raw=rows.tobytes(), form=4, even=0))
        np.testing.assert_array_equal(values, WAVE)


def test_a_transfer_in_text_mode_is_undone_and_told(tmp_path: Path) -> None:
    raw = bytearray(LITTLE)
    raw[100:104] = b"\n\r\n\x3f"
    whole = function_set(WAVE, raw=bytes(raw)) + units_set(1.0, 1.0)
    values, notes = read_one(tmp_path, whole.replace(b"\n", b"\r\n"))
    np.testing.assert_array_equal(values, np.frombuffer(bytes(raw), dtype="<f4"))
    assert any("text-mode transfer" in note for note in notes)


def test_values_that_are_not_there_are_told(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="announces 300 values and holds 250"):
        read_one(tmp_path, function_set(WAVE, raw=LITTLE[:1000]) + units_set(1.0, 1.0))


@pytest.mark.parametrize("exponent", ["D", "d", "E"])
def test_exponents_of_fortran(tmp_path: Path, exponent: str) -> None:
    for form in (2, 4):
        values, notes = read_one(tmp_path, function_set(WAVE.astype(float), exponent=exponent, form=form))
        assert notes == ()
        # Half a unit of the sixth digit, or of the twelfth.
        np.testing.assert_allclose(values, WAVE, rtol=5e-6 if form == 2 else 5e-12, atol=0)


@pytest.mark.parametrize(
    ("body", "kind", "count", "expected"),
    [
        (b" 1.00000-101 2.00000+100\n", 2, 2, [1e-101, 2e100]),
        (b"-1.00000E+00-2.00000E+00-3.00000E+00\n", 2, 3, [-1, -2, -3]),
        (b" 1.00000E+00\n 2.00000E+00             \n   \n", 2, 2, [1, 2]),
        (b"-1.000000000000E+00-2.000000000000E+00\n", 4, 2, [-1, -2]),
        (b" 1.0D0 2.0D0 3.0D0 4.0D0", 5, 2, [1 + 2j, 3 + 4j]),
        (b"1 2 3\r\n4\r\n", 2, 4, [1, 2, 3, 4]),
        (b" 1.00000E+00-2.00000-101 3.00000+100-4.", 2, 4, [1, -2e-101, 3e100, -4]),
    ],
)
def test_text_in_columns_or_between_blanks(body: bytes, kind: int, count: int, expected: list[complex]) -> None:
    layout = layout_of(kind, count, even=True)
    assert layout is not None
    values = text_values(body, layout)
    np.testing.assert_array_equal(values.data, expected)
    assert values.notes == ()


def test_uneven_text_takes_its_abscissae_apart() -> None:
    layout = layout_of(6, 2, even=False)
    assert layout is not None
    body = b" 1.00000E+00-2.000000000000E+00 3.000000000000E+00\n 2.00000E+00-4.000000000000E+00 5.000000000000E+00\n"
    values = text_values(body, layout)
    assert values.x is not None
    np.testing.assert_array_equal(values.x, [1, 2])
    np.testing.assert_array_equal(values.data, [-2 + 3j, -4 + 5j])


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b" 1.0 2.0", "announces 3 values and holds 2"),
        (b" 1.0 ***** 3.0", r"has '\*\*\*\*\*' where a number is due"),
        (b" 1.0 2.0z 3.0", "has '2.0z' where a number is due"),
        (b"", "holds 0"),
    ],
)
def test_text_without_the_numbers_it_announces_is_refused(body: bytes, words: str) -> None:
    layout = layout_of(2, 3, even=True)
    assert layout is not None
    with pytest.raises(LogError, match=words):
        text_values(body, layout)


def test_more_numbers_than_announced_are_told() -> None:
    layout = layout_of(2, 2, even=True)
    assert layout is not None
    values = text_values(b"1 2 3 4", layout)
    np.testing.assert_array_equal(values.data, [1, 2])
    assert values.notes == ("holds 2 numbers more than it announces, which were left out",)


def in_columns(rows: NDArray, widths: list[int]) -> bytes:
    """Numbers in the columns of the specification, as many rows a line as have room in 80 columns."""
    cells = ["".join(f"{number:{width}.5e}" for number, width in zip(row, widths, strict=True)) for row in rows]
    a_line = 80 // sum(widths)
    return "".join("".join(cells[first : first + a_line]) + "\n" for first in range(0, len(cells), a_line)).encode()


@pytest.mark.parametrize("form", [2, 4, 5, 6])
@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize(("count", "newline"), [(60, b"\n"), (60, b"\r\n"), (60, b"   \n"), (59, b"\n"), (61, b"\n")])
def test_a_piece_that_is_missing_in_a_line_of_columns_is_told(
    form: int, even: bool, count: int, newline: bytes
) -> None:
    widths = ([] if even else [13]) + [13 if form in (2, 5) else 20] * (2 if form > 4 else 1)
    body = in_columns(WAVE[: count * len(widths)].reshape(count, -1), widths).replace(b"\n", newline)
    layout = layout_of(form, count, even=even)
    assert layout is not None
    sound = text_values(body, layout)
    assert sound.notes == ()
    wrong = 0
    for place in range(0, len(body) - 10, 17):
        for size in (1, 4, 9):
            try:
                read = text_values(body[:place] + body[place + size :], layout)
            except LogError:
                continue
            same = np.array_equal(read.data, sound.data)
            same = same and (even or np.array_equal(read.x, sound.x))  # type: ignore[arg-type]
            wrong += not same
            assert same or read.notes, body[place - 20 : place + 20]
    assert wrong > 10


def test_numbers_between_blanks_have_lines_of_any_length() -> None:
    layout = layout_of(2, 60, even=True)
    assert layout is not None
    for text in ("{:g} ", "{:.3f}\n", "{:13.5e}\n", "{} {}\n"):
        numbers = iter(WAVE[:60].tolist())
        body = "".join(text.format(number, next(numbers) if text.count("{") > 1 else 0) for number in numbers)
        assert text_values(body.encode(), layout).notes == ()
