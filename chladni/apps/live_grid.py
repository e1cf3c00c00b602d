"""One sampling grid of a log that is still being written: its averages, and the responses and modes in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from chladni.apps.excitation import FORCE_UNITS, excitations
from chladni.apps.live_modes import ModeJob
from chladni.apps.modal_channels import motions_of_one_unit
from chladni.apps.modes import Band, Wanted
from chladni.signals.channel import Channel
from chladni.signals.coherence import Coherence
from chladni.signals.errors import SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.time_series import TimeSeries
from chladni.spectral.change_watch import ChangeWatch, SignalChange
from chladni.spectral.running import RunningAverages, running_segmentation
from chladni.spectral.severity import Machine
from chladni.spectral.windows import Window

if TYPE_CHECKING:
    from chladni.robots.robot import Robot
    from chladni.signals.cross_spectra import CrossSpectra

#: More channels than these, and modes of the present are looked for in the average over all.
MOST_FADING: Final = 32
#: Time constant of the averages from which modes of the present are taken.
RECENT_S: Final = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveOptions:
    """How a log is followed, see `chladni.live`."""

    references: Sequence[str] | None
    band_hz: Band | None
    resolution_hz: float | None
    window: Window
    overlap: float
    time_constant_s: float
    modes_every_s: float
    machine: Machine | None
    robot: "Robot | None"

    def __post_init__(self) -> None:
        if not 0 < self.time_constant_s < float("inf"):
            raise SetupError(f"time_constant_s is {self.time_constant_s}; it must be positive and finite")
        if not 0 <= self.modes_every_s < float("inf"):
            raise SetupError(f"modes_every_s is {self.modes_every_s}; it must be 0 (never) or more, and finite")


class LiveGrid:
    """Averages of one sampling grid, and what is usual on it; mutable.

    Parameters
    ----------
    channels, sample_rate_hz
        Of all blocks.
    options
        How they are averaged.

    Attributes
    ----------
    averages
        Of all blocks so far.
    watch
        What tells changes beyond scatter.
    """

    def __init__(self, channels: tuple[Channel, ...], sample_rate_hz: float, options: LiveOptions) -> None:
        plan = running_segmentation(
            sample_rate_hz,
            channels=len(channels),
            resolution_hz=options.resolution_hz,
            window=options.window,
            overlap=options.overlap,
        )
        fading = options.modes_every_s > 0 and len(channels) <= MOST_FADING
        self.channels = channels
        self.averages = RunningAverages(
            channels,
            sample_rate_hz,
            plan,
            pairs=len(channels) > 1 or options.modes_every_s > 0,
            fading_pairs_s=max(RECENT_S, options.time_constant_s) if fading else None,
            bands_hz=None if options.band_hz is None else [options.band_hz],
            time_constant_s=options.time_constant_s,
            machine=options.machine,
        )
        self.watch = ChangeWatch(channels, sample_rate_hz, plan)
        self._options = options
        self._silent: tuple[str, ...] = ()
        self._moved: set[str] = set()
        self._first: dict[str, float] = {}
        # Until modes are looked for in them.
        self._pairs: CrossSpectra | None = None

    def take(self, block: TimeSeries, silent_channels: Sequence[str]) -> tuple[SignalChange, ...]:
        """Average a block; give what changed in it.

        Raises
        ------
        EstimateError
            When it can't be averaged.
        """
        names = {channel.name for channel in self.channels}
        silent = tuple(name for name in silent_channels if name in names)
        if silent != self._silent:
            self._silent = silent
            self.averages.leave_out(silent)
        self.averages.update(block)
        self._note_moving(block)
        return self.watch.take(block)

    def _note_moving(self, block: TimeSeries) -> None:
        """Remember which channels showed more than one value."""
        if len(self._moved) == len(block.channels):
            return
        for channel, row in zip(block.channels, block.values, strict=True):
            if channel.name in self._moved:
                continue
            known = row[row == row]  # NaN is missing
            if known.size and (
                known.min() < known.max() or self._first.setdefault(channel.name, known[0]) != known[0]
            ):
                self._moved.add(channel.name)

    @property
    def still(self) -> tuple[str, ...]:
        """Names of the channels that showed one value only, or none."""
        return tuple(channel.name for channel in self.channels if channel.name not in self._moved)

    @property
    def references(self) -> tuple[str, ...]:
        """Those that were named, else the excitations that moved."""
        if self._options.references is not None:
            known = {channel.name for channel in self.channels}
            return tuple(name for name in self._options.references if name in known)
        return excitations([channel for channel in self.channels if channel.name in self._moved])

    @property
    def responds(self) -> bool:
        """Whether there are both a reference and a response."""
        return 0 < len(self.references) < len(self.channels)

    def response(self, sample_rate_hz: float | None) -> tuple[FrequencyResponse, Coherence] | None:
        """Renew the cross-spectra; give response and coherence to the references, None where there are none.

        Parameters
        ----------
        sample_rate_hz
            As all stamps so far tell it; None for that of the blocks.

        Raises
        ------
        EstimateError
            When there is too little to average.
        """
        self._pairs = self.averages.spectra(sample_rate_hz=sample_rate_hz)
        names = self.references
        held = {channel.name for channel in self._pairs.channels}
        if not (names and set(names) <= held and len(held) > len(names)):
            return None
        return self.averages.response(names, spectra=self._pairs)

    def mode_job(self, time_s: float) -> tuple[ModeJob | None, tuple[str, ...]]:
        """Give averages of the responses, as they are now, and notes on what they hold.

        There is no job where there are no responses, or no cross-spectra since the last one.

        Raises
        ------
        EstimateError
            When there is too little to average.
        """
        references = self.references
        answers = [
            channel
            for channel in self.channels
            if channel.name in self._moved and channel.name not in references and channel.unit not in FORCE_UNITS
            and channel.name not in self._silent
        ]  # fmt: skip
        names, notes = motions_of_one_unit(answers, named=False)
        if not names:
            return None, ()
        spectra, self._pairs = self._pairs, None
        if spectra is None:
            return None, notes
        whole = spectra.select(names)
        recent = whole if len(self.channels) > MOST_FADING else self.averages.recent_spectra().select(names)
        band_hz = self._options.band_hz
        wanted = Wanted.of(bands_hz=None if band_hz is None else [band_hz], count=None, frequencies_hz=None)
        return ModeJob(whole=whole, recent=recent, wanted=wanted, time_s=time_s), notes
