"""Where a command's words go: a table for people, JSON for programs, progress while one waits."""

import os
import sys
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, Protocol, Self

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from chladni.cli.channel_rows import told_once
from chladni.cli.places import require_places
from chladni.io.atomic import Place, atomic_write
from chladni.signals.errors import LogError, SetupError
from chladni.signals.visible import document_text, visible, visible_lines
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from chladni.cli.options import Looks
    from chladni.signals.study import Study
    from chladni.signals.value import Value
    from chladni.viewers.figures import Album

P = ParamSpec("P")
PROGRESS_AFTER_S = 1.0
STANDARD_OUTPUT = 1
# Rows of a table: terminals keep about as many lines to scroll back through.
MOST_ROWS = 1000


class Progress(Protocol):
    """Shows how far a command is."""

    def __call__(self, share: float, step: str = "") -> None:
        """Show the share done, 0 to 1, and what is being done where there are several steps."""


class _Console(Console):
    """A console that falls silent when its reader goes away, as with ``| head``: files are written all the same."""

    def on_broken_pipe(self) -> None:
        self.quiet = True
        # What Python flushes at its end must go somewhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), self.file.fileno())

    def print(self, *objects: Any, **options: Any) -> None:
        with writing("standard error" if self.stderr else "standard output"):
            super().print(*objects, **options)


@contextmanager
def writing(stream: str) -> Iterator[None]:
    """Make a `LogError` of what the operating system says of a stream; that its reader has gone is no mistake."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise LogError(
            f"{stream}: can't be written: {error.strerror or error}; send it to where there is room"
        ) from error


class Output:
    """Tables go to standard output, unless JSON or CSV was asked for there: then to standard error."""

    def __init__(
        self,
        json_target: str | None = None,
        csv_target: str | None = None,
        *,
        reads: Sequence[Path | None] = (),
        static: bool = False,
    ) -> None:
        self._reads, self._static = reads, static
        self.json_target = _told_target(json_target, "the document of --json")
        self.csv_target = _told_target(csv_target, "the table of --csv")
        if self.json_target == self.csv_target == "-":
            raise SetupError("--json and --csv would mix on standard output; name a file for one of them")
        self.console = _Console(stderr="-" in (self.json_target, self.csv_target), highlight=False, soft_wrap=False)
        if not self.console.is_terminal:
            # A pipe has no width of its own; rich's 80 would cut channel names in two.
            self.console.width = max(self.console.width, 160)

    @classmethod
    def of_log(
        cls,
        reads: Sequence[Path | None],
        *,
        json: str | None,
        csv: str | None = None,
        figures: Path | None,
        report: Path | None = None,
        static: bool = False,
        others: Mapping[str, Path | None] | None = None,
    ) -> Self:
        """Give the output of a command that reads `reads`, once all that it will write is known to have its place.

        `static` puts pictures in its report, not plots; `others` are further files, by the option that asks for each.
        """
        if static and report is None:
            raise SetupError("--static says how a report looks; ask for one (--report FILE.html)")
        require_places(
            reads=reads,
            writes={"--json": json, "--csv": csv, **(others or {}), "--report": report},
            folders={"--figures": figures},
        )
        return cls(json, csv, reads=reads, static=static)

    def line(self, text: str = "", *, style: str = "") -> None:
        """Print one line, wrapped at the terminal's width."""
        self.console.print(Text(visible(text)), style=style)

    def lines(self, texts: Sequence[str]) -> None:
        """Print sentences as a list."""
        for text in texts:
            self.console.print(Text(f"- {visible(text)}"), style="yellow" if text.startswith("Warning") else "")

    def table(
        self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], *, texts: Container[int] = (0,)
    ) -> None:
        """Print a table; columns with the numbers `texts` are text, the others line up to the right."""
        # Without vertical lines: long channel names need the room in a terminal of 100 columns.
        table = Table(
            box=box.SIMPLE_HEAD,
            show_edge=False,
            pad_edge=False,
            collapse_padding=True,
        )
        for number, column in enumerate(columns):
            # A heading may be broken into lines; it's a word of ours.
            side: Literal["left", "right"] = "left" if number in texts else "right"
            table.add_column(escape(visible_lines(column)), justify=side, overflow="fold")
        for row in rows[:MOST_ROWS]:
            table.add_row(*(escape(visible(cell)) for cell in row))
        # Not as the table's own title, which would wrap at the table's width.
        self.line(title, style="bold")
        self.console.print(table)
        if len(rows) > MOST_ROWS:
            self.line(f"... and {counted(len(rows) - MOST_ROWS, 'more row')}; --json FILE holds all of them")

    def channel_table(
        self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], *, named: int = 0
    ) -> None:
        """Print a table with channels' names in a column; what they share is told once, in its heading."""
        shared, rest = told_once([row[named] for row in rows])
        if shared:
            columns = [f"{one} {shared}" if place == named else one for place, one in enumerate(columns)]
            rows = [[*row[:named], name, *row[named + 1 :]] for name, row in zip(rest, rows, strict=True)]
        self.table(title, columns, rows)

    def pictures(
        self,
        *studies: "Study",
        figures: Path | None,
        report: Path | None,
        looks: "Looks | None" = None,
    ) -> None:
        """Save figures and report where they were asked for, and say where they are.

        Those of several logs are drawn over one another; their report names the log with each channel.
        """
        if figures is None and report is None:
            return
        from chladni.viewers.figures import Album
        from chladni.viewers.figures.log_axis import Scales

        scales = Scales() if looks is None else Scales(decibels=looks.db, log_frequency=looks.log_frequency)
        if len(studies) == 1:
            self.album(Album.of(studies[0], scales=scales), studies[0], figures=figures, report=report)
            return
        from chladni.apps.show import gather

        whole = gather(*studies)
        album = Album.over_one_another(whole, studies, scales=scales)
        self.album(album, whole, figures=figures, report=report)

    def album(self, album: "Album", study: "Study", *, figures: Path | None, report: Path | None) -> None:
        """Save the figures of an album, and the report that they stand in, where they were asked for."""
        if figures is not None:
            from chladni.viewers.figures import save_album

            for path in save_album(album, figures):
                self.line(f"figure: {path}")
        if report is not None:
            from chladni.viewers.report import write_report

            write_report(study, report, album=album, interactive=False if self._static else None)
            self.line(f"report: {report}")

    def figures(self, command: str, drawn: "Mapping[str, Figure]", folder: Path) -> None:
        """Save the figures of a command in a folder, and say where they are."""
        from chladni.viewers.figures import Album, save_album

        for path in save_album(Album({command: drawn}), folder):
            self.line(f"figure: {path}")

    def json(self, document: Callable[P, Mapping[str, Any]], *args: P.args, **options: P.kwargs) -> None:
        """Write the document of these values where ``--json`` said; it isn't made when that wasn't given."""
        if self.json_target is None:
            return
        # UTF-8, whatever the terminal's encoding.
        encoded = document_text(document(*args, **options)).encode()
        if self.json_target != "-":
            with atomic_write(self.json_target) as file:
                file.write(encoded)
            return
        _send(encoded)

    def documents(
        self, document: Callable[..., Mapping[str, Any]], values: Sequence[tuple[str, tuple[Any, ...]]]
    ) -> None:
        """Write the document of one log, made of its values, or those of several, each with its log's name."""
        if len(values) == 1:
            self.json(document, *values[0][1])
            return
        self.json(
            lambda: {
                "format": "chladni.logs/1",
                "logs": [{"log": name, **document(*some)} for name, some in values],
            }
        )

    @property
    def csv_streams(self) -> bool:
        """Whether ``--csv`` named a stream, which takes one table."""
        return self.csv_target is not None and (self.csv_target == "-" or Place.of(Path(self.csv_target)).is_stream)

    def csv(self, values: "Sequence[Value]") -> None:
        """Write `values` where ``--csv`` said, and say so; nothing when it wasn't given.

        A table has one axis. The second one goes beside the first, as ``psd_2.csv``, and so on. What the
        command reads isn't replaced.
        """
        if self.csv_target is None:
            return
        target = Path(self.csv_target)
        if len(values) > 1 and self.csv_streams:
            raise SetupError(
                f"--csv {target}: a stream takes one table, and there are {len(values)} of different axes; "
                "name a file, or a single channel (--channel)"
            )
        if self.csv_target == "-":
            with TemporaryDirectory() as folder:
                values[0].to_csv(Path(folder) / "table.csv")
                _send((Path(folder) / "table.csv").read_bytes())
            return
        paths = [target, *(target.with_stem(f"{target.stem}_{place}") for place in range(2, len(values) + 1))]
        beside = {f"table {place} of --csv": path for place, path in enumerate(paths, start=1)}
        require_places(reads=self._reads, writes={"--json": self.json_target, **beside})
        for value, path in zip(values, paths, strict=True):
            value.to_csv(path)
            self.line(f"table: {path}")

    @contextmanager
    def progress(self, title: str) -> Iterator[Progress]:
        """Give a function that takes the share done; a bar shows after a second, on a terminal only."""
        from time import monotonic

        from rich.progress import BarColumn, SpinnerColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        console = Console(stderr=True)
        # A step may take minutes: what turns and counts meanwhile tells it from one that hangs.
        columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(),
                   TimeElapsedColumn())  # fmt: skip
        bar = Bar(*columns, console=console, transient=True, disable=not console.is_terminal)
        title = visible(title)
        task = bar.add_task(escape(title), total=1.0)
        begun = monotonic()

        def show(share: float, step: str = "") -> None:
            if not bar.disable and not bar.live.is_started and monotonic() - begun > PROGRESS_AFTER_S:
                bar.start()
            bar.update(task, completed=share, description=escape(f"{title}: {visible(step)}" if step else title))

        try:
            yield show
        finally:
            # Some versions of rich print an empty line when a bar that never started is stopped.
            if bar.live.is_started:
                bar.stop()


def _told_target(target: str | None, what: str) -> str | None:
    """Give where a document goes, ``-`` for every name of standard output."""
    if target is not None and Place.of(target).descriptor == STANDARD_OUTPUT:
        target = "-"
    if target == "-" and sys.stdout is None:
        raise LogError(f"standard output is closed: it can't take {what} -; name a file")
    return target


def _send(content: bytes) -> None:
    with writing("standard output"):
        sys.stdout.flush()
        sys.stdout.buffer.write(content)
        sys.stdout.flush()
