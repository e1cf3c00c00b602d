"""WAV files against the numbers that were put in, and scipy's and the standard library's writers."""

import struct
import wave
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from chladni.io.files.wav import read_wav, write_wav
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted


def series_of(values: np.ndarray, **fields: object) -> TimeSeries:
    channels = tuple(Channel(name=f"a{row}", unit="N") for row in range(len(values)))
    return TimeSeries(**({"values": values, "sample_rate_hz": 8000.0, "channels": channels} | fields))


def written_pcm(path: Path, width: int, integers: list[int], rate: int = 48000) -> None:
    with wave.open(str(path), "wb") as file:
        file.setparams((1, width, rate, 0, "NONE", ""))
        if width == 1:
            file.writeframes(bytes(number + 128 for number in integers))
        else:
            file.writeframes(b"".join(number.to_bytes(width, "little", signed=True) for number in integers))


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_pcm_is_a_fraction_of_full_scale(tmp_path: Path, width: int) -> None:
    half = 2 ** (8 * width - 1)
    integers = [-half, 0, half // 2, half - 1]
    written_pcm(tmp_path / "a.wav", width, integers)
    (series,) = read_wav(tmp_path / "a.wav").series
    np.testing.assert_array_equal(series.values[0].astype(float), np.array(integers) / half)
    assert series.sample_rate_hz == 48000.0
    assert series.channels == (Channel(name="ch1", unit="1"),)


def test_full_scale_is_a_physical_value(tmp_path: Path) -> None:
    written_pcm(tmp_path / "a.wav", 2, [-32768, 16384])
    (series,) = read_wav(tmp_path / "a.wav", full_scale="50 g", names=["wrist"]).series
    np.testing.assert_allclose(series.values[0], [-50 * 9.80665, 25 * 9.80665], rtol=1e-7)  # single precision
    assert series.channels == (Channel(name="wrist", unit="m/s^2"),)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_floating_point_comes_back_to_the_bit(tmp_path: Path, dtype: type) -> None:
    values = (1e6 * np.random.default_rng(1).standard_normal((3, 100))).astype(dtype)
    losses = write_wav(series_of(values), tmp_path / "a.wav")
    (series,) = read_wav(tmp_path / "a.wav", units={"ch1": "N"}).series
    np.testing.assert_array_equal(series.values, values)
    assert series.values.dtype == dtype
    assert [channel.unit for channel in series.channels] == ["N", "1", "1"]
    assert "ch2 = a1 [N]" in losses[0]
    rate, frames = wavfile.read(tmp_path / "a.wav")
    assert rate == 8000
    np.testing.assert_array_equal(frames.T, values)


def test_the_lost_start_is_told(tmp_path: Path) -> None:
    assert "5 ns since 1970" in write_wav(series_of(np.zeros((1, 4)), start_time_ns=5), tmp_path / "a.wav")[1]


def test_chunks_with_remarks_are_skipped(tmp_path: Path) -> None:
    written_pcm(tmp_path / "a.wav", 2, [1, 2, 3])
    raw = (tmp_path / "a.wav").read_bytes()
    remark = b"LIST" + struct.pack("<I", 5) + b"hello" + b"\x00"
    raw = raw[:4] + struct.pack("<I", len(raw) - 8 + len(remark)) + raw[8:12] + remark + raw[12:]
    (tmp_path / "a.wav").write_bytes(raw)
    (series,) = read_wav(tmp_path / "a.wav").series
    np.testing.assert_array_equal(series.values[0] * 32768, [1, 2, 3])


def test_gaps_are_refused(tmp_path: Path) -> None:
    valid = np.array([[True, False, True]])
    with pytest.raises(LogError, match=r"a0: 1 samples are missing, the first at 0.000125 s"):
        write_wav(series_of(np.zeros((1, 3)), valid=valid), tmp_path / "a.wav")
    assert list(tmp_path.iterdir()) == []


def test_fractional_rates_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"not 610\.35 Hz; have it brought to one \(--resample 610\)"):
        write_wav(series_of(np.zeros((1, 3)), sample_rate_hz=610.35), tmp_path / "a.wav")


def test_several_rates_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="2 groups"):
        write_wav([series_of(np.zeros((1, 3))), series_of(np.zeros((1, 3)))], tmp_path / "a.wav")


@pytest.mark.parametrize(
    ("damage", "match"),
    [
        (lambda raw: raw[:0], "is no WAV"),
        (lambda raw: b"OggS" + raw[4:], "is no WAV"),
        (lambda raw: raw[:36], "holds no samples"),
        (lambda raw: raw[:12] + b"junk" + raw[16:], "holds no samples"),
        (lambda raw: raw[:20] + b"\x77\x00" + raw[22:], "can't be read"),
        (lambda raw: raw[:22] + b"\x00\x00" + raw[24:], "can't be read: encoding 1 of 2 bytes for 0 channels"),
        (lambda raw: raw[:24] + bytes(4) + raw[28:], "at 0 Hz"),
        (lambda raw: raw[:45], "holds no s"),
        (lambda raw: raw[:40] + b"\x00\x00\x00\x00", "holds no s"),
    ],
)
def test_damaged_files_are_told_in_one_line(tmp_path: Path, damage: object, match: str) -> None:
    written_pcm(tmp_path / "a.wav", 2, [1, 2, 3])
    (tmp_path / "a.wav").write_bytes(damage((tmp_path / "a.wav").read_bytes()))
    with pytest.raises(LogError, match=match):
        read_wav(tmp_path / "a.wav")


@pytest.mark.parametrize(
    ("options", "match"),
    [({"names": ["a", "b"]}, "has 1 channel, but 2 names"), ({"units": {"ch2": "N"}}, "no channel 'ch2'")],
)
def test_names_and_units_must_fit(tmp_path: Path, options: dict[str, object], match: str) -> None:
    written_pcm(tmp_path / "a.wav", 2, [1, 2, 3])
    with pytest.raises(SetupError, match=match):
        read_wav(tmp_path / "a.wav", **options)


FRAMES = np.round(20_000 * np.sin(2 * np.pi * 440 * np.arange(4000) / 8000)).astype("<i2")
DESCRIPTION = struct.pack("<HHIIHH", 1, 1, 8000, 16_000, 2, 16)
GUID_TAIL = bytes.fromhex("f3acd3118cd100c04f8edb8a")


def riff(
    name: bytes = b"RIFF", *, size: int, data: int, samples: bytes, before: bytes = b"", after: bytes = b""
) -> bytes:
    head = name + struct.pack("<I", size) + b"WAVE" + before + b"fmt " + struct.pack("<I", 16) + DESCRIPTION
    return head + b"data" + struct.pack("<I", data) + samples + after


def wave64(data: int, samples: bytes) -> bytes:
    riff_guid = b"riff" + bytes.fromhex("2e91cf11a5d628db04c10000")
    head = riff_guid + struct.pack("<Q", 0) + b"wave" + GUID_TAIL
    described = b"fmt " + GUID_TAIL + struct.pack("<Q", 40) + DESCRIPTION
    return head + described + b"data" + GUID_TAIL + struct.pack("<Q", data) + samples


RAW = FRAMES.tobytes()
LONG = struct.pack("<QQQI", 0, len(RAW), len(FRAMES), 0)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (riff(size=36 + len(RAW), data=len(RAW), samples=RAW), ""),
        (riff(size=0, data=0, samples=RAW), "never closed"),
        (riff(size=36, data=0, samples=RAW), "never closed"),
        (riff(size=0xFFFFFFFF, data=0xFFFFFFFF, samples=RAW), "never closed, or streamed"),
        (
            riff(size=36 + 2 * len(RAW), data=2 * len(RAW), samples=RAW),
            "announces 16000 bytes of samples, 8000 are there",
        ),
        (riff(size=36 + 2 * len(RAW), data=0x7FFFF000, samples=RAW + b"\x01"), "is cut short"),
        (
            riff(
                b"RF64", size=0xFFFFFFFF, data=0xFFFFFFFF, samples=RAW, before=b"ds64" + struct.pack("<I", 28) + LONG
            ),
            "",
        ),
        (
            riff(
                b"BW64",
                size=0xFFFFFFFF,
                data=0xFFFFFFFF,
                samples=RAW,
                before=b"ds64" + struct.pack("<I", 28) + bytes(28),
            ),
            "never closed",
        ),
        (riff(b"RF64", size=0xFFFFFFFF, data=0xFFFFFFFF, samples=RAW), "never closed"),
        (wave64(24 + len(RAW), RAW), ""),
        (wave64(24, RAW), "never closed"),
        (wave64(24 + 2 * len(RAW), RAW), "is cut short"),
        (riff(size=0, data=len(RAW), samples=RAW), ""),
        (riff(size=0, data=len(RAW), samples=RAW, after=b"LIST" + struct.pack("<I", 4) + b"INFO"), ""),
    ],
)
def test_files_are_read_as_far_as_they_go(tmp_path: Path, content: bytes, told: str) -> None:
    (tmp_path / "a.wav").write_bytes(content)
    contents = read_wav(tmp_path / "a.wav")
    (series,) = contents.series
    assert series.sample_rate_hz == 8000.0
    np.testing.assert_array_equal(series.values[0] * 32768, FRAMES)
    assert len(contents.notes) == bool(told)
    assert all(told in note for note in contents.notes)
    assert contents.unread == ()


def test_what_lies_behind_the_samples_is_told(tmp_path: Path) -> None:
    # A writer that fills in the sizes now and then, and stopped: no part of the file describes the rest.
    (tmp_path / "a.wav").write_bytes(riff(size=0, data=6000, samples=RAW))
    contents = read_wav(tmp_path / "a.wav")
    np.testing.assert_array_equal(contents.series[0].values[0] * 32768, FRAMES[:3000])
    assert contents.unread == (("2000 bytes at the end", "they lie behind the samples that the file announces"),)


def test_an_empty_file_is_not_taken_for_one_that_was_never_closed(tmp_path: Path) -> None:
    after = b"LIST" + struct.pack("<I", 4) + b"INFO"
    (tmp_path / "a.wav").write_bytes(riff(size=48, data=0, samples=b"", after=after))
    with pytest.raises(LogError, match="holds no samples"):
        read_wav(tmp_path / "a.wav")


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_pcm_agrees_with_scipy(tmp_path: Path, width: int) -> None:
    half = 2 ** (8 * width - 1)
    written_pcm(tmp_path / "a.wav", width, [-half, 1, half // 3, half - 1])
    _, expected = wavfile.read(tmp_path / "a.wav")
    centred = expected.astype(float) - (128 if width == 1 else 0)
    full = 2.0 ** (31 if width == 3 else 8 * width - 1)
    (series,) = read_wav(tmp_path / "a.wav").series
    np.testing.assert_allclose(series.values[0], centred / full, rtol=1e-7)


def test_big_endian_and_extensible_files(tmp_path: Path) -> None:
    frames = FRAMES[:10].astype(">i2").tobytes()
    description = struct.pack(">HHIIHH", 1, 1, 8000, 16_000, 2, 16)
    raw = b"RIFX" + struct.pack(">I", 56) + b"WAVEfmt " + struct.pack(">I", 16) + description
    (tmp_path / "a.wav").write_bytes(raw + b"data" + struct.pack(">I", len(frames)) + frames)
    np.testing.assert_array_equal(read_wav(tmp_path / "a.wav").series[0].values[0] * 32768, FRAMES[:10])
    guid = struct.pack("<H", 3) + bytes.fromhex("000000001000800000aa00389b71")
    description = struct.pack("<HHIIHHHHI", 0xFFFE, 1, 8000, 32_000, 4, 32, 22, 32, 4) + guid
    floats = np.linspace(-3, 3, 10, dtype="<f4").tobytes()
    raw = b"RIFF" + struct.pack("<I", 0) + b"WAVEfmt " + struct.pack("<I", len(description)) + description
    (tmp_path / "b.wav").write_bytes(raw + b"data" + struct.pack("<I", len(floats)) + floats)
    np.testing.assert_array_equal(
        read_wav(tmp_path / "b.wav").series[0].values[0], np.linspace(-3, 3, 10, dtype="<f4")
    )


def described(kind: int, channels: int, rate_hz: int, width: int, bits: int) -> bytes:
    frame = channels * width
    return struct.pack("<HHIIHH", kind, channels, rate_hz, rate_hz * frame, frame, bits)


def with_description(description: bytes) -> bytes:
    body = b"WAVEfmt " + struct.pack("<I", len(description)) + description
    body += b"data" + struct.pack("<I", 240) + np.arange(120, dtype="<i2").tobytes()
    return b"RIFF" + struct.pack("<I", len(body)) + body


@pytest.mark.parametrize(
    "described_as",
    [
        (1, 2, 8000, 1, 8),
        (1, 1, 8000, 2, 16),
        (1, 6, 48000, 2, 12),
        (1, 2, 8000, 3, 24),
        (1, 1, 8000, 3, 20),
        (1, 2, 8000, 4, 32),
        (1, 2, 8000, 4, 24),
        (3, 2, 8000, 4, 32),
        (3, 1, 44100, 8, 64),
    ],
)
def test_any_bit_of_a_description_that_changes_what_is_read_is_told(
    tmp_path: Path, described_as: tuple[int, int, int, int, int]
) -> None:
    sound = described(*described_as)
    path = tmp_path / "a.wav"
    path.write_bytes(with_description(sound))
    contents = read_wav(path)
    assert contents.notes == ()
    (series,) = contents.series
    # The first two bytes are the kind of number, which stands but once.
    for bit in range(16, 8 * len(sound)):
        flipped = bytearray(sound)
        flipped[bit // 8] ^= 1 << bit % 8
        path.write_bytes(with_description(bytes(flipped)))
        try:
            read = read_wav(path)
        except LogError:
            continue
        same = read.series[0].sample_rate_hz == series.sample_rate_hz
        same = same and np.array_equal(read.series[0].values, series.values)
        assert same or "contradicts itself" in read.notes[0], bit


def test_what_lies_behind_a_long_file_is_told_too(tmp_path: Path) -> None:
    before = b"ds64" + struct.pack("<I", 28) + LONG
    for behind in (b"\x01", b"\x01" * 9):
        content = riff(b"RF64", size=0xFFFFFFFF, data=0xFFFFFFFF, samples=RAW, before=before, after=behind)
        (tmp_path / "a.wav").write_bytes(content)
        assert read_wav(tmp_path / "a.wav").unread[0][0] == f"{counted(len(behind), 'byte')} at the end"
    after = b"LIST" + struct.pack("<I", 4) + b"INFO"
    (tmp_path / "a.wav").write_bytes(
        riff(b"RF64", size=0xFFFFFFFF, data=0xFFFFFFFF, samples=RAW, before=before, after=after)
    )
    assert read_wav(tmp_path / "a.wav").unread == ()
