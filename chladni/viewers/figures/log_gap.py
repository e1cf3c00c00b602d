"""Figures of a simulated log against a measured one."""

from chladni.viewers.figures.album import Album
from chladni.viewers.figures.gap_map import gap_map_figures
from chladni.viewers.figures.gap_signals import error_figures, signal_figures
from chladni.viewers.figures.gap_spectra import spectrum_figures
from chladni.viewers.gap_evidence import ComparisonEvidence


def log_gap_album(evidence: ComparisonEvidence, *, prefix: str = "") -> Album:
    """Draw errors, their spectra, the gap over band and time, and signals; names of figures begin with the prefix."""
    sections = {
        "errors": error_figures(evidence),
        "spectra": spectrum_figures(evidence),
        "map": gap_map_figures(evidence),
        "signals": signal_figures(evidence),
    }
    return Album(
        {
            section: {f"{prefix}{name}": figure for name, figure in figures.items()}
            for section, figures in sections.items()
        }
    )
