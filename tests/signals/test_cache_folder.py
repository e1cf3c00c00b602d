"""Kernels are kept where only their owner can write, or not at all."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from chladni.signals import cache_folder


@pytest.fixture
def nowhere_to_write(monkeypatch, tmp_path):
    """Neither beside the package nor in the home folder."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(cache_folder, "_can_write", lambda _folder: False)
    monkeypatch.setattr(cache_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    return tmp_path


def test_a_private_folder_is_made_and_named(nowhere_to_write, monkeypatch):
    assert cache_folder.choose_cache()
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    assert folder.parent == nowhere_to_write
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    assert cache_folder.choose_cache()


@pytest.mark.parametrize("trap", ["open to all", "link", "file"])
def test_what_somebody_else_may_have_put_there_is_not_used(nowhere_to_write, monkeypatch, trap):
    place = nowhere_to_write / f"chladni-numba-{os.getuid()}"
    if trap == "open to all":
        place.mkdir()
        place.chmod(0o777)
    elif trap == "link":
        (nowhere_to_write / "elsewhere").mkdir(mode=0o700)
        place.symlink_to(nowhere_to_write / "elsewhere")
    else:
        place.write_text("")
    assert not cache_folder.choose_cache()
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_a_folder_that_the_user_named_is_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "mine"))
    assert cache_folder.choose_cache()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert os.environ["NUMBA_CACHE_DIR"] == str(tmp_path)


def test_importing_the_package_does_not_import_numba():
    code = "import sys, chladni.models.integrator.simulate; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
