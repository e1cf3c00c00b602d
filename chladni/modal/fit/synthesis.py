"""Frequency responses synthesised from a modal model, held against the measured ones."""

import numpy as np

from chladni.modal.fit.modal_basis import modal_basis
from chladni.modal.fit.modal_model import ModalModel
from chladni.modal.fit.model_lines import ModelLines, model_lines
from chladni.signals.arrays import Complex, Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.modal_fit import ModalFit


def modal_fit(
    response: FrequencyResponse, model: ModalModel, *, band_hz: tuple[float, float] | None = None
) -> ModalFit:
    """Synthesise the measured functions from a model, and tell how far off it is.

    Parameters
    ----------
    response
        What was measured; only lines that were excited and have a value are compared.
    model
        Modes and residuals with as many responses and references.
    band_hz
        Lines to compare, default all.

    Returns
    -------
    ModalFit
        Errors are relative to the measured root mean square. Bands reach from midway below to midway above each mode,
        the outer ones to the ends of the lines; modes outside of the lines have none.

    Notes
    -----
    Averages of windowed segments are compared with the modes as the window shows them (see `LagWindow`), since a
    sharp resonance would differ from its own measurement otherwise.
    """
    lines = model_lines(response, band_hz)
    synthesised = windowed_synthesis(lines, model)
    # Zero weights mark lines where a single function has no value.
    valid = lines.weights > 0
    wrong = np.where(valid, np.abs(lines.values - synthesised) ** 2, 0.0)
    power = np.where(valid, np.abs(lines.values) ** 2, 0.0)
    edges = _edges(lines, model)
    inside = [(lines.frequency_hz >= low) & (lines.frequency_hz <= high) for low, high in edges]
    return ModalFit(
        frequency_hz=lines.frequency_hz,
        synthesised=synthesised,
        lower_residual=model.lower,
        upper_residual=model.upper,
        error=float(_relative(wrong.sum(), power.sum())),
        function_error=_relative(wrong.sum(axis=-1), power.sum(axis=-1)),
        bands_hz=edges,
        band_error=_relative(
            np.array([wrong[..., band].sum() for band in inside]),
            np.array([power[..., band].sum() for band in inside]),
        ),
        poles_hz=np.sort(model.frequency_hz),
    )


def windowed_synthesis(lines: ModelLines, model: ModalModel) -> Complex:
    """``[response, reference, line]`` of a model, in the form of the lines and as their segments show it."""
    basis = modal_basis(lines, model.poles)
    residues = np.moveaxis(model.residues, 0, -1)
    columns = np.ascontiguousarray(residues).view(np.float64)
    low, high = lines.s ** (lines.order - 2), lines.s**lines.order
    outside = model.lower[..., np.newaxis] * low + model.upper[..., np.newaxis] * high
    return np.asarray(columns @ basis.modes + outside, dtype=np.complex128)


def _edges(lines: ModelLines, model: ModalModel) -> Real:
    first, last = lines.frequency_hz[0], lines.frequency_hz[-1]
    modes = np.sort(model.frequency_hz)
    modes = modes[(modes >= first) & (modes <= last)]
    if not modes.size:
        return np.empty((0, 2))
    middles = (modes[1:] + modes[:-1]) / 2
    ends = np.concatenate([[first], middles, [last]])
    return np.stack([ends[:-1], ends[1:]], axis=1)


def _relative(wrong: Real, power: Real) -> Real:
    share = np.divide(wrong, power, out=np.zeros(np.shape(wrong)), where=np.asarray(power) > 0)
    return np.asarray(np.sqrt(share), dtype=np.float64)
