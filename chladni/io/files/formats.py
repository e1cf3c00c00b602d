"""The registry of data files: which kind is read and written by what, and which kind a file is.

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

import re
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from types import NoneType
from typing import Any, Final, TypeVar, get_args

from chladni.io.files.contents import FileContents
from chladni.io.mcap.log_file import looks_like
from chladni.io.regular_file import require_regular
from chladni.signals.errors import LogError, SetupError
from chladni.signals.wording import shown

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


MCAP: Final = ".mcap"
# What the first bytes of a file say it is, whatever its name says. What isn't read is left to the name.
_MAGIC: Final = (
    (re.compile(rb"\x89MCAP"), MCAP),
    (re.compile(rb"RIF[FX]....WAVE|RF64....WAVE|BW64....WAVE|riff\x2e\x91\xcf\x11", re.DOTALL), ".wav"),
    (re.compile(rb"MATLAB [57]\.\d MAT-file"), ".mat"),
    (re.compile(rb"PK\x03\x04.{26}[^\0]{1,200}\.npy", re.DOTALL), ".npz"),
    (re.compile(rb"\x93NUMPY"), ".npy"),
    (re.compile(rb"PAR1"), ".parquet"),
    (re.compile(rb"ARROW1"), ".arrow"),
    (re.compile(rb"TDSm"), ".tdms"),
    (re.compile(rb"LabVIEW Measurement"), ".lvm"),
    (re.compile(rb"\s*-1[ \t]*\r?\n[ \t]*\d{1,6}b?\b"), ".uff"),
)
_MAGIC_BYTES = 256
# Text that has no magic; all other kinds begin with theirs.
_TEXTS: Final = (*_CSV, *_LVM)
_TEXT = re.compile(rb"(\xff\xfe|\xfe\xff).*|[^\0-\x08\x0e-\x1f]+", re.DOTALL)


def file_kind(path: Path) -> str:
    """Tell the kind of a file: `MCAP`, or the suffix of the data files that it is one of.

    The first bytes decide where they tell; else the suffix, where it is that of a data file; else a text with lines
    of numbers is a table. All other files count as MCAP, whose reader says what they look like: so an archive.
    """
    suffix = path.suffix.lower()
    try:
        # A named pipe would block until someone writes to it.
        start = _first_bytes(path) if path.is_file() else b""
    except OSError:
        start = b""
    for magic, kind in _MAGIC:
        if magic.match(start):
            # Several suffixes stand for one kind.
            known = kind == MCAP or kind in FILE_SUFFIXES
            return suffix if known and _same_kind(suffix, kind) else kind if known else suffix
    # A zip archive may be an NPZ that holds something else first.
    if looks_like(start) and suffix != ".npz":
        return MCAP
    if suffix not in _TEXTS and _TEXT.fullmatch(start) and _is_table(path):
        return ".txt"
    return suffix if suffix in FILE_SUFFIXES else MCAP


def told_by_content(path: Path, kind: str) -> tuple[str, ...]:
    """Say that a file was read as another kind than its suffix stands for; nothing where the two agree."""
    suffix = path.suffix.lower()
    if suffix == kind or (kind == MCAP and not suffix):
        return ()
    return (f"read as a {kind} file by its content; its suffix is {suffix!r}.",)


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_MAGIC_BYTES)


def _same_kind(suffix: str, kind: str) -> bool:
    return suffix in FILE_SUFFIXES and kind in FILE_SUFFIXES and reader_of(f"a{suffix}") is reader_of(f"a{kind}")


def _is_table(path: Path) -> bool:
    from chladni.io.files.csv_dialect import sniff_csv

    try:
        return sniff_csv(path).columns > 0
    except (LogError, SetupError):
        return False


def read_file(path: Path | str, *, kind: str | None = None, **options: Any) -> FileContents:
    """Read a data file of any kind.

    Parameters
    ----------
    kind
        As `file_kind` tells it; None goes by the suffix.
    options
        Of the reader, see `READ_OPTIONS`, ``full_scale`` of `read_wav` and alike.

    Raises
    ------
    LogError
        When the file can't be read.
    SetupError
        When the suffix isn't known, an option isn't, or an option is missing.
    """
    reader = reader_of(f"a{kind}" if kind else path)
    require_regular(Path(path), LogError)
    try:
        contents: FileContents = call_with_options(reader, Path(path), options)
    except OSError as error:
        raise LogError(f"{path}: can't be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise LogError(f"{path}: takes more memory than there is; save it in parts, and read these") from error
    return contents


def fitting_options(path: Path, options: dict[str, Any]) -> dict[str, Any]:
    """Of options of `chladni.open` for files of many kinds, give those that this one's reader takes."""
    kind = file_kind(path)
    takes = ("stamp", "sample_rate_hz") if kind == MCAP else signature(reader_of(f"a{kind}")).parameters
    return {name: value for name, value in options.items() if name in takes}


def call_with_options(function: Callable[..., Any], first: object, options: dict[str, Any]) -> Any:
    """Call a reader or writer, with an option it doesn't have turned into one line."""
    # Options come from the command line by name: a wrong one is an input error, not a defect of chladni.
    known = [name for name in signature(function).parameters if name not in ("path", "series")]
    for name in options:
        if name not in signature(function).parameters:
            raise SetupError(f"{function.__name__} has no option {name!r}; it has {', '.join(known)}")
        _require_kind(name, options[name], signature(function).parameters[name].annotation)
    return function(first, **options)


def _require_kind(name: str, value: object, annotation: object) -> None:
    """Refuse text for a number, or a number for text: options come as people wrote them."""
    kinds = set(get_args(annotation) or (annotation,)) - {NoneType}
    if value is None or kinds not in ({str}, {float}, {int}):
        return
    found, told = (str, "text") if kinds == {str} else (int | float, "a number")
    if isinstance(value, bool) or not isinstance(value, found):
        raise SetupError(f"option {name} is {shown(value)}; must be {told}")


def reader_of(path: Path | str) -> Reader:
    """Give the reader of a file's kind; `SetupError` naming the kinds when there is none."""
    from chladni.io.files import csv, lvm, mat, npz, parquet, tdms, uff_contents, wav

    readers: dict[tuple[str, ...], Reader] = {
        _CSV: csv.read_csv,
        (*_WAV, *_LONG_WAV): wav.read_wav,
        _MAT: mat.read_mat,
        _NPZ: npz.read_npz,
        _NPY: npz.read_npy,
        _UFF: uff_contents.read_universal_file,
        _ARROW: parquet.read_arrow,
        _TDMS: tdms.read_tdms,
        _LVM: lvm.read_lvm,
    }
    return _known(readers, path, "read")


def writer_of(path: Path | str) -> Writer:
    """Give the writer of a file's kind; `SetupError` naming the kinds when there is none."""
    from chladni.io.files import csv, mat, npz, parquet, uff, wav

    writers: dict[tuple[str, ...], Writer] = {
        _CSV: csv.write_csv,
        _WAV: wav.write_wav,
        _MAT: mat.write_mat,
        _NPZ: npz.write_npz,
        _UFF: uff.write_uff,
        _ARROW: parquet.write_arrow,
    }
    return _known(writers, path, "written")


def _known(functions: dict[tuple[str, ...], _Function], path: Path | str, verb: str) -> _Function:
    suffix = Path(path).suffix.lower()
    for suffixes, function in functions.items():
        if suffix in suffixes:
            return function
    known = ", ".join(suffix for suffixes in functions for suffix in suffixes)
    raise SetupError(f"{path}: the suffix {suffix!r} isn't {verb}; supported are .mcap, {known}")
