"""``chladni gap``: where a model and a log disagree, what was left out, and how far the gap closes."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.gap_rows import print_by_level, print_comparison, print_diagnosis
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_places

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.apps.gap_comparison import GapComparison
    from chladni.apps.sources import Span
    from chladni.gap.records.diagnosis import Diagnosis
    from chladni.io.log import Log
    from chladni.models.core.model import Model
    from chladni.robots.machine import Machine
    from chladni.robots.robot import Robot
    from chladni.viewers.gap_evidence import GapEvidence
    from chladni.viewers.robot_scene import RobotScene
    from chladni.viewers.structure_sketch import StructureSketch

Files = Annotated[
    list[Path],
    typer.Argument(
        metavar="MODEL LOG...",
        help="A model file or a robot (MJCF, URDF, robot file), then logs of the machine; several levels tell more.",
        show_default=False,
    ),
]
Simulated = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="LOG",
        help="What a simulator of your own wrote, in place of MODEL: tells where and when, not why. Once a LOG.",
        show_default=False,
    ),
]
Without = Annotated[
    list[str] | None,
    typer.Option(
        metavar="EFFECT",
        help="Leave this effect out (of a robot at one site: EFFECT@SITE); may be repeated.",
        show_default=False,
    ),
]
Seed = Annotated[
    int, typer.Option(metavar="N", min=0, help="Start of the random numbers; the same seed gives the same answer.")
]
Report = Annotated[
    Path | None,
    typer.Option(
        "--html", "--report", metavar="FILE.html", help="Write a self-contained HTML report.", show_default=False
    ),
]
Sheet = Annotated[
    Path | None,
    typer.Option(
        metavar="OUT.png", help="Write one sheet with the evidence, as PNG, SVG or PDF.", show_default=False
    ),
]
Recording = Annotated[
    Path | None, typer.Option(metavar="OUT.rrd", help="Write a rerun recording.", show_default=False)
]
ExplainedModel = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write the model (.toml) or the robot's description (.xml, .urdf) with what was found.",
        show_default=False,
    ),
]


State = Annotated[
    str | None, typer.Option(metavar="TOPIC", help="Of a robot: where its joints were measured.", show_default=False)
]
Command = Annotated[
    str | None, typer.Option(metavar="TOPIC", help="Of a robot: where its joints were commanded.", show_default=False)
]


@opens_files
def gap(
    files: Files,
    *,
    simulated: Simulated = None,
    without: Without = None,
    seed: Seed = 0,
    start: options.Start = None,
    end: options.End = None,
    join: options.Join = "auto",
    opener: Opener,
    json: options.Json = None,
    report: Report = None,
    static: options.Static = False,
    figure: Sheet = None,
    figures: options.Figures = None,
    save: Recording = None,
    web: Annotated[
        bool, typer.Option("--web", help="Serve the pictures to a browser on this computer only.")
    ] = False,
    write_model: ExplainedModel = None,
    state: State = None,
    command: Command = None,
) -> None:
    """Where a model and a log disagree, which effect was left out, and how far the gap closes with it."""
    wanted = _Wanted(
        json=json, report=report, static=static, figure=figure, figures=figures, save=save, web=web,
        write_model=write_model,
    )  # fmt: skip
    # A diagnosis takes its time: it shouldn't be lost to a misspelt folder.
    from chladni.apps.sources import Span

    wanted.require_places([*files, *(simulated or ()), opener.setup])
    out = Output(json)
    open_one = opener.among([*(files if simulated else files[1:]), *(simulated or ())])
    with ExitStack() as opened:

        def opening(path: Path) -> "Log":
            return opened.enter_context(open_one(path))

        if simulated:
            _require_pairs(files, simulated, wanted, without)
            pairs = [(opening(ours), opening(theirs)) for ours, theirs in zip(files, simulated, strict=True)]
            _compare(out, pairs, wanted, Span(start_s=start, end_s=end, join=join))
            return
        model, logs = _model_and_logs(files)
        asked = _Asked(
            without=without or (), seed=seed, span=Span(start_s=start, end_s=end, join=join), state=state,
            command=command,
        )  # fmt: skip
        asked.require_fitting(model, wanted.write_model)
        _diagnose(out, model, [opening(log) for log in logs], wanted, asked)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Wanted:
    """Files that were asked for."""

    json: str | None
    report: Path | None
    static: bool
    figure: Path | None
    figures: Path | None
    save: Path | None
    web: bool
    write_model: Path | None

    def require_places(self, reads: "Sequence[Path | None]") -> None:
        """Refuse files that can't be written, before anything is computed."""
        if self.save is not None and self.web:
            from chladni.signals.errors import SetupError

            raise SetupError("--save writes a file and --web serves a page; give one of them")
        if self.static and self.report is None:
            from chladni.signals.errors import SetupError

            raise SetupError("--static says how a report looks; ask for one (--report FILE.html)")
        require_places(
            reads=reads, writes={"--json": self.json, **self._files()}, folders={"--figures": self.figures}
        )

    def of_a_model(self) -> list[str]:
        """Options that ask for a file which only a model gives."""
        given = {
            "--figure": self.figure, "--save": self.save, "--web": self.web or None, "--write-model": self.write_model
        }  # fmt: skip
        return [name for name, asked in given.items() if asked is not None]

    @property
    def interactive(self) -> bool | None:
        """Whether the report's plots zoom; None for where Bokeh is installed."""
        return False if self.static else None

    def _files(self) -> dict[str, Path | None]:
        return {
            "--html": self.report,
            "--figure": self.figure,
            "--save": self.save,
            "--write-model": self.write_model,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """How a diagnosis was asked for."""

    without: "Sequence[str]"
    seed: int
    span: "Span"
    state: str | None
    command: str | None

    def require_fitting(self, model: "Model | Robot", written: Path | None) -> None:
        """Refuse topics of joints for what is no robot, and a name of another kind of file than is written."""
        from chladni.robots.robot import Robot
        from chladni.signals.errors import SetupError

        given = [name for name, topic in (("--state", self.state), ("--command", self.command)) if topic is not None]
        if given and not isinstance(model, Robot):
            raise SetupError(f"{', '.join(given)}: names a topic of a robot's joints, and {model.name!r} is a model")
        right = (".xml", ".urdf") if isinstance(model, Robot) else (".toml",)
        if written is not None and written.suffix.lower() not in right:
            raise SetupError(
                f"{written}: --write-model writes {' or '.join(right)} of {model.name!r}; give such a name"
            )


def _model_and_logs(files: "Sequence[Path]") -> "tuple[Model | Robot, Sequence[Path]]":
    """Read the model or robot; `SetupError` when there's no log beside it, or a log in its place."""
    from chladni.io.files.formats import FILE_SUFFIXES, MCAP
    from chladni.models.files.model_file import load_model
    from chladni.signals.errors import SetupError

    first, *logs = files
    if first.suffix.lower() in (MCAP, *FILE_SUFFIXES):
        raise SetupError(f"{first}: is a log; give a model file first, or --simulated {first} for a comparison alone")
    if not logs:
        raise SetupError(f"{first}: no log to hold against the model; give one behind it")
    from chladni.robots.loading import is_robot_file, load_robot

    return load_robot(first, meshes=False) if is_robot_file(first) else load_model(first), logs


def _require_pairs(
    files: "Sequence[Path]", simulated: "Sequence[Path]", wanted: _Wanted, without: "Sequence[str] | None"
) -> None:
    """Refuse a log without its partner, and what takes a model."""
    from chladni.signals.errors import SetupError
    from chladni.signals.wording import counted

    if len(files) != len(simulated):
        raise SetupError(
            f"{counted(len(files), 'measured log')} and {counted(len(simulated), 'simulated log')}: give --simulated "
            "once for each measured log, in their order; no model belongs there"
        )
    # Rather refused than ignored: a picture that was asked for and never comes is looked for.
    given = [*wanted.of_a_model(), *(["--without"] if without else [])]
    if given:
        raise SetupError(
            f"{', '.join(given)}: takes a model; --simulated only tells where and when two logs disagree"
        )


def _diagnose(
    out: Output,
    model: "Model | Robot",
    logs: "Sequence[Log]",
    wanted: _Wanted,
    asked: _Asked,
) -> None:
    from chladni.apps.diagnose import diagnose_gap
    from chladni.apps.gap_document import gap_document
    from chladni.gap.kept_memory import keep_memory

    keep_memory()
    with out.progress(model.name) as progress:
        found = diagnose_gap(
            model,
            logs,
            leave_out=asked.without,
            seed=asked.seed,
            start_s=asked.span.start_s,
            end_s=asked.span.end_s,
            join=asked.span.join,
            state=asked.state,
            command=asked.command,
            progress=lambda step, share: progress(share, step),
        )
    # First: what took so long to find isn't lost to a picture or a model that can't be written.
    out.json(gap_document, found)
    print_diagnosis(out, found)
    _draw(out, found, model, wanted)
    if wanted.write_model is not None:
        _write_explained(out, found, model, wanted.write_model)
    # Last: a page is served until the user ends it.
    if wanted.web:
        _serve(out, found, model)


def _write_explained(out: Output, found: "Diagnosis", model: "Model | Robot", path: Path) -> None:
    from chladni.robots.robot import Robot

    if not isinstance(model, Robot):
        _write_model(out, found, model, path)
    elif found.machine is not None:
        _write_robot(out, found.machine, path)


def _write_robot(out: Output, machine: "Machine", path: Path) -> None:
    from chladni.robots.written import write_robot

    written = write_robot(machine, path)
    out.line(f"description: {written.description}")
    if written.robot_file is not None:
        out.line(f"robot file: {written.robot_file}")
    out.lines([f"not in the description: {one}" for one in written.not_held])


def _write_model(out: Output, found: "Diagnosis", model: "Model", path: Path) -> None:
    from chladni.apps.explained_model import explained_model
    from chladni.models.files.model_file import write_model
    from chladni.signals.errors import ModelError

    try:
        write_model(explained_model(model, found), path)
    except ModelError as error:
        raise ModelError(f"{path}: not written, a model file can't hold what was found; {error}") from error
    out.line(f"model: {path}")


def _compare(
    out: Output,
    pairs: "Sequence[tuple[Log, Log]]",
    wanted: _Wanted,
    span: "Span",
) -> None:
    from chladni.apps.gap_by_level import by_level_document, gap_by_level
    from chladni.apps.gap_comparison import compare_with_simulated, comparison_document

    with out.progress(", ".join(simulated.path.name for _, simulated in pairs)):
        found = [
            compare_with_simulated(ours, theirs, start_s=span.start_s, end_s=span.end_s, join=span.join)
            for ours, theirs in pairs
        ]
        several = gap_by_level(found) if len(found) > 1 else None
    if several is None:
        print_comparison(out, found[0])
    else:
        print_by_level(out, several)
    _draw_comparisons(out, found, () if several is None else several.sentences(), wanted)
    if several is None:
        out.json(comparison_document, found[0])
    else:
        out.json(by_level_document, several)


def _draw_comparisons(
    out: Output, found: "Sequence[GapComparison]", levels: "Sequence[str]", wanted: _Wanted
) -> None:
    """Write the pictures of comparisons that were asked for, and say where they are."""
    if wanted.report is None and wanted.figures is None:
        return
    from chladni.apps.gap_comparison_evidence import comparison_evidence
    from chladni.viewers.figures.log_gap import log_gap_album

    evidence = [comparison_evidence(one) for one in found]
    # Pictures of several logs would have the same names, and logs may have, too.
    albums = [
        log_gap_album(one, prefix="" if len(found) == 1 else f"{place} {one.signals.log} ")
        for place, one in enumerate(evidence, 1)
    ]
    if wanted.figures is not None:
        from chladni.viewers.figures.saving import save_album

        for album in albums:
            for path in save_album(album, wanted.figures):
                out.line(f"figure: {path}")
    if wanted.report is not None:
        from chladni.viewers.report.log_gap import write_log_gap_report

        write_log_gap_report(
            list(zip(evidence, albums, strict=True)), wanted.report, levels=levels, interactive=wanted.interactive
        )
        out.line(f"report: {wanted.report}")


def _draw(out: Output, found: "Diagnosis", model: "Model | Robot", wanted: _Wanted) -> None:
    """Write the pictures that were asked for, and say where they are."""
    if not any((wanted.report, wanted.figure, wanted.figures, wanted.save)):
        return
    from chladni.apps.gap_evidence import gap_evidence

    evidence = gap_evidence(found)
    _draw_album(out, evidence, wanted)
    if wanted.figure is not None:
        from chladni.viewers.figures.gap_sheet import save_gap_sheet

        save_gap_sheet(evidence, wanted.figure)
        out.line(f"figure: {wanted.figure}")
    if wanted.save is not None:
        from chladni.viewers.rerun.gap import write_gap_rrd

        write_gap_rrd(evidence, wanted.save, sketch=_sketch(found, model), scene=_scene(found))
        out.line(f"recording: {wanted.save}")


def _serve(out: Output, found: "Diagnosis", model: "Model | Robot") -> None:
    """Serve the recording to a browser until the user ends it."""
    from functools import partial

    from chladni.apps.gap_evidence import gap_evidence
    from chladni.viewers.rerun.gap import draw_gap
    from chladni.viewers.rerun.web import serve_drawing

    shown = partial(draw_gap, evidence=gap_evidence(found), sketch=_sketch(found, model), scene=_scene(found))
    with serve_drawing(shown) as server:
        out.line(server.address)
        out.line("Open this address in a browser on this computer (nobody else can reach it); Ctrl-C ends.")
        server.wait()


def _sketch(found: "Diagnosis", model: "Model | Robot") -> "StructureSketch | None":
    from chladni.apps.gap_structure import structure_sketch
    from chladni.robots.robot import Robot
    from chladni.viewers.gap_tables import places_of

    # A structure coloured by nothing would look like one that can't explain the gap anywhere.
    return None if isinstance(model, Robot) or not places_of(found.where) else structure_sketch(model, found.where)


def _scene(found: "Diagnosis") -> "RobotScene | None":
    from chladni.apps.robot_scene import robot_scene

    return robot_scene(found)


def _draw_album(out: Output, evidence: "GapEvidence", wanted: _Wanted) -> None:
    report, figures = wanted.report, wanted.figures
    if report is None and figures is None:
        return
    from chladni.viewers.figures.gap import gap_album

    # Drawn once for both.
    album = gap_album(evidence)
    if figures is not None:
        from chladni.viewers.figures.saving import save_album

        for path in save_album(album, figures):
            out.line(f"figure: {path}")
    if report is not None:
        from chladni.viewers.report.gap import write_gap_report

        write_gap_report(evidence, report, album=album, interactive=wanted.interactive)
        out.line(f"report: {report}")
