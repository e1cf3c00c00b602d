"""MAT files with parts that no other program reads, and WAV files that were never closed."""

import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io

from case_kinds.checks import check_rate, check_values
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.product import Product, channel, expect
from case_kinds.universal_kinds import WAVE

# MAT files, level 5 ("MAT-File Format", The MathWorks, chapter 1)

INT8, UINT8, INT32, UINT32, DOUBLE, MATRIX, COMPRESSED = 1, 2, 5, 6, 9, 14, 15
CELL, STRUCT, OBJECT, CHAR, DOUBLE_CLASS, UINT8_CLASS, UINT32_CLASS, FUNCTION, OPAQUE = 1, 2, 3, 4, 6, 9, 13, 16, 17
HEADER_BYTES = 128


@dataclass(frozen=True, slots=True)
class Mat:
    """Writes elements in one byte order."""

    order: str = "<"

    def element(self, kind: int, data: bytes) -> bytes:
        """Tag, data, and zeros up to eight bytes."""
        return struct.pack(f"{self.order}II", kind, len(data)) + data + bytes(-len(data) % 8)

    def matrix(self, mat_class: int, name: str, *parts: bytes, shape: tuple[int, int] | None = (1, 1)) -> bytes:
        """Flags, dimensions where the class has them, name, and what the class holds."""
        flags = self.element(UINT32, struct.pack(f"{self.order}II", mat_class, 0))
        dimensions = b"" if shape is None else self.element(INT32, struct.pack(f"{self.order}ii", *shape))
        return self.element(MATRIX, flags + dimensions + self.element(INT8, name.encode()) + b"".join(parts))

    def numbers(self, name: str, values: np.ndarray) -> bytes:
        """Give a row of doubles."""
        data = self.element(DOUBLE, values.astype(f"{self.order}f8").tobytes())
        return self.matrix(DOUBLE_CLASS, name, data, shape=(1, values.size))

    def opaque(self, name: str, class_name: str) -> bytes:
        """Give an object of a newer class: its content lies in the subsystem's data."""
        ids = np.array([0xDD000000, 2, 1, 1, 1, 1], f"{self.order}u4")
        inner = self.matrix(UINT32_CLASS, "", self.element(UINT32, ids.tobytes()), shape=(6, 1))
        names = (self.element(INT8, text.encode()) for text in ("MCOS", class_name))
        return self.matrix(OPAQUE, name, *names, inner, shape=None)

    def fields(self, mat_class: int, name: str, class_name: str, **values: bytes) -> bytes:
        """Give a struct, or an object of an older class: fields of 32 bytes of name each."""
        named = self.element(INT8, class_name.encode()) if mat_class == OBJECT else b""
        length = self.element(INT32, struct.pack(f"{self.order}i", 32))
        names = self.element(INT8, b"".join(key.encode().ljust(32, b"\0") for key in values))
        return self.matrix(mat_class, name, named, length, names, *values.values())

    def text(self, name: str, text: str) -> bytes:
        """Give an array of characters."""
        data = self.element(4, text.encode("utf-16-le" if self.order == "<" else "utf-16-be"))
        return self.matrix(CHAR, name, data, shape=(1, len(text)))

    def subsystem(self) -> bytes:
        """Give an array without a name at the file's end, to which the header points."""
        return self.matrix(UINT8_CLASS, "", self.element(UINT8, bytes(range(64))), shape=(1, 64))

    def file(self, elements: Sequence[bytes], *, subsystem: bool = False) -> bytes:
        """Put the header before the elements."""
        body = b"".join(elements)
        offset = HEADER_BYTES + len(body) if subsystem else 0
        mark = b"IM" if self.order == "<" else b"MI"
        head = b"MATLAB 5.0 MAT-file, Platform: PCWIN64".ljust(116) + struct.pack(f"{self.order}QH", offset, 0x0100)
        return head + mark + body + (self.subsystem() if subsystem else b"")


def _mat(make: Callable[[Mat], list[bytes]], *, order: str = "<", subsystem: bool = False,
         compress: bool = False, hidden: bool = False) -> Callable[[Path], Path]:  # fmt: skip
    """Write ``fs``, ``x`` and what is beside them; `hidden`: x isn't at the top for scipy to compare."""

    def write(folder: Path) -> Path:
        mat = Mat(order)
        elements = make(mat)
        if compress:
            packed = [zlib.compress(each) for each in elements]
            # A compressed element isn't padded.
            elements = [struct.pack(f"{order}II", COMPRESSED, len(each)) + each for each in packed]
        path = folder / "measured.mat"
        path.write_bytes(mat.file(elements, subsystem=subsystem))
        found = scipy.io.loadmat(path)
        if not hidden:
            assert found["fs"].item() == 200.0
            assert np.array_equal(found["x"].ravel(), WAVE)
        return path

    return write


def _check_mat(left_out: str, name: str = "x", samples: int = 400) -> Check:
    def check(product: Product, path: Path) -> None:
        check_rate(product, path, name, 200.0, samples=samples)
        check_values(product, path, name, WAVE)
        if left_out:
            product.told(rf"\b{left_out}\b")

    return check


def mat_with_a_matlab_string() -> list[Case]:
    """Numbers beside what only MATLAB reads."""
    kind = "mat_with_a_matlab_string"
    rate = np.array([200.0])

    def beside(*others: Callable[[Mat], bytes], first: bool = False) -> Callable[[Mat], list[bytes]]:
        def make(mat: Mat) -> list[bytes]:
            numbers = [mat.numbers("fs", rate), mat.numbers("x", WAVE)]
            extra = [other(mat) for other in others]
            return [*extra, *numbers] if first else [numbers[0], *extra, numbers[1]]

        return make

    def old_object(mat: Mat) -> bytes:
        return mat.fields(OBJECT, "filter_used", "dfilt", order=mat.numbers("", np.array([4.0])))

    def handle(mat: Mat) -> bytes:
        inner = mat.fields(STRUCT, "", "", function=mat.text("", "sin"), type=mat.text("", "simple"))
        return mat.matrix(FUNCTION, "callback", inner)

    def struct_with_string(mat: Mat) -> bytes:
        return mat.fields(STRUCT, "about", "", author=mat.text("", "nobody"), when=mat.opaque("", "datetime"))

    def cell(mat: Mat) -> bytes:
        return mat.matrix(CELL, "labels", mat.text("", "left"), mat.numbers("", np.arange(3.0)), shape=(1, 2))

    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("measured", given(kind, "measured.mat"), _check_mat("label")),
            ("datetime_and_subsystem",
             _mat(beside(lambda mat: mat.opaque("began", "datetime")), subsystem=True), _check_mat("began")),
            ("string_first_compressed",
             _mat(beside(lambda mat: mat.opaque("title", "string"), first=True), compress=True, subsystem=True),
             _check_mat("title")),
            ("table_big_endian",
             _mat(beside(lambda mat: mat.opaque("rows_of_it", "table")), order=">"), _check_mat("rows_of_it")),
            ("object_of_an_old_class", _mat(beside(old_object)), _check_mat("filter_used")),
            ("function_handle", _mat(beside(handle)), _check_mat("callback")),
            ("two_strings_and_a_cell",
             _mat(beside(lambda mat: mat.opaque("one", "string"), lambda mat: mat.opaque("two", "table"), cell)),
             _check_mat("two")),
            ("datetime_in_a_struct", _mat(beside(struct_with_string), hidden=True), _check_mat("")),
        )
    ]  # fmt: skip


# WAV files that were never closed

PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
UNKNOWN_SIZE = 0xFFFFFFFF
WAV_RATE_HZ = 8000
W64_RIFF = bytes.fromhex("726966662e91cf11a5d628db04c10000")
W64_TAIL = bytes.fromhex("f3acd3118cd100c04f8edb8a")


def _samples(count: int, channels: int, kind: str) -> tuple[bytes, np.ndarray]:
    """Frames as stored, and their values: 16 bit, 24 bit, or float."""
    phase = 2 * np.pi * 440 * np.arange(count)[:, None] / WAV_RATE_HZ + np.arange(channels)
    wave = 0.5 * np.sin(phase)
    if kind == "float":
        stored = wave.astype("<f4")
        return stored.tobytes(), stored.astype(float)
    bits = 16 if kind == "16" else 24
    whole = np.round(wave * (2 ** (bits - 1) - 1)).astype("<i4")
    data = whole.astype("<i2").tobytes() if bits == 16 else whole.ravel().view("u1").reshape(-1, 4)[:, :3].tobytes()
    return data, whole / 2.0 ** (bits - 1)


def _format(channels: int, kind: str, *, extensible: bool = False) -> bytes:
    size = {"16": 2, "24": 3, "float": 4}[kind]
    tag = FLOAT if kind == "float" else PCM
    rest = (channels, WAV_RATE_HZ, WAV_RATE_HZ * channels * size, channels * size, 8 * size)
    if not extensible:
        return struct.pack("<HHIIHH", tag, *rest)
    guid = struct.pack("<H", tag) + bytes.fromhex("000000001000800000aa00389b71")
    return struct.pack("<HHIIHHHHI", EXTENSIBLE, *rest, 22, 8 * size, 0) + guid


def _chunk(name: bytes, data: bytes, size: int | None = None) -> bytes:
    return name + struct.pack("<I", len(data) if size is None else size) + data + bytes(len(data) % 2)


def _wav(count: int, *, channels: int = 1, kind: str = "16", extensible: bool = False, riff: int | None = None,
         data_size: int | None = None, before: bytes = b"", cut: int = 0) -> Callable[[Path], Path]:  # fmt: skip
    """Write a WAV file whose sizes may be untrue; `cut` bytes are missing at its end."""

    def write(folder: Path) -> Path:
        data, values = _samples(count, channels, kind)
        body = (
            _chunk(b"fmt ", _format(channels, kind, extensible=extensible))
            + before
            + _chunk(b"data", data, data_size)
        )
        size = len(body) + 4 if riff is None else riff
        whole = b"RIFF" + struct.pack("<I", size) + b"WAVE" + body
        path = folder / "sound.wav"
        path.write_bytes(whole[: len(whole) - cut])
        closed = folder / "closed.wav"
        parts = _chunk(b"fmt ", _format(channels, kind, extensible=extensible)) + _chunk(b"data", data)
        closed.write_bytes(b"RIFF" + struct.pack("<I", len(parts) + 4) + b"WAVE" + parts)
        _assert_scipy_reads(closed, values)
        return path

    return write


def _assert_scipy_reads(path: Path, values: np.ndarray) -> None:
    rate, found = scipy.io.wavfile.read(path)
    assert rate == WAV_RATE_HZ
    # scipy keeps 24 bits at the top of 32.
    scale = {"int16": 2.0**15, "int32": 2.0**31, "float32": 1.0}[str(found.dtype)]
    assert np.allclose(found.reshape(values.shape) / scale, values, atol=1e-7)


def _rf64(mark: bytes, *, closed: bool = True) -> Callable[[Path], Path]:
    """EBU Tech 3306 and ITU-R BS.2088: the sizes stand in ``ds64``; without `closed` they are zero."""

    def write(folder: Path) -> Path:
        data, values = _samples(4000, 2, "16")
        sizes = (36 + 28 + len(data), len(data), 4000) if closed else (0, 0, 0)
        ds64 = _chunk(b"ds64", struct.pack("<QQQI", *sizes, 0))
        body = ds64 + _chunk(b"fmt ", _format(2, "16")) + _chunk(b"data", data, UNKNOWN_SIZE)
        path = folder / "sound.wav"
        path.write_bytes(mark + struct.pack("<I", UNKNOWN_SIZE) + b"WAVE" + body)
        if closed and mark == b"RF64":
            _assert_scipy_reads(path, values)
        return path

    return write


def _w64(folder: Path) -> Path:
    """Sony Wave64: names are 16 bytes, sizes 8 bytes that count the head too, parts at multiples of 8."""
    data, _ = _samples(4000, 1, "16")

    def part(name: bytes, content: bytes) -> bytes:
        return name + W64_TAIL + struct.pack("<Q", len(content) + 24) + content + bytes(-len(content) % 8)

    body = b"wave" + W64_TAIL + part(b"fmt ", _format(1, "16")) + part(b"data", data)
    path = folder / "sound.w64"
    path.write_bytes(W64_RIFF + struct.pack("<Q", len(body) + 24) + body)
    return path


NOT_CLOSED = r"closed|\bcut\b|stream|claim|announce|truncated|as far as|\bsizes?\b|\bbytes\b"


def _check_wav(count: int, *, channels: int = 1, kind: str = "16", word: bool = True) -> Check:
    def check(product: Product, path: Path) -> None:
        document = product.info(path)
        expect(len(document["channels"]) == channels, f"{len(document['channels'])} channels instead of {channels}")
        for entry in document["channels"]:
            expect(abs((entry["rate_hz"] or 0) - WAV_RATE_HZ) < 1e-3, f"rate {entry['rate_hz']} Hz instead of 8000")
            expect(entry["samples"] == count, f"{entry['samples']} samples instead of {count}")
        _, columns = product.columns(path)
        _, truth = _samples(count, channels, kind)
        for index, found in enumerate(columns.values()):
            expect(found.size == count, f"{found.size} samples instead of {count}")
            scale = float(np.max(np.abs(found)) / np.max(np.abs(truth[:, index])))
            expect(abs(scale - 1) < 1e-3, f"values are {scale:g} times the truth")
            expect(bool(np.allclose(found, truth[:, index], atol=1e-4)), "other values than were written")
        if word:
            product.told(NOT_CLOSED)

    return check


def _check_given(product: Product, path: Path) -> None:
    entry = channel(product.info(path), "1")
    expect(abs((entry["rate_hz"] or 0) - WAV_RATE_HZ) < 1e-3, f"rate {entry['rate_hz']} Hz instead of 8000")
    expect(entry["samples"] == 4000, f"{entry['samples']} samples instead of 4000")
    raw = np.frombuffer(path.read_bytes()[44:], "<i2") / 2.0**15
    [found] = product.columns(path)[1].values()
    expect(bool(np.allclose(found, raw, atol=1e-4)), "other values than are stored")
    product.told(NOT_CLOSED)


def wav_not_closed() -> list[Case]:
    """The header's sizes aren't those of the data."""
    kind = "wav_not_closed"
    listed = _chunk(b"LIST", b"INFOISFT" + struct.pack("<I", 6) + b"Lavf58")
    return [
        *(Case(kind=kind, name=name, write=given(kind, f"{name}.wav"), check=_check_given)
          for name in ("streamed", "size_zero", "cut")),
        *(
            Case(kind=kind, name=name, write=write, check=check)
            for name, write, check in (
                ("rf64", _rf64(b"RF64"), _check_wav(4000, channels=2, word=False)),
                ("bw64", _rf64(b"BW64"), _check_wav(4000, channels=2, word=False)),
                ("rf64_never_closed", _rf64(b"RF64", closed=False), _check_wav(4000, channels=2)),
                ("w64", _w64, _check_wav(4000, word=False)),
                ("ffmpeg_pipe_with_list",
                 _wav(3000, channels=2, riff=UNKNOWN_SIZE, data_size=UNKNOWN_SIZE, before=listed),
                 _check_wav(3000, channels=2)),
                ("24_bit_cut_amid_a_frame", _wav(5000, channels=2, kind="24", cut=3001),
                 _check_wav(4499, channels=2, kind="24")),
                ("float_extensible_size_zero",
                 _wav(2048, channels=3, kind="float", extensible=True, riff=0, data_size=0),
                 _check_wav(2048, channels=3, kind="float")),
                ("size_of_two_gigabytes_less_one",
                 _wav(4000, riff=0x7FFFFFFF, data_size=0x7FFFFFFF - 36), _check_wav(4000)),
                ("riff_size_alone_is_zero", _wav(4000, riff=0), _check_wav(4000, word=False)),
            )
        ),
    ]  # fmt: skip


def cases() -> list[Case]:
    """Every case about MAT and WAV files."""
    return [*mat_with_a_matlab_string(), *wav_not_closed()]
