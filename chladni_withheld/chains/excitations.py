"""What a bench is driven by, and the noise of its sensors, drawn at random."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.models.excitations.impact import Impact
from chladni.models.excitations.multisine import Multisine
from chladni.models.excitations.random_noise import RandomNoise
from chladni.models.excitations.swept_sine import SweptSine
from chladni_withheld.chains.plan import GROUND, Bench

Matrix = NDArray[np.float64]
#: Samples simulated beyond the log, so that a clock that is early has something to show.
BEYOND = 64
_LEAST_LINES = 8
#: RMS of what drives a drive, at most, in its unit.
_DRIVE_LEVELS = {"flow": 2.5e-5, "load": 150.0, "voltage": 8.0, "load_torque": 0.1, "position_reference": 0.5}
_WORDS, _SHARES = ("random", "multisine", "sweep", "steps", "impacts"), (0.42, 0.28, 0.15, 0.08, 0.07)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What drives a bench: samples that begin before the log when it starts in motion.

    Attributes
    ----------
    signals
        ``[driving signal, sample]``, in the order of ``plan.driven()``.
    before
        Samples before the log's first.
    words
        Kind of each.
    """

    signals: Matrix
    before: int
    words: tuple[str, ...]


def draw_drive(rng: np.random.Generator, bench: Bench) -> Drive:
    """Draw kind, band and level of every driving signal; a third of the logs start in motion."""
    before = int(rng.uniform(1.0, 3.0) * bench.rate_hz) if rng.random() < 1 / 3 else 0
    rows: list[Matrix] = []
    words: list[str] = []
    for name in bench.plan.driven():
        word = str(rng.choice(_WORDS, p=_SHARES))
        reference = name == "position_reference" or (bench.plan.loop is not None and name == bench.plan.loop.name)
        # A second, quieter input mostly.
        level = _level(rng, bench, name) * (rng.uniform(0.3, 1.0) if rows else 1.0)
        band_hz = _band(rng, bench, reference=reference)
        if reference and word in ("impacts", "steps"):
            word = "random"
        rows.append(level * _unit(rng, word, bench, before + bench.samples + BEYOND, band_hz))
        words.append(word)
    return Drive(signals=np.vstack(rows), before=before, words=tuple(words))


def _level(rng: np.random.Generator, bench: Bench, name: str) -> float:
    plan = bench.plan
    if plan.loop is not None and name == plan.loop.name:
        return float(np.exp(rng.uniform(np.log(1e-3), np.log(3e-2))))
    if name in _DRIVE_LEVELS:
        return _DRIVE_LEVELS[name] * float(np.exp(rng.uniform(-0.7, 0.0)))
    if any(one.name == name and one.at == GROUND for one in plan.inputs):
        return float(np.exp(rng.uniform(np.log(0.5), np.log(10.0))))
    return float(np.exp(rng.uniform(np.log(0.2), np.log(5.0))) if plan.rotary else np.exp(rng.uniform(1.5, 5.5)))


def _band(rng: np.random.Generator, bench: Bench, *, reference: bool) -> tuple[float, float]:
    if reference:
        return 0.05 * bench.modes_hz[0], min(1.5 * bench.modes_hz[0], 0.2 * bench.rate_hz)
    return (
        float(bench.modes_hz[0] * rng.uniform(0.1, 0.5)),
        float(min(bench.modes_hz[-1] * rng.uniform(1.1, 1.6), 0.3 * bench.rate_hz)),
    )


def _unit(rng: np.random.Generator, word: str, bench: Bench, count: int, band_hz: tuple[float, float]) -> Matrix:
    """Samples of unit RMS, or a peak of a few for what is mostly zero."""
    if word == "random":
        return RandomNoise(band_hz=band_hz).samples(count, bench.rate_hz, rng)
    if word == "multisine":
        # Several periods in the log, a whole number of samples each; each so long that its lines fill the band.
        longest = int(bench.samples / bench.rate_hz * (band_hz[1] - band_hz[0]) / _LEAST_LINES)
        period = bench.samples // max(min(int(rng.integers(3, 9)), longest), 1)
        lines = ("full", "odd", "odd-detection")[int(rng.integers(3))]
        sines = Multisine(period_s=period / bench.rate_hz, band_hz=band_hz, lines=lines)  # type: ignore[arg-type]
        return sines.samples(count, bench.rate_hz, rng)
    if word == "sweep":
        law = ("linear", "logarithmic")[int(rng.integers(2))]
        sweep = SweptSine(amplitude=np.sqrt(2.0), start_hz=band_hz[0], end_hz=band_hz[1], law=law)  # type: ignore[arg-type]
        return sweep.samples(count, bench.rate_hz, rng)
    if word == "steps":
        return _steps(rng, count, round(bench.rate_hz * rng.uniform(0.2, 0.8)))
    width_s = max(4.0 / bench.rate_hz, 0.4 / band_hz[1])
    every_s = rng.uniform(0.6, 1.5)
    blows = Impact(peak=8.0, width_s=width_s, at_s=rng.uniform(0.05, 0.3), every_s=every_s)
    return blows.samples(count, bench.rate_hz, rng)


def _steps(rng: np.random.Generator, count: int, hold: int) -> Matrix:
    """Levels at random, each held for a while; from zero."""
    levels = rng.uniform(-1.7, 1.7, size=count // hold + 1)
    levels[0] = 0.0
    return np.asarray(np.repeat(levels, hold)[:count], dtype=np.float64)


Colour = Literal["white", "pink", "low_pass", "resonant"]
COLOURS: tuple[Colour, ...] = ("pink", "low_pass", "resonant")
#: Share of a channel's RMS.
LEAST_SHARE, MOST_SHARE = 0.003, 0.03


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorNoise:
    """Noise of one channel.

    Attributes
    ----------
    share
        Its RMS over that of what the sensor measures.
    colour
        ``pink`` falls with a power of frequency, ``low_pass`` above a corner, ``resonant`` has a hump.
    corner
        Of the colour, as a share of the sample rate.
    """

    share: float
    colour: Colour = "white"
    corner: float = 0.1

    def samples(self, count: int, rng: np.random.Generator) -> Matrix:
        """Give ``[sample]`` of unit RMS."""
        lines = np.fft.rfft(rng.standard_normal(count))
        noise = np.fft.irfft(lines * self._weight(np.fft.rfftfreq(count)), n=count)
        noise -= noise.mean()
        return np.asarray(noise / np.sqrt(np.mean(noise**2)))

    def _weight(self, share: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
        if self.colour == "pink":
            # Flat below the lowest frequencies, as amplifiers are: the log would show a drift otherwise.
            return np.asarray((np.maximum(share, 1e-3) / 1e-3) ** -0.5)
        if self.colour == "low_pass":
            return np.asarray(1.0 / np.sqrt(1.0 + (share / self.corner) ** 2))
        if self.colour == "resonant":
            return np.asarray(0.3 + 1.0 / np.abs(1.0 - (share / self.corner) ** 2 + 0.2j * share / self.corner))
        return np.ones_like(share)


def draw_noise(rng: np.random.Generator, *, coloured: bool) -> SensorNoise:
    """Draw level and colour of a channel."""
    share = float(np.exp(rng.uniform(np.log(LEAST_SHARE), np.log(MOST_SHARE))))
    colour: Colour = COLOURS[int(rng.integers(len(COLOURS)))] if coloured else "white"
    return SensorNoise(share=share, colour=colour, corner=float(np.exp(rng.uniform(np.log(0.01), np.log(0.2)))))
