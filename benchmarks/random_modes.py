"""Frequency responses of random modes in closed form, for benchmarks: large sets whose answer is known."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance


@dataclass(frozen=True, kw_only=True)
class RandomModes:
    """Real modes.

    ``frequency_hz[mode]``, ``damping_ratio[mode]``, ``shapes[mode, response]``, ``drives[mode, reference]``.
    """

    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray
    drives: np.ndarray

    @property
    def poles(self) -> np.ndarray:
        """``[mode]`` in rad/s."""
        omega = 2 * np.pi * self.frequency_hz
        return omega * (-self.damping_ratio + 1j * np.sqrt(1 - self.damping_ratio**2))


def random_modes(count: int, *, responses: int, references: int, top_hz: float, seed: int = 0) -> RandomModes:
    """Modes spread over 4 to 96 % of the band, each off its even place by up to a third, damped by 0.3 to 1.2 %."""
    rng = np.random.default_rng(seed)
    step = 0.92 * top_hz / count
    places = 0.04 * top_hz + step * (np.arange(count) + 0.5 + rng.uniform(-1 / 3, 1 / 3, count))
    return RandomModes(
        frequency_hz=places,
        damping_ratio=rng.uniform(0.003, 0.012, count),
        shapes=rng.standard_normal((count, responses)),
        drives=rng.standard_normal((count, references)),
    )


def accelerances(modes: RandomModes, *, lines: int, top_hz: float, noise: float, seed: int = 1) -> FrequencyResponse:
    """Accelerances on even lines from 0 Hz, with noise of that part of each function's RMS on every line."""
    frequency_hz = np.arange(lines) * (top_hz / lines)
    omega, omega_r = 2 * np.pi * frequency_hz, 2 * np.pi * modes.frequency_hz[:, None]
    gain = -(omega**2) / (omega_r**2 - omega**2 + 2j * modes.damping_ratio[:, None] * omega_r * omega)
    responses, references = modes.shapes.shape[1], modes.drives.shape[1]
    products = (modes.shapes[:, :, None] * modes.drives[:, None, :]).reshape(len(gain), -1)
    values = (products.T @ gain).reshape(responses, references, lines)
    std = noise * np.sqrt(np.mean(np.abs(values) ** 2, axis=2, keepdims=True)) * np.ones(lines)
    rng = np.random.default_rng(seed)
    for row, sigma in zip(values, std, strict=True):
        row += sigma * (rng.standard_normal(row.shape) + 1j * rng.standard_normal(row.shape)) / np.sqrt(2)
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=std,
        coherence=np.ones((responses, lines)),
        excited=frequency_hz > 0,
        responses=tuple(Channel(name=f"/response{row}", unit="m/s^2") for row in range(responses)),
        references=tuple(Channel(name=f"/force{row}", unit="N", role="reference") for row in range(references)),
        # Exact lines, as periodic excitation gives them: no window leaks from one to the next.
        provenance=Provenance(
            estimator="H1", averages=50, effective_averages=50.0, segment_s=lines / top_hz, averaging="periodic"
        ),
    )
