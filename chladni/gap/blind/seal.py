"""Seals: the truth of a case is fixed before the run, and can't be known from it."""

import hashlib
import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from chladni.io.atomic import atomic_write
from chladni.io.folder import made_folder
from chladni.signals.errors import SetupError

CASE_FORMAT, TRUTH_FORMAT = "chladni.blind-case/1", "chladni.blind-truth/1"
SEALED_FILES = ("model.toml", "log.mcap")
_SALT_BYTES = 32


def new_salt() -> str:
    """Give a salt that nobody can guess: without it, every likely truth could be tried against the seal."""
    return secrets.token_hex(_SALT_BYTES)


def canonical(content: Mapping[str, Any]) -> str:
    """Give one text for equal contents: keys sorted, no spaces, no numbers that aren't any.

    Examples
    --------
    >>> canonical({"b": 1.5, "a": [None]})
    '{"a":[null],"b":1.5}'
    """
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=True)


def seal_of(truth: Mapping[str, Any]) -> str:
    """SHA-256 of the salt followed by the canonical text of everything else.

    Raises
    ------
    SetupError
        When the truth has no salt.
    """
    salt = truth.get("salt")
    if not isinstance(salt, str) or not salt:
        raise SetupError("the truth has no salt; seal it with chladni.gap.blind.seal.seal_case")
    rest = {key: value for key, value in truth.items() if key != "salt"}
    return hashlib.sha256((salt + canonical(rest)).encode()).hexdigest()


def seal_case(directory: Path, name: str, truth: Mapping[str, Any], *, leave_out: tuple[str, ...] = ()) -> str:
    """Seal a case that lies in ``DIR/cases/NAME``: write its truth to ``DIR/truth``, and the seal beside the case.

    For cases of one's own, too: put ``model.toml`` and ``log.mcap`` into the folder first.

    Parameters
    ----------
    truth
        At least ``kind`` and ``effects``, see docs/methods/withheld-check.md; format, salt and the checksums of model
        and log are added.
    leave_out
        Words that the catalogue must not hold in this run.

    Returns
    -------
    str
        The seal, hexadecimal.

    Raises
    ------
    SetupError
        When the case has no model or log, or the truth no kind or effects.
    LogError
        When the truth or the seal can't be written.
    """
    case = directory / "cases" / name
    for file in SEALED_FILES:
        if not (case / file).is_file():
            raise SetupError(f"{case / file}: isn't there; a case is a model and a log")
    for key in ("kind", "effects"):
        if key not in truth:
            raise SetupError(f"{name}: the truth has no {key!r}; it needs kind and effects")
    # With the files: an answer to another model than the sealed one says nothing of the truth.
    files = {file: checksum(case / file) for file in SEALED_FILES}
    sealed = {**truth, "files": files, "format": TRUTH_FORMAT, "salt": new_salt()}
    seal = seal_of(sealed)
    write_json(made_folder(directory / "truth") / f"{name}.json", sealed)
    # Last, since its presence says that the case is whole.
    write_json(case / "case.json", {"format": CASE_FORMAT, "seal": seal, "leave_out": sorted(leave_out)})
    return seal


def checksum(path: Path) -> str:
    """SHA-256 of a file, hexadecimal.

    Raises
    ------
    SetupError
        When it can't be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise SetupError(f"{path}: can't be read: {error.strerror or error}") from error


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write JSON that appears whole or not at all."""
    with atomic_write(path) as file:
        file.write((json.dumps(content, indent=1, allow_nan=False, ensure_ascii=True) + "\n").encode())
