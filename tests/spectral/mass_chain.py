"""Chains of one to five masses between springs and dampers: frequency responses in closed form, exact simulation."""

import numpy as np
from scipy.linalg import expm


class MassChain:
    """Equal masses, ground - k - m - k - m ... with a force on the first mass; output: accelerations."""

    def __init__(self, masses, *, mass=2.0, stiffness=4e4, damping=6.0):
        self.count = masses
        self.mass = mass * np.eye(masses)
        tie = 2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
        tie[-1, -1] = 1
        self.stiffness, self.damping = stiffness * tie, damping * tie

    def accelerance(self, frequency_hz):
        """``[mass, frequency]`` acceleration over force, from the equation of motion at each frequency."""
        s = 2j * np.pi * np.asarray(frequency_hz)[:, None, None]
        dynamic = self.mass * s**2 + self.damping * s + self.stiffness
        force = np.zeros((self.count, 1))
        force[0] = 1
        return (s**2 * np.linalg.solve(dynamic, np.broadcast_to(force, (len(s), self.count, 1))))[:, :, 0].T

    def discrete(self, rate_hz):
        """State space for a force that is constant between samples (zero-order hold), exact at the samples."""
        n = self.count
        inverse = np.linalg.inv(self.mass)
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.stiffness, -inverse @ self.damping]])
        b = np.concatenate([np.zeros((n, 1)), inverse[:, :1]])
        c, d = a[n:], b[n:]
        step = expm(np.block([[a, b], [np.zeros((1, 2 * n + 1))]]) / rate_hz)
        return step[: 2 * n, : 2 * n], step[: 2 * n, 2 * n :], c, d

    def discrete_response(self, frequency_hz, rate_hz):
        """``[mass, frequency]`` of the sampled system, which differs from the continuous by the hold."""
        a, b, c, d = self.discrete(rate_hz)
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) / rate_hz)[:, None, None]
        states = np.linalg.solve(z * np.eye(len(a)) - a, np.broadcast_to(b, (len(z), *b.shape)))
        return (c @ states + d)[:, :, 0].T

    def respond(self, force, rate_hz):
        """``[mass, sample]`` accelerations, starting at rest."""
        a, b, c, d = self.discrete(rate_hz)
        state, output = np.zeros(len(a)), np.empty((self.count, force.size))
        for sample, value in enumerate(force):
            output[:, sample] = c @ state + d[:, 0] * value
            state = a @ state + b[:, 0] * value
        return output
