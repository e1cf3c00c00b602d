"""The free numbers of the diagnosis stand in one file, each with what it means."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import chladni.gap
from chladni.gap import calibration

GAP = Path(chladni.gap.__file__).parent
CALIBRATION = Path(calibration.__file__)
#: Kinds of numbers that decide nothing, by file: codes of a library's header, a format, an offset of what stands in
#: the calibration. Robots are a diagnosis of their own.
ALLOWED = {
    "kept_memory.py": {"_TRIM_THRESHOLD", "_MMAP_THRESHOLD"},
    "comparison/whole_stretch.py": {"_TOLD_HZ"},
    "comparison/local_rational.py": {"POLES"},
    "comparison/outside_band.py": {"_LINES"},
    "plant/linear_problem.py": {"_AT_ONCE"},
}
#: None, all, half, small counts; and 12, by which a step's square is divided for the variance of its rounding.
PLAIN = {0, 1, 2, 3, 4, 0.5, 12}
MOST = 120


def files() -> list[Path]:
    return [one for one in sorted(GAP.rglob("*.py")) if "robots" not in one.relative_to(GAP).parts]


def name_of(path: Path) -> str:
    return path.relative_to(GAP).as_posix()


def numbers_in(tree: ast.AST) -> list[float]:
    found = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    return [one for one in found if isinstance(one, int | float) and not isinstance(one, bool)]


def constants(source: str) -> Iterator[tuple[str, ast.expr, int]]:
    """Name, value and line of every constant of a module."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for name in (each.id for one in targets for each in ast.walk(one) if isinstance(each, ast.Name)):
                if name.lstrip("_").isupper():
                    yield name, node.value, node.lineno


def thresholds(source: str) -> Iterator[tuple[int, float]]:
    """Line and value of numbers that are compared with, or that an argument has by default."""
    for node in ast.walk(ast.parse(source)):
        parts: list[ast.expr] = []
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
        elif isinstance(node, ast.arguments):
            parts = [one for one in (*node.defaults, *node.kw_defaults) if one is not None]
        for part in parts:
            # What only picks an item or a slice of something is no threshold.
            inside = {
                id(each) for one in ast.walk(part) if isinstance(one, ast.Subscript) for each in ast.walk(one.slice)
            }
            kept = [one for one in ast.walk(part) if isinstance(one, ast.Constant) and id(one) not in inside]
            yield from ((part.lineno, one) for each in kept for one in numbers_in(each))


@pytest.mark.parametrize("path", [one for one in files() if one != CALIBRATION], ids=name_of)
def test_no_number_has_a_name_elsewhere(path: Path) -> None:
    named = {name for name, value, _ in constants(path.read_text(encoding="utf-8")) if numbers_in(value)}
    assert named <= ALLOWED.get(name_of(path), set())


@pytest.mark.parametrize("path", files(), ids=name_of)
def test_no_threshold_is_a_bare_number(path: Path) -> None:
    bare = [(line, one) for line, one in thresholds(path.read_text(encoding="utf-8")) if one not in PLAIN]
    assert not bare


def test_every_number_says_what_it_means() -> None:
    lines = CALIBRATION.read_text(encoding="utf-8").splitlines()
    silent = [name for name, _, line in constants("\n".join(lines)) if not lines[line - 2].startswith("#: ")]
    assert not silent


def test_every_number_is_read() -> None:
    source = CALIBRATION.read_text(encoding="utf-8")
    read = {
        word for one in files() if one != CALIBRATION for word in re.findall(r"\w+", one.read_text(encoding="utf-8"))
    }
    # One of them may be made of another.
    names = [
        one for one in ast.walk(ast.parse(source)) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Load)
    ]
    assert not {name for name, _, _ in constants(source)} - read - {one.id for one in names}


def test_there_are_few_numbers() -> None:
    # By lines, for one may name two.
    found = [{line: value for _, value, line in constants(one.read_text(encoding="utf-8"))} for one in files()]
    assert sum(len(numbers_in(value)) for one in found for value in one.values()) <= MOST
