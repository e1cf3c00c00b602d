"""Error bars of a fitted modal model, propagated to first order."""

from math import pi

import numpy as np

from chladni.modal.fit.fit_inflation import Misfit
from chladni.modal.fit.fitted_modes import FittedModes
from chladni.modal.fit.lsfd import ShapeSolution
from chladni.modal.fit.modal_model import ModalModel
from chladni.modal.fit.mode_scatter import ModeScatter
from chladni.modal.fit.model_lines import ModelLines
from chladni.modal.fit.parameter_spread import ParameterSpread, parameter_spread
from chladni.modal.fit.scatter_estimate import mode_scatters, too_many
from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.provenance import Provenance

SIMPLE = (
    "so many functions and lines that leakage isn't followed from line to line: error bars of frequency may be twice "
    "too wide, those of shapes too narrow where the reference is noisy; a narrower band or fewer responses do better"
)


def fitted_modes(
    lines: ModelLines,
    poles: Complex,
    solution: ShapeSolution,
    *,
    found: Misfit,
    provenance: Provenance,
    kept: Index,
    notes: tuple[str, ...],
) -> FittedModes:
    """Attach error bars to poles and their best shapes, with what was found of the misfit."""
    spread = parameter_spread(lines, solution)
    model, largest = _normalised(solution.model(poles))
    scatters = mode_scatters(lines, spread, poles, found, provenance)
    each = list(zip(range(poles.size), map(int, largest), scatters, strict=True))
    covariance, inflation = _covariance(poles, spread, scatters)
    std = np.sqrt(np.einsum("rara->ra", covariance))
    amplitude = np.sqrt([scatter.amplitude for scatter in scatters])
    shape_std = np.stack([spread.shape_std(mode, most, scatter) for mode, most, scatter in each])
    participation_std = np.stack([spread.participation_std(mode, most) for mode, most, _ in each])
    masses = np.stack([spread.mass_std(mode, most, poles[mode]) for mode, most, _ in each])
    order = np.argsort(np.abs(poles), kind="stable")
    return FittedModes(
        model=model.select(order),
        kept=kept[order],
        frequency_std_hz=std[order, 0],
        damping_std=std[order, 1],
        covariance=covariance[order][:, :, order],
        shape_std=shape_std[order],
        participation_std=(amplitude[:, np.newaxis] * participation_std)[order],
        modal_mass_std=(amplitude[:, np.newaxis, np.newaxis] * masses)[order],
        chi_square=found.chi_square if lines.weighted else float("nan"),
        inflation=inflation[order],
        notes=(*notes, SIMPLE) if too_many(lines, poles.size) else notes,
    )


def no_modes(lines: ModelLines, notes: tuple[str, ...]) -> FittedModes:
    """Give the answer that no mode is left."""
    responses, references, _ = lines.values.shape
    none = np.zeros((responses, references), dtype=np.complex128)
    model = ModalModel(
        poles=np.empty(0, dtype=np.complex128),
        shapes=np.empty((0, responses), dtype=np.complex128),
        participation=np.empty((0, references), dtype=np.complex128),
        lower=none,
        upper=none,
    )
    return FittedModes(
        model=model,
        kept=np.empty(0, dtype=np.intp),
        frequency_std_hz=np.empty(0),
        damping_std=np.empty(0),
        covariance=np.empty((0, 2, 0, 2)),
        shape_std=model.shapes,
        participation_std=model.participation,
        modal_mass_std=np.empty((0, responses, references)),
        chi_square=float("nan"),
        inflation=np.empty(0),
        notes=notes,
    )


def _covariance(poles: Complex, spread: ParameterSpread, scatters: list[ModeScatter]) -> tuple[Real, Real]:
    """``[mode, 2, mode, 2]`` of natural frequency and damping ratio, and how far it exceeds independent lines."""
    independent = spread.poles()
    own = np.stack([independent[mode, :, mode] for mode in range(poles.size)])
    total = np.stack([scatter.pole for scatter in scatters])
    inflation = np.einsum("raa->r", total) / np.einsum("raa->r", own)
    gains = np.sqrt([scatter.shared for scatter in scatters])
    # Between modes only noise is shared; what leakage adds near one mode says nothing about another.
    covariance = independent * gains[:, None, None, None] * gains[:, np.newaxis]
    for mode, matrix in enumerate(total):
        covariance[mode, :, mode] = matrix
    change = np.stack([_frequency_slopes(poles), _damping_slopes(poles)], axis=1)
    return np.asarray(np.einsum("rax,rxsy,sby->rasb", change, covariance, change)), inflation


def _normalised(model: ModalModel) -> tuple[ModalModel, Index]:
    largest = np.argmax(np.abs(model.shapes), axis=1)
    scale = model.shapes[np.arange(largest.size), largest][:, np.newaxis]
    shapes = model.shapes / scale
    # Exactly 1, which rounding of the quotient needn't give.
    shapes[np.arange(largest.size), largest] = 1
    normalised = ModalModel(
        poles=model.poles,
        shapes=shapes,
        participation=model.participation * scale,
        lower=model.lower,
        upper=model.upper,
    )
    return normalised, largest


def _frequency_slopes(poles: Complex) -> Real:
    """``[mode, 2]`` derivative of abs(lambda)/(2 pi) to Re and Im."""
    unit = poles / np.abs(poles)
    return np.stack([unit.real, unit.imag], axis=1) / (2 * pi)


def _damping_slopes(poles: Complex) -> Real:
    """``[mode, 2]`` derivative of -Re/abs to Re and Im."""
    size = np.abs(poles)
    slopes = np.stack([-(poles.imag**2), poles.real * poles.imag], axis=1) / size[:, np.newaxis] ** 3
    return np.asarray(slopes, dtype=np.float64)
