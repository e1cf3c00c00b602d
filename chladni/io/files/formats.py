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
from chladni.signals.errors import SetupError

Reader = Callable[..., FileContents]
Writer = Callable[..., tuple[str, ...]]
_Function = TypeVar("_Function", bound=Callable[..., Any])

WRITTEN_SUFFIXES: Final = (".csv", ".txt", ".wav", ".mat", ".npz", ".uff", ".unv")
"""Data files that are written."""
FILE_SUFFIXES: Final = WRITTEN_SUFFIXES
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
    contents: FileContents = call_with_options(reader_of(path), Path(path), options)
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
    from chladni.io.files import csv, mat, npz, uff, wav

    readers: dict[str, Reader] = {
        ".csv": csv.read_csv,
        ".txt": csv.read_csv,
        ".wav": wav.read_wav,
        ".mat": mat.read_mat,
        ".npz": npz.read_npz,
        ".uff": uff.read_uff,
        ".unv": uff.read_uff,
    }
    return _known(readers, path, "read")


def writer_of(path: Path | str) -> Writer:
    """Give the writer of a file's kind; `SetupError` naming the kinds when there is none."""
    from chladni.io.files import csv, mat, npz, uff, wav

    writers: dict[str, Writer] = {
        ".csv": csv.write_csv,
        ".txt": csv.write_csv,
        ".wav": wav.write_wav,
        ".mat": mat.write_mat,
        ".npz": npz.write_npz,
        ".uff": uff.write_uff,
        ".unv": uff.write_uff,
    }
    return _known(writers, path, "written")


def _known(functions: dict[str, _Function], path: Path | str, verb: str) -> _Function:
    suffix = Path(path).suffix.lower()
    if suffix not in functions:
        raise SetupError(f"{path}: the suffix {suffix!r} isn't {verb}; supported are .mcap, {', '.join(functions)}")
    return functions[suffix]
