"""The folders of a campaign: cases, truths and results as documents that are checked, and the seals on them.

A seal fixes the truth of a case before the run, and tells nothing of it. What else stands in a document than what a
score goes by is passed over: a result may be that of another program.
"""

import hashlib
import json
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, model_validator

from chladni.io.atomic import atomic_write
from chladni.io.folder import made_folder
from chladni.io.regular_file import read_text
from chladni.io.validation import ModelT, validated
from chladni.signals.errors import SetupError
from chladni.signals.wording import MOST_SHOWN, counted, shown
from chladni_withheld.case import QUIET, Kind
from chladni_withheld.vocabulary import FAMILY_OF

RESULT_FORMAT, FAILURE_FORMAT = "chladni.gap/1", "chladni.blind-failure/1"
_MOST_TOLD = 3

Text = Annotated[str, Field(min_length=1, max_length=1000)]
Number = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def _word(text: str) -> str:
    if text not in FAMILY_OF:
        raise ValueError("must be an effect of the vocabulary")
    return text


def _seal(found: object) -> str:
    if not isinstance(found, str) or re.fullmatch("[0-9a-f]{64}", found) is None:
        raise ValueError("must be 64 hexadecimal digits")
    return found


def read_as(document: type[ModelT], content: Mapping[str, Any], where: str, remedy: str) -> ModelT:
    """Give content as a document of its kind.

    Raises
    ------
    SetupError
        With the first mistakes, each with its key, what was found and what would be right; and the remedy.
    """
    read, mistakes = validated(content, document)
    if read is not None:
        return read
    told = [f"{_key(one.loc)}{one.text()}" for one in mistakes[:_MOST_TOLD]]
    more = len(mistakes) - len(told)
    told += [f"and {counted(more, 'more mistake')}"] if more else []
    raise SetupError(f"{where}: {'; '.join(told)}; {remedy}")


def _key(loc: tuple[str | int, ...]) -> str:
    """``("causes", 0, "effect")`` as programs write it: ``causes[0].effect: ``."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part[:MOST_SHOWN]}" for part in loc)
    return f"{path.removeprefix('.')}: " if loc else ""


class _Document(BaseModel):
    # Strict: "0.5" is no number, and 1 no truth value.
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True, strict=True)


class Named(_Document):
    """An effect and its site."""

    effect: Text
    site: Text


class Hidden(Named):
    """What was hidden: its numbers, how clear it is, and what else says the same."""

    parameters: dict[str, Any] | None = None
    severity_tuned: Number | None = None
    also: list[Named] | None = None


class SealedCase(_Document):
    """``chladni.blind-case/1``."""

    seal: Annotated[str, PlainValidator(_seal)]
    leave_out: list[Annotated[str, AfterValidator(_word)]] = []


class Truth(_Document):
    """``chladni.blind-truth/1``: what was hidden, how far it is off the noise, and what was sealed with it."""

    kind: Kind
    effects: list[Hidden]
    coloured: bool = False
    off: dict[str, Any] | None = None
    ratio: Number | None = None
    ratio_tuned: Number | None = None
    ideal: Annotated[float, Field(gt=0.0)] | None = None
    files: dict[str, str] | None = None
    gains: dict[str, dict[str, float]] | None = None

    @model_validator(mode="after")
    def _hides_something(self) -> Self:
        if not self.effects and self.kind not in QUIET:
            raise ValueError(f"kind is {self.kind}, and effects holds none")
        return self


class OtherEffect(_Document):
    """An effect that can't be told from the one that is named."""

    effect: Text


class Cause(Named):
    """A cause that was named."""

    group: list[Text] | None = None
    probability: Share | None = None
    alternatives: list[OtherEffect] | None = None
    parameters: dict[str, Any] | None = None


class Ranked(Named):
    """A candidate and the gap that it leaves."""

    gap: Number | None = None


class Gap(_Document):
    """How much of the gap was closed."""

    closed: Share | None = None


class Result(_Document):
    """``chladni.gap/1``, an answer."""

    verdict: Literal["none", "parameters", "effect", "unknown"]
    causes: list[Cause] | None = None
    ranking: list[Ranked] | None = None
    naive: Named | None = None
    gap: Gap | None = None
    where: dict[str, Any] | None = None
    tuned_parameters: dict[str, Any] | None = None
    remarks: list[str] | None = None


CASE_FORMAT, TRUTH_FORMAT = "chladni.blind-case/1", "chladni.blind-truth/1"
MODEL_FILES, LOG_FILE = ("robot.toml", "model.toml"), "log.mcap"
#: What a robot file names: its description.
_BESIDE = ("*.urdf", "*.xml")
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
        raise SetupError("the truth has no salt; seal it with chladni_withheld.folders.seal_case")
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
    model, log = _model_and_log(case)
    for key in ("kind", "effects"):
        if key not in truth:
            raise SetupError(f"{name}: the truth has no {key!r}; it needs kind and effects")
    # With the files: an answer to another model than the sealed one says nothing of the truth.
    files = _checksums(model, log)
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
    model, log = _model_and_log(path.parent)
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
        require_files(case, read.files)
    return truth


def _model_and_log(folder: Path) -> tuple[Path, Path]:
    models = [folder / file for file in MODEL_FILES]
    model, log = next((file for file in models if file.is_file()), models[-1]), folder / LOG_FILE
    for file in (model, log):
        if not file.is_file():
            raise SetupError(f"{file}: isn't there; a case is a model and a log")
    return model, log


def checksums(case: CaseFolder) -> dict[str, str]:
    """SHA-256 of a case's model, its log, and the descriptions beside them, by the names of the files."""
    return _checksums(case.model, case.log)


def _checksums(model: Path, log: Path) -> dict[str, str]:
    beside = sorted(file for kind in _BESIDE for file in model.parent.glob(kind))
    return {file.name: checksum(file) for file in (model, log, *beside)}


def require_files(case: CaseFolder, sealed: Mapping[str, str]) -> None:
    """Refuse a model or a log that isn't the one that was sealed.

    Raises
    ------
    SetupError
        With the file, when its checksum is another.
    """
    found = checksums(case)
    for name in sorted({*found, *sealed}):
        if sealed.get(name) != found.get(name):
            raise SetupError(
                f"{case.model.parent / name}: isn't what was sealed: an answer to it can't be scored; put the "
                "sealed one back, and run the case again"
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
