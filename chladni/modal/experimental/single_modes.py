"""Modes that were found one at a time, gathered to a set."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.modal.experimental.resonance_lines import MobilityLines, Resonance
from chladni.signals.arrays import Complex, Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SingleMode:
    """One mode: frequency and damping with one sigma, and the diameter of each function's mobility circle.

    Attributes
    ----------
    frequency_hz, frequency_std_hz, damping_ratio, damping_std
        See `ModeSet`.
    diameter, diameter_std
        ``[response, reference]`` complex mobility at resonance that is the mode's own, and one sigma of its real and
        of its imaginary part.
    """

    frequency_hz: float
    frequency_std_hz: float
    damping_ratio: float
    damping_std: float
    diameter: Complex
    diameter_std: Real


def left_out(lines: MobilityLines, resonance: Resonance) -> str:
    """Say that no mode is taken at a peak, and what to do."""
    return (
        f"no mode is taken at {lines.frequency_hz[resonance.line]:.5g} Hz: the lines around it, "
        f"{lines.spacing_hz:.3g} Hz apart, tell no single resonance; take plscf, which fits all modes together"
    )


def mode_set(
    modes: Sequence[SingleMode], response: FrequencyResponse, *, estimator: str, notes: Sequence[str]
) -> ModeSet:
    """Gather single modes to a set, by rising frequency.

    Notes
    -----
    A mobility D/(1 + j x) has the residue psi L = D zeta omega_r/(j omega_d) of the receptance (see `ModeSet`).
    """
    modes = sorted(modes, key=lambda mode: mode.frequency_hz)
    answers, sources = len(response.responses), len(response.references)
    split = [_rank_one(mode) for mode in modes]
    return ModeSet(
        frequency_hz=np.array([mode.frequency_hz for mode in modes]),
        frequency_std_hz=np.array([mode.frequency_std_hz for mode in modes]),
        damping_ratio=np.array([mode.damping_ratio for mode in modes]),
        damping_std=np.array([mode.damping_std for mode in modes]),
        shapes=np.array([shape for shape, _, _ in split], dtype=complex).reshape(-1, answers),
        shape_std=np.array([std for _, std, _ in split], dtype=complex).reshape(-1, answers),
        channels=response.responses,
        references=response.references,
        participation=np.array([factors for _, _, factors in split], dtype=complex).reshape(-1, sources),
        provenance=replace(response.provenance, estimator=estimator).with_notes(*notes),
    )


def _rank_one(mode: SingleMode) -> tuple[Complex, Complex, Complex]:
    """Shape, its std and participation whose product is nearest to the residues."""
    # A reference that is known badly has little to say.
    trust = 1 / np.sqrt(np.mean(mode.diameter_std**2, axis=0))
    _, _, right = np.linalg.svd(mode.diameter * trust)
    direction = right[0].conj()
    vector = mode.diameter @ (trust * direction)
    spread = np.sqrt(mode.diameter_std**2 @ np.abs(trust * direction) ** 2)
    largest = int(np.argmax(np.abs(vector)))
    shape = vector / vector[largest]
    shape[largest] = 1
    std = np.hypot(spread, np.abs(shape) * spread[largest]) / np.abs(vector[largest])
    std[largest] = 0.0
    # psi L with psi = D T v / (that of the largest): L_j is the largest's row of the rank-one matrix.
    row = vector[largest] * right[0] / trust
    to_residue = mode.damping_ratio / (1j * np.sqrt(1 - mode.damping_ratio**2))
    return shape, std * (1 + 1j), row * to_residue
