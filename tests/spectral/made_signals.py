"""Series whose spectra are known."""

import numpy as np

from chladni.signals.channel import Channel
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries


def series(values, *, rate_hz=1000.0, names="abcdefghij", units=None, **fields):
    """Make a series of ``[channel, sample]`` values, named a, b, ... unless told."""
    values = np.atleast_2d(np.asarray(values))
    units = units or ["m/s^2"] * len(values)
    channels = tuple(Channel(name=name, unit=unit) for name, unit in zip(names, units, strict=False))
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=channels[: len(values)], **fields)


def noise(channels, samples, *, seed=0):
    """White Gaussian noise of variance 1, ``[channel, sample]``."""
    return np.random.default_rng(seed).standard_normal((channels, samples))


def multisine(period, lines, *, seed=0):
    """One period of a random-phase multisine of RMS 1 on the given lines."""
    spectrum = np.zeros(period // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(seed).random(len(lines)))
    signal = np.fft.irfft(spectrum, period)
    return signal / np.sqrt(np.mean(signal**2))


def blocks(whole, lengths):
    """Cut a series into consecutive blocks of the given lengths; the rest is the last block."""
    edges = np.unique(np.clip(np.cumsum([0, *lengths, whole.samples]), 0, whole.samples))
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield part(whole, first, last)


def part(whole, first, last):
    """Samples first to last of a series, with their time."""
    start_ns = whole.start_time_ns + round(first / whole.sample_rate_hz * 1e9)
    valid = None if whole.valid is None else whole.valid[:, first:last]
    return TimeSeries(
        values=whole.values[:, first:last],
        sample_rate_hz=whole.sample_rate_hz,
        channels=whole.channels,
        start_time_ns=start_ns,
        valid=valid,
    )


def made_density(values, *, unit="m/s^2", last_hz=2500.0, std=0.1):
    """Densities that are given, from 0 Hz on, each known to the same share of itself."""
    values = np.atleast_2d(values)
    return PowerSpectralDensity(
        frequency_hz=np.linspace(0, last_hz, values.shape[1]),
        values=values,
        std=std * values,
        channels=tuple(Channel(name=f"c{row}", unit=unit) for row in range(len(values))),
        bandwidth_hz=1.0,
        provenance=Provenance(),
    )
