"""Radau IIA collocation with three stages: order 5, stiffly accurate (Hairer & Wanner 1996, section IV.5)."""

from math import sqrt

import numpy as np

#: Instants of the stages, as fractions of the step.
NODES = np.array([(4 - sqrt(6)) / 10, (4 + sqrt(6)) / 10, 1.0])
#: ``[power, stage]``: the polynomial of degree 2 through 1 at one node and 0 at the others.
LAGRANGE = np.linalg.inv(np.vander(NODES, increasing=True))
#: ``[stage, stage]``: integral of each of them up to each node.
WEIGHTS = (NODES[:, None] ** np.arange(1, 4) / np.arange(1, 4)) @ LAGRANGE
#: Reciprocal of the real eigenvalue of the inverse of WEIGHTS: the weight of the error estimate.
GAMMA = float(1 / min(np.linalg.eigvals(np.linalg.inv(WEIGHTS)), key=lambda value: abs(value.imag)).real)
