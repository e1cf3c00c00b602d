"""Modes, levels, lines and causes of a study, followed over its logs."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chladni.apps.documents import Document, finite, plain
from chladni.io.study.results import StudyResults
from chladni.modal.shapes.mode_comparison import cheapest_pairs
from chladni.modal.shapes.mode_tracks import ModeTrack, SeenModes, follow_modes
from chladni.signals.trend import CovariateEffect, Trend, TrendKind
from chladni.signals.wording import counted, with_sigma
from chladni.spectral.change_points import LEAST_IN_SEGMENT, find_steps

if TYPE_CHECKING:
    from chladni.io.study.recipe_file import TrendTable
    from chladni.signals.arrays import Real

TRENDS_FORMAT: Final = "chladni.trends/1"
#: Of the logs that have modes, lines or causes at all: what is seen more rarely is no trend.
LEAST_SHARE: Final = 0.2
LEAST_LOGS: Final = 3
#: Changes aren't looked for in fewer: a level on each side takes some.
LEAST_TO_CHANGE: Final = 2 * LEAST_IN_SEGMENT
#: Lines of a channel that are followed: the highest of each log.
MOST_LINES: Final = 5
#: By what share of its frequency a line may move from log to log.
FARTHEST_LINE: Final = 0.02

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trends:
    """All that was followed.

    Attributes
    ----------
    trends
        Modes first, then damping, levels, lines, causes.
    seldom
        What too few logs show to be followed. Nothing is fitted to it; limits hold for it all the same.
    logs
        Number of logs that were read.
    notes
        What couldn't be followed, and why, in sentences.
    """

    trends: tuple[Trend, ...]
    logs: int
    seldom: tuple[Trend, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(slots=True, kw_only=True, eq=False)
class _Points:
    """Values of one quantity, by the log's number."""

    kind: TrendKind
    name: str
    unit: str
    channel: str = ""
    near_hz: float = 0.0
    often: bool = True
    values: dict[int, tuple[float, float]] = field(default_factory=dict)


def follow(found: StudyResults, asked: "TrendTable") -> Trends:
    """Follow what a study found over its logs, in the order of time.

    Parameters
    ----------
    found
        The study.
    asked
        Table ``[trend]`` of its recipe: covariates, and how modes are matched.
    """
    logs = _in_time(found)
    number = {row["log"]: place for place, row in enumerate(logs)}
    covariates, notes = _covariates(found, asked.covariates, number)
    points = [
        *_modes(found, number, asked),
        *_levels(found, number),
        *_lines(found, number),
        *_causes(found, number),
    ]
    trends = [_trend(one, logs, covariates) for one in points if one.often]
    seldom = tuple(_values(one, logs) for one in points if not one.often and one.values)
    short = sum(len(one.logs) < LEAST_TO_CHANGE for one in trends)
    if short:
        notes.append(
            f"{counted(short, 'trend')} of fewer than {LEAST_TO_CHANGE} logs: too few to tell a change from scatter"
        )
    return Trends(trends=tuple(trends), logs=len(logs), seldom=seldom, notes=tuple(notes))


def _in_time(found: StudyResults) -> list[Row]:
    rows = found.query("select log, epoch_ns(begins) as ns from logs where status <> 'failed' order by begins, log")
    logs: list[Row] = rows.to_pylist()
    if any(row["ns"] is None for row in logs):
        # A clock that some logs lack orders none of them.
        logs = [{"log": name, "ns": 0} for name in sorted(row["log"] for row in logs)]
    return logs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Covariate:
    channel: str
    unit: str
    means: "Real"


def _covariates(
    found: StudyResults, names: Sequence[str], number: Mapping[str, int]
) -> tuple[list[_Covariate], list[str]]:
    known: list[_Covariate] = []
    notes = []
    rows = found.table("levels").to_pylist() if names else []
    for name in names:
        means, unit = np.full(len(number), np.nan), ""
        for row in rows:
            if row["channel"] == name and row["mean"] is not None and row["log"] in number:
                means[number[row["log"]]], unit = row["mean"], row["unit"]
        if np.isfinite(means).any():
            known.append(_Covariate(channel=name, unit=unit, means=means))
        else:
            notes.append(
                f"covariate {name} is left out: no log has a mean of it; let [levels] measure it, without bands"
            )
    return known, notes


def _modes(found: StudyResults, number: Mapping[str, int], asked: "TrendTable") -> Iterator[_Points]:
    rows: dict[int, list[Row]] = {}
    for row in found.table("modes").to_pylist():
        if row["log"] in number and row["frequency_hz"] is not None:
            rows.setdefault(number[row["log"]], []).append(row)
    logs = sorted(rows)
    tracks = follow_modes(
        [_seen(rows[log]) for log in logs], farthest=asked.widest_percent / 100, least_mac=asked.least_mac
    )
    kept = [track for track in tracks if _often(len(track.sightings), len(logs))]
    others = [track for track in tracks if not _often(len(track.sightings), len(logs))]
    for kind, unit, key, std in (
        ("mode", "Hz", "frequency_hz", "frequency_std_hz"),
        ("damping", "1", "damping_ratio", "damping_std"),
    ):
        for place, track in enumerate(kept, 1):
            yield _of_track(track, logs, rows, kind=kind, name=f"mode {place}", unit=unit, key=key, std=std)
        for track in others:
            found_seldom = _of_track(track, logs, rows, kind=kind, name="mode", unit=unit, key=key, std=std)
            found_seldom.often = False
            yield found_seldom


def _of_track(
    track: ModeTrack, logs: Sequence[int], rows: Mapping[int, Sequence[Row]], *, kind: Any, name: str, unit: str,
    key: str, std: str,
) -> _Points:  # fmt: skip
    points = _Points(kind=kind, name=name, unit=unit)
    seen = {logs[log]: rows[logs[log]][row] for log, row in track.sightings.items()}
    points.near_hz = float(np.median([row["frequency_hz"] for row in seen.values()]))
    points.values = {log: _with_std(row[key], row[std]) for log, row in seen.items() if row[key] is not None}
    return points


def _seen(rows: Sequence[Row]) -> SeenModes:
    names = tuple(dict.fromkeys(name for row in rows for name in row["channels"]))
    shapes = np.zeros((len(rows), len(names)), dtype=complex)
    for place, row in enumerate(rows):
        parts = zip(row["channels"], row["shape_real"], row["shape_imag"], strict=True)
        for name, real, imag in parts:
            shapes[place, names.index(name)] = complex(real or 0.0, imag or 0.0)
    return SeenModes(frequency_hz=np.array([row["frequency_hz"] for row in rows]), shapes=shapes, channels=names)


def _often(seen: int, logs: int) -> bool:
    return seen >= max(LEAST_LOGS, LEAST_SHARE * logs)


def _levels(found: StudyResults, number: Mapping[str, int]) -> Iterator[_Points]:
    groups: dict[tuple[str, float, float], _Points] = {}
    for row in found.table("levels").to_pylist():
        if row["log"] not in number or row["rms"] is None:
            continue
        # Half the rate is fitted to the stamps of each log, and isn't a band of its own each time.
        key = (row["channel"], float(f"{row['low_hz']:.4g}"), float(f"{row['high_hz']:.4g}"))
        if key not in groups:
            name = f"{key[0]}, {key[1]:g} to {key[2]:g} Hz"
            groups[key] = _Points(
                kind="level", name=name, unit=row["unit"], channel=key[0], near_hz=(key[1] + key[2]) / 2
            )
        groups[key].values[number[row["log"]]] = _with_std(row["rms"], row["rms_std"])
    for _, one in sorted(groups.items()):
        one.often = len(one.values) >= LEAST_LOGS
        yield one


def _lines(found: StudyResults, number: Mapping[str, int]) -> Iterator[_Points]:
    channels: dict[str, dict[int, list[Row]]] = {}
    for row in found.table("peaks").to_pylist():
        if row["step"] == "psd" and row["rank"] <= MOST_LINES and row["log"] in number:
            channels.setdefault(row["channel"], {}).setdefault(number[row["log"]], []).append(row)
    for channel, logs in sorted(channels.items()):
        for track in sorted(_line_tracks(logs), key=lambda one: one.near_hz):
            track.often = _often(len(track.values), len(logs))
            track.name, track.channel = f"{channel}, line at {track.near_hz:.4g} Hz", channel
            yield track


def _line_tracks(logs: Mapping[int, Sequence[Row]]) -> list[_Points]:
    tracks: list[_Points] = []
    for log in sorted(logs):
        rows = logs[log]
        now_hz = np.array([row["frequency_hz"] for row in rows])
        before_hz = np.array([track.near_hz for track in tracks])
        alike = np.ones((len(tracks), len(rows)))
        pairs = cheapest_pairs(before_hz, now_hz, alike, farthest=FARTHEST_LINE) if tracks else []
        taken = {row: one for one, row in pairs}
        for place, row in enumerate(rows):
            if place not in taken:
                tracks.append(_Points(kind="line", name="", unit="Hz"))
            track = tracks[taken[place]] if place in taken else tracks[-1]
            track.values[log] = _with_std(row["frequency_hz"], row["frequency_std_hz"])
            track.near_hz = float(np.median([value for value, _ in track.values.values()]))
    return tracks


def _causes(found: StudyResults, number: Mapping[str, int]) -> Iterator[_Points]:
    judged = {number[row["log"]] for row in found.table("gaps").to_pylist() if row["log"] in number}
    groups: dict[tuple[str, str], _Points] = {}
    for row in found.table("causes").to_pylist():
        if row["log"] in number and row["effect"] is not None and row["probability"] is not None:
            key = (row["effect"], row["site"] or "")
            name = f"{key[0]} at {key[1]}" if key[1] else key[0]
            points = groups.setdefault(key, _Points(kind="cause", name=name, unit="1"))
            points.values[number[row["log"]]] = (row["probability"], np.inf)
    for _, points in sorted(groups.items()):
        # Where another cause was named, this one wasn't found.
        yield _Points(
            kind="cause", name=points.name, unit="1", values=dict.fromkeys(judged, (0.0, np.inf)) | points.values
        )


def _with_std(value: float, std: float | None) -> tuple[float, float]:
    return value, np.inf if std is None else std


def _values(points: _Points, logs: Sequence[Row]) -> Trend:
    """Give the values in the order of time, with nothing fitted to them."""
    order = sorted(points.values)
    values, std = (np.array([points.values[log][place] for log in order]) for place in (0, 1))
    return Trend(
        kind=points.kind,
        name=points.name,
        unit=points.unit,
        channel=points.channel,
        near_hz=points.near_hz,
        logs=tuple(logs[log]["log"] for log in order),
        times_ns=np.array([logs[log]["ns"] for log in order], dtype=np.int64),
        values=values,
        std=std,
        expected=np.full(values.size, values.mean()),
        explained=np.zeros(values.size),
        scatter=np.inf,
    )


def _trend(points: _Points, logs: Sequence[Row], covariates: Sequence[_Covariate]) -> Trend:
    plainly, order = _values(points, logs), sorted(points.values)
    # A covariate that is missing in one of its logs, or never moves, explains nothing.
    known = [one for one in covariates if np.isfinite(one.means[order]).all() and np.ptp(one.means[order]) > 0]
    explaining = [one.means[order] for one in known] if known else None
    fit = find_steps(plainly.values, std=plainly.std, covariates=explaining)
    left_out = [one.channel for one in covariates if one not in known]
    return replace(
        plainly,
        expected=fit.expected,
        explained=fit.explained,
        scatter=fit.scatter,
        changes=fit.changes,
        covariates=tuple(
            CovariateEffect(
                channel=one.channel,
                unit=f"{points.unit} per {one.unit}",
                slope=float(slope),
                slope_std=float(slope_std),
                mean=float(one.means[order].mean()),
            )
            for one, slope, slope_std in zip(known, fit.slopes, fit.slopes_std, strict=True)
        ),
        notes=tuple(f"{name} isn't known in all of these logs, and is left out" for name in left_out),
    )


def trend_sentences(trends: Iterable[Trend], *, unit: Callable[[str], str] = str) -> tuple[str, ...]:
    """Say what changed, when, and by how much; the surest first. `unit` gives a unit as it's to be written."""
    told = []
    for one in trends:
        of = "" if one.unit == "1" else f" {unit(one.unit)}"
        for change in one.changes:
            sure = abs(change.step) / max(change.step_std, 1e-300)
            step = with_sigma(change.step, change.step_std)
            told.append((-sure, f"{title(one)} changed by {step}{of} {_when(one, change)}"))
    return tuple(sentence for _, sentence in sorted(told))


def title(trend: Trend) -> str:
    """Give what is followed, in words."""
    match trend.kind:
        case "mode":
            return f"{trend.name} ({trend.near_hz:.4g} Hz)"
        case "damping":
            return f"damping of {trend.name} ({trend.near_hz:.4g} Hz)"
        case "level":
            return f"RMS of {trend.name}"
    return trend.name


def _when(trend: Trend, change: Any) -> str:
    after = moment(trend, change.place)
    earliest, latest = moment(trend, change.first - 1), moment(trend, change.last)
    return f"before {after} (95 %: after {earliest} and until {latest})"


def moment(trend: Trend, place: int) -> str:
    """Give when a log began, to the minute, or its name where no clock says it."""
    place = min(max(place, 0), len(trend.logs) - 1)
    if not trend.times_ns[place]:
        return trend.logs[place].rpartition("/")[2]
    return str(np.datetime64(int(trend.times_ns[place]), "ns").astype("datetime64[m]")).replace("T", " ")


def trends_document(found: Trends) -> Document:
    """Document of the trends of ``chladni study``."""
    return {
        "format": TRENDS_FORMAT,
        "trends": [
            {
                "kind": one.kind, "name": one.name, "unit": one.unit, "channel": one.channel or None,
                "near_hz": one.near_hz, "logs": list(one.logs), "times_ns": one.times_ns.tolist(),
                "values": plain(one.values), "std": plain(one.std), "expected": plain(one.expected),
                "explained": plain(one.explained),
                "scatter": finite(one.scatter),
                "changes": [
                    {
                        "log": one.logs[change.place], "first_log": one.logs[change.first],
                        "last_log": one.logs[change.last], "step": finite(change.step),
                        "step_std": finite(change.step_std),
                    }
                    for change in one.changes
                ],
                "covariates": [
                    {"channel": effect.channel, "unit": effect.unit, "slope": finite(effect.slope),
                     "slope_std": finite(effect.slope_std)}
                    for effect in one.covariates
                ],
                "notes": list(one.notes),
            }
            for one in found.trends
        ],
        "findings": list(trend_sentences(found.trends)),
        "notes": list(found.notes),
    }  # fmt: skip
