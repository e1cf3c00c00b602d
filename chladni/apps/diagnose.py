"""The gap between a model and logs of the real machine, diagnosed in one call."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from chladni.apps.findings import reading_sentences, require_channels
from chladni.apps.gap_document import Document, gap_document
from chladni.apps.robot_gap import Topics, robot_gap
from chladni.apps.sources import Span, joined
from chladni.gap.comparison.measuring import MatchedLog, matched_log
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.measurement import LogUse, Measurement
from chladni.io.log import Log, open_log
from chladni.io.log_info import some_of
from chladni.models.core.model import Model
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.wording import nearest
from chladni.models.files.model_file import load_model
from chladni.robots.loading import is_robot_file, load_robot
from chladni.robots.robot import Robot
from chladni.signals.errors import LogError, SetupError
from chladni.signals.join import JoinMethod
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.visible import visible

StepProgress = Callable[[str, float], None]
Recording = Log | TimeSeries | Path | str

NAMES_TOLD = 8


def diagnose_gap(
    model: Model | Robot | Path | str,
    logs: Recording | Sequence[Recording],
    *,
    leave_out: Iterable[str] = (),
    own_effects: Sequence[EffectKind] = (),
    seed: int = 0,
    start_s: float | None = None,
    end_s: float | None = None,
    join: JoinMethod = "auto",
    state: str | None = None,
    command: str | None = None,
    progress: StepProgress | None = None,
) -> Diagnosis:
    """Say where a model and the logs of its machine disagree, which unmodelled effect causes it, and what it closes.

    Parameters
    ----------
    model
        What the simulation believes, or its file: a model, or a robot (MJCF, URDF, robot file; see docs/robots.md).
    logs
        A log or data file, or several: their paths, opened, or series. Channels are those that the model's inputs and
        outputs name.
    leave_out
        Words of effects that don't take part; of a robot at one site as ``word@site``.
    own_effects
        Effects of your own that take part, see docs/effects.md.
    seed
        Start of the random numbers; the same input and seed give the same answer. A robot's diagnosis draws none.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from each log's start.
    join
        How channels of several sampling grids become one, see `chladni.signals.join.join_resampled`.
    state, command
        Of a robot: topics of the log with its joints' states and commands; chosen where they aren't given.
    progress
        Called with the name of the step and the share done, 0 to 1.

    Returns
    -------
    Diagnosis
        Verdict, causes with probability and uncertainty, where the gap lies, how far it closes on samples that no
        fit saw, and what to measure next. That no effect explains the gap is an answer, too.

    Raises
    ------
    ModelError
        When the model can't be simulated, or its units and those of the channels don't fit.
    LogError
        When a log can't be read, lacks a channel of an input, holds no output, has channels of several rates or has
        no stretch without gaps that is long enough.
    SetupError
        When there is no log, or an effect to leave out doesn't exist.

    Examples
    --------
    >>> found = diagnose_gap("arm.toml", ["quiet.mcap", "loud.mcap"])  # doctest: +SKIP
    >>> found.verdict, found.causes[0].effect, found.causes[0].site  # doctest: +SKIP
    ('effect', 'coulomb_friction', 'elbow')
    """
    if isinstance(model, Robot) or (isinstance(model, Path | str) and is_robot_file(Path(model))):
        if own_effects:
            raise SetupError("own_effects act in models; a robot's words are those of docs/robots.md")
        if join != "auto":
            raise SetupError(f"join {join!r}: commands of a robot are always held; leave it out")
        robot = model if isinstance(model, Robot) else load_robot(model, meshes=False)
        topics = Topics(state=state, command=command)
        return robot_gap(robot, _several(logs), leave_out, topics, Span(start_s=start_s, end_s=end_s), progress)
    # Here, because it compiles what it simulates with, which a look at the façade shouldn't pay for.
    from chladni.gap.diagnosis.diagnose import diagnose

    # Before anything is read: a misspelt word would leave nothing out, in silence.
    left_out = known_effects(leave_out, own_effects)
    chosen = load_model(model) if isinstance(model, Path | str) else model
    read = list(_measured(chosen, _several(logs), Span(start_s=start_s, end_s=end_s, join=join)))
    found = diagnose(
        chosen,
        [one.measurement for one in read],
        leave_out=left_out,
        own_effects=tuple(own_effects),
        seed=seed,
        progress=progress,
    )
    # What limits the logs comes first, it limits everything after; several logs may say the same.
    remarks = [remark for one in read for remark in one.remarks]
    return replace(
        found, remarks=tuple(dict.fromkeys([*remarks, *found.remarks])), used=tuple(one.use for one in read)
    )


def diagnosis_json(
    model: Path, logs: Sequence[Path], *, leave_out: frozenset[str] = frozenset(), seed: int = 0
) -> Document:
    """Give the diagnosis of files as the document of ``chladni gap``; see `diagnose_gap`."""
    return gap_document(diagnose_gap(model, logs, leave_out=leave_out, seed=seed))


def known_effects(words: Iterable[str], own_effects: Sequence[EffectKind] = ()) -> frozenset[str]:
    """Give the words as a set; `SetupError`, naming the nearest, when one is no effect."""
    known = [*CATALOGUE, *(kind.name for kind in own_effects)]
    given = frozenset(words)
    for word in sorted(given.difference(known)):
        raise SetupError(f"no effect {word!r} to leave out; {nearest(word, known, 'effects')}")
    return given


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """A log as its model sees it, how much of it that is, and what limits it."""

    measurement: Measurement
    use: LogUse
    remarks: tuple[str, ...]


def _several(logs: Recording | Sequence[Recording]) -> Sequence[Recording]:
    given = [logs] if isinstance(logs, Log | TimeSeries | Path | str) else list(logs)
    if not given:
        raise SetupError("no log to hold against the model; give one or several")
    return given


def _measured(model: Model, logs: Sequence[Recording], span: Span) -> Iterator[_Read]:
    for log, name in zip(logs, _names(logs), strict=True):
        if isinstance(log, TimeSeries):
            yield _of_series(model, log.window(start_s=span.start_s or 0.0, end_s=span.end_s), name)
        elif isinstance(log, Log):
            yield _of_log(model, log, name, span)
        else:
            with open_log(log) as opened:
                yield _of_log(model, opened, name, span)


def _of_log(model: Model, log: Log, name: str, span: Span) -> _Read:
    # Only those: a log may hold a hundred other channels, at rates of their own.
    held = [channel.name for channel in log.channels]
    wanted = _listened_to(model)
    require_channels(log, name)
    chosen = [channel for channel in held if visible(channel) in wanted]
    if not chosen:
        raise LogError(
            f"{name}: holds no channel that model {model.name!r} listens to; it holds "
            f"{some_of(held, count=NAMES_TOLD)}, the model listens to {some_of(sorted(wanted), count=NAMES_TOLD)}"
        )
    series, notes = joined(log, chosen, span, exact=True)
    damage = reading_sentences(log, everything=False)
    begins_s = (series.start_time_ns - log.start_time_ns) / NS_PER_S
    found = matched_log(model, series, log=name, held=held, begins_s=begins_s, damage=damage)
    return _with_use(found, series, (*damage, *notes))


def _of_series(model: Model, series: TimeSeries, name: str) -> _Read:
    return _with_use(matched_log(model, series, log=name), series)


def _with_use(found: MatchedLog, series: TimeSeries, told: tuple[str, ...] = ()) -> _Read:
    seen, losses = found.measurement, (*told, *found.losses)
    use = LogUse(
        log=seen.log,
        used_s=seen.duration_s,
        recorded_s=series.samples / series.sample_rate_hz,
        sample_rate_hz=series.sample_rate_hz,
        losses=losses,
        warnings=found.warnings,
    )
    return _Read(measurement=seen, use=use, remarks=(*found.warnings, *losses, *found.remarks))


def _listened_to(model: Model) -> set[str]:
    compiled = model.compile()
    terminals = (*compiled.inputs, *compiled.outputs)
    names = {name for terminal in terminals for name in (terminal.channel, terminal.name) if name is not None}
    return set(map(visible, names))


def _names(logs: Sequence[Recording]) -> list[str]:
    """File names where they tell the logs apart, else whole paths; series are numbered."""
    paths = [log.path if isinstance(log, Log) else None if isinstance(log, TimeSeries) else Path(log) for log in logs]
    uses = Counter(path.name for path in paths if path is not None)
    return [
        f"series {place}" if path is None else path.name if uses[path.name] == 1 else str(path)
        for place, path in enumerate(paths, start=1)
    ]
