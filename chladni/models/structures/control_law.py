"""A controller's law as equations.

::

    x' = A x + Br (r, r') + By (y, y')
    u  = C x + Dr (r, r') + Dy (y, y')
"""

from dataclasses import dataclass

import numpy as np

from chladni.models.structures.controller import FILTER, Controller
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlLaw:
    """Matrices as in the module's equations; ``[.., 2]`` for a signal and its rate."""

    a: Real
    b_reference: Real
    b_feedback: Real
    c: Real
    d_reference: Real
    d_feedback: Real
    states: tuple[str, ...]

    @property
    def uses_reference_rate(self) -> bool:
        """Whether r' acts."""
        return bool(np.any(self.d_reference[1]) or np.any(self.b_reference[:, 1]))

    @property
    def uses_feedback_rate(self) -> bool:
        """Whether y' acts."""
        return bool(np.any(self.d_feedback[1]) or np.any(self.b_feedback[:, 1]))


def control_law(controller: Controller) -> ControlLaw:
    """Give the equations of a controller, before gain and limit."""
    if controller.law == "transfer-function":
        return _transfer_function(controller)
    gains = controller.gains
    # p-p is a proportional law inside, whose command is the reference of a velocity loop.
    outer = gains["kv"] if controller.law == "p-p" else 1.0
    law = _Law(controller.name)
    law.error(outer * gains["kp"])
    if "ki" in gains:
        law.integral(gains["ki"])
    if "kd" in gains or "kv" in gains:
        law.rate(gains.get("kd", gains.get("kv", 0.0)), gains.get(FILTER), of=controller.rate_of)
    return law.equations()


class _Law:
    """Adds up the terms of a law."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._direct = np.zeros((2, 2))  # of reference and feedback: (signal, rate)
        self._states: list[tuple[str, float, Real, float]] = []  # name, pole, input as `_direct`, gain

    def error(self, gain: float) -> None:
        # Rows are reference and feedback: the error counts one up and the other down.
        self._direct += gain * np.array([[1.0, 0.0], [-1.0, 0.0]])

    def integral(self, gain: float) -> None:
        self._states.append(("integral", 0.0, np.array([[1.0, 0.0], [-1.0, 0.0]]), gain))

    def rate(self, gain: float, filter_s: float | None, *, of: str) -> None:
        # Fed back alone, a step of the reference gives no impulse.
        signal = np.array([1.0 if of == "error" else 0.0, -1.0])
        if filter_s is None:
            self._direct[:, 1] += gain * signal
            return
        # s/(T s + 1) = (1 - 1/(T s + 1))/T: the signal minus what a lag lets through.
        lagged = np.stack([signal / filter_s, np.zeros(2)], axis=1)
        self._direct[:, 0] += gain / filter_s * signal
        self._states.append(("filter", -1.0 / filter_s, lagged, -gain / filter_s))

    def equations(self) -> ControlLaw:
        count = len(self._states)
        driven = np.array([signal for _, _, signal, _ in self._states]).reshape(count, 2, 2)
        return ControlLaw(
            a=np.diag([pole for _, pole, _, _ in self._states]).reshape(count, count),
            b_reference=driven[:, 0],
            b_feedback=driven[:, 1],
            c=np.array([gain for _, _, _, gain in self._states]),
            d_reference=self._direct[0],
            d_feedback=self._direct[1],
            states=tuple(f"{self._name}.{name}" for name, _, _, _ in self._states),
        )


def _transfer_function(controller: Controller) -> ControlLaw:
    """Controllable canonical form (Ogata, Modern Control Engineering, 5th edition, section 9-2)."""
    # Scaled so that the highest power of s has the coefficient 1, which the form asks for.
    den = np.asarray(controller.den) / controller.den[0]
    num = np.concatenate([np.zeros(den.size - len(controller.num)), controller.num]) / controller.den[0]
    order = den.size - 1
    a = np.eye(order, k=1)
    b = np.zeros((order, 2))
    if order:
        a[-1] = -den[:0:-1]  # lowest power first
        b[-1, 0] = 1.0
    # With as many zeros as poles a part of the error goes straight through; the states hold the rest.
    direct = np.array([num[0], 0.0])
    return ControlLaw(
        a=a,
        b_reference=b,
        b_feedback=-b,
        c=(num[1:] - num[0] * den[1:])[::-1],
        d_reference=direct,
        d_feedback=-direct,
        states=tuple(f"{controller.name}.{place}" for place in range(order)),
    )
