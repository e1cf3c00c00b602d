"""Which tuned parameters a log tells together only."""

import numpy as np

from chladni.gap.calibration import ZERO
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.diagnosis import Correlation
from chladni.gap.tuning.output_error import OutputErrorFit


def correlation_of(tunables: Tunables, fit: OutputErrorFit) -> Correlation | None:
    """Correlate the errors of the tuned parameters, those that the fit's effects leave free with them.

    ``r_ij = C_ij / sqrt(C_ii C_jj)`` with C the covariance of the logarithms over the tolerances, log and tolerances
    taken together; to first order that of the values too.

    Returns
    -------
    Correlation or None
        None where nothing was tuned.
    """
    count = len(tunables.names)
    if not np.any(fit.parameter_std):
        return None
    covariance = fit.covariance[:count, :count]
    std = np.sqrt(np.maximum(np.diag(covariance), ZERO))
    matrix = np.clip(covariance / std[:, None] / std, -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return Correlation(names=tunables.names, matrix=matrix)
