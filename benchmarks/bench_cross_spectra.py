"""Cross-spectra of all channel pairs against scipy.signal.csd pair by pair, and against the FFTs they need."""

import time
from collections.abc import Callable
from itertools import combinations_with_replacement
from os import cpu_count

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft, signal

import chladni
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni.spectral.accumulator import CrossSpectraAccumulator
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.segmentation import Segmentation

CHANNELS, SAMPLES, SEGMENT = 9, 2**20, 4096
SHORT_CHANNELS, SHORT_SAMPLES = 4, 73_728
ROUNDS, SHORT_ROUNDS = 7, 40
STREAM_CHANNELS, STREAM_RATE_HZ, STREAM_SECONDS = 12, 25_600, 120


def times_s(works: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Shortest time of each work; the works take turns, so that all see the same load of the machine."""
    shortest = dict.fromkeys(works, float("inf"))
    for _ in range(rounds):
        for name, work in works.items():
            begun = time.perf_counter()
            work()
            shortest[name] = min(shortest[name], time.perf_counter() - begun)
    return shortest


def pair_by_pair(values: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
    """Do what a user of SciPy would do."""
    pairs = combinations_with_replacement(range(CHANNELS), 2)
    return {(i, j): signal.csd(values[i], values[j], fs=SEGMENT, nperseg=SEGMENT)[1] for i, j in pairs}


def largest_difference(ours: np.ndarray, pairs: dict[tuple[int, int], np.ndarray]) -> float:
    """Largest difference of any pair and line, relative to that number itself."""
    return max(float(np.max(np.abs(ours[pair] - theirs) / np.abs(theirs))) for pair, theirs in pairs.items())


def short_record() -> dict[str, float]:
    """Time of H1 and coherence of three responses to one reference, of a record as short as a press of a button."""
    values = np.random.default_rng(2).standard_normal((SHORT_CHANNELS, SHORT_SAMPLES))
    series = chladni.TimeSeries.from_arrays(values, sample_rate_hz=float(SEGMENT))
    needed = [(0, row) for row in range(SHORT_CHANNELS)] + [(row, row) for row in range(1, SHORT_CHANNELS)]

    def scipys() -> list[np.ndarray]:
        return [signal.csd(values[i], values[j], fs=SEGMENT, nperseg=SEGMENT)[1] for i, j in needed]

    def ours() -> object:
        return chladni.frf(series, references="ch1", resolution_hz=1.0)

    return times_s({"ours": ours, "scipy": scipys}, SHORT_ROUNDS)


def stream_rate() -> float:
    """Samples a second that the running average takes from blocks of one second, single precision."""
    rng = np.random.default_rng(1)
    values = rng.standard_normal((STREAM_CHANNELS, STREAM_RATE_HZ)).astype(np.float32)
    channels = tuple(Channel(name=f"/{number}") for number in range(STREAM_CHANNELS))
    average = CrossSpectraAccumulator(channels, STREAM_RATE_HZ, Segmentation(samples=8192, hop=4096))
    begun = time.perf_counter()
    for second in range(STREAM_SECONDS):
        average.update(
            TimeSeries(
                values=values, sample_rate_hz=STREAM_RATE_HZ, channels=channels, start_time_ns=second * 1_000_000_000
            )
        )
    average.result()
    return values.size * STREAM_SECONDS / (time.perf_counter() - begun)


def main() -> None:
    values = np.random.default_rng(0).standard_normal((CHANNELS, SAMPLES))
    series = TimeSeries(
        values=values,
        sample_rate_hz=float(SEGMENT),
        channels=tuple(Channel(name=f"/{number}") for number in range(CHANNELS)),
    )
    segments = np.ascontiguousarray(sliding_window_view(values, SEGMENT, axis=1)[:, :: SEGMENT // 2])
    works: dict[str, Callable[[], object]] = {
        "ours": lambda: cross_spectra(series, resolution_hz=1.0),
        "FFTs": lambda: fft.rfft(segments, axis=-1, workers=cpu_count()),
    }
    shortest = times_s(works, ROUNDS) | times_s({"scipy": lambda: pair_by_pair(values)}, 2)
    ours, scipys, ffts = (shortest[name] for name in ("ours", "scipy", "FFTs"))
    rate = stream_rate()
    print(f"{CHANNELS} channels x {SAMPLES} samples, segments of {SEGMENT}, 50 % overlap, {cpu_count()} processors\n")
    print("| work | time | ratio |")
    print("| --- | ---: | --- |")
    print(f"| chladni, all {CHANNELS * (CHANNELS + 1) // 2} pairs | {ours:.3f} s | |")
    print(f"| `scipy.signal.csd` pair by pair | {scipys:.3f} s | chladni is {scipys / ours:.1f} times faster |")
    print(f"| the FFTs alone, `scipy.fft.rfft` | {ffts:.3f} s | chladni takes {ours / ffts:.1f} times as long |")
    difference = largest_difference(cross_spectra(series, resolution_hz=1.0).density, pair_by_pair(values))
    print(f"| largest relative difference from SciPy, any pair and line | | {difference:.1e} |")
    short = short_record()
    print(
        f"| `chladni.frf` of {SHORT_CHANNELS} x {SHORT_SAMPLES}, beside the `scipy.signal.csd` that it takes "
        f"| {1e3 * short['ours']:.1f} ms | chladni is {short['scipy'] / short['ours']:.2f} times as fast |"
    )
    print(
        f"| stream of {STREAM_CHANNELS} channels at {STREAM_RATE_HZ / 1000:g} kHz, averaged as it comes "
        f"| {rate / 1e6:.0f} M samples/s | {rate / STREAM_CHANNELS / STREAM_RATE_HZ:.0f} times real time |"
    )


if __name__ == "__main__":
    main()
