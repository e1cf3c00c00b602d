"""Figures of a diagnosis, by section."""

from chladni.viewers.figures.album import Album
from chladni.viewers.figures.gap_map import gap_map_figures
from chladni.viewers.figures.gap_shares import share_figures
from chladni.viewers.figures.gap_signals import error_figures, signal_figures
from chladni.viewers.figures.gap_spectra import spectrum_figures
from chladni.viewers.figures.restoring_force import restoring_force_figures
from chladni.viewers.figures.robot import motion_figures, residual_figures, torque_map_figures
from chladni.viewers.gap_evidence import GapEvidence


def gap_album(evidence: GapEvidence) -> Album:
    """Draw every figure that the diagnosis has data for."""
    residuals = residual_figures(evidence)
    return Album(
        {
            # What tells comes first; measured and simulated, which lie on each other where the answer is good, last.
            "residuals": residuals,
            # Residuals are the errors of a robot's torques.
            "errors": {} if residuals else error_figures(evidence),
            "force": restoring_force_figures(evidence),
            "friction": torque_map_figures(evidence, "velocity"),
            "positions": torque_map_figures(evidence, "position"),
            "spectra": spectrum_figures(evidence),
            "motion": motion_figures(evidence),
            "map": gap_map_figures(evidence),
            "shares": share_figures(evidence),
            "signals": signal_figures(evidence),
        }
    )
