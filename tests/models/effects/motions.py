"""Laws driven by a given motion: forces, and the energy that a cycle takes."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port_law import PortLaw
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real


def law_of(effect: AttachedEffect, compiled: CompiledModel) -> PortLaw:
    """The law that the effect adds to a model."""
    return effect.attach(compiled).laws[-1]


def force(law: PortLaw, d: float = 0.0, s: float = 0.0, t: float = 0.0) -> float:
    """Force of a law without states of its own."""
    return law.function(d, s, t, law.parameters, (), [])


def driven(law: PortLaw, d: Callable[[Real], Real], s: Callable[[Real], Real], times_s: Real) -> Real:
    """Force along a prescribed motion; the law's states by SciPy's Radau."""
    states = np.zeros((0, times_s.size))

    def rates(t: float, state: Real) -> list[float]:
        found = [0.0] * len(law.state)
        law.function(float(d(np.float64(t))), float(s(np.float64(t))), t, law.parameters, list(state), found)
        return found

    if law.state:
        span = (float(times_s[0]), float(times_s[-1]))
        solved = solve_ivp(
            rates, span, law.state, method="LSODA", t_eval=times_s, rtol=1e-9, atol=1e-11, max_step=span[1] / 200
        )
        states = solved.y
    return np.array(
        [
            law.function(float(d(t)), float(s(t)), t, law.parameters, list(states[:, place]), [0.0] * len(law.state))
            for place, t in enumerate(times_s)
        ]
    )


def loop(law: PortLaw, amplitude: float, omega: float, samples: int = 4001) -> tuple[Real, Real]:
    """Displacement and force over the second cycle of ``d = amplitude sin(omega t)``."""
    period = 2 * np.pi / omega
    times_s = np.linspace(0, 2 * period, 2 * samples - 1)
    found = driven(
        law, lambda t: amplitude * np.sin(omega * t), lambda t: amplitude * omega * np.cos(omega * t), times_s
    )
    return amplitude * np.sin(omega * times_s[samples - 1 :]), found[samples - 1 :]


def energy(d: Real, f: Real) -> float:
    """What a closed loop takes."""
    return float(np.trapezoid(f, d))
