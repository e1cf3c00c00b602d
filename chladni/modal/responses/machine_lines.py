"""Modes that stand where a machine turns, taken out."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet

# What a machine and a window make of a sine is this near to its frequency, and decays no faster.
NEAR, LEAST_DAMPING = 0.01, 0.005


def without_machines(modes: ModeSet, harmonics: Sequence[MachineHarmonic], *, line_hz: float) -> ModeSet:
    """Leave out modes that are lines of machines, and list those lines with their reasons.

    Parameters
    ----------
    modes
        From spectra, which don't tell a sine from a mode that is narrower than their lines.
    harmonics
        Of the same record; see `chladni.modal.responses.harmonics.machine_harmonics`.
    line_hz
        Distance of the spectral lines, Hz.

    Returns
    -------
    ModeSet
        Without the modes next to a harmonic whose damping ratio is at most half a percent, or whose half-power width
        is at most two lines: a window makes that of a sine.
    """
    known = (*modes.harmonics, *harmonics)
    if not known:
        return modes
    machine_hz = np.array([one.frequency_hz for one in known])
    away_hz = np.abs(modes.frequency_hz[:, np.newaxis] - machine_hz).min(axis=1)
    narrow = (modes.damping_ratio <= LEAST_DAMPING) | (modes.damping_ratio * modes.frequency_hz <= line_hz)
    machine = narrow & (away_hz <= np.maximum(NEAR * modes.frequency_hz, line_hz))
    kept = modes.select(np.flatnonzero(~machine))
    unique = {round(one.frequency_hz / line_hz): one for one in reversed(known)}
    return replace(kept, harmonics=tuple(sorted(unique.values(), key=lambda one: one.frequency_hz)))
