"""Files that are no MCAP logs are refused in one line that helps."""

import gzip
import os
import re
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard

from chladni.io.mcap.container import McapContainer
from chladni.signals.errors import LogError
from tests.io.mcap import log_bytes


@pytest.mark.parametrize(
    ("content", "hint"),
    [
        (b"#ROSBAG V2.0\n" + bytes(50), "a ROS 1 bag; 'rosbags-convert --src in.bag --dst out"),
        (b"SQLite format 3\0" + bytes(50), "a ROS 2 .db3 bag; 'rosbags-convert --src FOLDER"),
        (gzip.compress(b"log", mtime=0), "gzip; unpack it with gunzip"),
        (zstandard.compress(b"log" * 10), "zstd; unpack it with 'zstd -d'"),
        (lz4.frame.compress(b"log" * 10), "lz4; unpack it with 'lz4 -d'"),
        (b"PK\x03\x04" + bytes(50), "a zip archive"),
        (b"\x89MCAP9\r\n" + bytes(50), "another version of MCAP"),
    ],
)
def test_what_the_file_looks_like_is_said(tmp_path: Path, content: bytes, hint: str) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError) as told:
        McapContainer.open(path)
    message = str(told.value)
    assert message.startswith(f"{path}: not a log as it is; it looks like ")
    assert hint in message
    assert "\n" not in message


IN_TEXT_MODE = [
    (lambda content: content.replace(b"\r\n", b"\n"), "0d 0a became 0a in its first bytes"),
    (lambda content: content.replace(b"\n", b"\r\n"), "0a became 0d 0a in its first bytes"),
    (lambda content: content.replace(b"\r\n", b"\r"), "0d 0a became 0d in its first bytes"),
    (lambda content: content.replace(b"\r", b"\n"), "0d became 0a in its first bytes"),
    (lambda content: bytes(byte & 0x7F for byte in content), "8 bits became 7 in its first bytes"),
    (lambda content: content.decode("latin-1").encode(), "89 became UTF-8 in its first bytes"),
    (lambda content: content.decode("utf-8", "replace").encode(), "89 became the replacement character of UTF-8"),
    # As git writes files that it takes for text: what has a carriage return already keeps it, the magic does.
    (lambda content: re.sub(rb"(?<!\r)\n", b"\r\n", content), "bytes 0a in its first"),
]


@pytest.mark.parametrize(("transfer", "told"), IN_TEXT_MODE, ids=range(len(IN_TEXT_MODE)))
@pytest.mark.parametrize("suffix", [".mcap", ".csv"])
def test_a_text_mode_transfer_is_told_in_those_words(
    tmp_path: Path, transfer: Callable[[bytes], bytes], told: str, suffix: str
) -> None:
    sound = log_bytes.sample_log()
    path = tmp_path / f"log{suffix}"
    path.write_bytes(transfer(sound))
    with pytest.raises(LogError) as refused:
        McapContainer.open(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: changed by a text-mode transfer (git's autocrlf, FTP in ASCII mode): ")
    assert told in message
    assert message.endswith(
        "; copy the file again in binary mode, and in git mark it as binary: '*.mcap binary' in .gitattributes"
    )
    assert "\n" not in message


def test_a_damaged_log_with_lone_line_feeds_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    sound = log_bytes.sample_log()
    assert sound.count(b"\n") > sound.count(b"\r\n")
    path = tmp_path / "log.mcap"
    path.write_bytes(sound[: len(sound) * 3 // 4])
    with McapContainer.open(path) as log:
        assert log.damage


def test_other_bytes_are_shown(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"hello")
    with pytest.raises(LogError, match=r"starts with 68 65 6c 6c 6f, expected .* 0d 0a$"):
        McapContainer.open(str(path))


def test_an_empty_file_is_called_empty(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.touch()
    with pytest.raises(LogError, match="the file is empty; expected an MCAP log"):
        McapContainer.open(path)


def test_a_folder_a_pipe_and_nothing_are_no_logs(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"is a folder; name a file in it$"):
        McapContainer.open(tmp_path)
    for name in ("bag_0.mcap", "bag_1.mcap"):
        (tmp_path / name).touch()
    with pytest.raises(LogError, match=r"such as bag_0\.mcap; 'mcap merge' makes one file of its 2 \.mcap files"):
        McapContainer.open(tmp_path)
    with pytest.raises(LogError, match=r"none\.mcap: can't be opened: No such file"):
        McapContainer.open(tmp_path / "none.mcap")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(LogError, match="is a named pipe"):
            McapContainer.open(tmp_path / "pipe")


def test_only_the_magic_is_a_log_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"\x89MCAP0\r\n")
    with McapContainer.open(path) as log:
        assert dict(log.channels) == {}
        assert any("its recording was cut off" in one.what for one in log.damage)
