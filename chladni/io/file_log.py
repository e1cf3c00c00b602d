"""A data file as a log: CSV, WAV, MAT, universal files and the like, whose samples are in memory once it is open."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chladni.io.files.contents import FileContents, on_common_grids
from chladni.io.files.formats import read_file, told_by_content
from chladni.io.known_schemas import likely_role
from chladni.io.log import Log, outside
from chladni.io.log_info import LogInfo, some_of, unread_sentences
from chladni.io.log_survey import survey_file
from chladni.io.loss import Loss, Unread
from chladni.io.missing_samples import MissingSamples
from chladni.io.setup import ChannelSetup, Setup, refined
from chladni.io.shared_grid import SampleGrid
from chladni.io.stamps import StampRequest
from chladni.signals.channel import Channel, channel_names, labelled
from chladni.signals.errors import EstimateError, LogError, SetupError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.visible import place_of
from chladni.signals.wording import counted, near_matches

if TYPE_CHECKING:
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.mode_set import ModeSet


def open_file(path: Path, kind: str, *, setup: Setup, stamp: StampRequest, options: Mapping[str, Any]) -> "FileLog":
    """Read a data file; see `chladni.io.log.open`."""
    if stamp != "auto":
        raise SetupError(
            f"{path}: stamp {stamp!r} (--stamp) chooses among the times of messages, which are in MCAP logs alone; "
            "leave it out"
        )
    if setup.batches:
        raise SetupError(f"{setup.path}: [[batch]] {next(iter(setup.batches))}: {path.name} holds no messages")
    contents, setup = _contents(path, kind, setup, options)
    return FileLog(path, kind, _refined(contents, setup), geometry=setup.geometry)


class FileLog(Log):
    """Channels of one data file; made by `chladni.io.log.open`."""

    def __init__(self, path: Path, kind: str, contents: FileContents, *, geometry: Geometry) -> None:
        self._path = path
        self._kind = kind
        self._contents = contents
        self._geometry = _joined(contents.geometry, geometry)
        self._info: LogInfo | None = None
        self._missing = MissingSamples()

    @property
    def path(self) -> Path:
        """The file."""
        return self._path

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every channel that has samples over time."""
        return tuple(channel for part in self._contents.series for channel in part.channels)

    @property
    def start_time_ns(self) -> int:
        """Time of the earliest sample; 0 where the file says none."""
        return min((part.start_time_ns for part in self._contents.series), default=0)

    @property
    def size_bytes(self) -> int:
        """Size of the samples in memory."""
        return sum(part.values.nbytes for part in self._contents.series)

    @property
    def geometry(self) -> Geometry:
        """Points and lines of the file, with those of the setup file before them."""
        return self._geometry

    @property
    def damage(self) -> tuple[Loss, ...]:
        """Nothing: what of a data file isn't read is told in `unread`."""
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what was inferred from the file, and on samples that are missing in what was read."""
        return (*self._inferred, *self._missing.sentences(from_ns=self.start_time_ns))

    @property
    def _inferred(self) -> tuple[str, ...]:
        told = [note.removeprefix(f"{self._path}: ") for note in self._contents.notes]
        return (*told_by_content(self._path, self._kind), *told)

    @property
    def unread(self) -> tuple[Unread, ...]:
        """Parts of the file that no channel is made of."""
        return tuple(Unread(topic=name, reason=f"not read: {reason}") for name, reason in self._contents.unread)

    @property
    def functions(self) -> "FrequencyResponse | None":
        """Frequency responses that the file holds ready-made."""
        return self._contents.functions

    @property
    def modes(self) -> "ModeSet | None":
        """Modes that the file holds ready-made."""
        return self._contents.modes

    def read_groups(
        self,
        paths: Sequence[str] | None = None,
        *,
        start_s: float | None = None,
        end_s: float | None = None,
        one_clock: bool = False,  # noqa: ARG002  # a data file has one
    ) -> tuple[TimeSeries, ...]:
        """Give channels, one series for each sampling grid; see `Log.read_groups`."""
        window = self._window_ns(start_s, end_s)
        paths = None if paths is None else self.names(paths)
        groups = on_common_grids(self._selected(paths))
        found = [_ordered(part, paths) for group in groups if (part := _within(group, *window)) is not None]
        missing = [] if paths is None else _without(paths, found)
        if missing or not found:
            told = f"between {start_s or 0.0} s and {'its end' if end_s is None else f'{end_s} s'}"
            told += outside(start_s, end_s, self._last_s(groups))
            raise LogError(f"{self._path.name}: {some_of(missing) + ' has ' if missing else ''}no sample {told}")
        return tuple(self._missing.watch(found))

    def _last_s(self, groups: Sequence[TimeSeries]) -> float | None:
        ends_ns = [one.start_time_ns + round((one.samples - 1) / one.sample_rate_hz * NS_PER_S) for one in groups]
        return (max(ends_ns) - self.start_time_ns) / NS_PER_S if ends_ns else None

    def blocks(
        self,
        paths: Sequence[str] | None = None,
        *,
        seconds: float,
        start_s: float | None = None,
        end_s: float | None = None,
        between: tuple[int, int] | None = None,
    ) -> Iterator[TimeSeries]:
        """Give channels block by block; see `Log.blocks`."""
        if not (isfinite(seconds) and seconds > 0):
            raise LogError(f"blocks of {seconds} s: seconds must be finite and positive")
        whole = self.read(paths, start_s=start_s, end_s=end_s)
        whole = whole if between is None else whole.samples_between(*between)
        size = max(1, round(seconds * whole.sample_rate_hz))
        return (whole.samples_between(first, first + size) for first in range(0, whole.samples, size))

    def grids(
        self, paths: Sequence[str] | None = None, *, start_s: float | None = None, end_s: float | None = None
    ) -> tuple[SampleGrid, ...]:
        """Tell which channels share a sampling grid; see `Log.grids`."""
        return tuple(
            SampleGrid(
                names=tuple(channel.name for channel in part.channels),
                sample_rate_hz=part.sample_rate_hz,
                start_time_ns=part.start_time_ns,
                samples=part.samples,
            )
            for part in self.read_groups(paths, start_s=start_s, end_s=end_s)
        )

    def names(self, paths: Sequence[str]) -> tuple[str, ...]:
        """Names of the channels that words name; `LogError` when the file doesn't hold one."""
        if not paths:
            raise LogError(f"{self._path.name}: no channel is asked for; name one, or None for all")
        self._require_samples()
        try:
            return tuple(dict.fromkeys(channel_names(self.channels, paths)))
        except EstimateError as error:
            raise LogError(f"{self._path.name}: {error}") from None

    def info(self) -> LogInfo:
        """Look at all samples once and tell whether the file is sound."""
        if self._info is None:
            kind = self._kind.removeprefix(".")
            self._info = survey_file(self._path.name, kind, self._contents, notes=self._inferred, unread=self.unread)
        return self._info

    def close(self) -> None:
        """Nothing to do: the file was closed when it had been read."""

    def _require_samples(self) -> None:
        """Say what the file holds where it holds no samples over time."""
        if self._contents.series:
            return
        name, held = self._path.name, []
        if (functions := self.functions) is not None:
            held.append(counted(len(functions.responses) * len(functions.references), "frequency response"))
        if self.modes is not None:
            held.append(counted(self.modes.frequency_hz.size, "mode"))
        told = [f"holds {' and '.join(held)}, but no samples over time" if held else "holds no samples over time"]
        if held:
            told.append(f"chladni {'modes' if self.functions is None else 'frf'} {name} shows them")
        raise LogError(f"{name}: {'; '.join([*told, *unread_sentences(self.unread)])}")

    def _selected(self, paths: Sequence[str] | None) -> list[TimeSeries]:
        self._require_samples()
        if paths is None:
            return list(self._contents.series)
        names = set(self.names(paths))
        chosen = [
            (part, [channel.name for channel in part.channels if channel.name in names])
            for part in self._contents.series
        ]
        return [part if len(own) == len(part.channels) else part.select(own) for part, own in chosen if own]

    def _window_ns(self, start_s: float | None, end_s: float | None) -> tuple[int | None, int | None]:
        for time_s in (start_s, end_s):
            if time_s is not None and not isfinite(time_s):
                raise LogError(f"{self._path.name}: time {time_s} s must be finite")
        if start_s is not None and end_s is not None and start_s >= end_s:
            raise LogError(
                f"{self._path.name}: the window from {start_s} s to {end_s} s is empty; let it end after its start"
            )
        first, last = (None if time_s is None else self.start_time_ns + round(time_s * NS_PER_S)
                       for time_s in (start_s, end_s))  # fmt: skip
        return first, last


def _joined(own: Geometry, stated: Geometry) -> Geometry:
    """The points of the file with those of the setup file, whose lines go before the file's."""
    points = {point.name: point for point in (*own.points, *stated.points)}
    return Geometry(points=tuple(points.values()), lines=stated.lines or own.lines)


# --- windows and order -------------------------------------------------------------------------------------------


def _within(series: TimeSeries, start_ns: int | None, end_ns: int | None) -> TimeSeries | None:
    """Samples with ``start_ns <= time < end_ns``; None when there are none."""
    first, last = (
        whole if time_ns is None else int(np.clip(_index(series, time_ns), 0, series.samples))
        for time_ns, whole in ((start_ns, 0), (end_ns, series.samples))
    )
    return (
        None
        if first >= last
        else series
        if (first, last) == (0, series.samples)
        else series.samples_between(first, last)
    )


def _index(series: TimeSeries, time_ns: int) -> int:
    # A time within a thousandth of a sample of the grid means that sample, whatever floating point says.
    return int(np.ceil((time_ns - series.start_time_ns) / NS_PER_S * series.sample_rate_hz - 1e-3))


def _ordered(series: TimeSeries, names: Sequence[str] | None) -> TimeSeries:
    """Channels in the order asked for, else in that of the file."""
    own = [channel.name for channel in series.channels]
    wanted = own if names is None else [name for name in dict.fromkeys(names) if name in own]
    return series if wanted == own else series.select(wanted)


def _without(names: Sequence[str], found: Sequence[TimeSeries]) -> list[str]:
    there = {channel.name for part in found for channel in part.channels}
    return [name for name in names if name not in there]


# --- setup -------------------------------------------------------------------------------------------------------


def _contents(path: Path, kind: str, setup: Setup, options: Mapping[str, Any]) -> tuple[FileContents, Setup]:
    """Read the file, with the units that the setup file states: only the reader knows the numbers as they stand.

    Returns
    -------
    contents : FileContents
    setup : Setup
        With the names that the file has for channels.
    """
    stated = {one.path: one.unit for one in setup.channels if one.unit is not None}
    if not stated:
        contents = read_file(path, kind=kind, **options)
        return contents, _as_held(path, contents, setup)
    try:
        contents = read_file(path, kind=kind, **{**options, "units": stated | dict(options.get("units", {}))})
        return contents, _as_held(path, contents, setup)
    except SetupError:
        # A channel that isn't there is told with the line of the setup file; all else as it was.
        held = _as_held(path, read_file(path, kind=kind, **options), setup)
        if held.channels == setup.channels:
            raise
    return _contents(path, kind, held, options)


def _as_held(path: Path, contents: FileContents, setup: Setup) -> Setup:
    """Give the names that the data file has; `SetupError` naming every channel of the setup file that it hasn't."""
    known = [channel.name for channel in _all_channels(contents)]
    places = [place_of(one.path, known) for one in setup.channels]
    unknown = [one for one, place in zip(setup.channels, places, strict=True) if place is None]
    if unknown:
        raise SetupError(
            *(
                f"{one.place}: [[channel]] path: {path.name} has no channel {one.path!r}; "
                f"{near_matches(one.path, known)}"
                for one in unknown
            )
        )
    held = zip(setup.channels, places, strict=True)
    return replace(setup, channels=tuple(replace(one, path=known[place]) for one, place in held if place is not None))


def _all_channels(contents: FileContents) -> list[Channel]:
    functions = contents.functions
    held = () if functions is None else (*functions.responses, *functions.references)
    return [*(channel for part in contents.series for channel in part.channels), *held]


def _refined(contents: FileContents, setup: Setup) -> FileContents:
    """Refine channels by what the setup file says of them besides their units, and guess excitations before."""
    contents = _labelled(replace(contents, series=_with_likely_roles(contents.series)))
    if not setup.channels:
        return contents
    # The reader has brought the numbers to the unit that is stated.
    stated = {one.path: replace(one, unit=None) for one in setup.channels}
    functions = contents.functions
    return replace(
        contents,
        series=tuple(_refined_series(part, stated) for part in contents.series),
        functions=None if functions is None else _refined_functions(functions, stated),
    )


def _labelled(contents: FileContents) -> FileContents:
    """Give all channels of the file the labels that tell them apart."""
    label = {channel.name: channel.label for channel in labelled(_all_channels(contents))}

    def of(channels: Sequence[Channel]) -> tuple[Channel, ...]:
        return tuple(replace(channel, label=label[channel.name]) for channel in channels)

    held = contents.functions
    return replace(
        contents,
        series=tuple(part.with_channels(of(part.channels)) for part in contents.series),
        functions=held and replace(held, responses=of(held.responses), references=of(held.references)),
    )


def _with_likely_roles(series: tuple[TimeSeries, ...]) -> tuple[TimeSeries, ...]:
    """Take forces for excitations, as in a log of messages, unless the file itself marks some."""
    if any(channel.role == "reference" for part in series for channel in part.channels):
        return series
    return tuple(
        part.with_channels([replace(one, role=likely_role(one.name, one.unit)) for one in part.channels])
        for part in series
    )


def _refined_series(series: TimeSeries, stated: Mapping[str, ChannelSetup]) -> TimeSeries:
    channels, factors = _refined_channels(series.channels, stated)
    values = series.values if (factors == 1.0).all() else series.values * factors[:, np.newaxis]
    return replace(series, values=values, channels=channels)


def _refined_functions(functions: "FrequencyResponse", stated: Mapping[str, ChannelSetup]) -> "FrequencyResponse":
    responses, above = _refined_channels(functions.responses, stated)
    references, below = _refined_channels(functions.references, stated)
    factors = (above[:, np.newaxis] / below)[:, :, np.newaxis]
    return replace(
        functions,
        values=functions.values * factors,
        std=functions.std * np.abs(factors),
        responses=responses,
        references=references,
    )


def _refined_channels(
    channels: Sequence[Channel], stated: Mapping[str, ChannelSetup]
) -> tuple[tuple[Channel, ...], np.ndarray[Any, np.dtype[np.float64]]]:
    told = [
        refined(channel, 1.0, stated[channel.name]) if channel.name in stated else (channel, 1.0)
        for channel in channels
    ]
    return tuple(channel for channel, _ in told), np.array([factor for _, factor in told])
