"""The diagnosis knows effects by what their records say, never by name: one's own is as good as any other."""

import ast
from pathlib import Path

import chladni.gap
from chladni.gap.records.diagnosis import PARAMETER
from chladni.models.effects.catalogue import CATALOGUE

GAP = Path(next(iter(chladni.gap.__path__)))


def names_in(path: Path) -> list[str]:
    """Effects' names that stand in a module as text of their own."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    texts = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return [f"{path.name}:{node.lineno} {node.value}" for node in texts if node.value in {*CATALOGUE, PARAMETER}]


def test_no_module_of_the_diagnosis_names_an_effect() -> None:
    # Of robots words are columns of torques, which their own modules make, tell and simulate.
    modules = [path for path in GAP.rglob("*.py") if GAP / "robots" not in path.parents]
    assert len(modules) > 50
    found = [name for path in modules for name in names_in(path)]
    assert [name.split(" ")[1] for name in found] == [PARAMETER], found
