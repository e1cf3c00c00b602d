"""``chladni bench`` as a program."""

import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
import typer

from chladni.cli.bench import bench
from chladni.models.files.model_file import write_model
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.signals.errors import ModelError, SetupError

PROGRAM = "import typer; from chladni.cli.bench import bench; typer.run(bench)"


@pytest.mark.nightly
def test_serves_this_computer_only_says_so_and_ends_with_ctrl_c() -> None:
    arguments = [sys.executable, "-u", "-c", PROGRAM, "pneumatic-motor", "--no-open"]
    with subprocess.Popen(
        arguments,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as program:
        assert program.stdout is not None
        address = program.stdout.readline().strip()
        assert address.startswith("http://127.0.0.1:")
        assert address.endswith("/pneumatic-motor")
        assert "Only this computer" in program.stdout.readline()
        with urllib.request.urlopen(address, timeout=30) as page:  # noqa: S310  # our own server
            assert page.status == 200
        program.send_signal(signal.SIGINT)
        _, errors = program.communicate(timeout=30)
    assert program.returncode == 130
    assert "Traceback" not in errors


def test_an_unknown_instrument_names_those_there_are() -> None:
    with pytest.raises(ModelError, match=r"^piano: no such file, and no instrument .*: pneumatic-motor, "):
        bench("piano")


def test_a_misspelt_instrument_is_recognised() -> None:
    with pytest.raises(ModelError, match=r"did you mean pneumatic-motor\?$"):
        bench("pneumatic-motr")


def test_rows_need_an_instrument() -> None:
    with pytest.raises(SetupError, match="--variants holds rows of one instrument's parameters"):
        bench(variants=Path("rows.csv"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "rows.csv: no such file"),
        ("name,colour\na,3\n", "colour"),
        ("name,active_area [kg]\na,3\n", "kg"),
        ("name,active_area\na,nan\n", "nan"),
    ],
)
def test_a_wrong_file_of_rows_is_told_in_the_terminal(tmp_path: Path, text: str | None, words: str) -> None:
    rows = tmp_path / "rows.csv"
    if text is not None:
        rows.write_text(text)
    with pytest.raises(ModelError, match=words):
        bench("pneumatic-motor", variants=rows, open_page=False)


def test_a_taken_port_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(SetupError, match=f"port {port} of 127.0.0.1 can't be had"):
            bench("pneumatic-motor", port=port, open_page=False)


def test_opens_the_page_when_it_can_be_had(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    opened: list[str] = []

    class Server:
        address = "http://127.0.0.1:1/"

        def run(self, ready: object) -> None:
            assert callable(ready)
            ready()

    asked: list[list[Any]] = []
    monkeypatch.setattr("webbrowser.open", opened.append)

    def open_bench(shown: Iterable[Any], **_: object) -> Server:
        asked.append(list(shown))
        return Server()

    monkeypatch.setattr("chladni.apps.bench.open_bench", open_bench)
    rows = tmp_path / "rows.csv"
    rows.write_text("name,inertia\nheavy,3e-4\n")
    bench("dc-servo", variants=rows)
    bench()
    file = tmp_path / "arm.toml"
    write_model(INSTRUMENTS["dc-servo"].model().with_values({"inertia": 3e-4}), file)
    bench(str(file))
    assert opened[:2] == ["http://127.0.0.1:1/dc-servo", "http://127.0.0.1:1/"]
    # A file of rows is of one instrument: the others get no page.
    assert asked[0] == [INSTRUMENTS["dc-servo"]]
    assert asked[1] == list(INSTRUMENTS.values())
    # A model from a file has a page of its own.
    assert asked[2][0].parameters["inertia"].value == 3e-4
    assert opened[2] == f"http://127.0.0.1:1/{asked[2][0].name}"


def test_help_lists_what_there_is() -> None:
    command = typer.main.get_command(_app())
    assert {"instrument", "port", "log", "variants", "open_page"} <= {parameter.name for parameter in command.params}


def _app() -> typer.Typer:
    app = typer.Typer()
    app.command()(bench)
    return app
