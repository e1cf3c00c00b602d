"""An electronic oscillator beside its linear model: diagnosed on multisines, checked on a growing noise.

Needs ``silverbox.mcap`` and ``models/`` in the folder that CHLADNI_DATA names, or in ../shared/data. A path as
argument takes the picture, such as ``circuit.png``.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import chladni
from chladni import Model, explained_model, tuned_model

INPUT, OUTPUT = "/input.value", "/output.value"
#: Samples of the growing noise, then of two of the ten multisines, without the first one's transient.
GROWING, MULTISINES = slice(0, 40_700), slice(41_300, 57_684)


def smooth_between_samples(series: chladni.TimeSeries) -> chladni.TimeSeries:
    """Give back what straight lines between samples take from a smooth input: the square of sin(x)/x, x = pi f/rate.

    A simulation joins the samples of an input by straight lines. The voltage that drove this circuit went through a
    filter first and has no power near half the sample rate: between its samples it is smooth.
    """
    row, values = series.index(INPUT), series.values.copy()
    lost = np.sinc(np.fft.rfftfreq(series.samples)) ** 2
    values[row] = np.fft.irfft(np.fft.rfft(values[row]) / lost, series.samples)
    return replace(series, values=values)


def part(series: chladni.TimeSeries, samples: slice) -> chladni.TimeSeries:
    """Give a stretch of a series."""
    rate_hz = series.sample_rate_hz
    # Half a sample early: which samples are inside doesn't hang on rounding.
    return series.window(start_s=max(samples.start - 0.5, 0.0) / rate_hz, end_s=(samples.stop - 0.5) / rate_hz)


def error_mv(model: Model, series: chladni.TimeSeries) -> float:
    """RMS of measured less simulated, free run from rest, but for a constant."""
    outputs = chladni.simulate(model, series).outputs
    missed = series.values[series.index(OUTPUT)] - outputs.values[outputs.index(OUTPUT)]
    return float(1e3 * np.std(missed))


def main() -> None:
    """Print the answer, and the error on the growing noise, which no fit saw."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not (data / "silverbox.mcap").exists():
        print(f"{data / 'silverbox.mcap'} is not there; set CHLADNI_DATA to the folder of measured logs")
        return
    with chladni.open_log(data / "silverbox.mcap") as log:
        measured = log.read([INPUT, OUTPUT])
    # As its model file says: means are to be removed.
    measured = replace(measured, values=measured.values - measured.values.mean(axis=1, keepdims=True))
    series = smooth_between_samples(measured)
    model = chladni.load_model(data / "models" / "silverbox.toml")
    found = chladni.diagnose_gap(model, part(series, MULTISINES))
    print(*found.summary(), sep="\n")
    explained = explained_model(model, found)
    growing = part(series, GROWING)
    print(f"growing noise, free run: nominal {error_mv(model, growing):.2f} mV", end=", ")
    print(f"best linear {error_mv(tuned_model(model, part(series, MULTISINES)), growing):.2f} mV", end=", ")
    print(f"explained {error_mv(explained, growing):.2f} mV")
    print(f"the same with straight lines between samples: {error_mv(explained, part(measured, GROWING)):.2f} mV")
    if len(sys.argv) > 1:
        found.plot().figure.savefig(sys.argv[1], dpi=200)
        print("picture:", sys.argv[1])


if __name__ == "__main__":
    main()
