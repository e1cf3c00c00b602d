"""Small systems whose answers are known, and models made of functions, for the tests of analysis."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import control
import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, ModelKind
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Terminal
from chladni.models.core.simulation import Simulation
from chladni.models.core.state_space import StateSpace


def state_space(a, b, c, d=0.0, *, input_unit: str = "N", output_unit: str = "m") -> StateSpace:
    """One input ``u``, outputs ``y`` (or ``y1``, ``y2``, ...)."""
    a, b, c = np.atleast_2d(a).astype(float), np.asarray(b, float).reshape(-1, 1), np.atleast_2d(c).astype(float)
    rows = len(c)
    names = ["y"] if rows == 1 else [f"y{row + 1}" for row in range(rows)]
    return StateSpace(
        a=a,
        b=b,
        c=c,
        d=np.broadcast_to(np.asarray(d, float).reshape(-1, 1), (rows, 1)).copy(),
        inputs=(Terminal(name="u", unit=input_unit),),
        outputs=tuple(Terminal(name=name, unit=output_unit) for name in names),
        states=tuple(f"x{place}" for place in range(len(a))),
    )


def gain_only(gain: float) -> StateSpace:
    return StateSpace(
        a=np.zeros((0, 0)),
        b=np.zeros((0, 1)),
        c=np.zeros((1, 0)),
        d=np.array([[gain]]),
        inputs=(Terminal(name="u", unit="1"),),
        outputs=(Terminal(name="y", unit="1"),),
        states=(),
    )


def of_control(system, **units: str) -> StateSpace:
    system = control.ss(system)
    return state_space(system.A, system.B, system.C, system.D, **units)


def pt2(omega: float, zeta: float, gain: float = 1.0, **units: str) -> StateSpace:
    """``gain omega^2/(s^2 + 2 zeta omega s + omega^2)``; position and rate as states."""
    return state_space([[0, 1], [-(omega**2), -2 * zeta * omega]], [0, gain * omega**2], [1, 0], **units)


def random_stable(order: int, seed: int, **units: str) -> StateSpace:
    rng = np.random.default_rng(seed)
    a = rng.standard_normal((order, order))
    a -= (np.linalg.eigvals(a).real.max() + 0.3) * np.eye(order)
    return state_space(a, rng.standard_normal(order), rng.standard_normal(order), **units)


def compiled(system: StateSpace, **changes: object) -> CompiledModel:
    """A compiled model without ports."""
    n, m, p = len(system.states), len(system.inputs), len(system.outputs)
    plain = CompiledModel(
        a=system.a, b=system.b, c=system.c, d=system.d, g=np.zeros((n, 0)), h=np.zeros((p, 0)),
        displacement_state=np.zeros((0, n)), displacement_column=np.zeros((0, m)), displacement_port=np.zeros((0, 0)),
        velocity_state=np.zeros((0, n)), velocity_column=np.zeros((0, m)), velocity_port=np.zeros((0, 0)),
        inputs=system.inputs, outputs=system.outputs, states=system.states, ports=(),
    )  # fmt: skip
    return replace(plain, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class FunctionModel:
    """A model whose equations are a function of its parameters."""

    parameters: Parameters
    equations: Callable[[Mapping[str, float]], CompiledModel]
    name: str = "made"
    kind: ModelKind = "drive"
    effects: Sequence[Effect] = ()
    said: tuple[str, ...] = field(default=())

    def with_values(self, values: Mapping[str, float]) -> Self:
        return replace(self, parameters=self.parameters.with_values(values))

    def with_effects(self, effects: Sequence[Effect]) -> Self:
        return replace(self, effects=tuple(effects))

    def compile(self) -> CompiledModel:
        return self.equations(self.parameters.numbers())

    def flags(self, simulation: Simulation) -> tuple[str, ...]:
        return self.said if simulation.inputs.samples else ()


def parameter(name: str, value: float, *, low: float = 0.1, high: float = 10.0, **more: object) -> Parameter:
    return Parameter(name=name, value=value, low=low, high=high, **more)  # type: ignore[arg-type]


def oscillator(mass: float = 1.0, damping: float = 0.4, stiffness: float = 4.0, **units: str) -> FunctionModel:
    """A mass on a spring and a damper, pushed; parameters m, c, k."""

    def equations(values: Mapping[str, float]) -> CompiledModel:
        m, c, k = values["m"], values["c"], values["k"]
        return compiled(state_space([[0, 1], [-k / m, -c / m]], [0, 1 / m], [1, 0], **units))

    return FunctionModel(
        parameters=Parameters(
            (
                parameter("m", mass, minimum=1e-6),
                parameter("c", damping, minimum=0.0),
                parameter("k", stiffness, minimum=0.0),
            )
        ),
        equations=equations,
    )
