"""The registry of data files keeps its contract for every kind."""

import os
from inspect import Parameter, signature
from pathlib import Path

import pytest

from chladni.io.files.formats import (
    FILE_SUFFIXES,
    READ_OPTIONS,
    WRITTEN_SUFFIXES,
    read_file,
    reader_of,
    writer_of,
)
from chladni.signals.errors import LogError, SetupError


@pytest.mark.parametrize("suffix", FILE_SUFFIXES)
def test_options_of_readers_are_keywords_and_optional(suffix: str) -> None:
    path, *options = signature(reader_of(f"a{suffix.upper()}")).parameters.values()
    assert path.kind is Parameter.POSITIONAL_OR_KEYWORD
    assert all(one.kind is Parameter.KEYWORD_ONLY and one.default is not Parameter.empty for one in options)
    # What is called alike means the same: the few others belong to a kind.
    own = {one.name for one in options} - set(READ_OPTIONS)
    assert own <= {"max_bytes", "decimal", "full_scale"}


@pytest.mark.parametrize("suffix", WRITTEN_SUFFIXES)
def test_what_is_written_is_read(suffix: str) -> None:
    assert suffix in FILE_SUFFIXES
    assert "overwrite" in signature(writer_of(f"a{suffix}")).parameters


@pytest.mark.parametrize("suffix", FILE_SUFFIXES)
def test_nonsense_is_refused_in_one_line(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(LogError, match="no such file"):
        read_file(tmp_path / f"a{suffix}")
    for content in (b"", b"\x00\xff" * 400):
        (tmp_path / f"a{suffix}").write_bytes(content)
        with pytest.raises(LogError) as refused:
            read_file(tmp_path / f"a{suffix}")
        assert "\n" not in str(refused.value)
        assert str(tmp_path / f"a{suffix}") in str(refused.value)


def test_other_kinds_and_options_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"the suffix '.xlsx' isn't read; supported are .mcap, .csv"):
        read_file(tmp_path / "a.xlsx")
    with pytest.raises(SetupError, match=r"the suffix '.lvm' isn't written"):
        writer_of("a.lvm")
    (tmp_path / "a.csv").write_text("a\n1\n")
    with pytest.raises(SetupError, match="read_csv has no option 'colour'; it has sample_rate_hz, time"):
        read_file(tmp_path / "a.csv", colour=1)


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("sample_rate_hz", "fast", "must be a num"),
        ("time", 3.0, "must be text"),
        ("decimal", True, "must be text"),
    ],
)
def test_an_option_of_another_kind_is_refused(tmp_path: Path, option: str, value: object, told: str) -> None:
    (tmp_path / "a.csv").write_text("a,b\n1,2\n3,4\n")
    with pytest.raises(SetupError, match=f"option {option} is .*; {told}"):
        read_file(tmp_path / "a.csv", **{option: value})


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("suffix", FILE_SUFFIXES)
def test_no_kind_of_file_waits_for_a_pipe(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    os.mkfifo(path)
    with pytest.raises(LogError, match=rf"a\{suffix}: is a named pipe; files alone are read"):
        read_file(path)


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="needs a file that no byte can be read of")
@pytest.mark.parametrize("suffix", FILE_SUFFIXES)
def test_what_the_operating_system_refuses_is_told_with_the_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.symlink_to("/proc/self/mem")
    with pytest.raises(LogError, match=rf"a\{suffix}: .*can't be read"):
        read_file(path)
