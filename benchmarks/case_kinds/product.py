"""The product as its users run it: a command, its exit code, its JSON, and the sentences that it says."""

import contextlib
import io
import json
import re
import shutil
import signal
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from chladni.cli.main import main

SUCCESS, UNUSABLE = 0, 2
LIMIT_S = 180
"""A command that takes longer on a file of a few kilobytes hangs."""
_NO_DOOR = re.compile(r"not an MCAP log|makes a log of it|convert it first|holds no time record|holds no function")


class RefusalError(Exception):
    """The product said that it can't use the file; its line."""


class DefectError(Exception):
    """The product crashed or hung; its line."""


class MismatchError(Exception):
    """The product answered, and the answer isn't the truth."""


class UntoldError(Exception):
    """The answer is right, and what should have been said about it wasn't."""


def expect(condition: bool, otherwise: str) -> None:
    """Raise what a wrong answer is, with one line of why."""
    if not condition:
        raise MismatchError(otherwise)


@dataclass(frozen=True, slots=True)
class Reply:
    """What one command said."""

    code: int
    document: dict[str, Any]
    errors: str

    def sentences(self, path: Path) -> str:
        """Everything but tables and channels, without the file's own name: that could tell what is looked for."""
        said = [
            line for line in self.errors.splitlines() if line.startswith(("-", "chladni:", " ")) or "  " not in line
        ]
        said += _strings({key: value for key, value in self.document.items() if key not in ("source", "target")})
        text = " ".join(" ".join(said).split())
        return text.replace(str(path), "").replace(path.name, "").replace(path.stem, "")


def _strings(value: Any) -> list[str]:
    if isinstance(value, str):
        return [value]
    if isinstance(value, Mapping):
        # A channel's own reason and warnings are sentences too; an empty list under a key says nothing.
        return [text for key, item in value.items() if item not in (None, [], {}) for text in (key, *_strings(item))]
    if isinstance(value, list):
        return [text for item in value for text in _strings(item)]
    return []


class _TooLong(BaseException):
    """Not caught by the product's own last line of defence."""


@contextlib.contextmanager
def _limit(seconds: int) -> Iterator[None]:
    def stop(_signal: int, _frame: object) -> None:
        raise _TooLong

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def run(arguments: Sequence[str]) -> Reply:
    """Run a command in this process, its output captured."""
    # Documents are written as bytes.
    written, errors = io.BytesIO(), io.StringIO()
    output = io.TextIOWrapper(written, encoding="utf-8")
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors), _limit(LIMIT_S):
            code = main(arguments)
    except _TooLong:
        raise DefectError(f"{' '.join(arguments)}: still running after {LIMIT_S} s") from None
    output.flush()
    try:
        document = json.loads(written.getvalue()) if written.getvalue().strip() else {}
    except json.JSONDecodeError as error:
        raise DefectError(f"{' '.join(arguments)}: standard output is no JSON: {error}") from None
    return Reply(code, document, errors.getvalue())


@dataclass(slots=True)
class Product:
    """The commands on one file, with the options that an earlier refusal named.

    Attributes
    ----------
    extra
        Options that every command gets which knows them.
    notes
        What was done otherwise than a user would hope: a file that had to be converted first.
    said
        Every sentence said so far.
    damage
        Whether something was told as damaged or lost.
    """

    extra: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)
    said: str = ""
    damage: bool = False

    def ask(self, command: str, path: Path, *options: str) -> dict[str, Any]:
        """Run `command` on `path`, by way of `convert` where the command doesn't take such files.

        Raises
        ------
        RefusalError
            When the product can't use the file, with its line.
        DefectError
            When it crashed or hung.
        """
        reply = self._run([command, str(path), *options])
        self._note(reply, path)
        if reply.code == UNUSABLE and path.suffix != ".mcap" and _NO_DOOR.search(reply.errors):
            log = self._converted(path)
            self.notes.append(f"{command} {path.suffix}: only by way of convert")
            reply = self._run([command, str(log), *options])
            self._note(reply, log)
        return self._document(reply)

    def info(self, path: Path) -> dict[str, Any]:
        """``chladni info``."""
        return self.ask("info", path)

    def values(self, path: Path, name: str) -> np.ndarray:
        """Samples of one channel, as ``chladni convert`` writes them; unset ones are left out."""
        _, columns = self.columns(path)
        return columns[match(name, columns)]

    def columns(self, path: Path) -> tuple[dict[str, str], dict[str, np.ndarray]]:
        """Units and samples of every channel, as ``chladni convert`` writes them."""
        target = path.with_name(f"{path.stem}-{path.suffix[1:]}-values.npz")
        reply = self._run(["convert", str(path), str(target), "--overwrite"])
        self._note(reply, path)
        self._document(reply)
        units: dict[str, str] = {}
        columns: dict[str, list[np.ndarray]] = {}
        with np.load(target) as arrays:
            for key in (key for key in arrays if key.endswith(".names")):
                group = key.removesuffix(".names")
                for index, name in enumerate(str(each) for each in arrays[key]):
                    units[name] = str(arrays[f"{group}.units"][index])
                    columns.setdefault(name, []).append(arrays[f"{group}.values"][:, index])
        joined = {name: np.concatenate(parts) for name, parts in columns.items()}
        return units, {name: part[np.isfinite(part)] for name, part in joined.items()}

    def told(self, *patterns: str) -> None:
        """Raise unless one of the sentences said so far holds each of `patterns`."""
        for pattern in patterns:
            if not re.search(pattern, self.said, re.IGNORECASE):
                raise UntoldError(f"right, but nothing is said that matches /{pattern}/")

    def tells(self, pattern: str) -> bool:
        """Whether something said so far holds `pattern`."""
        return re.search(pattern, self.said, re.IGNORECASE) is not None

    def _converted(self, path: Path) -> Path:
        log = path.with_name(f"{path.stem}-{path.suffix[1:]}.mcap")
        reply = self._run(["convert", str(path), str(log), "--overwrite"])
        self._note(reply, path)
        self._document(reply)
        return log

    def _run(self, arguments: Sequence[str]) -> Reply:
        reply = run([*arguments, *self.extra, "--json", "-"])
        if self.extra and reply.code == UNUSABLE and "No such option" in reply.errors:
            return run([*arguments, "--json", "-"])
        return reply

    def _note(self, reply: Reply, path: Path) -> None:
        self.said += " " + reply.sentences(path)
        self.damage |= bool(reply.document.get("damage"))

    def _document(self, reply: Reply) -> dict[str, Any]:
        if reply.code == SUCCESS:
            return reply.document
        line = next((line for line in reply.errors.splitlines() if line.startswith("chladni:")), reply.errors.strip())
        raise (RefusalError if reply.code == UNUSABLE else DefectError)(line)


def match(name: str, names: Mapping[str, object]) -> str:
    """Find the channel that ends in `name`, or the only one there is."""
    found = [each for each in names if each == name or re.search(rf"[./:\s\[\"]{re.escape(name)}[\]\"]*$", each)]
    if len(found) == 1:
        return found[0]
    if len(names) == 1 and not found:
        return next(iter(names))
    raise MismatchError(f"{len(found) or 'no'} channels {name!r} among {', '.join(names) or 'none'}")


def channel(document: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Entry of one channel in a document of ``info`` or ``psd``."""
    entries = {entry["name"]: entry for entry in document["channels"]}
    return dict(entries[match(name, entries)])


def count(value: object) -> int:
    """Give how many there are: documents may hold a list or a number."""
    return len(value) if isinstance(value, Sequence) else int(value) if isinstance(value, int | float) else 0


def copied(source: Path, folder: Path) -> Path:
    """Copy a file that can't be written beside."""
    target = folder / source.name
    shutil.copyfile(source, target)
    target.chmod(0o644)
    return target
