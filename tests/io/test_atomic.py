"""Nothing half-written: a file is there whole, or as it was."""

import errno
import os
from pathlib import Path

import pytest

from chladni.io.atomic import atomic_path, atomic_write
from chladni.signals.errors import LogError


def test_the_file_is_whole_and_alone(tmp_path: Path) -> None:
    with atomic_write(tmp_path / "a.bin") as file:
        file.write(b"part")
        assert not (tmp_path / "a.bin").exists()
        file.write(b" and rest")
    assert (tmp_path / "a.bin").read_bytes() == b"part and rest"
    assert [path.name for path in tmp_path.iterdir()] == ["a.bin"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path, error: type[BaseException]) -> None:
    (tmp_path / "a.bin").write_bytes(b"old")

    def interrupted() -> None:
        with atomic_write(tmp_path / "a.bin") as file:
            file.write(b"half")
            raise error

    with pytest.raises(error):
        interrupted()
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a.bin", b"old")]


def test_what_is_under_way_lies_beside_the_file_and_is_not_taken_for_one(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "plot.svg") as part:
        assert (part.parent, part.suffix) == (tmp_path.resolve(), ".part")
        part.write_text("<svg/>")
        assert not list(tmp_path.glob("*.svg"))
    assert (tmp_path / "plot.svg").read_text() == "<svg/>"


def test_a_symbolic_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link.bin").symlink_to(tmp_path / "real" / "a.bin")
    with atomic_write(tmp_path / "link.bin") as file:
        file.write(b"new")
    assert (tmp_path / "link.bin").is_symlink()
    assert (tmp_path / "real" / "a.bin").read_bytes() == b"new"


def test_permissions_are_those_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    with atomic_write(tmp_path / "a.bin") as file:
        file.write(b"x")
    assert (tmp_path / "a.bin").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_data_reaches_the_disk_before_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    fsync, replace = os.fsync, Path.replace
    monkeypatch.setattr(os, "fsync", lambda fd: (order.append("fsync"), fsync(fd))[1])
    monkeypatch.setattr(Path, "replace", lambda self, target: (order.append("rename"), replace(self, target))[1])
    with atomic_write(tmp_path / "a.bin") as file:
        file.write(b"x")
    assert order == ["fsync", "rename", "fsync"]


def test_a_file_that_appears_meanwhile_is_kept_unless_told(tmp_path: Path) -> None:

    def overtaken() -> None:
        with atomic_write(tmp_path / "a", overwrite=False) as file:
            file.write(b"mine")
            (tmp_path / "a").write_bytes(b"theirs")

    with pytest.raises(LogError, match="exists already"):
        overtaken()
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"theirs")]


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"there is no folder .*none; make it"), atomic_write(tmp_path / "none" / "a"):
        pass


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="is a folder"), atomic_write(tmp_path):
        pass


def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(LogError, match="No space left on device; nothing was left behind"),
        atomic_write(tmp_path / "a"),
    ):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_an_error_about_another_file_is_passed_on(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic_write(tmp_path / "a"):
        (tmp_path / "source").read_bytes()
    assert list(tmp_path.iterdir()) == []
