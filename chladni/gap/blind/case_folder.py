"""Reading the folders of a campaign: cases, results, truths. What they hold is checked, wherever it came from."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from chladni.gap.blind.documents import SealedCase, Truth, read_as
from chladni.gap.blind.seal import CASE_FORMAT, SEALED_FILES, TRUTH_FORMAT, checksum, seal_of
from chladni.io.regular_file import read_text
from chladni.signals.errors import SetupError
from chladni.signals.wording import shown

#: Largest JSON that is read, bytes.
_MOST_BYTES = 16 * 1024 * 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseFolder:
    """A case as the diagnosis gets it.

    Attributes
    ----------
    name
        Of the folder.
    model, log
        Its files.
    seal
        SHA-256 of the truth, hexadecimal.
    leave_out
        Words that the catalogue must not hold.
    """

    name: str
    model: Path
    log: Path
    seal: str
    leave_out: frozenset[str]


def case_folders(directory: Path) -> list[CaseFolder]:
    """All cases of a campaign, by name.

    Raises
    ------
    SetupError
        When there is none, or one isn't whole.
    """
    found = sorted((directory / "cases").glob("*/case.json"))
    if not found:
        raise SetupError(f"{directory / 'cases'}: holds no case; make some with chladni blind make {directory}")
    return [_folder(path) for path in found]


def _folder(path: Path) -> CaseFolder:
    content = read_json(path, CASE_FORMAT)
    model, log = (path.with_name(file) for file in SEALED_FILES)
    for file in (model, log):
        if not file.is_file():
            raise SetupError(f"{file}: isn't there; a case is a model and a log")
    case = read_as(SealedCase, content, str(path), "seal the case again")
    return CaseFolder(
        name=path.parent.name, model=model, log=log, seal=case.seal, leave_out=frozenset(case.leave_out)
    )


def truth_of_case(directory: Path, case: CaseFolder) -> Mapping[str, Any]:
    """Open the truth of a case.

    Raises
    ------
    SetupError
        When it isn't there, or it, the model or the log isn't what was sealed.
    """
    path = directory / "truth" / f"{case.name}.json"
    if not path.is_file():
        raise SetupError(f"{path}: isn't there; move the truths back to {path.parent} for the score")
    truth = read_json(path, TRUTH_FORMAT)
    if seal_of(truth) != case.seal:
        raise SetupError(
            f"{path}: doesn't fit the seal of {case.name}: truth or seal were changed after the case was made; "
            "it can't be scored"
        )
    read = read_as(Truth, truth, str(path), "seal a whole truth")
    if read.files is not None:
        _require_sealed(case, read.files)
    return truth


def _require_sealed(case: CaseFolder, checksums: Mapping[str, str]) -> None:
    """Refuse a model or a log that was changed; a truth sealed by an earlier version doesn't know them."""
    for file in (case.model, case.log):
        if checksums.get(file.name) != checksum(file):
            raise SetupError(
                f"{file}: was changed after the case was sealed: an answer to it can't be scored; put the sealed one "
                "back, and run the case again"
            )


def read_json(path: Path, *words: str) -> dict[str, Any]:
    """Read one JSON object of a format, or of one of several.

    Raises
    ------
    SetupError
        When the file isn't there, is too large, is no such JSON, or holds what isn't finite.
    """
    text = read_text(path, _MOST_BYTES, SetupError)
    try:
        content = json.loads(text, parse_constant=_refused, parse_float=_finite)
        # Seals are of this text; half a surrogate pair, or lists too deep for it, have none.
        json.dumps(content, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise SetupError(f"{path}: isn't JSON: {error}") from error
    if not isinstance(content, dict) or content.get("format") not in words:
        found = content.get("format") if isinstance(content, dict) else type(content).__name__
        raise SetupError(f"{path}: format is {shown(found)}; must be {' or '.join(map(repr, words))}")
    return content


def _finite(text: str) -> float:
    number = float(text)
    return number if isfinite(number) else _refused(text[:20])


def _refused(word: str) -> float:
    raise ValueError(f"{word} is no finite number")
