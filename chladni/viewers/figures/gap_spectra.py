"""Spectra of the errors, before and after, between what was measured and the noise."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.gap.records.diagnosis import GapSignals
from chladni.viewers.drawing import Floats
from chladni.viewers.figures.gap_signals import AFTER, BEFORE, MEASURED, OUTPUTS_A_FIGURE, stacked
from chladni.viewers.figures.log_axis import logarithmic
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import look, plain
from chladni.viewers.gap_evidence import GapEvidence, GapSpectra
from chladni.viewers.labels import amplitude_density_unit

# Down to what is left and a little below the noise; never more decades than these.
BELOW_NOISE, ROOM, DECADES = 0.5, 0.7, 6.0


def spectrum_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw the spectra of the errors of every output, by name; none without spectra."""
    signals, spectra = evidence.found.signals, evidence.spectra
    if signals is None or spectra is None:
        return {}
    with look():
        return {
            f"spectra{part}": stacked(
                signals, rows, lambda axes, row: draw_spectrum(axes, signals, spectra, row), x_label="Frequency [Hz]"
            )
            for part, rows in pages(len(signals.output_names), OUTPUTS_A_FIGURE)
        }


def draw_spectrum(axes: Axes, signals: GapSignals, spectra: GapSpectra, row: int) -> None:
    """Draw one output's amplitude densities: measured, error before and after, noise."""
    lines = list(_lines(spectra, row))
    for values, colour, width, label in lines:
        axes.plot(spectra.frequency_hz, values, color=colour, linewidth=width, label=label)
    noise = float(np.sqrt(spectra.noise[row]))
    axes.axhline(noise, color="black", linewidth=0.8, linestyle=(0, (4, 2)), label="noise, if white")
    high = max(float(values.max()) for values, *_ in lines)
    # A channel that is zero has no place on a logarithmic axis.
    if high > 0:
        left = lines[-1][0]
        lowest = min(BELOW_NOISE * noise, ROOM * float(left[left > 0].min(initial=high)))
        logarithmic(axes, max(lowest, high / 10**DECADES), 2 * high)
    axes.set_xlim(0, float(spectra.frequency_hz[-1]))
    axes.set_ylabel(f"[{plain(amplitude_density_unit(signals.output_units[row]))}]")


def _lines(spectra: GapSpectra, row: int) -> Iterator[tuple[Floats, tuple[float, float, float], float, str]]:
    yield np.sqrt(spectra.measured[row]), MEASURED, 1.6, "measured"
    yield np.sqrt(spectra.before[row]), BEFORE, 0.9, "error before"
    yield np.sqrt(spectra.after[row]), AFTER, 0.9, "error after"
