"""Synthesis of many modes: group after group, each with the residuals of its own part of the band."""

from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from chladni.modal.grouped_refinement import ALONE, groups_of, surroundings
from chladni.modal.lsfd import least_squares_frequency_domain
from chladni.modal.synthesis import modal_fit
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.modal_fit import ModalFit

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]


def grouped_fit(response: FrequencyResponse, poles: Complex, participation: Complex) -> ModalFit:
    """Synthesise the excited lines from poles and participation, and tell how far off that is.

    Up to a dozen modes have one pair of residuals. Of more, each group of neighbours explains the lines up to midway
    to the next group, with residuals of its own; those given are of what lies below the lowest group and above the
    highest.
    """
    if poles.size <= ALONE:
        return modal_fit(response, least_squares_frequency_domain(response, poles, participation))
    lines = np.flatnonzero(response.excited)
    parts = _parts(response, response.frequency_hz[lines], poles, participation)
    synthesised = np.concatenate([part.synthesised for part in parts], axis=-1)
    usable = np.isfinite(response.values[..., lines])
    measured = np.where(usable, response.values[..., lines], 0)
    wrong = np.where(usable, np.abs(measured - synthesised) ** 2, 0.0).sum(axis=-1)
    power = (np.abs(measured) ** 2).sum(axis=-1)
    return ModalFit(
        frequency_hz=response.frequency_hz[lines],
        synthesised=synthesised,
        lower_residual=parts[0].lower_residual,
        upper_residual=parts[-1].upper_residual,
        error=_relative(wrong.sum(), power.sum()),
        function_error=np.sqrt(np.divide(wrong, power, out=np.zeros_like(wrong), where=power > 0)),
        bands_hz=np.concatenate([part.bands_hz for part in parts]),
        band_error=np.concatenate([part.band_error for part in parts]),
    )


def _parts(
    response: FrequencyResponse, frequency_hz: Floats, poles: Complex, participation: Complex
) -> list[ModalFit]:
    rising = np.argsort(poles.imag, kind="stable")
    groups = sorted(
        (rising[own] for own in groups_of(poles[rising])), key=lambda group: float(poles[group].imag.min())
    )
    # Up to midway between the outer modes of neighbouring groups.
    middles = [(poles[below].imag.max() + poles[above].imag.min()) / (4 * pi) for below, above in pairwise(groups)]
    cuts = [0, *np.searchsorted(frequency_hz, middles).tolist(), frequency_hz.size]
    found = []
    for group, (start, stop) in zip(groups, pairwise(cuts), strict=True):
        if stop == start:
            continue
        band, members = surroundings(response, poles, group)
        model = least_squares_frequency_domain(response, poles[members], participation[members], band_hz=band)
        core = (float(frequency_hz[start]), float(frequency_hz[stop - 1]))
        found.append(modal_fit(response, model, band_hz=core))
    return found


def _relative(wrong: float, power: float) -> float:
    return float(np.sqrt(wrong / power)) if power > 0 else 0.0
