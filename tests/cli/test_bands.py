"""Bands on the command line: one word or two, the same for every command that has one."""

from collections.abc import Iterator

import pytest
from typer.main import get_command

from chladni.cli.main import app
from tests.cli.conftest import Run


def band_options() -> Iterator[tuple[str, str]]:
    """Each command with each of its options that take a band."""
    for name, command in vars(get_command(app))["commands"].items():
        for one in command.params:
            if one.nargs == 2:
                yield name, one.opts[0]


def test_the_commands_that_have_a_band_are_found() -> None:
    found = dict(band_options())
    assert found.keys() >= {"levels", "modes", "envelope", "zoom", "srs", "delay", "simulate", "orders"}


@pytest.mark.parametrize(
    ("words", "ends"),
    [
        (["{} 5-50"], (5.0, 50.0)),
        (["{}", "5-50"], (5.0, 50.0)),
        (["{}", "5:50"], (5.0, 50.0)),
        (["{}", "5", "50"], (5.0, 50.0)),
        (["{}=5-50"], (5.0, 50.0)),
        (["{}=5", "50"], (5.0, 50.0)),
        (["{}", "2.5e-1-1e+2"], (0.25, 100.0)),
        (["{}", ".5:+2."], (0.5, 2.0)),
    ],
)
def test_one_word_or_two_are_one_band(words: list[str], ends: tuple[float, float]) -> None:
    commands = vars(get_command(app))["commands"]
    for command, option in band_options():
        given = [part for word in words for part in word.format(option).split()]
        beside = {"simulate": ["--out", "a.mcap"], "delay": ["--reference", "/a.x"]}.get(command, [])
        found = commands[command].make_context(command, ["log.mcap", *given, *beside])
        assert found.params[option.lstrip("-").replace("-", "_")] == ends, (command, option)


def test_the_answer_is_the_same(run: Run, arm_log: object) -> None:
    apart = run("levels", arm_log, "--band", 5, 50, "--json", "-")
    assert apart.code == 0, apart.err
    for together in ("5-50", "5:50"):
        assert run("levels", arm_log, "--band", together, "--json", "-").document == apart.document


@pytest.mark.parametrize(
    "words", [["5"], ["5-"], ["-50"], ["5-x"], ["5", "x"], ["x", "5"], ["5-50-70"], ["5", "--slow"]]
)
def test_what_is_no_band_is_told_in_one_line_with_a_remedy(run: Run, arm_log: object, words: list[str]) -> None:
    outcome = run("levels", arm_log, "--band", *words)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert f"--band {words[0]!r} is no band; give its ends in Hz, such as --band 5-50" in outcome.err


def test_a_band_ends_with_itself_and_options_end_with_two_dashes(run: Run) -> None:
    outcome = run("levels", "a.mcap", "--band", "5-50", "70")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "unexpected extra argument" in outcome.err
    assert "--band: can't be opened" in run("levels", "--", "--band").err


@pytest.mark.parametrize("words", [["50-5"], ["50", "5"], ["5-5"]])
def test_a_band_that_falls_is_told(run: Run, arm_log: object, words: list[str]) -> None:
    outcome = run("levels", arm_log, "--band", *words)
    assert outcome.code == 2
    assert "doesn't rise; give the lower end first" in outcome.err
