"""Force of a magnetorheological damper: the modified Bouc-Wen law (equation 5), and one with two more regimes.

Both are written in w = x - y, how far the inner element is stretched, instead of y: w stays small while the rod
travels, nothing cancels, and the law can act at any joint, where only d = x and s = x' of two bodies are known.
"""

from math import exp, tanh
from typing import Any

#: Order of the numbers that `modified_bouc_wen` reads; the last bounds abs(z) in steps that are thrown away.
PAPER_ORDER = ("alpha", "c0", "c1", "k0", "k1", "x0", "beta", "gamma", "delta", "n", "z_limit")
#: What `asymmetric_bouc_wen` reads after those.
ASYMMETRY_ORDER = (
    "alpha_sides", "c0_sides", "c1_sides", "k0_sides", "k1_sides",
    "alpha_moving", "c1_moving", "yield_moving", "speed",
)  # fmt: skip


def modified_bouc_wen(d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give ``f = c0 (x' - y') + k0 (x - y) + k1 (x - x0) + alpha z``; states w = x - y and z.

    ::

        y' = (alpha z + c0 x' + k0 (x - y)) / (c0 + c1)   =>   w' = (c1 x' - alpha z - k0 w) / (c0 + c1)
        z' = -gamma |w'| z |z|^(n-1) - beta w' |z|^n + delta w'
    """
    w, z = state[0], state[1]
    alpha, c0, c1, k0 = parameters[0], parameters[1], parameters[2], parameters[3]
    stretch = (c1 * s - alpha * z - k0 * w) / (c0 + c1)
    # A step that the integrator will throw away may leave |z| far outside; a high power must not overflow there.
    size = min(abs(z), parameters[10]) ** parameters[9]
    turned = parameters[7] * abs(stretch) if z >= 0.0 else -parameters[7] * abs(stretch)
    rates[0] = stretch
    rates[1] = parameters[8] * stretch - (turned + parameters[6] * stretch) * size
    return float(c0 * stretch + k0 * w + parameters[4] * (d - parameters[5]) + alpha * z)


def asymmetric_bouc_wen(d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give the force of the law above with coefficients that follow the direction and the speed of the rod.

    ``u = tanh(s/speed)`` runs from -1 (compression) over 0 (at rest) to 1 (extension)::

        alpha -> alpha exp(alpha_sides u + alpha_moving u^2)      c0 -> c0 exp(c0_sides u)
        c1    -> c1 exp(c1_sides u + c1_moving u^2)               k0 -> k0 exp(k0_sides u)
        k1    -> k1 + k1_sides u                                  z' -> z' exp(-yield_moving u^2)
    """
    w, z = state[0], state[1]
    u = tanh(s / parameters[19])
    moving = u * u
    alpha = parameters[0] * exp(parameters[11] * u + parameters[16] * moving)
    c0 = parameters[1] * exp(parameters[12] * u)
    c1 = parameters[2] * exp(parameters[13] * u + parameters[17] * moving)
    k0 = parameters[3] * exp(parameters[14] * u)
    k1 = parameters[4] + parameters[15] * u
    stretch = (c1 * s - alpha * z - k0 * w) / (c0 + c1)
    size = min(abs(z), parameters[10]) ** parameters[9]
    turned = parameters[7] * abs(stretch) if z >= 0.0 else -parameters[7] * abs(stretch)
    rates[0] = stretch
    rates[1] = exp(-parameters[18] * moving) * (parameters[8] * stretch - (turned + parameters[6] * stretch) * size)
    return float(c0 * stretch + k0 * w + k1 * (d - parameters[5]) + alpha * z)
