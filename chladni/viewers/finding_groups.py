"""Findings as a page tells them: short names of channels, a prefix that all share once, one subject once."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile

# A topic or a message path as it stands in a sentence: from a slash to what can't be in it.
_PATH = re.compile(r"(?<![\w/.\]])/[\w\-./\[\]{}]*[\w\]}]")
_PATHS = re.compile(rf"{_PATH.pattern}(?:, {_PATH.pattern})*(?: and \d+ more)?")
# Fewer paths have no prefix that is worth a line.
FEWEST_PATHS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingGroup:
    """Findings on one subject; `subject` is empty for those that have none of their own."""

    subject: str
    findings: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ToldFindings:
    """Findings in groups; `prefix` is what was left out at the beginning of every path."""

    prefix: str
    groups: tuple[FindingGroup, ...]


def told_findings(findings: Sequence[str], labels: Mapping[str, str]) -> ToldFindings:
    """Shorten the names in findings and put those of one subject together, in the order in which they come.

    Parameters
    ----------
    findings
        Sentences; those that begin with paths and a colon have these as their subject.
    labels
        Label of each channel by its full name, as figures and the table of channels have it.

    Examples
    --------
    >>> told = told_findings(["/a/b: one", "All is well.", "/a/b: two", "/a/c: three"], {})
    >>> told.prefix, [(group.subject, group.findings) for group in told.groups]
    ('/a/', [('b', ('one', 'two')), ('', ('All is well.',)), ('c', ('three',))])
    """
    labelled = [_PATH.sub(lambda found: labels.get(found.group(), found.group()), one) for one in findings]
    paths = [path for one in labelled for path in _PATH.findall(one)]
    prefix = _shared(paths) if len(paths) >= FEWEST_PATHS else ""
    subjects: dict[str, list[str]] = {}
    for place, one in enumerate(labelled):
        subject, said = _parted(one)
        shortened = [_PATH.sub(lambda found: found.group().removeprefix(prefix), part) for part in (subject, said)]
        # A sentence without a subject is a group of its own, so that the order stays.
        subjects.setdefault(shortened[0] or f"\0{place}", []).append(shortened[1])
    groups = (
        FindingGroup(subject="" if subject.startswith("\0") else subject, findings=tuple(said))
        for subject, said in subjects.items()
    )
    return ToldFindings(prefix=prefix, groups=tuple(groups))


def _shared(paths: Sequence[str]) -> str:
    """Give what all paths begin with, whole parts of it; nothing where that is the first slash alone."""
    parts = zip(*(path.split("/")[:-1] for path in paths), strict=False)
    shared = [same[0] for same in takewhile(lambda same: len(set(same)) == 1, parts)]
    # A path begins with a slash, so that its first part is empty.
    return "/".join([*shared, ""]) if len(shared) > 1 else ""


def _parted(sentence: str) -> tuple[str, str]:
    """Split a sentence that begins with paths at its colon."""
    subject, colon, said = sentence.partition(": ")
    # Paths and how many more there are, no words: those would be told as if they were a name.
    begins = subject.startswith("/") and _PATHS.fullmatch(subject) is not None
    return (subject, said) if colon and begins else ("", sentence)
