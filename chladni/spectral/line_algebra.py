"""Small linear systems, one for each spectral line, solved together."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Complex, Mask, Real

# References whose normalised matrix is worse conditioned than this are one and the same signal to the last digits
# that an average over noisy segments has.
WORST_CONDITION = 1e8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineSolution:
    """Least-squares answer of the responses to the references.

    Attributes
    ----------
    values
        ``[response, reference, frequency]`` H with G_xy = G_xx H^T; NaN where `solvable` is False.
    explained
        ``[response, frequency]`` power of the response that the references explain; 0 where not solvable.
    inverse
        ``[reference, frequency]`` diagonal of G_xx^-1; infinite where not solvable.
    solvable
        ``[frequency]``; False where the references can't be told apart or have no power.
    """

    values: Complex
    explained: Real
    inverse: Real
    solvable: Mask


def solve_lines(density: Complex, references: list[int], responses: list[int]) -> LineSolution:
    """Solve G_xx H^T = G_xy on each line (Bendat & Piersol 2010, chapter 7).

    Parameters
    ----------
    density
        ``[channel, channel, frequency]``, conj(X_i) X_j.
    references, responses
        Rows of the references and the responses.
    """
    power = np.einsum("iif->fi", density).real[:, references]
    scale = np.sqrt(np.where(power > 0, power, 1.0))
    # Units of the references differ (N, N m, V); with unit power each, the condition means what it says.
    reference = density[np.ix_(references, references)].transpose(2, 0, 1) / (scale[:, :, None] * scale[:, None, :])
    cross = density[np.ix_(references, responses)].transpose(2, 0, 1)
    solvable = _well_conditioned(reference)
    # Any matrix that can be inverted will do: its answer is thrown away.
    reference[~solvable] = np.eye(len(references))
    inverse = np.linalg.inv(reference)
    answer = inverse @ (cross / scale[:, :, None]) / scale[:, :, None]
    explained = np.einsum("fjr,fjr->rf", cross.conj(), answer).real
    diagonal = np.einsum("fii->if", inverse).real / scale.T**2
    return LineSolution(
        values=np.where(solvable, answer.transpose(2, 1, 0), np.nan),
        explained=np.where(solvable, np.maximum(explained, 0.0), 0.0),
        inverse=np.where(solvable, diagonal, np.inf),
        solvable=solvable,
    )


def _well_conditioned(matrices: Complex) -> Mask:
    eigenvalues = np.linalg.eigvalsh(matrices)
    return np.asarray(eigenvalues[:, 0] * WORST_CONDITION > eigenvalues[:, -1])


def conditioned_density(density: Complex, removed: list[int], kept: list[int]) -> Complex:
    """Take out of the `kept` channels what is linearly due to the `removed` ones.

    G_ij.r = G_ij - G_ir G_rr^-1 G_rj (Bendat & Piersol 2010, section 7.3); lines where the removed channels can't be
    told apart, or have no power, keep G_ij.
    """
    solution = solve_lines(density, removed, kept)
    # H^T with a row for each removed channel; NaN lines have nothing to remove.
    due = np.nan_to_num(solution.values).transpose(2, 1, 0)
    cross = density[np.ix_(kept, removed)].transpose(2, 0, 1)
    rest: Complex = density[np.ix_(kept, kept)] - (cross @ due).transpose(1, 2, 0)
    return rest
