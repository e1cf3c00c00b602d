"""Mode sets from responses alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.modal.operational.response_shapes import ResponseShape, largest_one
from chladni.modal.operational.spectral_decomposition import SpectralDecomposition
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet
from chladni.signals.wording import counted

UNSCALED = "shapes are unscaled: responses alone don't tell the modal mass"
ONE_CHANNEL = (
    "one channel shows frequencies and damping but no shape, and no agreement of shapes that makes a peak a mode"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResponseMode:
    """A mode before it joins a set; `shape` in the scale of the decomposition."""

    frequency_hz: float
    frequency_std_hz: float
    damping_ratio: float
    damping_std: float
    shape: ResponseShape


def response_mode_set(
    decomposition: SpectralDecomposition,
    modes: Sequence[ResponseMode],
    *,
    estimator: str,
    notes: Sequence[str] = (),
    harmonics: Sequence[MachineHarmonic] = (),
) -> ModeSet:
    """Gather modes by rising frequency, and say what limits them."""
    ordered = sorted(modes, key=lambda mode: mode.frequency_hz)
    shapes = [largest_one(mode.shape, decomposition.scale) for mode in ordered]
    # An array of no rows has no columns either, and these are known.
    empty = np.zeros((0, len(decomposition.channels)), dtype=np.complex128)
    remarks = [*notes, UNSCALED]
    if len(decomposition.channels) == 1:
        remarks.append(ONE_CHANNEL)
    # The first singular value stands all the same: only what lies below it is lost.
    if decomposition.averages < len(decomposition.channels):
        remarks.append(
            f"{decomposition.averages:.3g} effective averages of {counted(len(decomposition.channels), 'channel')} "
            "leave the spectral matrix singular, and its small singular values without meaning; a coarser resolution "
            "helps"
        )
    return ModeSet(
        frequency_hz=np.array([mode.frequency_hz for mode in ordered], dtype=np.float64),
        frequency_std_hz=np.array([mode.frequency_std_hz for mode in ordered], dtype=np.float64),
        damping_ratio=np.array([mode.damping_ratio for mode in ordered], dtype=np.float64),
        damping_std=np.array([mode.damping_std for mode in ordered], dtype=np.float64),
        shapes=np.array([shape for shape, _ in shapes]) if shapes else empty,
        shape_std=np.array([std for _, std in shapes]) if shapes else empty,
        channels=decomposition.channels,
        harmonics=tuple(harmonics),
        provenance=replace(decomposition.provenance, estimator=estimator).with_notes(*remarks),
    )
