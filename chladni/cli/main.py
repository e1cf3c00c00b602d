"""The ``chladni`` program: its commands, and one place that turns errors into a line and an exit code."""

import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from signal import Signals
from typing import Annotated, Any

import typer
from typer.main import get_command

from chladni import __version__
from chladni.apps.stopping import LISTENER, Stopped
from chladni.cli.bench import bench
from chladni.cli.blind import blind
from chladni.cli.cepstrum import cepstrum
from chladni.cli.compare import compare
from chladni.cli.convert import convert
from chladni.cli.delay import delay
from chladni.cli.demo import demo
from chladni.cli.envelope import envelope
from chladni.cli.excite import excite
from chladni.cli.frf import frf
from chladni.cli.gap import gap
from chladni.cli.influence import influence
from chladni.cli.info import info
from chladni.cli.levels import levels
from chladni.cli.live import live
from chladni.cli.modes import modes
from chladni.cli.octaves import octaves
from chladni.cli.ods import ods
from chladni.cli.options import Command
from chladni.cli.orders import orders
from chladni.cli.psd import psd
from chladni.cli.query import query
from chladni.cli.simulate import simulate
from chladni.cli.srs import srs
from chladni.cli.study import study
from chladni.cli.tolerance import tolerance
from chladni.cli.view import view
from chladni.cli.waterfall import waterfall
from chladni.cli.zoom import zoom
from chladni.signals.errors import ChladniError, LogError
from chladni.signals.visible import visible, visible_lines
from chladni.signals.wording import counted

SUCCESS, DEFECT, UNUSABLE, INTERRUPTED = 0, 1, 2, 130
MOST_MISTAKES = 3

app = typer.Typer(
    name="chladni",
    help="A virtual Fourier analyser: acceleration logs to spectra, transfer functions and modes, in rerun, "
    "with simulated machines beside them.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for command in (
    info,
    levels,
    psd,
    waterfall,
    octaves,
    envelope,
    cepstrum,
    frf,
    modes,
    srs,
    orders,
    ods,
    delay,
    tolerance,
    zoom,
    view,
    live,
    compare,
    study,
    query,
    convert,
    simulate,
    influence,
    gap,
    excite,
    bench,
    demo,
):
    app.command(cls=Command)(command)
app.add_typer(blind)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"chladni {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


@cache
def _program() -> Any:
    # Half of the time of a short command goes into this; within a process it's made once.
    return get_command(app)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and give its exit code.

    0 success; 2 unusable input, or output that can't be written; 130, 143, 129 ended by Ctrl-C, SIGTERM, SIGHUP; 1 a
    defect of chladni. Each but the first is one line on standard error; with ``CHLADNI_TRACEBACK=1`` in the
    environment the traceback follows.
    """
    try:
        code = _program()(args=arguments, prog_name="chladni", standalone_mode=False)
    except (ChladniError, typer.TyperException) as error:
        return _fail(error, UNUSABLE)
    except Stopped as stopped:
        return _stopped(f"ended by {stopped.name}", 128 + stopped.number)
    except SystemExit:
        # Typer's way of saying that the reader of our output has gone, as with `| head`: nothing is wrong.
        return SUCCESS
    except (KeyboardInterrupt, typer.Abort):
        return _stopped("interrupted", INTERRUPTED)
    except OSError as error:
        return _fail(_told(error), UNUSABLE)
    except Exception as error:  # noqa: BLE001  # the last line of defence: a defect is told in one line
        return _fail(error, DEFECT)
    # Typer makes an exit code of Ctrl-C in a command.
    if code == INTERRUPTED:
        return _stopped("interrupted", INTERRUPTED)
    return code if isinstance(code, int) else SUCCESS


def _stopped(how: str, code: int) -> int:
    # True because files are written atomically: each appears when it's whole.
    _say(f"chladni: {how}; every file is whole, or as it was before")
    return code


def _say(line: str) -> None:
    # Where standard error can't be written to, the exit code says it alone.
    with suppress(OSError):
        print(line, file=sys.stderr)  # noqa: T201  # the one line that a failure prints


def _told(error: OSError) -> ChladniError:
    """What the operating system refuses is no mistake of ours: a full disk, a lack of rights, too many open files."""
    about = f"{error.filename}: " if error.filename is not None else ""
    return LogError(f"{about}the operating system refuses: {error.strerror or error}")


def _fail(error: Exception, code: int) -> int:
    if LISTENER.heard is not None:
        # A library made an error of its own of what the signal raised.
        return _stopped(f"ended by {Signals(LISTENER.heard).name}", 128 + LISTENER.heard)
    if os.environ.get("CHLADNI_TRACEBACK"):
        import traceback

        print(visible_lines("".join(traceback.format_exception(error))), file=sys.stderr)  # noqa: T201
    text = error.format_message() if isinstance(error, typer.TyperException) else str(error)
    # Typer hands on how its own validation calls a wrong choice.
    text = text.replace("Value error, ", "")
    # In a message that chladni wrote only a name can hold a line feed, and no blank of a name is left out.
    line = _mistakes([*map(visible, error.mistakes)]) if isinstance(error, ChladniError) else _on_one_line(text)
    if code == DEFECT:
        line = f"defect of chladni ({type(error).__name__}): {line}; CHLADNI_TRACEBACK=1 shows where"
    _say(f"chladni: {line}")
    return code


def _on_one_line(text: str) -> str:
    return " ".join(visible_lines(text).split())


def _mistakes(lines: Sequence[str]) -> str:
    """Several mistakes of one file, the first few with their lines, as one line."""
    told = list(lines[:MOST_MISTAKES])
    if place := re.match(r".+?:(?=\d+: )", lines[0] if lines else ""):
        # All have the same long path in front.
        told[1:] = [line.replace(place[0], "line ", 1) for line in told[1:]]
    if more := lines[MOST_MISTAKES:]:
        # The last line counts those that have none of their own.
        further = re.fullmatch(r"\.\.\. and (at least )?(\d+) more mistakes?", more[-1])
        count = len(more) + (int(further[2]) - 1 if further else 0)
        told.append(f"and {further[1] or '' if further else ''}{counted(count, 'more mistake')}")
    return "; ".join(told)
