"""Vibration severity after ISO 20816-3: RMS of velocity and displacement from 10 to 1000 Hz, and their zone."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from chladni.io.missing_samples import MissingSamples
from chladni.io.source import Blocks, SeriesLike, blocks_of
from chladni.signals.channel import Channel, Names
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.levels import Levels, RunningLevels, Severity
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import shown
from chladni.spectral.band_filter import SharedTransforms
from chladni.spectral.blocks import Margins, Numbers, Own, leading_part, sum_up
from chladni.spectral.levels import LevelsAccumulator

Machine = Literal["large-rigid", "large-flexible", "medium-rigid", "medium-flexible"]
# ISO 20816-3:2022, tables A.1 (group 1: above 300 kW, or shafts 315 mm high and more) and A.2 (group 2: above 15 kW,
# or 160 mm), each on rigid and on flexible foundations: boundaries A/B, B/C and C/D in mm/s, and below in um. Each
# pair is one motion at 12.5 Hz (group 1) or 10 Hz (group 2), rounded: below it displacement is the severer.
BOUNDARIES_MM_S: Mapping[str, tuple[float, float, float]] = {
    "large-rigid": (2.3, 4.5, 7.1),
    "large-flexible": (3.5, 7.1, 11.0),
    "medium-rigid": (1.4, 2.8, 4.5),
    "medium-flexible": (2.3, 4.5, 7.1),
}
BOUNDARIES_UM: Mapping[str, tuple[float, float, float]] = {
    "large-rigid": (29.0, 57.0, 90.0),
    "large-flexible": (45.0, 90.0, 140.0),
    "medium-rigid": (22.0, 45.0, 71.0),
    "medium-flexible": (37.0, 71.0, 113.0),
}
# ISO 20816-3:2022: 2 Hz instead for machines that turn slower than 600 r/min.
BAND_HZ, SLOW_BAND_HZ = (10.0, 1000.0), (2.0, 1000.0)
# A third of an octave: that far outside the band the filter is 3 dB down, so that it's 1 dB down at the band's ends.
# ISO 2954 asks for flanks of third order, and for 0.8 to 1.1 of the true value at the ends.
THIRD_OCTAVE = 10**0.1
# How often each motion is integrated to be a velocity.
_INTEGRATIONS = {"m/s^2": 1, "m/s": 0}
MM_PER_M, UM_PER_M = 1e3, 1e6


def severity(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    machine: Machine | None = None,
    slow: bool = False,
) -> Severity:
    """Measure vibration severity: the RMS of velocity and of displacement from 10 to 1000 Hz.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, an array ``[channel, sample]``, or
        consecutive blocks of a series. Its accelerations (m/s^2) and velocities (m/s) are judged, others left out.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
    machine
        ``large-rigid``, ``large-flexible``, ``medium-rigid`` or ``medium-flexible``: class and foundation, for the
        zone. Large is above 300 kW, or an electrical machine with a shaft 315 mm high or more; medium is above 15 kW,
        or 160 mm. A foundation is flexible when its lowest natural frequency in the direction of measurement is less
        than 1.25 times the speed.
    slow
        Whether the machine turns slower than 600 r/min: the band then begins at 2 Hz.

    Returns
    -------
    Severity
        Zone A: as newly commissioned. B: fit for long-term operation. C: not for long, B was exceeded. D: enough to
        do damage (ISO 20816-3:2022). Of velocity and displacement the severer counts. The standard judges the largest
        value of all bearings.

    Raises
    ------
    EstimateError
        When no channel is an acceleration or a velocity, the sample rate shows nothing of the band, or no unbroken
        run is long enough.
    SetupError
        When there is no such class.

    Examples
    --------
    >>> t = np.arange(40_000) / 10_000
    >>> tone = 9.8 * np.sin(2 * np.pi * 24.9 * t)  # 9.8 / (2 pi 24.9) / sqrt(2) = 44.3 mm/s
    >>> x = TimeSeries.from_arrays(tone, sample_rate_hz=1e4, units="m/s^2")
    >>> found = severity(x, machine="large-rigid")
    >>> float(found.velocity_mm_s[0].round(1)), float(found.displacement_um[0].round()), found.zones
    (44.3, 283.0, ('D',))
    """
    source = blocks_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    missing = MissingSamples()
    lead, blocks = leading_part(missing.watch(source), 1)
    accumulator = SeverityAccumulator(lead[0].channels, lead[0].sample_rate_hz, machine=machine, slow=slow)
    sum_up(blocks, accumulator)
    found = accumulator.result()
    return replace(found, notes=(*found.notes, *missing.sentences(from_ns=lead[0].start_time_ns)))


class SeverityAccumulator:
    """Running measure of severity, see `severity`; mutable, the result is a frozen value."""

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        *,
        machine: Machine | None = None,
        slow: bool = False,
    ) -> None:
        if machine is not None and machine not in BOUNDARIES_MM_S:
            raise SetupError(f"machine {shown(machine)} is none of {', '.join(get_args(Machine))}")
        self.machine = machine
        self.band_hz = SLOW_BAND_HZ if slow else BAND_HZ
        self._nyquist_hz = sample_rate_hz / 2
        low_hz, high_hz = self.band_hz
        if self._nyquist_hz <= low_hz:
            raise EstimateError(
                f"severity is judged from {low_hz:g} Hz on, and samples at {sample_rate_hz:g} Hz end at "
                f"{self._nyquist_hz:g} Hz; measure at {2 * THIRD_OCTAVE * high_hz:.0f} Hz or more"
            )
        passed_hz = (low_hz / THIRD_OCTAVE, min(high_hz * THIRD_OCTAVE, self._nyquist_hz))
        # By the channels of one unit: velocity, displacement.
        self._measured: dict[tuple[str, ...], tuple[LevelsAccumulator, LevelsAccumulator]] = {}
        for unit, integrations in _INTEGRATIONS.items():
            if motions := [channel for channel in channels if channel.unit == unit]:
                transforms = SharedTransforms()
                velocity, displacement = (
                    LevelsAccumulator(
                        motions, sample_rate_hz, bands_hz=[passed_hz], integrations=often, transforms=transforms
                    )
                    for often in (integrations, integrations + 1)
                )
                self._measured[tuple(channel.name for channel in motions)] = velocity, displacement
        if not self._measured:
            raise EstimateError(
                "severity needs an acceleration [m/s^2] or a velocity [m/s], and there is none; name the units in a "
                "setup file"
            )

    @property
    def margins(self) -> Margins:
        """Of a part: as far as the filter reaches."""
        return self._all()[0].margins

    def begin(self, own: Own) -> None:
        """See `chladni.spectral.blocks.Accumulator`."""
        for one in self._all():
            one.begin(own)

    def numbers(self) -> Numbers:
        """See `chladni.spectral.blocks.Accumulator`."""
        return {
            f"{place}/{name}": found for place, one in enumerate(self._all()) for name, found in one.numbers().items()
        }

    def add_numbers(self, found: Numbers) -> None:
        """See `chladni.spectral.blocks.Accumulator`."""
        for place, one in enumerate(self._all()):
            mine = f"{place}/"
            one.add_numbers({name.removeprefix(mine): some for name, some in found.items() if name.startswith(mine)})

    def settle(self, runs: Sequence[tuple[int, int]]) -> None:
        """See `chladni.spectral.blocks.Accumulator`."""
        for one in self._all():
            one.settle(runs)

    def update(self, block: TimeSeries) -> None:
        """Take in the next block."""
        for names, accumulators in self._measured.items():
            motions = block.select(names)
            for accumulator in accumulators:
                accumulator.update(motions)

    def result(self) -> Severity:
        """Give the severity; no more blocks may follow."""
        velocity, displacement = ([pair[order].result() for pair in self._measured.values()] for order in range(2))
        machine = self.machine
        return Severity(
            channels=tuple(channel for one in velocity for channel in one.channels),
            band_hz=(self.band_hz[0], min(self.band_hz[1], self._nyquist_hz)),
            velocity_mm_s=np.concatenate([one.rms[:, 0] for one in velocity]) * MM_PER_M,
            velocity_std_mm_s=np.concatenate([one.rms_std[:, 0] for one in velocity]) * MM_PER_M,
            displacement_um=np.concatenate([one.rms[:, 0] for one in displacement]) * UM_PER_M,
            displacement_std_um=np.concatenate([one.rms_std[:, 0] for one in displacement]) * UM_PER_M,
            machine=machine,
            boundaries_mm_s=() if machine is None else BOUNDARIES_MM_S[machine],
            boundaries_um=() if machine is None else BOUNDARIES_UM[machine],
            running=_joined(velocity),
            running_displacement=_joined(displacement),
            notes=self._notes(),
        )

    def _all(self) -> list[LevelsAccumulator]:
        return [one for pair in self._measured.values() for one in pair]

    def _notes(self) -> tuple[str, ...]:
        if self._nyquist_hz >= self.band_hz[1]:
            return ()
        note = (
            f"severity is at least as told: samples end at {self._nyquist_hz:g} Hz, and the standard judges up to "
            f"{self.band_hz[1]:g} Hz; measure at a higher rate"
        )
        return (note,)


def is_motion(channel: Channel) -> bool:
    """Whether a channel is an acceleration or a velocity, whose severity can be judged."""
    return channel.unit in _INTEGRATIONS


def _joined(found: Sequence[Levels]) -> RunningLevels:
    """Running levels of all; each has the windows of the others, since they saw the same blocks by one filter."""
    running = [one.running for one in found]
    return replace(
        running[0],
        rms=np.concatenate([one.rms for one in running]),
        peak=np.concatenate([one.peak for one in running]),
        kurtosis=np.concatenate([one.kurtosis for one in running]),
        channels=tuple(channel for one in running for channel in one.channels),
    )
