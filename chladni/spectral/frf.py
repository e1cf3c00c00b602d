"""Frequency response functions: H1, H2 and Hv from averaged cross-spectra."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.spectral.channel_choice import ChannelChoice, choose_channels
from chladni.spectral.coherence import share
from chladni.spectral.excitation import HAMMER_RANGE, excitation_notes, excited_lines, repeated_density
from chladni.spectral.frf_error import periodic_response_std, response_std
from chladni.spectral.line_algebra import LineSolution, solve_lines
from chladni.spectral.psd import auto_densities
from chladni.spectral.response_advice import response_notes

Estimator = Literal["H1", "H2", "Hv"]
ESTIMATORS = ("H1", "H2", "Hv")


def frequency_response(
    spectra: CrossSpectra,
    *,
    references: str | Sequence[str],
    responses: str | Sequence[str] | None = None,
    estimator: Estimator = "H1",
    hammer_range: float = HAMMER_RANGE,
) -> FrequencyResponse:
    """Estimate H = response/reference, with the convention e^{+j w t}: a delay tau gives the phase -w tau.

    Parameters
    ----------
    spectra
        Averaged cross-spectra.
    references
        Names of the excitations; several are solved for together, so that each column is the response to one of
        them alone.
    responses
        Names of the responses; None takes all other channels.
    estimator
        ``H1``, G_xx^-1 G_xy, is right when only the response is noisy; ``H2``, G_yy/G_yx, when only the reference is
        (with several references it needs as many responses); ``Hv``, total least squares with every channel scaled
        to unit power, shares the noise between them (Rocklin, Crowley & Vold 1985; for one reference it's the
        geometric mean of H1 and H2). For periodic excitation the mean periods are divided, where all three agree.
    hammer_range
        Least power of a hammer's lines over that of its strongest; see `excited_lines`.

    Returns
    -------
    FrequencyResponse
        ``[response, reference, frequency]``. NaN with infinite `std` where the references can't be told apart or
        have no power; those lines and the ones that are not excited have ``excited`` False and a note says how many.
        One sigma: see `response_std`; for periodic excitation `periodic_response_std`.

    Raises
    ------
    EstimateError
        When a channel is missing or named twice, H2 has not as many responses as references, or the spectra are
        peak-held.
    SetupError
        When there is no such estimator.
    """
    if estimator not in ESTIMATORS:
        raise SetupError(f"estimator {estimator!r} is none of {', '.join(ESTIMATORS)}")
    chosen = choose_channels(spectra, references, responses)
    # For periodic excitation what repeats is rank one, so that H1, H2 and Hv are all mean over mean.
    density = repeated_density(spectra)
    solution = solve_lines(density, chosen.references, chosen.responses)
    values = _estimate(estimator, density, chosen, solution)
    names = [spectra.channels[row].name for row in chosen.references]
    excited = excited_lines(spectra, names, hammer_range=hammer_range)
    # The matrix of references is solved as a whole, so that a line must be excited by all of them.
    everywhere = np.logical_and.reduce(excited)
    response = FrequencyResponse(
        frequency_hz=spectra.frequency_hz,
        values=values,
        std=_std(spectra, chosen, solution, values),
        coherence=_coherence(spectra, chosen),
        excited=everywhere & solution.solvable,
        responses=tuple(spectra.channels[row] for row in chosen.responses),
        references=tuple(spectra.channels[row] for row in chosen.references),
        provenance=spectra.provenance.with_estimator(estimator).with_notes(
            *excitation_notes(excited, names), *_solvability_notes(everywhere, solution, names, spectra)
        ),
    )
    return response_notes(response)


def _estimate(estimator: Estimator, density: Complex, chosen: ChannelChoice, solution: LineSolution) -> Complex:
    if estimator == "H2":
        return _h2(density, chosen)
    if estimator == "Hv":
        return _hv(density, chosen, solution.solvable)
    return solution.values


def _h2(density: Complex, chosen: ChannelChoice) -> Complex:
    if len(chosen.references) == 1:
        # With one reference every response has an answer of its own.
        return np.stack([_h2_square(density, chosen.references, [row])[0] for row in chosen.responses])
    if len(chosen.references) != len(chosen.responses):
        raise EstimateError(
            f"H2 with {len(chosen.references)} references needs as many responses, got {len(chosen.responses)}; "
            "name the responses, or use H1 or Hv"
        )
    return _h2_square(density, chosen.references, chosen.responses)


def _h2_square(density: Complex, references: list[int], responses: list[int]) -> Complex:
    # G_yy = G_yx H^T; a line whose G_yx is singular has no answer, and says NaN.
    cross = density[np.ix_(responses, references)].transpose(2, 0, 1)
    power = density[np.ix_(responses, responses)].transpose(2, 0, 1)
    scale = np.abs(cross).max(axis=(1, 2))
    solvable = np.linalg.svd(cross, compute_uv=False)[:, -1] > 1e-14 * scale
    cross = np.where(solvable[:, None, None], cross, np.eye(len(references)))
    answer = np.linalg.solve(cross, power).transpose(2, 1, 0)
    return np.asarray(np.where(solvable, answer, np.nan), dtype=np.complex128)


def _hv(density: Complex, chosen: ChannelChoice, solvable: Mask) -> Complex:
    return np.stack([_hv_response(density, chosen.references, row, solvable) for row in chosen.responses])


def _hv_response(density: Complex, references: list[int], response: int, solvable: Mask) -> Complex:
    rows = [*references, response]
    matrix = density[np.ix_(rows, rows)].transpose(2, 0, 1)
    power = np.einsum("fii->fi", matrix).real
    usable = solvable & (power > 0).all(axis=1)
    scale = np.sqrt(np.where(usable[:, None], power, 1.0))
    matrix = np.where(usable[:, None, None], matrix / (scale[:, :, None] * scale[:, None, :]), np.eye(len(rows)))
    # The combination of least power, sum of v_i z_i ~ 0, gives y = -sum of (v_x / v_y) x.
    smallest = np.linalg.eigh(matrix)[1][:, :, 0]
    usable &= np.abs(smallest[:, -1]) > 1e-14
    # Where the response has no part in the combination it doesn't depend on the references at all.
    last = np.where(usable, smallest[:, -1], 1.0)
    values = -smallest[:, :-1] / last[:, None] * scale[:, -1:] / scale[:, :-1]
    return np.asarray(np.where(usable, values.T, np.nan), dtype=np.complex128)


def _coherence(spectra: CrossSpectra, chosen: ChannelChoice) -> Real:
    # Of the whole density, scatter included: coherence tells how much of the measured power is explained.
    density = np.asarray(spectra.density, dtype=np.complex128)
    solution = solve_lines(density, chosen.references, chosen.responses)
    return share(solution.explained, auto_densities(density)[chosen.responses])


def _std(spectra: CrossSpectra, chosen: ChannelChoice, solution: LineSolution, values: Complex) -> Real:
    if spectra.noise_density is not None and len(chosen.references) == 1:
        std = periodic_response_std(spectra, solution.values[:, 0], chosen.references[0], chosen.responses)
        return np.where(np.isfinite(values), std[:, np.newaxis], np.inf)
    power = auto_densities(np.asarray(spectra.density, dtype=np.complex128))[chosen.responses]
    # Rounding may leave a perfectly explained response with less than no residual.
    residual = np.maximum(power - solution.explained, 0.0)
    with np.errstate(invalid="ignore"):
        least_squares = response_std(
            residual[:, np.newaxis],
            solution.inverse[np.newaxis],
            averages=spectra.provenance.effective_averages,
            references=len(chosen.references),
        )
        # H2 and Hv scatter by the same share of their magnitude as H1 does, to first order.
        std = least_squares * np.abs(values) / np.abs(solution.values)
    return np.where(np.isfinite(std), std, np.inf)


def _solvability_notes(
    excited: Mask, solution: LineSolution, names: list[str], spectra: CrossSpectra
) -> tuple[str, ...]:
    count = int(np.count_nonzero(excited & ~solution.solvable))
    if count == 0:
        return ()
    remedy = (
        "references that repeat together take as many different experiments as there are references"
        if spectra.noise_density is not None
        else "excite them independently, or name one of them"
    )
    return (f"on {count} of {excited.size} lines {', '.join(names)} can't be told apart; masked: {remedy}",)
