"""The registry of data files: which suffix is read and written by what.

The contract of a reader, which every command relies on::

    reader(path, **options) -> FileContents

- `path` is a `Path`; the file is closed again when the reader returns, and all samples are in memory, in SI.
- What can't be read raises `LogError` in one line; an option that is missing or impossible raises `SetupError`, which
  names the option that settles it.
- One bad part never costs the rest: what is left out is in `FileContents.unread`, what was inferred in
  `FileContents.notes`.
- Options are keywords and all optional. Those with the same name mean the same in all readers (`READ_OPTIONS`); a
  reader that has no use for one doesn't take it, and `read_file` refuses it in one line.

A writer is ``writer(series, path, *, overwrite, **options) -> losses``.
"""

from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any, Final, TypeVar

from chladni.io.files.contents import FileContents
from chladni.signals.errors import LogError, SetupError

Reader = Callable[..., FileContents]
Writer = Callable[..., tuple[str, ...]]
_Function = TypeVar("_Function", bound=Callable[..., Any])

_CSV: Final = (".csv", ".txt", ".tsv")
_WAV: Final = (".wav",)
_LONG_WAV: Final = (".w64", ".rf64", ".bw64", ".bwf")
_MAT: Final = (".mat",)
_NPZ: Final = (".npz",)
_NPY: Final = (".npy",)
_UFF: Final = (".uff", ".unv")
_ARROW: Final = (".parquet", ".pq", ".arrow", ".feather")
_TDMS: Final = (".tdms",)
_LVM: Final = (".lvm",)

WRITTEN_SUFFIXES: Final = (*_CSV, *_WAV, *_MAT, *_NPZ, *_UFF, *_ARROW)
"""Data files that are written."""
FILE_SUFFIXES: Final = (*WRITTEN_SUFFIXES, *_LONG_WAV, *_NPY, *_TDMS, *_LVM)
"""Data files that are read."""
READ_OPTIONS: Final = {
    "sample_rate_hz": "samples a second, where the file doesn't say it (--rate)",
    "time": "name of the column or vector that holds the times (--time)",
    "time_unit": "what its numbers count: s, ms, us, ns, min, h, days, excel or datenum (--time-unit)",
    "units": "unit by channel name, instead of what the file says",
    "names": "names of the channels or columns, instead of what the file says",
}
"""Options that mean the same in all readers that have them."""


def is_data_file(path: Path | str) -> bool:
    """Whether the suffix is that of a data file."""
    return Path(path).suffix.lower() in FILE_SUFFIXES


def read_file(path: Path | str, **options: Any) -> FileContents:
    """Read a data file of any kind, told by its suffix.

    Parameters
    ----------
    options
        Of the reader, see `READ_OPTIONS`, ``full_scale`` of `read_wav` and alike.

    Raises
    ------
    LogError
        When the file can't be read.
    SetupError
        When the suffix isn't known, an option isn't, or an option is missing.
    """
    reader = reader_of(path)
    if not Path(path).is_file():
        raise LogError(f"{path}: no such file")
    contents: FileContents = call_with_options(reader, Path(path), options)
    return contents


def call_with_options(function: Callable[..., Any], first: object, options: dict[str, Any]) -> Any:
    """Call a reader or writer, with an option it doesn't have turned into one line."""
    # Options come from the command line by name: a wrong one is an input error, not a defect of chladni.
    known = [name for name in signature(function).parameters if name not in ("path", "series")]
    for name in options:
        if name not in signature(function).parameters:
            raise SetupError(f"{function.__name__} has no option {name!r}; it has {', '.join(known)}")
    return function(first, **options)


def reader_of(path: Path | str) -> Reader:
    """Give the reader of a file's kind; `SetupError` naming the kinds when there is none."""
    from chladni.io.files import arrow, csv, lvm, mat, npz, tdms, uff, wav

    readers: dict[tuple[str, ...], Reader] = {
        _CSV: csv.read_csv,
        (*_WAV, *_LONG_WAV): wav.read_wav,
        _MAT: mat.read_mat,
        _NPZ: npz.read_npz,
        _NPY: npz.read_npy,
        _UFF: uff.read_uff,
        _ARROW: arrow.read_arrow,
        _TDMS: tdms.read_tdms,
        _LVM: lvm.read_lvm,
    }
    return _known(readers, path, "read")


def writer_of(path: Path | str) -> Writer:
    """Give the writer of a file's kind; `SetupError` naming the kinds when there is none."""
    from chladni.io.files import arrow, csv, mat, npz, uff, wav

    writers: dict[tuple[str, ...], Writer] = {
        _CSV: csv.write_csv,
        _WAV: wav.write_wav,
        _MAT: mat.write_mat,
        _NPZ: npz.write_npz,
        _UFF: uff.write_uff,
        _ARROW: arrow.write_arrow,
    }
    return _known(writers, path, "written")


def _known(functions: dict[tuple[str, ...], _Function], path: Path | str, verb: str) -> _Function:
    suffix = Path(path).suffix.lower()
    for suffixes, function in functions.items():
        if suffix in suffixes:
            return function
    known = ", ".join(suffix for suffixes in functions for suffix in suffixes)
    raise SetupError(f"{path}: the suffix {suffix!r} isn't {verb}; supported are .mcap, {known}")
