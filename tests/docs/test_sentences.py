"""No sentence that users read is longer than 40 words: README, guide, help and messages."""

import ast
import re
from pathlib import Path

import pytest

from chladni.cli.main import app

ROOT = Path(__file__).parents[2]
MOST_WORDS = 40
PAGES = ("README.md", "CONTRIBUTING.md", "docs/guide.md")
CODE = re.compile(r"```.*?```", re.DOTALL)
# A sentence ends with its mark and a space; a line of a table, a heading or an item of a list ends one, too.
HEADING = re.compile(r"^#.*$", re.MULTILINE)
END = re.compile(r"(?<=[.!?])[\"')\]*_`]*\s+|\n\s*\n|\n(?=\s*[-*#|>]|\s*\d+\. )|(?<=\|)")

# What may hold a text of so many words: adjacent literals, or one of many lines that is no docstring.
LONG_TEXT = re.compile(r'(?:f?"(?:[^"\\\n]|\\.)*"\s+)+f?"(?:[^"\\\n]|\\.)*"|[=(,]\s*f?"""[^"]*"""')
SHORTEST = 3 * MOST_WORDS


def too_long(text: str) -> list[str]:
    sentences = (" ".join(one.split()) for one in END.split(text))
    return [one for one in sentences if sum(any(c.isalnum() for c in word) for word in one.split()) > MOST_WORDS]


def spoken(node: ast.expr) -> str | None:
    """Text of a literal, what is put in at run time as one word; None when it is no text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(one.value if isinstance(one, ast.Constant) else "N" for one in node.values)
    return None


def literals(node: ast.AST) -> list[str]:
    """Texts of a module without its docstrings; the parts of one text once, as a whole."""
    text = spoken(node) if isinstance(node, ast.expr) else None
    if text is not None:
        return [text]
    parts = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node, clean=False):
        parts.remove(node.body[0])
    return [one for part in parts for one in literals(part)]


def test_the_count_itself():
    long = "word " * (MOST_WORDS + 1)
    assert too_long(long + ".") == [long + "."]
    assert too_long(("word " * MOST_WORDS).strip() + ". " + "Next one.") == []
    assert too_long("```\n" + long + "\n```") != []
    assert literals(ast.parse('"""Doc."""\nx = f"a {y} b" " c"\nz = "d"')) == ["a N b c", "d"]


@pytest.mark.parametrize("page", PAGES)
def test_pages(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert too_long(HEADING.sub("\n\n", CODE.sub("\n\n", text))) == []


def test_help():
    import typer

    told = []
    for name, command in typer.main.get_command(app).commands.items():
        texts = [command.help or "", *(getattr(one, "help", None) or "" for one in command.params)]
        told += [(name, one) for text in texts for one in too_long(text)]
    assert told == []


def test_messages():
    told = []
    for path in sorted([*(ROOT / "chladni").rglob("*.py"), *(ROOT / "chladni_withheld").rglob("*.py")]):
        source = path.read_text(encoding="utf-8")
        # To parse every module would take seconds.
        if not any(len(found[0]) > SHORTEST for found in LONG_TEXT.finditer(source)):
            continue
        for text in literals(ast.parse(source)):
            # Rules of style and scripts of pages aren't read by users.
            if "{" not in text and "<" not in text:
                told += [(str(path.relative_to(ROOT)), one) for one in too_long(text)]
    assert told == []
