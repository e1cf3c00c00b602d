"""A log: its channels, and their samples on a uniform grid; and the one door through which every kind is opened."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from chladni.io.files.formats import MCAP, file_kind
from chladni.io.log_info import LogInfo
from chladni.io.log_reader import StampedSamples
from chladni.io.loss import Loss, Unread
from chladni.io.mcap.limits import Limits
from chladni.io.setup import Setup, load_setup
from chladni.io.shared_grid import SampleGrid, several_grids
from chladni.io.stamps import StampRequest
from chladni.signals.channel import Channel, Names, as_names
from chladni.signals.channel_names import require_one
from chladni.signals.errors import EstimateError, LogError, SetupError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import Frame, TimeSeries

if TYPE_CHECKING:
    from chladni.io.number_lists import NumberLists
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.join import JoinMethod
    from chladni.signals.mode_set import ModeSet


def open(  # noqa: A001  # as in gzip and tarfile: users write chladni.open
    path: Path | str | Frame,
    *,
    setup: Setup | Path | str | None = None,
    stamp: StampRequest = "auto",
    limits: Limits | None = None,
    sample_rate_hz: float | None = None,
    **reading: Any,
) -> "Log":
    """Open an MCAP log or a data file of any kind that is read; its first bytes tell the kind, else its suffix.

    Parameters
    ----------
    path
        The file; or a data frame of pandas or polars, see `chladni.io.data_frame.open_data_frame`.
    setup
        Setup file, or what `load_setup` made of one; channels of a data file are named by their names.
    stamp
        Of an MCAP log: which time a sample has: ``header`` (the message's own stamp), ``publish``, ``log``, or
        ``auto``: the own stamp where messages have one that moves, else the publish time, else the log time.
    limits
        Of an MCAP log: how much memory it may ask for.
    sample_rate_hz
        True rate of the samples, where the file doesn't say it; nothing is resampled.
    reading
        Of a data file: options of its reader, see `chladni.io.files.formats.READ_OPTIONS`.

    Returns
    -------
    Log
        Samples of an MCAP log aren't read yet, those of a data file are in memory.

    Raises
    ------
    LogError
        When the file can't be read, or is of no kind that is read.
    SetupError
        When the setup file has mistakes, or names a channel that the log doesn't hold; when an option isn't one of
        this kind of file, or is missing.

    Examples
    --------
    >>> with open("arm.mcap") as log:  # doctest: +SKIP
    ...     series = log.read(["/imu.linear_acceleration.x"], start_s=10, end_s=20)
    >>> open("test.csv", time_unit="ms", units={"force": "N"}).read()  # doctest: +SKIP
    """
    rate = {} if sample_rate_hz is None else {"sample_rate_hz": sample_rate_hz}
    if not isinstance(path, Path | str):
        from chladni.io.data_frame import open_data_frame

        if setup is not None or stamp != "auto" or limits is not None:
            raise SetupError("setup, stamp and limits are for files; a data frame takes units= instead")
        return open_data_frame(path, **rate | reading)
    path = Path(path)
    known = load_setup(setup) if isinstance(setup, Path | str) else setup or Setup()
    kind = file_kind(path)
    if kind == MCAP:
        from chladni.io.mcap_log import open_mcap

        return open_mcap(
            path, setup=known, stamp=stamp, limits=limits, sample_rate_hz=sample_rate_hz, options=reading
        )
    # Readers bring in numpy's and scipy's own, which a log of messages does without.
    from chladni.io.file_log import open_file

    return open_file(path, kind, setup=known, stamp=stamp, options=rate | reading)


def open_log(
    path: Path | str | Frame,
    *,
    setup: Setup | Path | str | None = None,
    stamp: StampRequest = "auto",
    limits: Limits | None = None,
    sample_rate_hz: float | None = None,
    **reading: Any,
) -> "Log":
    """Open a log; the same as `open`, under a name that hides no builtin."""
    return open(path, setup=setup, stamp=stamp, limits=limits, sample_rate_hz=sample_rate_hz, **reading)


def outside(start_s: float | None, end_s: float | None, last_s: float | None) -> str:
    """Say where a log ends or begins, for a window that lies behind or before it; nothing for others."""
    if start_s and last_s is not None and start_s > last_s:
        return f" (the log ends at {last_s:.6g} s; begin before that)"
    return " (the log begins at 0 s; end after that)" if end_s is not None and end_s <= 0 else ""


class Log(ABC):
    """Channels of one file, of whatever kind; made by `open`.

    Times in seconds count from `start_time_ns`, the earliest sample of all channels.
    """

    @property
    @abstractmethod
    def path(self) -> Path:
        """The file."""

    @property
    @abstractmethod
    def channels(self) -> tuple[Channel, ...]:
        """Every channel that is a signal: numbers, but no stamps, covariances, counters or identities."""

    @property
    @abstractmethod
    def start_time_ns(self) -> int:
        """Time of the earliest sample, nanoseconds since the Unix epoch: zero of all times in seconds."""

    @property
    @abstractmethod
    def size_bytes(self) -> int:
        """What reading all of it may take: the size of the file, or of its samples where they are in memory."""

    @property
    @abstractmethod
    def geometry(self) -> Geometry:
        """Points and lines of the file itself and of the setup file; empty without."""

    @property
    @abstractmethod
    def damage(self) -> tuple[Loss, ...]:
        """What was lost of what has been read so far; complete after `info`, or after all of it has been read."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what was inferred from the file, or is odd about what has been read so far."""
        return ()

    @property
    def unread(self) -> tuple[Unread, ...]:
        """Topics, fields of topics, and parts of a data file that no channel is made of."""
        return ()

    @property
    def number_lists(self) -> "tuple[NumberLists, ...]":
        """Lists of numbers in messages, an element for each joint or motor, as in JointState; none in data files."""
        return ()

    @property
    def functions(self) -> "FrequencyResponse | None":
        """Frequency responses that the file holds ready-made, as universal files do."""
        return None

    @property
    def modes(self) -> "ModeSet | None":
        """Modes that the file holds ready-made, as universal files do."""
        return None

    def read(
        self,
        paths: Names | None = None,
        *,
        start_s: float | None = None,
        end_s: float | None = None,
        sample_rate_hz: float | None = None,
        join: "JoinMethod | None" = None,
    ) -> TimeSeries:
        """Read channels onto one uniform grid.

        Parameters
        ----------
        paths
            Message paths, or names of the channels of a data file, one or several; None for every channel listed
            whose samples are uniform.
        start_s, end_s
            Only samples with ``start_s <= t < end_s``, seconds from the log's start.
        sample_rate_hz
            Rate of the grid; by default that of the channels, or as `join` chooses it.
        join
            How channels of different grids become one, see `chladni.signals.join.join_resampled`:
            ``band-limited``, ``hold``, or ``auto``, as each channel tells. By default ``band-limited`` at
            `sample_rate_hz`; without either such channels are refused.

        Returns
        -------
        TimeSeries
            In the order of `paths`; gaps are NaN and not valid, nothing is bridged.

        Raises
        ------
        LogError
            When there is no such channel, its samples are events rather than a uniform series, channels don't share
            a grid and no rate is given, their clocks were set at different times, or the window holds no sample.
        """
        paths = None if paths is None else as_names(paths)
        groups = self.read_groups(paths, start_s=start_s, end_s=end_s, one_clock=True)
        if sample_rate_hz is not None or (join is not None and len(groups) > 1):
            # Resampling brings in scipy's filters, which a plain read does without.
            from chladni.signals.join import join as on_one_grid

            joined = on_one_grid(groups, sample_rate_hz=sample_rate_hz, method=join or "band-limited")
            return joined if paths is None else joined.select(list(self.names(paths)))
        if len(groups) > 1:
            told = [(one.channels, one.sample_rate_hz, one.start_time_ns) for one in groups]
            raise LogError(several_grids(self.path.name, told))
        return groups[0]

    @abstractmethod
    def read_groups(
        self,
        paths: Sequence[str] | None = None,
        *,
        start_s: float | None = None,
        end_s: float | None = None,
        one_clock: bool = False,
    ) -> tuple[TimeSeries, ...]:
        """Read channels, one series for each sampling grid; see `read`.

        Parameters
        ----------
        paths, start_s, end_s
            As for `read`.
        one_clock
            Whether the series are to be brought together, so that their clocks mustn't have been set at different
            times.

        Raises
        ------
        LogError
            As `read` does, but not when channels have different grids.
        """

    def stamped(
        self, paths: Sequence[str], *, start_s: float | None = None, end_s: float | None = None
    ) -> tuple["StampedSamples", ...]:
        """Read channels as they were stamped, on no grid: events, or what is set now and then.

        Parameters
        ----------
        paths, start_s, end_s
            As for `read`.

        Returns
        -------
        tuple of StampedSamples
            One for all channels whose samples come in the same messages.

        Raises
        ------
        LogError
            When there is no such channel.
        """
        return tuple(
            StampedSamples(channels=part.channels, times_ns=part.times_ns(), values=part.values)
            for part in self.read_groups(paths, start_s=start_s, end_s=end_s)
        )

    @abstractmethod
    def blocks(
        self,
        paths: Sequence[str] | None = None,
        *,
        seconds: float,
        start_s: float | None = None,
        end_s: float | None = None,
        between: tuple[int, int] | None = None,
    ) -> Iterator[TimeSeries]:
        """Read channels block by block; the blocks one after another are what `read` gives.

        Parameters
        ----------
        paths
            As for `read`; all must share one grid.
        seconds
            Length of a block; the last one may be shorter.
        start_s, end_s
            As for `read`.
        between
            Only samples from the first to before the second number, counted from the first sample that is given
            without; of the others little more than the stamps is read.

        Raises
        ------
        LogError
            As `read` does.
        """

    @abstractmethod
    def grids(
        self, paths: Sequence[str] | None = None, *, start_s: float | None = None, end_s: float | None = None
    ) -> tuple[SampleGrid, ...]:
        """Tell which channels share a sampling grid, without keeping samples; arguments and errors as for `read`."""

    @abstractmethod
    def names(self, paths: Sequence[str]) -> tuple[str, ...]:
        """Names that channels have in what is read; `LogError` when the log doesn't hold one."""

    def name(self, path: str) -> str:
        """Name of the one channel that a word names; `LogError` when it names none, or several."""
        names = self.names([path])
        try:
            return names[require_one(path, range(len(names)), names)]
        except EstimateError as error:
            raise LogError(f"{self.path.name}: {error}") from None

    @abstractmethod
    def info(self) -> LogInfo:
        """Read all of the log once and tell whether it's sound.

        Returns
        -------
        LogInfo
            Rates, jitter, gaps, clipped samples of every channel, events included; damage; findings as sentences.
        """

    @abstractmethod
    def close(self) -> None:
        """Close the file; a log that is dropped closes it too."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exception_type: type[BaseException] | None,
        exception: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
