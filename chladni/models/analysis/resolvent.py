"""Frequency response of a linear path at many frequencies, by one Schur decomposition."""

import numpy as np
from scipy.linalg import schur

from chladni.models.analysis.linear_path import LinearPath
from chladni.signals.arrays import Complex, Real


class Resolvent:
    """Evaluates ``H(j omega) = c (j omega I - A)^-1 b + d`` of a path to one output.

    With ``A = Q T Q^H``, T upper triangular, each frequency takes a back substitution, done for all frequencies at
    once (Laub 1981, with the complex Schur form in place of Hessenberg's).

    Parameters
    ----------
    path
        To one output.
    """

    def __init__(self, path: LinearPath) -> None:
        self._path = path
        triangle, basis = schur(path.a, output="complex") if path.b.size else (np.empty((0, 0)), np.empty((0, 0)))
        self._triangle = np.asarray(triangle, dtype=np.complex128)
        # Rounding errors of integrators would put a corner where there is none.
        diagonal = np.diag(self._triangle).copy()
        if path.integrators() and path.poles.any():
            diagonal[np.abs(diagonal) <= 1e-9 * np.abs(path.poles).max()] = 0
        self._diagonal = diagonal
        self._entry = np.asarray(basis.conj().T @ path.b, dtype=np.complex128)
        self._exit = np.asarray(path.c[0] @ basis, dtype=np.complex128)
        self._minus_a = -path.a.astype(np.complex128)
        if path.exact is not None:
            self._column = path.exact.inputs.index(path.source)
            self._row = path.exact.outputs.index(path.outputs[0])

    def __call__(self, omega: Real) -> Complex:
        """Give H at angular frequencies in rad/s, ``[frequency]``, without the dead time outside of loops."""
        omega = np.atleast_1d(np.asarray(omega, dtype=np.float64))
        if self._path.exact is not None:
            exact = self._path.exact.frequency_response(omega / (2 * np.pi))[self._row, self._column]
            return np.asarray(exact * np.exp(1j * omega * self._path.dead_time_s[0]), dtype=np.complex128)
        return self.at(np.asarray(1j * omega, dtype=np.complex128))

    def at(self, s: Complex) -> Complex:
        """Give H at points s of the complex plane in rad/s, ``[point]``; not with a dead time inside a loop."""
        count = self._diagonal.size
        # An undamped pole to the last digit; beside it the response is finite.
        s = np.where(np.isin(s, self._diagonal), s.real + 1j * np.nextafter(s.imag, np.inf), s)
        solved = np.empty((count, s.size), dtype=np.complex128)
        for row in range(count - 1, -1, -1):
            coupled = self._triangle[row, row + 1 :] @ solved[row + 1 :]
            solved[row] = (self._entry[row] + coupled) / (s - self._diagonal[row])
        return np.asarray(self._exit @ solved + self._path.d[0], dtype=np.complex128)

    def value(self, omega: float) -> complex:
        """Give H at one angular frequency, without the dead time outside of loops."""
        path = self._path
        if path.exact is not None:
            return complex(self(np.array([omega]))[0])
        # For one frequency a solution is quicker than a back substitution in Python.
        try:
            solved = np.linalg.solve(self._at(omega), path.b)
        except np.linalg.LinAlgError:
            # An undamped pole to the last digit; beside it the response is finite.
            return self.value(float(np.nextafter(omega, np.inf)))
        return complex(path.c[0] @ solved + path.d[0])

    def derivatives(self, omega: float) -> tuple[complex, complex, complex]:
        """Give H and its first and second derivative to omega, without the dead time outside of loops.

        ::

            H = c R b + d,   H' = -j c R R b,   H'' = -2 c R R R b,   R = (j omega I - A)^-1
        """
        path = self._path
        if path.exact is not None:
            # No closed form through a loop with dead time: central differences, good to 1e-10 and to 1e-6.
            step = 1e-5 * omega
            before, here, after = (complex(value) for value in self(np.array([omega - step, omega, omega + step])))
            return here, (after - before) / (2 * step), (after - 2 * here + before) / step**2
        try:
            inverse = np.linalg.inv(self._at(omega))
        except np.linalg.LinAlgError:
            return self.derivatives(float(np.nextafter(omega, np.inf)))
        left, right = path.c[0] @ inverse, inverse @ path.b
        return complex(left @ path.b + path.d[0]), complex(-1j * (left @ right)), complex(-2 * left @ inverse @ right)

    def _at(self, omega: float) -> Complex:
        """``j omega I - A``."""
        matrix = self._minus_a.copy()
        matrix.flat[:: len(matrix) + 1] += 1j * omega
        return matrix
