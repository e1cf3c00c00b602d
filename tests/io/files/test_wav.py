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
    [({"names": ["a", "b"]}, "has 1 channels, but 2 names"), ({"units": {"ch2": "N"}}, "no channel 'ch2'")],
)
def test_names_and_units_must_fit(tmp_path: Path, options: dict[str, object], match: str) -> None:
    written_pcm(tmp_path / "a.wav", 2, [1, 2, 3])
    with pytest.raises(SetupError, match=match):
        read_wav(tmp_path / "a.wav", **options)
