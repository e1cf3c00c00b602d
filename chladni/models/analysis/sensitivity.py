"""Exact derivatives of behaviour to a parameter, by the tangent of a linear path."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.models.analysis.behaviour import Behaviour
from chladni.models.analysis.exponential import exponential
from chladni.models.analysis.frequency_behaviour import FrequencyBehaviour
from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.resolvent import Resolvent
from chladni.models.analysis.step_behaviour import SETTLING_BAND, StepMarks
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class Tangent:
    """How a path changes with a parameter, per relative change of it.

    The derivative of a response is the response of a system of twice the size::

        d/dt [dx; x] = [A dA; 0 A] [dx; x] + [db; b] u,   dy = [c dc] [dx; x] + dd u

    so that steps, final values and frequency responses are differentiated by what computes them.

    Attributes
    ----------
    path
        That system.
    read
        The same of the reading in time (the output or its rate).
    dead_time_s
        Change of the dead time.
    """

    path: LinearPath
    read: LinearPath
    dead_time_s: float


def tangent(nominal: Behaviour, change: Real, dead_time_s: float) -> Tangent:
    """Make the tangent from the change of ``[A b; c d]`` of the path's own states.

    Parameters
    ----------
    nominal
        Behaviour at the operating point.
    change
        ``[state + 1, state + 1]``, per relative change of the parameter.
    dead_time_s
        Likewise.
    """
    doubled = _doubled(nominal.path, change)
    return Tangent(path=doubled, read=_read(doubled, nominal.step.rates), dead_time_s=dead_time_s)


def _read(doubled: LinearPath, rates: int) -> LinearPath:
    """Go from the output of the doubled system to the reading, by the same steps as for the system itself."""
    read = doubled
    for _ in range(abs(rates)):
        # Rates and integrals of a response are linear in it, and so of its derivative to a parameter as well.
        read = _rate(read) if rates > 0 else read.integral()
    return read


def _rate(read: LinearPath) -> LinearPath:
    # Without the states that only the output itself saw: an integrator there would leave no final value.
    further = read.rate()
    if further is None:
        raise ModelError("the response jumps for other values of the parameter; it has no derivative here")
    return further


def log_derivatives(nominal: Behaviour, moved: Tangent, *, band: float = SETTLING_BAND) -> dict[str, float]:
    """Give ``d ln(behaviour)/d ln(parameter)`` of each behaviour parameter that exists at the operating point.

    Where something happens at a place x (a time, a frequency) at which a condition is zero, implicit differentiation
    gives ``dx = -d(condition)/(d condition/dx)``.
    """
    # Frequency and poles have derivatives for what never settles, too.
    found = {**_frequency(nominal, moved), **_errors(nominal, moved)}
    if not nominal.step.missing:
        found |= _StepDerivatives(nominal.step, moved, band).all(float(nominal.path.dead_time_s[0]))
    return found


class _StepDerivatives:
    """Derivatives of what happens after a step."""

    def __init__(self, marks: StepMarks, moved: Tangent, band: float) -> None:
        self._marks, self._moved, self._band = marks, moved, band
        read, count = moved.read, moved.read.b.size
        self._generator = np.zeros((count + 1, count + 1))
        self._generator[:count, :count], self._generator[:count, count] = read.a, read.b
        self._row = np.append(read.c[0], read.d[0])
        self._final = read.final_value()

    def all(self, dead_time_s: float) -> dict[str, float]:
        """Give the logarithmic derivatives of all that exist; times begin `dead_time_s` before the response."""
        marks, found, delayed = self._marks, {}, self._moved.dead_time_s
        for name, at in (("answer_time", marks.answer), ("peak_time", marks.top)):
            # What happens at the step itself has no time that could change.
            if at:
                found[name] = (self._time(at, 1, 0.0) + delayed) / (at + dead_time_s)
        if marks.fastest is not None:
            found |= self._acceleration(marks.fastest, dead_time_s)
        if marks.settled:
            side = np.sign((self._signal(marks.settled) - marks.final) / marks.final)
            moved = self._time(marks.settled, 0, 1 + side * self._band)
            found["settling_time"] = (moved + delayed) / (marks.settled + dead_time_s)
        if marks.begun is not None and marks.nearly is not None:
            moved = self._time(marks.nearly, 0, 0.9) - self._time(marks.begun, 0, 0.1)
            found["rise_time"] = moved / (marks.nearly - marks.begun)
        if marks.top is not None:
            # At a peak the shift of its time counts for nothing.
            top = self._signal(marks.top)
            found["overshoot"] = (self._change(marks.top) - top / marks.final * self._final) / (top - marks.final)
        if marks.final:
            found["final_value"] = self._final / marks.final
        return found

    def _acceleration(self, at: float, dead_time_s: float) -> dict[str, float]:
        order = self._marks.acceleration_rates() or 0
        found = {"peak_acceleration": self._change(at, order) / self._signal(at, order)}
        if at > 0:
            moved = self._time(at, order + 1, 0.0) + self._moved.dead_time_s
            found["acceleration_time"] = moved / (at + dead_time_s)
        return found

    def _time(self, at: float, order: int, level: float) -> float:
        """Change of the time at which a rate of the reading passes `level` times the final value."""
        away = self._change(at, order) - level * self._final
        return -away / self._signal(at, order + 1)

    def _signal(self, at: float, order: int = 0) -> float:
        return float(self._marks.row(order) @ self._marks.motion.at(at))

    def _change(self, at: float, order: int = 0) -> float:
        state = exponential(self._generator * at)[:, -1]
        for _ in range(order):
            state = self._generator @ state
        return float(self._row @ state)


def _frequency(nominal: Behaviour, moved: Tangent) -> dict[str, float]:
    found, path = nominal.frequency, nominal.path
    here, there = Resolvent(path), Resolvent(moved.path)
    result = _pair(found, path, moved)
    delay = float(path.dead_time_s[0])
    if found.critical is not None:
        value, slope, _ = here.derivatives(found.critical)
        change, _, _ = there.derivatives(found.critical)
        turned = (change / value).imag - found.critical * moved.dead_time_s
        result["critical_frequency"] = -turned / ((slope / value).imag - delay) / found.critical
    if found.bandwidth is not None:
        value, slope, _ = here.derivatives(found.bandwidth)
        change, _, _ = there.derivatives(found.bandwidth)
        fallen = (change / value).real - moved.path.final_value() / path.final_value()
        result["bandwidth"] = -fallen / (slope / value).real / found.bandwidth
    if found.peak is not None:
        result["peak_frequency"] = _peak(found.peak[0], here, there)
    return result


def _peak(omega: float, here: Resolvent, there: Resolvent) -> float:
    """At the peak Re(H'/H) = 0, the slope of ln|H|."""
    value, slope, curve = here.derivatives(omega)
    change, slope_change, _ = there.derivatives(omega)
    tilted = (slope_change / value - slope * change / value**2).real
    return -tilted / (curve / value - (slope / value) ** 2).real / omega


def _pair(found: FrequencyBehaviour, path: LinearPath, moved: Tangent) -> dict[str, float]:
    """Change of an eigenvalue: w^H dA v/(w^H v) with its left and right eigenvectors (Lancaster 1964)."""
    if found.pair is None:
        return {}
    count = path.b.size
    w, v = (_eigenvector(matrix, found.pair) for matrix in (path.a.T, path.a))
    change = complex(w @ moved.path.a[:count, count:] @ v / (w @ v))
    relative = change / found.pair
    # With p = |p| e^{j theta}: d ln|p| is the real part of dp/p, d theta the imaginary, and cos(theta) = -zeta.
    damping = -found.pair.real / abs(found.pair)
    result = {"resonance_frequency": change.imag / found.pair.imag}
    if damping:
        result["damping_ratio"] = float(np.sqrt(1 - damping**2) / damping * relative.imag)
    return result


def _eigenvector(matrix: Real, pole: complex) -> Complex:
    poles, vectors = np.linalg.eig(matrix)
    return np.asarray(vectors[:, int(np.argmin(np.abs(poles - pole)))], dtype=np.complex128)


def _errors(nominal: Behaviour, moved: Tangent) -> dict[str, float]:
    result = {}
    lag, stays = nominal.value("tracking_error"), nominal.value("steady_state_error")
    if lag:
        doubled = moved.path
        twice = np.linalg.solve(doubled.a, np.linalg.solve(doubled.a, doubled.b))
        result["tracking_error"] = float(doubled.c[0] @ twice + moved.dead_time_s) / lag
    if stays and not nominal.step.rates:
        result["steady_state_error"] = -moved.path.final_value() / (1 - nominal.step.final)
    return result


def _doubled(path: LinearPath, change: Real) -> LinearPath:
    count = path.b.size
    zero = np.zeros((count, count))
    return replace(
        path,
        a=np.block([[path.a, change[:count, :count]], [zero, path.a]]),
        b=np.concatenate([change[:count, count], path.b]),
        c=np.concatenate([path.c, change[count:, :count]], axis=1),
        d=change[count:, count],
        poles=np.concatenate([path.poles, path.poles]),
        dead_time_s=np.zeros(1),
        kept=np.concatenate([path.kept, path.kept]),
        scale=np.concatenate([path.scale, path.scale]),
    )
