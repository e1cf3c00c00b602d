"""A scene: a true machine with its log's grid, excitation, recorder and noise, before anything is hidden in it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.signal import butter, lfilter

from chladni_withheld.networks.excitation import Band, Grid, Hold, Signal, draw_signal
from chladni_withheld.networks.linear_view import LinearView
from chladni_withheld.networks.machine import Addition, Recorder, Recording, record
from chladni_withheld.networks.network import GROUND, Matrix, Network
from chladni_withheld.networks.network_draw import draw_network

Rng = np.random.Generator
_MOST_SAMPLES = 12_000
_STEPS = 220_000
"""Steps of an integration that a core does in a fifth of a second."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A machine that could be hidden in, and all that is drawn of its log.

    Attributes
    ----------
    nominal, network
        What the model states, and the machine, whose numbers differ within their tolerances.
    tolerances
        One sigma of each number, relative.
    band, hold, in_motion, words
        Of the excitation; `words` tell each input's.
    drives, recorder
        What moves the machine and records it.
    noise_levels, noise_colour, noise_seed
        Of each output, over its RMS.
    """

    nominal: Network
    network: Network
    tolerances: dict[str, float]
    band: Band
    hold: Hold
    in_motion: bool
    words: tuple[str, ...]
    drives: tuple[Signal, ...]
    recorder: Recorder
    noise_levels: Matrix
    noise_colour: str
    noise_seed: int

    @property
    def grid(self) -> Grid:
        """Times of log and steps."""
        return self.recorder.grid

    @cached_property
    def view(self) -> LinearView:
        """The machine's linear response."""
        return LinearView(network=self.network, grid=self.grid, drives=self.drives)

    @cached_property
    def _recordings(self) -> dict[tuple[tuple[Addition, ...], bool], Recording]:
        return {}

    def recorded(self, additions: tuple[Addition, ...] = (), *, filtered: bool = False) -> Recording:
        """The log without noise of the machine with all that is added; `filtered`: by the filter of all channels."""
        key = (additions, filtered and self.recorder.anti_alias is not None)
        if key not in self._recordings:
            recorder = self.recorder if key[1] else Recorder(grid=self.grid)
            self._recordings[key] = record(self.network, additions, self.drives, recorder)
        return self._recordings[key]

    @cached_property
    def noise(self) -> Matrix:
        """Noise of all outputs, ``[output, sample]``."""
        rng = np.random.default_rng(self.noise_seed)
        white = rng.standard_normal((len(self.network.sensors), self.grid.samples))
        if self.noise_colour == "pink":
            # Falls by 10 dB a decade above a hundredth of the rate (Kellet's three poles).
            poles, weights = (0.99765, 0.963, 0.57), (0.099046, 0.2965164, 1.0526913)
            parts = [
                lfilter([weight], [1.0, -pole], white, axis=1) for pole, weight in zip(poles, weights, strict=True)
            ]
            white = np.sum(parts, axis=0) + 0.1848 * white
        rms = np.sqrt(np.mean(white**2, axis=1, keepdims=True))
        noise: Matrix = white / rms * (self.noise_levels * self.outputs_rms)[:, np.newaxis]
        return noise

    @cached_property
    def outputs_rms(self) -> Matrix:
        """RMS of each output of the bare machine."""
        rms: Matrix = np.sqrt(np.mean(self.recorded().outputs ** 2, axis=1))
        return rms

    @cached_property
    def smooth_outputs(self) -> tuple[int, ...]:
        """Outputs that don't follow a jump of an input at once, so that filters act on them as they are computed."""
        every = range(len(self.network.sensors))
        if self.hold == "band_limited":
            return tuple(every)
        return tuple(row for row in every if self.network.sensors[row].measures != "acceleration")

    def travel(self, first: int, second: int) -> tuple[float, float]:
        """RMS way and speed of one end against another."""
        way, speed = self.view.motion(self.network.direction(first, second))
        return _rms(way), _rms(speed)

    def load(self, joint: int) -> float:
        """RMS force in a joint."""
        way, speed = self.view.motion(self.network.joint_direction(joint))
        return _rms(self.network.joints[joint].stiffness * way + self.network.joints[joint].damping * speed)

    def inertia(self, body: int) -> float:
        """RMS force that a body's mass resists with."""
        _, force = self.view.resisting(f"{self.network.bodies[body]}.{self.network.mass_word}")
        return self.network.masses[body] * _rms(self.view.at_samples(force))


def _rms(values: Matrix) -> float:
    return float(np.sqrt(np.mean(values**2)))


def draw_scene(rng: Rng, *, hold: Hold | None = None, noise: float | None = None) -> Scene:
    """Draw a scene; its hold and noise may be given.

    200 to 5000 Hz, 5 to 20 s; the band reaches from below the lowest mode to above the highest.
    """
    rate_hz = float(np.round(np.exp(rng.uniform(np.log(200), np.log(5000)))))
    samples = int(np.clip(rng.uniform(5, 20) * rate_hz, 3000, max(_MOST_SAMPLES, 5 * rate_hz)))
    samples = int(np.clip(samples, 5 * rate_hz, 20 * rate_hz))
    nominal = draw_network(rng, rate_hz, samples / rate_hz)
    tolerances = _tolerances(rng, nominal)
    network = nominal.with_numbers(_true_numbers(rng, nominal, tolerances))
    run_in = int(5 / -network.poles().real.max() * rate_hz)
    over = 4 * int(np.clip(_STEPS / (samples + run_in) / 4, 4, 16))
    grid = Grid(rate_hz=rate_hz, samples=samples, before=run_in, over=over)
    modes_hz = network.modes_hz()
    band = Band(
        low_hz=float(modes_hz[0] * rng.uniform(0.2, 0.6)), high_hz=float(modes_hz[-1] * rng.uniform(1.05, 1.6))
    )
    hold = hold or ("band_limited" if rng.random() < 0.6 else "zoh")
    in_motion = bool(rng.random() < 0.5)
    drawn = [draw_signal(rng, grid, band, hold, from_rest=not in_motion) for _ in network.drives]
    filtered = hold == "band_limited" and rng.random() < 0.5
    level = noise or float(np.exp(rng.uniform(np.log(0.0013), np.log(0.015))))
    spread = rng.uniform(0.75, 1.3, len(network.sensors)) if noise is None else np.ones(len(network.sensors))
    return Scene(
        nominal=nominal, network=network, tolerances=tolerances, band=band, hold=hold, in_motion=in_motion,
        words=tuple(word for _, word in drawn), drives=_sized(rng, network, grid, [signal for signal, _ in drawn]),
        recorder=Recorder(grid=grid, anti_alias=_common_filter(rng, grid) if filtered else None),
        noise_levels=level * spread, noise_colour=str(rng.choice(["white", "pink"], p=[0.65, 0.35])),
        noise_seed=int(rng.integers(2**32)),
    )  # fmt: skip


def _tolerances(rng: Rng, network: Network) -> dict[str, float]:
    sizes = {
        "stiffness": float(rng.choice([0.02, 0.03, 0.05, 0.1])),
        network.mass_word: round(float(rng.uniform(0.01, 0.03)), 3),
        "damping": float(rng.choice([0.1, 0.15, 0.25])),
    }
    return {name: sizes[name.rsplit(".", 1)[1]] for name in network.numbers()}


def _true_numbers(rng: Rng, network: Network, tolerances: dict[str, float]) -> dict[str, float]:
    """Numbers off by their tolerances, two sigma at most."""
    off = rng.normal(0, 1, len(tolerances)).clip(-2, 2)
    numbers = network.numbers()
    return {
        name: numbers[name] * float(1 + tolerances[name] * sigma) for name, sigma in zip(tolerances, off, strict=True)
    }


def _common_filter(rng: Rng, grid: Grid) -> Matrix:
    """A recorder's filter, which all channels pass."""
    corner_hz = rng.uniform(0.4, 0.46) * grid.rate_hz
    sections: Matrix = butter(int(rng.choice([6, 8])), corner_hz, fs=1 / grid.step_s, output="sos")
    return sections


def _sized(rng: Rng, network: Network, grid: Grid, signals: list[Signal]) -> tuple[Signal, ...]:
    """Give inputs their sizes: the first any, another about as much motion as the first."""
    levels = [10 ** rng.uniform(-0.5, 2), *rng.uniform(0.4, 1.5, len(signals) - 1)]
    logs = []
    for number in range(len(signals)):
        alone = tuple(
            replace(signal, values=signal.values * float(row == number)) for row, signal in enumerate(signals)
        )
        logs.append(np.mean(LinearView(network=network, grid=grid, drives=alone).log() ** 2, axis=1))
    alike = [float(np.sqrt(np.mean(logs[0] / log))) for log in logs]
    return tuple(
        replace(signal, values=signal.values * level * same * (levels[0] if number else 1.0))
        for number, (signal, level, same) in enumerate(zip(signals, levels, alike, strict=True))
    )


def ground_moves(network: Network) -> bool:
    """Whether an input shakes the ground."""
    return any(drive.at == GROUND and drive.where == "ground" for drive in network.drives)
