"""Small compiled models and laws whose behaviour is known."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.structures.structure import GROUND, Body, Joint, Structure
from chladni.signals.arrays import Real


def oscillator(*, mass=1.0, frequency_hz=10.0, damping=1.0):
    """One body on a spring and a damper."""
    stiffness = mass * (2 * math.pi * frequency_hz) ** 2
    return Structure(
        bodies=(Body(name="body", mass=mass),),
        joints=(Joint(name="joint", between=(GROUND, "body"), stiffness=stiffness, damping=damping),),
    )


def compiled_structure(structure: Structure, *, force_at: str, laws=(), **changes) -> CompiledModel:
    """States: displacements, then velocities; outputs: displacements, velocities, accelerations; ports: joints."""
    mass, n = np.linalg.inv(structure.mass_matrix()), len(structure.bodies)
    pattern = np.zeros((len(structure.joints), n))
    for row, joint in enumerate(structure.joints):
        for end, sign in zip(joint.between, (-1.0, 1.0), strict=True):
            if end != GROUND:
                pattern[row, structure.body_index(end)] = sign
    a = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-mass @ structure.stiffness_matrix(), -mass @ structure.damping_matrix()],
        ]
    )
    b = np.vstack([np.zeros((n, 1)), mass[:, [structure.body_index(force_at)]]])
    g = np.vstack([np.zeros_like(pattern.T), -mass @ pattern.T])
    ports, zero = len(pattern), np.zeros_like(pattern)
    names = [body.name for body in structure.bodies]
    parts = {
        "a": a,
        "b": b,
        "c": np.vstack([np.eye(2 * n), a[n:]]),
        "d": np.vstack([np.zeros((2 * n, 1)), b[n:]]),
        "g": g,
        "h": np.vstack([np.zeros((2 * n, ports)), g[n:]]),
        "displacement_state": np.hstack([pattern, zero]),
        "displacement_column": np.zeros((ports, 1)),
        "displacement_port": np.zeros((ports, ports)),
        "velocity_state": np.hstack([zero, pattern]),
        "velocity_column": np.zeros((ports, 1)),
        "velocity_port": np.zeros((ports, ports)),
        "inputs": (Terminal(name="force", unit="N", channel="/force"),),
        "outputs": tuple(
            Terminal(name=f"{what}_{name}", unit=unit)
            for what, unit in (("displacement", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2"))
            for name in names
        ),
        "states": tuple(f"{what}_{name}" for what in ("x", "v") for name in names),
        "ports": tuple(Port(name=joint.name, kind="joint") for joint in structure.joints),
        "laws": tuple(laws),
    }
    return CompiledModel(**(parts | changes))


def plain_model(a, b, c, d, *, g=None, h=None, motion=None, laws=(), kind="input", **changes) -> CompiledModel:
    """Model of matrices; `motion` is ``(Pd, Qd, Rd)`` of its ports, whose velocity is 0."""
    a, b, c, d = (np.atleast_2d(np.asarray(each, dtype=float)) for each in (a, b, c, d))
    n, m, p = a.shape[0] if a.size else 0, b.shape[1], c.shape[0]
    ports = 0 if motion is None else np.atleast_2d(motion[0]).shape[0]
    shapes = ((ports, n), (ports, m), (ports, ports))
    pd, qd, rd = (
        np.zeros(shape) if motion is None else np.reshape(np.asarray(each, dtype=float), shape)
        for each, shape in zip(motion or (0, 0, 0), shapes, strict=True)
    )
    parts = {
        "a": a.reshape(n, n), "b": b.reshape(n, m), "c": c.reshape(p, n), "d": d,
        "g": np.zeros((n, ports)) if g is None else np.reshape(np.asarray(g, dtype=float), (n, ports)),
        "h": np.zeros((p, ports)) if h is None else np.reshape(np.asarray(h, dtype=float), (p, ports)),
        "displacement_state": pd, "displacement_column": qd, "displacement_port": rd,
        "velocity_state": np.zeros((ports, n)), "velocity_column": np.zeros((ports, m)),
        "velocity_port": np.zeros((ports, ports)),
        "inputs": tuple(Terminal(name=f"u{place}", unit="N") for place in range(m)),
        "outputs": tuple(Terminal(name=f"y{place}", unit="m") for place in range(p)),
        "states": tuple(f"x{place}" for place in range(n)),
        "ports": tuple(Port(name=f"p{place}", kind=kind) for place in range(ports)),
        "laws": tuple(laws),
    }  # fmt: skip
    return CompiledModel(**(parts | changes))


def reference_states(compiled: CompiledModel, signals: Real, rate_hz: float, **options) -> Real:
    """``[state, sample]`` by SciPy, from the same laws called as Python."""
    n, times = len(compiled.states), np.arange(signals.shape[1]) / rate_hz
    starts = np.cumsum([n, *(len(law.state) for law in compiled.laws)])

    def rates(t, y):
        u = np.array([np.interp(t, times, row) for row in signals])
        force, law_rates = np.zeros(len(compiled.ports)), np.zeros(len(y) - n)
        d, s = compiled.displacement_state @ y[:n], compiled.velocity_state @ y[:n]
        for law, begin, end in zip(compiled.laws, starts[:-1], starts[1:], strict=True):
            force[law.port] += law.function(
                d[law.port], s[law.port], t, law.parameters, y[begin:end], law_rates[begin - n : end - n]
            )
        return np.concatenate([compiled.a @ y[:n] + compiled.b @ u + compiled.g @ force, law_rates])

    start = np.concatenate([np.zeros(n), *(law.state for law in compiled.laws)])
    chosen = {"method": "Radau", "rtol": 1e-10, "atol": 1e-14, "max_step": 1 / rate_hz} | options
    found = solve_ivp(rates, (0, times[-1]), start, t_eval=times, **chosen)
    assert found.success
    return found.y[:n]


def relative_rms(found: Real, truth: Real) -> float:
    """Largest over the rows."""
    return float(np.max(np.sqrt(np.mean((found - truth) ** 2, axis=1) / np.mean(truth**2, axis=1))))


def refined(signals: Real, times: int) -> Real:
    """The same straight lines, sampled `times` as fast."""
    count = signals.shape[1]
    return np.array([np.interp(np.arange((count - 1) * times + 1) / times, np.arange(count), row) for row in signals])


def cubic(d, s, t, parameters, state, rates):
    return parameters[0] * d * d * d


def quadratic_damping(d, s, t, parameters, state, rates):
    return parameters[0] * s * abs(s)


def bouc_wen(d, s, t, parameters, state, rates):
    force, displacement, n = parameters[0], parameters[1], parameters[2]
    z = state[0]
    same = 1.0 if s * z >= 0.0 else 0.0
    rates[0] = s / displacement * (1.0 - abs(z) ** n * same)
    return force * z


def smooth_hysteresis(d, s, t, parameters, state, rates):
    """Memory without a kink: the Duhem form with s^2/(s^2 + w^2) in place of the sign."""
    z = state[0]
    rates[0] = s / parameters[1] - math.sqrt(s * s + parameters[2] ** 2) / parameters[1] * z * z * z
    return parameters[0] * z


def coulomb(d, s, t, parameters, state, rates):
    return parameters[0] * math.tanh(s / parameters[1])


def stribeck(d, s, t, parameters, state, rates):
    level = parameters[0] + (parameters[1] - parameters[0]) * math.exp(-((s / parameters[2]) ** 2))
    return level * math.tanh(s / parameters[3])


def backlash(d, s, t, parameters, state, rates):
    stiffness, half = parameters[0], 0.5 * parameters[1]
    if d > half:
        return -stiffness * half
    if d < -half:
        return stiffness * half
    return -stiffness * d


def one_sided_stop(d, s, t, parameters, state, rates):
    return parameters[0] * (d - parameters[1]) if d > parameters[1] else 0.0


def saturation(d, s, t, parameters, state, rates):
    limit = parameters[0]
    return (limit if d > limit else (max(d, -limit))) - d


def law(port, function, *parameters, state=()):
    return PortLaw(port=port, function=function, parameters=parameters, state=state)
