"""What the documents promise is there: links, commands, and the gate's own command."""

import doctest
import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
import typer

import chladni
from chladni.cli.main import app

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "benchmarks").glob("*.md")])
# Keys of MCAP metadata begin as names of the package do.
NOT_PYTHON = {"unit"}
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
    commands = typer.main.get_command(app).commands.values()
    known = {option for command in commands for one in command.params for option in (*one.opts, *one.secondary_opts)}
    named = set(re.findall(r"(?<=[ `\[(])--[a-z][a-z-]+", text))
    assert len(named) > 3
    assert named - {"--help"} <= known


def test_the_gate_runs_the_command_that_the_readme_gives():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = [line for line in readme.splitlines() if line.startswith("python3 -m venv .venv && ")]
    assert lines == [
        "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/chladni demo",
        "python3 -m venv .venv && .venv/bin/pip install -e '.[dev]' && .venv/bin/python -m pytest",
    ]
    assert "README.md" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_the_page_of_arrays_runs_as_it_stands():
    for extra in ("pandas", "xarray"):
        pytest.importorskip(extra, reason=f"needs the extra [{extra}]")
    found = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False)
    plt.close("all")
    assert found.attempted > 10
    assert not found.failed


def test_functions_that_the_guide_names_exist():
    named = set(re.findall(r"`chladni\.([A-Za-z_]+)`", (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")))
    assert len(named) > 30
    assert named <= set(chladni.__all__)


# Of what users read and copy; decisions and benchmarks are for who works on chladni itself.
SHOWN = [
    ROOT / "README.md",
    *(one for one in (ROOT / "docs").rglob("*.md") if "decisions" not in one.parts),
    *(ROOT / "examples").glob("*.[pi]*y*"),
]


@pytest.mark.parametrize("shown", SHOWN, ids=lambda path: str(path.relative_to(ROOT)))
def test_users_are_sent_to_no_module_inside(shown):
    text = shown.read_text(encoding="utf-8")
    floors = "apps|cli|viewers|robots|modal|models|spectral|io|signals|gap"
    assert not re.findall(rf"chladni\.(?:{floors})\b(?!/|-comparison/).*", text)
    public = {
        name for names in re.findall(r"^from chladni import (.+)$", text, re.MULTILINE) for name in names.split(", ")
    }
    used = set(re.findall(r"(?<![\w.\"/])chladni\.([A-Za-z_]+)(?=[(\[.,)\s])", text))
    assert public | (used - NOT_PYTHON) <= set(chladni.__all__)
