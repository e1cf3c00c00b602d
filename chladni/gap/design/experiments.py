"""Experiments within reach of who made a log: its level, band, course, length, and the place of its input."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import CYCLES, FORMS, LITTLE, PLACES, SAMPLES_A_CYCLE, SOME, TAIL
from chladni.gap.comparison.doubts import modes_of
from chladni.gap.design.experiment import Change, Experiment
from chladni.gap.plant.windows import windows_for
from chladni.gap.records.measurement import Measurement
from chladni.models.core.model import Model
from chladni.models.excitations.random_noise import RandomNoise
from chladni.models.excitations.swept_sine import SweptSine
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.arrays import Real
from chladni.signals.engineering import engineering

Band = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """The log, or a stretch of it, that experiments start from; the same seed gives the same answer.

    Where the stretch begins with the log, they start from the initial states that fits found.
    """

    model: Model
    measurement: Measurement
    begins_with_log: bool
    seed: int

    @property
    def rms(self) -> Real:
        """``[input]`` RMS."""
        return np.asarray(np.sqrt(np.mean(self.measurement.inputs**2, axis=1)), dtype=np.float64)

    @property
    def _top_hz(self) -> float:
        """Highest frequency that is asked for."""
        return self.measurement.sample_rate_hz / SAMPLES_A_CYCLE

    def experiment(self, change: Change, words: str, inputs: Real, *, level: float = 0.0) -> Experiment:
        """Give an experiment on the model as it is, with the log's own inputs at a level, or others."""
        start = level if self.begins_with_log else 0.0
        return Experiment(change=change, words=words, model=self.model, inputs=inputs, start=start)

    def as_logged(self) -> Experiment:
        """Give the experiment that the log is."""
        return self.experiment("nothing", "Repeat the same", self.measurement.inputs, level=1.0)

    def levels(self) -> Iterator[Experiment]:
        """Give the log's own excitation, louder and quieter, and averaged."""
        logged = self.as_logged()
        for factor in (2.0, 0.5, 4.0, 0.25):
            words = f"Repeat with {self._driven()} at {factor:g} times the level{self._told(factor * self.rms)}"
            louder = self.experiment("level", words, factor * self.measurement.inputs, level=factor)
            # Twice is less to ask for than four times.
            yield replace(louder, further=0.5 * (abs(float(np.log2(factor))) - 1.0))
        for place, count in enumerate((4, 16)):
            words = f"Repeat the same input {count} times and average the responses"
            yield replace(logged, change="repeats", words=words, repeats=count, further=(place + 1) / 3)

    def courses(self) -> Iterator[Experiment]:
        """Give other bands, sweeps and a slow sine, all at the log's RMS or peak."""
        if not self._is_free():
            return
        low, high = excited_band_hz(self.measurement)
        middle = float(np.sqrt(low * high))
        bands = [(low, middle), (middle, high)]
        modes = self._modes_hz()
        bands += [((1 - SOME) * one, (1 + SOME) * one) for one in modes[:PLACES]]
        for band in bands:
            yield from self._noise(band)
        span = self._wide(low, high, modes)
        yield self._sweep(span, "up")
        yield self._sweep((span[1], span[0]), "down")
        if modes:
            yield from self._slow(LITTLE * modes[0])

    def positions(self) -> Iterator[Experiment]:
        """Give the same force at other bodies."""
        model = self.model
        if not isinstance(model, StructureModel) or model.controllers:
            return
        bodies = [body.name for body in model.structure.bodies]
        for place, one in enumerate(model.inputs):
            if one.kind != "force" or one.at not in bodies or self.rms[place] == 0:
                continue
            for body in [body for body in bodies if body != one.at][:FORMS]:
                inputs = tuple(replace(two, at=body) if two is one else two for two in model.inputs)
                words = f"Repeat with {one.name} at {body} instead of {one.at}"
                moved = self.experiment("position", words, self.measurement.inputs)
                yield replace(moved, model=replace(model, inputs=inputs))

    def _is_free(self) -> bool:
        """Whether the inputs may take any course: forces and floors, not motions or what a loop should follow.

        Nor may those of an axis that is free: nothing would hold it where it can travel.
        """
        if windows_for(self.model, self.measurement) is not None:
            return False
        derivatives = [one.derivatives for one in self.model.compile().inputs]
        closed = isinstance(self.model, StructureModel) and bool(self.model.controllers)
        return not closed and self.model.kind == "structure" and not any(derivatives) and bool(np.any(self.rms > 0))

    def _noise(self, band: Band) -> Iterator[Experiment]:
        measurement = self.measurement
        step, top = 1.0 / measurement.duration_s, measurement.sample_rate_hz / SAMPLES_A_CYCLE
        low, high = max(band[0], step), min(band[1], top)
        if high - low < 4 * step:
            return
        made = self._driven_by([RandomNoise(rms=rms or 1.0, band_hz=(low, high)) for rms in self.rms])
        words = f"Drive {self._driven()} with noise of {low:.3g} to {high:.3g} Hz{self._told(self.rms)}"
        yield self.experiment("band", words, made)

    def _sweep(self, span: Band, way: str) -> Experiment:
        sines = [
            SweptSine(amplitude=float(np.sqrt(2) * rms), start_hz=span[0], end_hz=span[1], law="logarithmic")
            for rms in self.rms
        ]
        words = f"Sweep {self._driven()} {way} from {span[0]:.3g} to {span[1]:.3g} Hz{self._told(self.rms)}"
        return self.experiment("sweep", words, self._driven_by(sines))

    def _slow(self, frequency_hz: float) -> Iterator[Experiment]:
        measurement = self.measurement
        if frequency_hz * measurement.duration_s < 2.0:
            return
        peak = np.max(np.abs(measurement.inputs), axis=1)
        sines = [SweptSine(amplitude=float(one), start_hz=frequency_hz, end_hz=frequency_hz) for one in peak]
        told = self._told(peak, "peak")
        words = f"Drive {self._driven()} with a slow sine of {frequency_hz:.3g} Hz{told}"
        yield self.experiment("slow", words, self._driven_by(sines))

    def _driven_by(self, excitations: Sequence[RandomNoise | SweptSine]) -> Real:
        rng = np.random.default_rng(self.seed)
        samples, rate = self.measurement.samples, self.measurement.sample_rate_hz
        return np.stack(
            [
                one.samples(samples, rate, rng) if rms > 0 else np.zeros(samples)
                for one, rms in zip(excitations, self.rms, strict=True)
            ]
        )

    def _modes_hz(self) -> list[float]:
        """Frequencies of the modes that the log can show, rising."""
        turning = np.sort(modes_of(self.model.compile()))
        seen = (turning > CYCLES / self.measurement.duration_s) & (turning < self._top_hz)
        return [float(one) for one in turning[seen]]

    def _wide(self, low: float, high: float, modes: list[float]) -> Band:
        """Band of the log, widened to hold its modes."""
        if modes:
            low, high = min(low, 0.5 * modes[0]), max(high, 1.5 * modes[-1])
        return max(low, 1.0 / self.measurement.duration_s), min(high, self._top_hz)

    def _driven(self) -> str:
        names = [name for name, rms in zip(self.measurement.input_names, self.rms, strict=True) if rms > 0]
        return " and ".join(names) or "the start"

    def _told(self, sizes: Real, word: str = "RMS") -> str:
        units = [one.unit for one in self.model.compile().inputs]
        told = [
            engineering(size, None, unit) for size, unit, rms in zip(sizes, units, self.rms, strict=True) if rms > 0
        ]
        return f" ({word} {' and '.join(told)})" if told else ""


def excited_band_hz(measurement: Measurement) -> Band:
    """Band that holds 99 % of the power of the inputs, each scaled by its RMS."""
    signals = measurement.inputs - measurement.inputs.mean(axis=1, keepdims=True)
    size = np.sqrt(np.mean(signals**2, axis=1, keepdims=True))
    signals = signals / np.where(size > 0, size, 1.0)
    total = np.cumsum(np.sum(np.abs(np.fft.rfft(signals, axis=1)) ** 2, axis=0))
    if not total[-1] > 0:
        return 1.0 / measurement.duration_s, measurement.sample_rate_hz / SAMPLES_A_CYCLE
    low, high = np.searchsorted(total / total[-1], (TAIL, 1 - TAIL))
    step = measurement.sample_rate_hz / measurement.samples
    return float(max(low, 1) * step), float(max(high, low + 2) * step)
