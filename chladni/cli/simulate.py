"""``chladni simulate``: a log with known truth."""

from math import isinf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.settings import effect_of, with_settings
from chladni.cli.words import NOTHING, count, number
from chladni.signals.errors import SetupError
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from chladni.apps.documents import Document
    from chladni.apps.simulated_log import SimulatedLog
    from chladni.apps.simulated_robot import JointError
    from chladni.io.mcap.writer import WrittenLog
    from chladni.models.core.instrument import Instrument
    from chladni.models.core.model import Model
    from chladni.signals.time_series import TimeSeries


ModelOrInstrument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="A model file, the name of an instrument, or a robot (MJCF, URDF, robot file; with --log).",
        show_default=False,
    ),
]
Target = Annotated[Path, typer.Option("--out", metavar="LOG.mcap", help="The log to write.", show_default=False)]
Seconds = Annotated[
    float | None, typer.Option(metavar="S", help="Length; by the slowest decay if not given.", show_default=False)
]
Rate = Annotated[
    float | None,
    typer.Option(
        metavar="HZ",
        help="Sample rate; twenty times the highest natural frequency if not given. With --log: the log's true one.",
    ),
]
Kind = Annotated[
    Literal["random", "sweep", "multisine", "step", "impact"],
    typer.Option("--input", help="What drives the model."),
]
At = Annotated[str | None, typer.Option(metavar="NAME", help="Input that is driven; the first if not given.")]
Level = Annotated[
    float | None,
    typer.Option(metavar="X", help="RMS, amplitude, step or peak, in the input's unit; 1, or the instrument's."),
]
Band = Annotated[
    tuple[float, float] | None,
    typer.Option(metavar="LO-HI", help="Excited frequencies in Hz, of random, sweep and multisine."),
]
Driving = Annotated[
    Path | None,
    typer.Option(
        metavar="LOG", help="Drive the model with the channels of this log or data file instead.", show_default=False
    ),
]
Noise = Annotated[float, typer.Option(metavar="SHARE", help="Noise of each sensor, as a share of its signal's RMS.")]
Seed = Annotated[
    int, typer.Option(metavar="N", help="Start of the random numbers; the same seed gives the same log.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Change a parameter; may be repeated.", show_default=False),
]
State = Annotated[
    str | None, typer.Option(metavar="TOPIC", help="Of a robot: where its joints were measured.", show_default=False)
]
Command = Annotated[
    str | None, typer.Option(metavar="TOPIC", help="Of a robot: where its joints were commanded.", show_default=False)
]
Effects = Annotated[
    list[str] | None,
    typer.Option(
        metavar="EFFECT@SITE:NAME=VALUE,...",
        help="Add an effect, such as coulomb_friction@elbow:force=8; may be repeated.",
        show_default=False,
    ),
]


@opens_files
def simulate(
    model: ModelOrInstrument,
    *,
    out: Target,
    seconds: Seconds = None,
    rate: Rate = None,
    kind: Kind = "random",
    at: At = None,
    level: Level = None,
    band: Band = None,
    log: Driving = None,
    opener: Opener,
    noise: Noise = 0.0,
    seed: Seed = 0,
    settings: Settings = None,
    effect: Effects = None,
    state: State = None,
    command: Command = None,
    json: options.Json = None,
) -> None:
    """Simulate a model and write a log, with its truth beside it; or a robot, by a log's commands."""
    from chladni.apps.model_sources import named_instrument
    from chladni.apps.simulated_log import Drive, require_log_place, simulate_log, write_simulated_log

    to = Output(json)
    # A simulation may take minutes: it shouldn't be lost to a misspelt folder.
    require_log_place(out)
    require_places(
        reads=[Path(model), log, opener.setup],
        writes={"--out": out, "the truth of --out": out.with_suffix(".truth.json"), "--json": json},
    )
    drive_options = {"--input": None if kind == "random" else kind, "--at": at, "--level": level, "--band": band,
                     "--seconds": seconds}  # fmt: skip
    if _is_robot(model):
        others = {"--rate": rate, "--noise": noise or None, "--set": settings, "--effect": effect}
        _refuse({**drive_options, **others}, "for a robot: it runs as described, by the log's commands")
        _simulate_robot(to, Path(model), log, out, opener, state=state, command=command)
        return
    if state is not None or command is not None:
        raise SetupError(f"--state and --command name topics of a robot's joints, and {model!r} is none")
    instrument = named_instrument(model)
    chosen = _changed(instrument.model(), settings or (), effect or ())
    if log is not None:
        _refuse(drive_options, "with --log: the log's own signals drive the model")
    recording, damage = (None, ()) if log is None else _recording(chosen, log, opener)
    drive = Drive(
        word=kind,
        level=_usual_level(instrument, at) if level is None else level,
        input_name=at or instrument.step_input or None,
        band_hz=band,
        seed=seed,
        noise=noise,
    )
    made = simulate_log(chosen, drive, seconds=seconds, rate_hz=rate, recording=recording)
    written, truth = write_simulated_log(made, out)
    _print(to, chosen.name, made, written)
    to.lines((*damage, *made.simulation.flags))
    to.line(f"wrote {written.path}")
    to.line(f"wrote {truth}")
    to.json(lambda: _document(made, written, truth))


def _recording(model: "Model", log: Path, opener: Opener) -> "tuple[TimeSeries, tuple[str, ...]]":
    from chladni.apps.model_sources import recording_for

    with opener(log) as opened:
        return recording_for(model, opened)


def _is_robot(name: str) -> bool:
    from chladni.robots.loading import is_robot_file

    # Instruments have names without a suffix.
    return Path(name).is_file() and is_robot_file(Path(name))


def _simulate_robot(
    to: Output, path: Path, log: Path | None, out: Path, opener: Opener, *, state: str | None, command: str | None
) -> None:
    from chladni.apps.simulated_robot import run_told, simulate_robot, simulated_robot_document
    from chladni.io.mcap.writer import write_mcap
    from chladni.robots.loading import load_robot

    if log is None:
        raise SetupError(f"{path}: a robot runs by the commands of a log; give one with --log")
    with opener(log) as opened, to.progress(log.name):
        found = simulate_robot(load_robot(path, meshes=False), opened, state=state, command=command)
    written = write_mcap(found.series, out)
    to.line(
        f"{found.robot}: {number(found.series.duration_s, digits=6)} s at "
        f"{number(found.series.sample_rate_hz, digits=6)} Hz by {found.log}, {run_told(found)}"
    )
    to.table(
        "Simulated less measured position",
        ["joint", "RMS error", "of its motion"],
        [[one.joint, *_error_row(one)] for one in found.joints],
    )
    to.lines(found.remarks)
    to.line(f"wrote {written.path}")
    to.json(lambda: {**simulated_robot_document(found), "log": str(written.path)})


def _error_row(one: "JointError") -> tuple[str, str]:
    from chladni.signals.engineering import engineering, percent

    if isinf(one.error):
        return "astray", NOTHING
    return engineering(one.error, None, one.unit), percent(one.error / one.motion) if one.motion else NOTHING


def _changed(model: "Model", settings: "Sequence[str]", effects: "Sequence[str]") -> "Model":
    """Give the model with the parameters and the further effects that were asked for."""
    chosen = with_settings(model, settings)
    if not effects:
        return chosen
    return chosen.with_effects((*chosen.effects, *(effect_of(one, chosen) for one in effects)))


def _print(to: Output, name: str, made: "SimulatedLog", written: "WrittenLog") -> None:
    """Print what was recorded, and how well it agrees with the log that drove it."""
    series = made.recorded
    to.line(
        f"{name}: {number(series.duration_s, digits=6)} s at {number(series.sample_rate_hz, digits=6)} Hz, "
        f"{count(series.samples)} samples of {counted(len(series.channels), 'channel')}"
    )
    to.table("What the log holds", ["channel", "role", "RMS", "unit"], _rows(series, written.names))
    for score in made.agreement:
        told = "not known" if score.value is None else f"{score.value:.3g} {score.unit}"
        to.line(f"{score.name}: {told} ({score.definition})")


def _document(made: "SimulatedLog", written: "WrittenLog", truth: Path) -> "Document":
    nrmse = {score.name.removeprefix("NRMSE "): score.value for score in made.agreement}
    return {**made.truth, "format": "chladni.simulate/1", "log": str(written.path), "truth_file": str(truth),
            "nrmse_percent": nrmse}  # fmt: skip


def _usual_level(instrument: "Instrument", at: str | None) -> float:
    """What is a step on the bench is a sensible size for any excitation of that input; of others nothing is known."""
    return instrument.step_size if at in (None, instrument.step_input) else 1.0


def _rows(series: "TimeSeries", names: "Mapping[str, str]") -> list[list[str]]:
    from chladni.signals.number_range import rms

    roles = {"reference": "input", "response": "output"}
    return [
        [names[channel.name], roles[channel.role], f"{size:.4g}", channel.unit]
        for channel, size in zip(series.channels, rms(series.values).tolist(), strict=True)
    ]


def _refuse(given: "Mapping[str, object]", why: str) -> None:
    """Raise `SetupError` for the first option that was given though it can't do anything."""
    for name, value in given.items():
        if value is not None:
            raise SetupError(f"{name} has no meaning {why}")
