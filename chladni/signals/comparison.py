"""What changed between two measurements, and how sure that is."""

from dataclasses import dataclass
from typing import Literal

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.peak import Peak
from chladni.signals.value import Value, require_frequency_axis, require_shape

PeakFate = Literal["moved", "unchanged", "appeared", "vanished"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelChange:
    """RMS of one channel in one band, before and after.

    Attributes
    ----------
    channel, unit
        Name and unit of the channel.
    low_hz, high_hz
        The band.
    before, before_std, after, after_std
        RMS and one sigma of it, in `unit`.
    change_db, change_std_db
        20 log10(after/before) and one sigma of it.
    significant
        Whether scatter doesn't explain the change.
    """

    channel: str
    unit: str
    low_hz: float
    high_hz: float
    before: float
    before_std: float
    after: float
    after_std: float
    change_db: float
    change_std_db: float
    significant: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PeakChange:
    """What became of a peak.

    Attributes
    ----------
    fate
        ``moved`` when the shift of frequency is significant.
    before, after
        The peak in each measurement; None where it isn't there.
    shift_hz, shift_std_hz
        Frequency after minus before, and one sigma of it; NaN unless both are there.
    """

    fate: PeakFate
    before: Peak | None
    after: Peak | None
    shift_hz: float
    shift_std_hz: float

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that show the peak."""
        peak = self.before or self.after
        return peak.channels if peak else ()

    @property
    def sigmas(self) -> float:
        """Shift over its own uncertainty; NaN unless the peak is in both measurements."""
        return abs(self.shift_hz) / self.shift_std_hz


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DensityComparison(Value):
    """Power spectral densities before and after.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    change_db, change_std_db
        ``[channel, frequency]``, 10 log10(after/before) and one sigma of it; NaN where either is zero.
    significant
        ``[channel, frequency]`` boolean: lines whose change scatter doesn't explain.
    channels
        Those that both have, one for each row.
    overall
        Change of the whole RMS, one a channel.
    bands
        Changes in third octaves, channel by channel.
    peaks
        What became of the peaks, channel by channel.
    only_before, only_after
        Names of channels that have no partner.
    notes
        Sentences of advice.
    """

    frequency_hz: Real
    change_db: Real
    change_std_db: Real
    significant: Mask
    channels: tuple[Channel, ...]
    overall: tuple[LevelChange, ...]
    bands: tuple[LevelChange, ...]
    peaks: tuple[PeakChange, ...]
    only_before: tuple[str, ...] = ()
    only_after: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.channels), self.frequency_hz.size)
        for name in ("change_db", "change_std_db", "significant"):
            require_shape(name, getattr(self, name), expected, "channels x frequencies")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResponseComparison(Value):
    """Frequency responses before and after.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    change_db, change_std_db
        ``[response, reference, frequency]``, 20 log10(|after|/|before|) and one sigma of it; NaN on lines that
        aren't excited in both.
    phase_change_deg
        ``[response, reference, frequency]``, -180 to 180; NaN likewise.
    significant
        ``[response, reference, frequency]`` boolean: lines whose complex difference scatter doesn't explain.
    responses, references
        Those that both have.
    peaks
        What became of the peaks, function by function.
    only_before, only_after
        Names of channels that have no partner.
    notes
        Sentences of advice.
    """

    frequency_hz: Real
    change_db: Real
    change_std_db: Real
    phase_change_deg: Real
    significant: Mask
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    peaks: tuple[PeakChange, ...]
    only_before: tuple[str, ...] = ()
    only_after: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.responses), len(self.references), self.frequency_hz.size)
        for name in ("change_db", "change_std_db", "phase_change_deg", "significant"):
            require_shape(name, getattr(self, name), expected, "responses x references x frequencies")
        self._freeze()
