"""Reading the folders of a campaign: cases, results, truths. What they hold is checked, wherever it came from."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chladni.gap.blind.seal import CASE_FORMAT, SEALED_FILES, TRUTH_FORMAT, checksum, seal_of
from chladni.gap.blind.vocabulary import WORDS
from chladni.signals.errors import SetupError

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
    seal, words = content.get("seal"), content.get("leave_out", [])
    if not isinstance(seal, str) or len(seal) != 64:
        raise SetupError(f"{path}: seal must be 64 hexadecimal digits; seal the case again")
    if not isinstance(words, list) or not all(word in WORDS for word in words):
        raise SetupError(f"{path}: leave_out {words!r:.80} must be a list of effects of the vocabulary")
    return CaseFolder(name=path.parent.name, model=model, log=log, seal=seal, leave_out=frozenset(words))


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
    for key, kind in (("kind", str), ("effects", list)):
        if not isinstance(truth.get(key), kind):
            raise SetupError(f"{path}: {key} is missing or no {kind.__name__}")
    _require_sealed(case, truth.get("files"))
    return truth


def _require_sealed(case: CaseFolder, checksums: object) -> None:
    """Refuse a model or a log that was changed; a truth sealed by an earlier version doesn't know them."""
    if not isinstance(checksums, dict):
        return
    for file in (case.model, case.log):
        if checksums.get(file.name) != checksum(file):
            raise SetupError(
                f"{file}: was changed after the case was sealed: an answer to it can't be scored; put the sealed one "
                "back, and run the case again"
            )


def read_json(path: Path, word: str) -> dict[str, Any]:
    """Read one JSON object of a format.

    Raises
    ------
    SetupError
        When the file isn't there, is too large, is no such JSON or holds NaN.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise SetupError(f"{path}: is larger than {_MOST_BYTES} bytes, which no such file is")
        content = json.loads(path.read_text(encoding="utf-8"), parse_constant=_refused)
    except OSError as error:
        raise SetupError(f"{path}: can't be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise SetupError(f"{path}: isn't JSON: {error}") from error
    if not isinstance(content, dict) or content.get("format") != word:
        found = content.get("format") if isinstance(content, dict) else type(content).__name__
        raise SetupError(f"{path}: format is {found!r:.60}; must be {word!r}")
    return content


def _refused(word: str) -> float:
    raise ValueError(f"{word} is no number")
