"""Noise of each sensor as it shows when an unknown force is allowed for."""

import itertools

import numpy as np
from scipy.optimize import nnls

from chladni.gap.calibration import FAINT_WISH, FLOOR_BANDS, HARDLY_ANY, LESS, SAME
from chladni.gap.comparison.whitening import noise_floor_of
from chladni.gap.location.profile import Profile, Projection
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.records.noise_floor import NoiseFloor


def noise_behind(problem: LinearProblem, found: Profile) -> NoiseFloor:
    """Estimate the noise again, under the hypothesis that forces of any shape act at the sites of a profile.

    What is left off the patterns has, in sensor j, the variance ``sum_k |P_jk|^2 s_k^2`` with P the projector off the
    patterns and s_k^2 the noise of sensor k (whitened by the former estimate): a small non-negative least-squares
    problem in each band (minimum norm quadratic unbiased estimation, Rao 1971). A floor is lowered, never raised:
    the estimates before hold distortion that the force explains.
    """
    measurement = problem.measurement
    whole = problem.on(all_lines(measurement.samples, measurement.sample_rate_hz))
    view = whole.view(found.z)
    patterns = [whole.pattern(view, site) for site in found.sites]
    out = Projection(patterns)
    residual = (whole.measured - view.response(found.transient, ())) * whole.weight
    left = np.abs(out.away(residual)[:, 0]) ** 2
    size = len(left)
    spread = np.abs(out.away(np.broadcast_to(np.eye(size)[:, :, None, None], (size, size, 1, left.shape[1])))) ** 2
    edges = np.linspace(0, left.shape[1], FLOOR_BANDS + 1).astype(np.int64)
    factor = np.ones((size, left.shape[1]))
    for low, high in itertools.pairwise(edges):
        matrix = spread[:, :, 0, low:high].mean(axis=2).T
        # A sensor that the patterns take whole says nothing of its noise: a faint wish keeps it as it was.
        wish = FAINT_WISH * np.eye(size)
        found_power = nnls(
            np.vstack([matrix, wish]), np.concatenate([left[:, low:high].mean(axis=1), np.diag(wish)])
        )[0]
        # Few sensors hardly tell whose a residual is: one's a little lower and another's higher would lower both.
        lower = np.where(found_power < LESS, np.maximum(found_power, HARDLY_ANY**2), 1.0)
        factor[:, low:high] = lower[:, None]
    former = problem.noise
    # What no model follows a machine to is in the weight beside the noise, and may be in what is left: no one knows.
    density = np.minimum(factor / whole.weight[:, 0] ** 2, former.density(whole.lines.cycles))
    return noise_floor_of(
        np.pad(density, ((0, 0), (1, 1 - measurement.samples % 2)), mode="edge"),
        samples=measurement.samples,
        freedom=np.full(size, 2.0 * left.shape[1]),
        method=tuple(
            "explained residual" if np.mean(one) < 1 / SAME else old
            for one, old in zip(factor, former.method, strict=True)
        ),
        upper_bound=former.upper_bound,
        scale=np.std(measurement.outputs, axis=1),
    )
