"""Spectra of the errors, before and after, between what was measured and the noise."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.gap.records.diagnosis import GapSignals
from chladni.signals.arrays import Real
from chladni.viewers.figures.gap_signals import AFTER, BEFORE, MEASURED, OUTPUTS_A_FIGURE, stacked
from chladni.viewers.figures.log_axis import logarithmic, logarithmic_frequency
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import look, plain
from chladni.viewers.gap_evidence import Evidence, GapSpectra
from chladni.viewers.labels import amplitude_density_unit

Paint = tuple[float, float, float]

# Down to what is left, and a little below the noise where it isn't far; never more decades than these.
BELOW_NOISE, FAR, ROOM, DECADES = 0.5, 0.03, 0.7, 6.0
# The band that is shown holds this share of each curve's power, and some room above it.
HELD, ABOVE = 0.999, 4.0
# Powers of ten at most: more would stand on top of each other where several outputs share a figure.
NUMBERS = 5


def spectrum_figures(evidence: Evidence) -> dict[str, Figure]:
    """Draw the spectra of the errors of every output, by name; none without spectra."""
    signals, spectra = evidence.signals, evidence.spectra
    if signals is None or spectra is None:
        return {}
    with look():
        return {
            f"spectra{part}": stacked(
                evidence,
                signals,
                rows,
                lambda axes, row: draw_spectrum(axes, signals, spectra, row, after=evidence.after),
                x_label="Frequency [Hz]",
            )
            for part, rows in pages(len(signals.output_names), OUTPUTS_A_FIGURE)
        }


def draw_spectrum(axes: Axes, signals: GapSignals, spectra: GapSpectra, row: int, *, after: str | None) -> None:
    """Draw one output's amplitude densities: measured, error before and after, noise."""
    # What stands still has no place on a logarithmic axis of frequency.
    shown = slice(1, _last_line(spectra) + 1)
    frequency_hz = spectra.frequency_hz[shown]
    lines = [(values[shown], colour, width, label) for values, colour, width, label in _lines(spectra, row, after)]
    for values, colour, width, label in lines:
        axes.plot(frequency_hz, values, color=colour, linewidth=width, label=label)
    high = max(float(values.max()) for values, *_ in lines)
    # A channel that is zero has no place on a logarithmic axis, either.
    if high > 0:
        noise, left = np.sqrt(spectra.noise[row, shown]), lines[-1][0]
        least, quiet = (float(one[one > 0].min(initial=high)) for one in (left, noise))
        lowest = min(BELOW_NOISE * quiet, ROOM * least) if quiet > FAR * least else ROOM * least
        low = max(lowest, high / 10**DECADES)
        logarithmic(axes, low, 2 * high, numbers=NUMBERS)
        # What lies below the axis isn't promised in the legend.
        if noise.max() > low:
            axes.plot(frequency_hz, noise, color="black", linewidth=0.8, linestyle=(0, (4, 2)), label="noise")
    logarithmic_frequency(axes, float(frequency_hz[0]), float(frequency_hz[-1]))
    axes.set_ylabel(f"[{plain(amplitude_density_unit(signals.output_units[row]))}]")


def _last_line(spectra: GapSpectra) -> int:
    """Line above which no curve of any output has power that is worth showing."""
    curves = np.vstack([spectra.measured, spectra.before, spectra.after])[:, 1:]
    rising = np.cumsum(curves, axis=1)
    held = [int(np.searchsorted(one, HELD * one[-1])) for one in rising if one[-1] > 0]
    most = spectra.frequency_hz.size - 1
    return min(round(ABOVE * (max(held, default=most) + 1)), most)


def _lines(spectra: GapSpectra, row: int, after: str | None) -> Iterator[tuple[Real, Paint, float, str]]:
    yield np.sqrt(spectra.measured[row]), MEASURED, 2.2, "measured"
    yield np.sqrt(spectra.before[row]), BEFORE, 1.4, "error" if after is None else "error before"
    if after is not None:
        yield np.sqrt(spectra.after[row]), AFTER, 0.8, f"error {after}"
