"""What drives a network between and at the samples: band-limited signals, and commands that a converter holds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.fft import irfft, next_fast_len

from chladni_withheld.networks.network import Matrix

Rng = np.random.Generator
Hold = Literal["zoh", "band_limited"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Times of a log, of the run-in before it, and of the integrator's steps between its samples.

    Attributes
    ----------
    rate_hz, samples
        Of the log.
    before
        Samples of the run-in.
    over
        Steps of the integrator from sample to sample, a multiple of four.
    """

    rate_hz: float
    samples: int
    before: int
    over: int

    @property
    def steps(self) -> int:
        """Steps in all."""
        return (self.before + self.samples) * self.over

    @property
    def step_s(self) -> float:
        """Length of a step."""
        return 1 / (self.rate_hz * self.over)

    @property
    def duration_s(self) -> float:
        """Length of the log."""
        return self.samples / self.rate_hz

    def half_times_s(self) -> Matrix:
        """Times of all ends and middles of steps, zero at the log's first sample."""
        halves = np.arange(2 * self.steps + 1, dtype=np.float64) - 2 * self.over * self.before
        return halves * (0.5 * self.step_s)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Signal:
    """A quantity at all ends and middles of steps.

    Attributes
    ----------
    values
        ``[2 steps + 1]``.
    jumps
        Whether it's constant from one value to the next, instead of smooth.
    """

    values: Matrix
    jumps: bool = False

    def rms(self) -> float:
        """Root of the mean square."""
        return float(np.sqrt(np.mean(self.values**2)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """Frequencies that a signal holds."""

    low_hz: float
    high_hz: float


def random_signal(rng: Rng, grid: Grid, band: Band) -> Matrix:
    """Gaussian noise with a flat spectrum in the band and nothing outside."""
    return _from_lines(rng, grid, band, length=next_fast_len(2 * grid.steps + 1, real=True), random_size=True)


def multisine_signal(rng: Rng, grid: Grid, band: Band) -> Matrix:
    """Lines of one size and random phases; the log holds two to five periods."""
    periods = int(rng.integers(2, 6))
    return _from_lines(rng, grid, band, length=grid.samples // periods * 2 * grid.over, random_size=False)


def _from_lines(rng: Rng, grid: Grid, band: Band, *, length: int, random_size: bool) -> Matrix:
    spacing_hz = 2 * grid.over * grid.rate_hz / length
    first, last = int(np.ceil(band.low_hz / spacing_hz)), int(band.high_hz / spacing_hz)
    lines = np.zeros(length // 2 + 1, dtype=np.complex128)
    count = last - first + 1
    size = rng.rayleigh(size=count) if random_size else np.ones(count)
    lines[first : last + 1] = size * np.exp(2j * np.pi * rng.random(count))
    period = irfft(lines, length)
    repeated: Matrix = np.resize(period, 2 * grid.steps + 1)
    return repeated


def sweep_signal(rng: Rng, grid: Grid, band: Band) -> Matrix:
    """A sine whose frequency rises or falls through the band once, evenly or by octaves; before the log it stands."""
    share = (grid.half_times_s() / grid.duration_s).clip(0, 1)
    if rng.random() < 0.5:
        share = 1 - share
    by_octaves = band.low_hz * (band.high_hz / band.low_hz) ** share
    frequency_hz = by_octaves if rng.random() < 0.5 else band.low_hz + (band.high_hz - band.low_hz) * share
    swept: Matrix = np.sin(2 * np.pi * np.cumsum(frequency_hz) * (0.5 * grid.step_s))
    return swept


def pulse_signal(rng: Rng, grid: Grid, band: Band) -> Matrix:
    """Rounded pulses of both signs at random times, as from a soft hammer; their spectrum ends with the band."""
    times_s = grid.half_times_s()
    width_s = 1.0 / band.high_hz
    total = np.zeros(len(times_s))
    count = int(np.ceil((times_s[-1] - times_s[0]) * band.low_hz * rng.uniform(2, 6)))
    for at_s, size in zip(rng.uniform(times_s[0], times_s[-1], count), rng.normal(0, 1, count), strict=True):
        first, last = np.searchsorted(times_s, [at_s - 4 * width_s, at_s + 4 * width_s])
        # A Gaussian whose spectrum is 1e-4 of its largest at the end of the band.
        total[first:last] += size * np.exp(-0.5 * ((times_s[first:last] - at_s) * (2 * np.pi / 4.3 / width_s)) ** 2)
    return total


def held_values(rng: Rng, grid: Grid, band: Band) -> Matrix:
    """A command, one value a sample: noise, a staircase of random levels, or a smooth signal read at the samples."""
    count = grid.before + grid.samples
    form = rng.choice(["noise", "staircase", "smooth"])
    if form == "noise":
        return rng.normal(0, 1, count).clip(-3, 3)
    if form == "staircase":
        shortest = max(2, int(grid.rate_hz / band.high_hz))
        lengths = rng.integers(shortest, 6 * shortest, count)
        levels: Matrix = np.repeat(rng.normal(0, 1, count).clip(-3, 3), lengths)[:count]
        return levels
    return multisine_signal(rng, grid, band)[: -1 : 2 * grid.over]


SMOOTH: dict[str, Callable[[Rng, Grid, Band], Matrix]] = {
    "random": random_signal,
    "multisine": multisine_signal,
    "sweep": sweep_signal,
    "pulses": pulse_signal,
}


def draw_signal(rng: Rng, grid: Grid, band: Band, hold: Hold, *, from_rest: bool) -> tuple[Signal, str]:
    """Draw a signal of unit RMS in the log, and tell it in words; `from_rest`: nothing before the log's first sample.

    A band-limited signal that begins at rest swells over a few periods of the band's lowest frequency, so that it
    stays band-limited.
    """
    if hold == "zoh":
        values = held_values(rng, grid, band)
        if from_rest:
            values[: grid.before] = 0.0
        fine = np.append(np.repeat(values, 2 * grid.over), values[-1])
        word = "held command"
    else:
        word = str(rng.choice(list(SMOOTH)))
        fine = SMOOTH[word](rng, grid, band)
        if from_rest:
            fine = fine * _swell(grid, 3 / band.low_hz)
    size = np.sqrt(np.mean(fine[2 * grid.over * grid.before :] ** 2))
    return Signal(values=fine / size, jumps=hold == "zoh"), f"{word}, {hold}, {band.low_hz:.3g}-{band.high_hz:.3g} Hz"


def _swell(grid: Grid, longest_s: float) -> Matrix:
    rise: Matrix = np.sin(np.pi / 2 * (grid.half_times_s() / min(longest_s, 0.1 * grid.duration_s)).clip(0, 1)) ** 2
    return rise
