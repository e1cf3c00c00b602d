"""One case: a file whose truth is known, a check, and what the product made of it."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from case_kinds.product import DefectError, MismatchError, Product, RefusalError, UntoldError

Outcome = Literal["right", "asked", "untold", "told wrong", "refused", "dead end", "defect", "WRONG"]
GOOD: tuple[Outcome, ...] = ("right", "asked")
SILENT: tuple[Outcome, ...] = ("WRONG", "defect")
_OPTION = re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)(?:[ =]([^\s,;:)]+))?")
_PLACEHOLDER = re.compile(r"^[A-Z_.]+$|^<")
MOST_TRIES = 8

Check = Callable[[Product, Path], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A file, and what is right about it.

    Attributes
    ----------
    kind
        Folder of the given files.
    name
        Of this file.
    write
        Makes the file in a folder; None when a given file isn't there.
    check
        Raises unless the product's answer is the truth.
    may_refuse
        ``no``; ``asking``: a refusal is as right as an answer where its advice leads to the truth; ``yes``.
    answers
        What a user would answer when asked: values an option (``--rate``), a reader's option (``time_unit``),
        or the text of a ``setup`` file; any one of several spellings.
    """

    kind: str
    name: str
    write: Callable[[Path], Path | None]
    check: Check
    may_refuse: Literal["no", "asking", "yes"] = "no"
    answers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one case, and one line of why."""

    case: Case
    outcome: Outcome
    why: str
    notes: tuple[str, ...]

    @property
    def good(self) -> bool:
        """Whether the case counts as answered."""
        return self.outcome in GOOD


def judge(case: Case, folder: Path) -> Verdict | None:
    """Write the case's file, run the product on it, and follow its advice where it refuses; None: no such file."""
    path = case.write(folder)
    if path is None:
        return None
    product = Product()
    outcome, why = _outcome(case, product, path)
    if outcome == "refused":
        outcome, why = _follow(case, path, why)
    return Verdict(case, outcome, " ".join(why.split()), tuple(dict.fromkeys(product.notes)))


def _outcome(case: Case, product: Product, path: Path) -> tuple[Outcome, str]:
    try:
        case.check(product, path)
    except RefusalError as refusal:
        return "refused", str(refusal)
    except UntoldError as untold:
        return "untold", str(untold)
    except MismatchError as mismatch:
        return "told wrong" if product.damage else "WRONG", str(mismatch)
    except DefectError as defect:
        return "defect", str(defect)
    return "right", ""


def _follow(case: Case, path: Path, line: str) -> tuple[Outcome, str]:
    """Do what the line of a refusal says, and look whether that leads to the truth."""
    tries = 0
    for extra in _remedies(case, path, line):
        tries += 1
        outcome, _ = _outcome(case, Product(extra=extra), path)
        if outcome in ("right", "untold"):
            asked = case.may_refuse != "no"
            return "asked" if asked else "refused", f"{line} [followed: {' '.join(extra)} gives the truth]"
        if tries == MOST_TRIES:
            break
    if case.may_refuse == "yes":
        return "asked", line
    return ("dead end", f"{line} [followed in {tries} ways: none gives the truth]") if tries else ("refused", line)


def _remedies(case: Case, path: Path, line: str) -> Iterator[tuple[str, ...]]:
    """Options that the line names, with a user's answer where the case knows one, else as the line spells them."""
    for name, value in dict.fromkeys(_OPTION.findall(line)):
        key = value.partition("=")[0] if name == "read" else f"--{name}"
        if name == "read" and key in case.answers:
            yield from (("--read", f"{key}={answer}") for answer in case.answers[key])
        elif name != "read" and key in case.answers:
            yield from ((key, answer) for answer in case.answers[key])
        elif value and not _PLACEHOLDER.match(value):
            yield (f"--{name}", value)
        elif not value:
            yield (f"--{name}",)
    if "setup" in case.answers and "setup" in line:
        setup = path.with_suffix(".setup.toml")
        setup.write_text(case.answers["setup"][0])
        yield ("--setup", str(setup))
