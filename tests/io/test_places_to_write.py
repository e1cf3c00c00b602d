"""Where an output may go: files are replaced whole, everything else is written to or refused and stays."""

import fcntl
import os
import random
import stat
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.io import atomic
from chladni.io.atomic import Place, atomic_path, atomic_write, remove_parts, require_place, scratch_path
from chladni.io.convert import convert
from chladni.io.files.formats import WRITTEN_SUFFIXES
from chladni.io.files.npz import write_npz
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries

pytestmark = pytest.mark.skipif(os.name == "nt", reason="pipes, links and locks of POSIX")
#: Written by libraries that take a path, or go back in what they wrote.
SEEKING = (".arrow", ".feather", ".mat", ".parquet", ".pq", ".uff", ".unv")
WHOLE = random.Random(4).randbytes(300_000)  # noqa: S311  # larger than any pipe holds


def write(path: Path | str, content: bytes = WHOLE) -> None:
    with atomic_write(path) as file:
        file.write(content[:1000])
        file.write(content[1000:])


@contextmanager
def reading(source: Path | int) -> Iterator[list[bytes]]:
    """Read all that comes, beside the block."""
    found: list[bytes] = []

    def read() -> None:
        with open(source, "rb") as file:  # noqa: PTH123  # a number, too
            found.append(file.read())

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield found
    finally:
        reader.join(timeout=20)


# --- streams


@pytest.mark.parametrize("folder", ["/dev/fd", "/proc/self/fd"])
def test_an_open_pipe_gets_everything(tmp_path: Path, folder: str) -> None:
    """What the shell's ``>(command)`` and ``/dev/stdout`` are."""
    if not Path(folder).exists():
        pytest.skip(f"no {folder} here")
    inlet, outlet = os.pipe()
    with reading(inlet) as found:
        (tmp_path / "link").symlink_to(f"{folder}/{outlet}")
        write(tmp_path / "link")
        os.close(outlet)
    assert found == [WHOLE]
    assert (tmp_path / "link").is_symlink()


def test_an_open_file_is_written_behind_what_it_holds(tmp_path: Path) -> None:
    with (tmp_path / "both.txt").open("wb", buffering=0) as file:
        file.write(b"before,")
        write(f"/dev/fd/{file.fileno()}", b"between,")
        file.write(b"after")
    assert (tmp_path / "both.txt").read_bytes() == b"before,between,after"


def test_a_pipe_with_a_name_stays_one_and_gets_everything(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    with reading(tmp_path / "pipe.json") as found:
        write(tmp_path / "pipe.json")
    assert found == [WHOLE]
    assert stat.S_ISFIFO((tmp_path / "pipe.json").stat().st_mode)
    assert [path.name for path in tmp_path.iterdir()] == ["pipe.json"]


@pytest.mark.parametrize("kind", ["node", "link", "link of a link"])
def test_a_device_stays_one(tmp_path: Path, kind: str) -> None:
    device = tmp_path / "null"
    if kind == "node":
        try:
            os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        except (PermissionError, OSError):
            pytest.skip("only root makes devices")
    else:
        (tmp_path / "first").symlink_to(os.devnull)
        device.symlink_to(os.devnull if kind == "link" else "first")
    before = device.lstat()
    write(device)
    after = device.lstat()
    assert (after.st_mode, after.st_ino, after.st_rdev) == (before.st_mode, before.st_ino, before.st_rdev)
    assert stat.S_ISCHR(device.stat().st_mode)


def test_a_device_without_room_is_one_line() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with pytest.raises(LogError, match=r"^/dev/full: can't be written: No space left on device"):
        write("/dev/full")


def test_a_stream_needs_no_leave_to_be_overwritten() -> None:
    assert require_place(os.devnull, overwrite=False).is_stream


@pytest.mark.parametrize("suffix", sorted({".mcap", *WRITTEN_SUFFIXES}))
def test_every_format_is_sent_whole_or_refused_in_one_line(tmp_path: Path, suffix: str) -> None:
    series = TimeSeries(values=np.arange(40.0)[None], sample_rate_hz=8.0, channels=(Channel(name="a", unit="N"),))
    write_npz(series, tmp_path / "source.npz")
    convert(tmp_path / "source.npz", tmp_path / f"file{suffix}")
    inlet, outlet = os.pipe()
    (tmp_path / f"pipe{suffix}").symlink_to(f"/dev/fd/{outlet}")
    with reading(inlet) as found:
        refused = suffix in SEEKING
        with pytest.raises(LogError, match=r"is a pipe or a device, .*; name a file") if refused else nullcontext():
            convert(tmp_path / "source.npz", tmp_path / f"pipe{suffix}")
        os.close(outlet)
    assert len(found[0]) == (0 if refused else (tmp_path / f"file{suffix}").stat().st_size)


# --- links, permissions, refusals


def test_a_replaced_file_hands_on_permissions_and_links(tmp_path: Path) -> None:
    target, link = tmp_path / "private.json", tmp_path / "link.json"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to("private.json")
    write(link)
    assert (stat.S_IMODE(target.stat().st_mode), target.read_bytes(), str(link.readlink())) == (
        0o640, WHOLE, "private.json",
    )  # fmt: skip
    if os.geteuid() == 0:
        os.chown(target, 12345, 54321)
        write(link)
        assert (target.stat().st_uid, target.stat().st_gid) == (12345, 54321)


def test_what_replaces_a_private_file_is_private_from_the_start(tmp_path: Path) -> None:
    (tmp_path / "a").touch(mode=0o600)
    with atomic_path(tmp_path / "a") as part:
        assert stat.S_IMODE(part.stat().st_mode) == 0o600


def _loop(folder: Path) -> Path:
    (folder / "one").symlink_to("two")
    (folder / "two").symlink_to("one")
    return folder / "one"


def _dangling(folder: Path) -> Path:
    (folder / "link").symlink_to("nowhere/file")
    return folder / "link"


def _below_a_file(folder: Path) -> Path:
    (folder / "file").touch()
    return folder / "file" / "x"


REFUSED = {
    "loop": (_loop, "can't be written: Too many levels"),
    "link to no folder": (_dangling, "there is no folder .*nowhere; make it"),
    "300 bytes": (lambda folder: folder / ("a" * 300), "can't be written: File name too long"),
    "300 bytes of a folder": (lambda folder: folder / ("a" * 300) / "x", "can't be written: File name too long"),
    "no folder": (lambda folder: folder / "none" / "x", "there is no folder"),
    "a folder": (lambda folder: folder, "is a folder; name a file in it"),
    "below a file": (_below_a_file, "can't be written: Not a directory"),
    "closed": (lambda _: Path("/dev/fd/987"), "can't be written: Bad file descriptor"),
}


@pytest.mark.parametrize("kind", list(REFUSED))
def test_a_place_that_holds_no_file_is_one_line_beforehand(tmp_path: Path, kind: str) -> None:
    make, words = REFUSED[kind]
    path = make(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    for refuse in (require_place, write):
        with pytest.raises(LogError, match=words) as told:
            refuse(path)
        assert str(told.value).startswith(str(path))
        assert "\n" not in str(told.value)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_removed_current_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    code = (
        "import os, sys; os.chdir(sys.argv[1]); os.rmdir(sys.argv[1])\n"
        "from chladni.io.atomic import require_place\n"
        "from chladni.signals.errors import LogError\n"
        "try: require_place('x.json')\n"
        "except LogError as error: print(error)"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "gone"], capture_output=True, text=True, check=True
    )  # fmt: skip
    assert told.stdout == "x.json: the current folder was removed; change to one that is there (cd)\n"


@pytest.mark.parametrize("refused", ["folder", "file"])
def test_what_may_not_be_written_to_is_one_line_beforehand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: str
) -> None:
    (tmp_path / "x").write_text("kept")
    # Root may write anywhere, so that rights can't be taken away in a test.
    place = tmp_path if refused == "folder" else tmp_path / "x"
    monkeypatch.setattr(os, "access", lambda path, _mode: Path(path) != place)
    with pytest.raises(LogError, match="can't be written to" if refused == "folder" else "write-protected"):
        write(tmp_path / "x")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("x", "kept")]


@pytest.mark.parametrize("name", ["a" * 255, "ü" * 127, "😀" * 63, "x." + "s" * 250, "\udcff" * 255])
def test_any_name_that_the_system_takes_can_be_written(tmp_path: Path, name: str) -> None:
    try:
        (tmp_path / name).touch()
    except OSError:
        pytest.skip("not a name here")
    write(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_one_file_under_two_names_is_one(tmp_path: Path) -> None:
    (tmp_path / "a").touch()
    (tmp_path / "hard").hardlink_to(tmp_path / "a")
    (tmp_path / "soft").symlink_to("a")
    (tmp_path / "new").symlink_to("later")
    same = [("a", "hard"), ("a", "soft"), ("new", "later")]
    for one, other in same:
        assert Place.of(tmp_path / one).is_same(Place.of(tmp_path / other))
    assert not Place.of(tmp_path / "a").is_same(Place.of(tmp_path / "later"))
    assert not Place.of(os.devnull).is_same(Place.of(os.devnull))


# --- parts that programs left


def _parts(folder: Path) -> list[Path]:
    return sorted(folder.glob(".*.part"))


def _killed(target: Path) -> None:
    """Write half a file, and die of SIGKILL."""
    code = (
        "import os, signal, sys\n"
        "from chladni.io.atomic import atomic_write\n"
        "with atomic_write(sys.argv[1]) as file:\n"
        "    file.write(b'half'); file.flush(); os.kill(os.getpid(), signal.SIGKILL)"
    )
    assert subprocess.run([sys.executable, "-c", code, target], check=False).returncode == -9


def test_what_a_killed_program_left_is_removed_by_the_next_writer_of_that_file(tmp_path: Path) -> None:
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"old")
        _killed(tmp_path / name)
        assert (tmp_path / name).read_bytes() == b"old"
    assert len(_parts(tmp_path)) == 2
    write(tmp_path / "a.mcap")
    (left,) = _parts(tmp_path)
    assert left.name.startswith(".b.mcap.")
    write(tmp_path / "b.mcap")
    assert not _parts(tmp_path)


def test_writers_of_one_file_leave_each_other_alone(tmp_path: Path) -> None:
    target = tmp_path / "a"
    with atomic_write(target) as first:
        first.write(b"first")
        with atomic_write(target) as second:
            assert len(_parts(tmp_path)) == 2
            second.write(b"second")
        assert (target.read_bytes(), len(_parts(tmp_path))) == (b"second", 1)
    assert (target.read_bytes(), _parts(tmp_path)) == (b"first", [])


def test_many_writers_at_once_all_end_well(tmp_path: Path) -> None:
    failed: list[BaseException] = []

    def repeat(number: int) -> None:
        try:
            for _ in range(40):
                write(tmp_path / "a", bytes([number]) * 500)
        except LogError as error:
            failed.append(error)

    threads = [threading.Thread(target=repeat, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    content = (tmp_path / "a").read_bytes()
    assert content == content[:1] * 500
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_part_taken_before_its_lock_was_held_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between the making of a part and its lock another writer may take it for abandoned."""
    taken: list[Path] = []

    def flock(descriptor: int, how: int) -> None:
        if not taken:
            (part,) = _parts(tmp_path)
            taken.append(part)
            part.unlink()
        fcntl.flock(descriptor, how)

    monkeypatch.setattr(atomic, "_locks", SimpleNamespace(LOCK_EX=fcntl.LOCK_EX, LOCK_NB=fcntl.LOCK_NB, flock=flock))
    write(tmp_path / "a")
    assert taken
    assert (tmp_path / "a").read_bytes() == WHOLE


def test_what_only_looks_like_a_part_is_kept(tmp_path: Path) -> None:
    names = [".a.0123456789ab.csv", ".a.xyz.part", ".ab.0123456789ab.part", "a.0123456789ab.part", ".a.part"]
    for name in names:
        (tmp_path / name).touch()
    (tmp_path / ".a.0123456789ab.part").touch()
    write(tmp_path / "a")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names, "a"])


def test_scratch_beside_a_part_goes_and_is_found_with_it(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "a") as part, scratch_path(part) as scratch:
        scratch.write_text("s")
        left = [part.name, scratch.name]
        assert len(_parts(tmp_path)) == 2
    assert not _parts(tmp_path)
    for name in left:
        (tmp_path / name).touch()
    write(tmp_path / "a")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_who_ends_here_and_now_removes_the_parts(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "a") as part:
        remove_parts()
        assert not _parts(tmp_path)
        part.write_text("made again")
    assert (tmp_path / "a").read_text() == "made again"


def test_without_locks_nothing_is_taken_for_abandoned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atomic, "_locks", None)
    (tmp_path / ".a.0123456789ab.part").touch()
    write(tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == WHOLE
    assert len(_parts(tmp_path)) == 1
