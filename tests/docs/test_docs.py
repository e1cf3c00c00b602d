"""What the documents promise is there: links, commands, and the gate's own command."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chladni.cli.main import app

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "benchmarks").glob("*.md")])
LINK = re.compile(r"\]\((?!https?://)([^)#]+)[^)]*\)")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document):
    for target in LINK.findall(document.read_text(encoding="utf-8")):
        assert (document.parent / target).exists(), f"{document.name} links to {target}"


def test_every_command_is_in_the_guide():
    guide = (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")
    commands = {command.callback.__name__ for command in app.registered_commands}
    assert len(commands) > 8
    for name in commands - {"demo"}:
        assert f"chladni {name}" in guide, name


@pytest.mark.parametrize("document", ["README.md", "docs/guide.md"])
def test_options_that_are_named_exist(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    helps = " ".join(
        CliRunner().invoke(app, [command.callback.__name__, "--help"], env={"COLUMNS": "200"}).output
        for command in app.registered_commands
    )
    for option in set(re.findall(r"(?<=[ `\[(])--[a-z][a-z-]+", text)) - {"--help"}:
        assert option in helps, option


def test_the_gate_runs_the_command_that_the_readme_gives():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = [line for line in readme.splitlines() if line.startswith("python3 -m venv .venv && ")]
    assert lines == [
        "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/chladni demo",
        "python3 -m venv .venv && .venv/bin/pip install -e '.[dev]' && .venv/bin/python -m pytest",
    ]
    assert "README.md" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_functions_that_the_guide_names_exist():
    from importlib import import_module

    guide = (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")
    paths = set(re.findall(r"`(chladni(?:\.[a-z_]+)+\.[A-Za-z_]+)`", guide))
    assert len(paths) > 8
    for path in paths:
        module, name = path.rsplit(".", 1)
        assert hasattr(import_module(module), name), path
