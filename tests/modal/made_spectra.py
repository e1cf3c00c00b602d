"""Averaged spectra of responses that are known in closed form, without scatter."""

import numpy as np

from chladni.signals.channel import Channel
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.provenance import Provenance


def expected_spectra(modes, *, spacing_hz, lines, floor=1e-9, averages=1000.0, unit="m/s^2"):
    """What endless averaging over Hann segments gives of uncorrelated modes ``(frequency_hz, damping, shape)``.

    The spectrum of each mode, computed 64 times as densely, is averaged over the window's own power: no formula of
    the estimator is used.
    """
    fine = 64
    frequency_hz = np.arange(lines) * spacing_hz
    dense_hz = np.arange(-lines * fine, 2 * lines * fine) * (spacing_hz / fine)
    segment = np.sin(np.pi * np.arange(1024) / 1024) ** 2
    # Power of the window's transform, 16 lines to either side; beyond it there's less than 1e-8 of it.
    kernel = np.abs(np.fft.fft(segment, 1024 * fine)) ** 2
    kernel = np.concatenate([kernel[-16 * fine :], kernel[: 16 * fine + 1]])
    kernel /= kernel.sum()
    count = len(modes[0][2])
    density = np.zeros((count, count, lines), dtype=complex)
    for natural_hz, damping, shape in modes:
        gain = dense_hz**2 / (natural_hz**2 - dense_hz**2 + 2j * damping * natural_hz * dense_hz)
        power = np.convolve(np.abs(gain) ** 2 * damping**2, kernel, mode="same")
        seen = power[lines * fine : 2 * lines * fine : fine]
        density += np.outer(np.conj(shape), shape)[:, :, None] * seen
    density += floor * np.eye(count)[:, :, None]
    return CrossSpectra(
        frequency_hz=frequency_hz,
        density=density,
        channels=tuple(Channel(name=f"a{row}", unit=unit) for row in range(count)),
        bandwidth_hz=1.5 * spacing_hz,
        provenance=Provenance(
            window="hann",
            segment_s=1 / spacing_hz,
            overlap=0.5,
            averages=int(averages),
            effective_averages=averages,
        ),
    )
