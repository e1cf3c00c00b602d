"""Current, velocity and position loops of a servo drive, and their gains by the textbook's rules."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.drives.limit_law import limit_law
from chladni.models.drives.loop import Loop

VOLTAGE = Terminal(name="voltage", unit="V")
CURRENT_REFERENCE = Terminal(name="current_reference", unit="A")
VELOCITY_REFERENCE = Terminal(name="velocity_reference", unit="rad/s")
POSITION_REFERENCE = Terminal(name="position_reference", unit="rad")
CURRENT = Terminal(name="current", unit="A")
VELOCITY = Terminal(name="velocity", unit="rad/s")
POSITION = Terminal(name="position", unit="rad")

#: Words of the option ``loop``, each with all loops inside it.
LOOPS: Final = ("open", "current", "velocity", "position")

# The defaults are `tuned_gains` of the default motor.
LOOP_PARAMETERS: Final = Parameters(
    (
        Parameter(
            name="current_gain", value=2e-3 / 3e-4, unit="V/A", low=0.5, high=50.0, minimum=0.0, maximum=1e6,
            symbol="K_i", tolerance=0.0, meaning="proportional gain of the current's PI",
        ),
        Parameter(
            name="current_time", value=2e-3, unit="s", low=2e-4, high=2e-2, minimum=1e-7, maximum=1e3, symbol="T_i",
            shown_unit="ms", tolerance=0.0, meaning="integral time of the current's PI",
        ),
        Parameter(
            name="velocity_gain", value=1e-4 / (2 * 0.1 * 3e-4), unit="A s/rad", low=0.05, high=20.0, minimum=0.0,
            maximum=1e6, symbol="K_v", tolerance=0.0, meaning="proportional gain of the velocity's PI",
        ),
        Parameter(
            name="velocity_time", value=1.2e-3, unit="s", low=5e-4, high=1e-1, minimum=1e-7, maximum=1e3,
            symbol="T_v", shown_unit="ms", tolerance=0.0, meaning="integral time of the velocity's PI",
        ),
        # At 0 the closed loop has no zero, as with the textbook's filter in front: 8 instead of 43 % overshoot.
        Parameter(
            name="velocity_weight", value=0.0, low=0.0, high=1.0, minimum=0.0, maximum=1.0, symbol="b", tolerance=0.0,
            meaning="how much of a jump of the velocity's reference the proportional part sees",
        ),
        Parameter(
            name="position_gain", value=1 / (16 * 3e-4), unit="1/s", low=5.0, high=500.0, minimum=0.0, maximum=1e6,
            symbol="K_p", tolerance=0.0, meaning="velocity for a unit of position error",
        ),
        # Saves the motor's magnets; the voltage limit saves nothing, it's what there is.
        Parameter(
            name="current_limit", value=20.0, unit="A", low=2.0, high=50.0, minimum=1e-6, maximum=1e5, tolerance=0.0,
            role="function", meaning="largest current that the velocity loop asks for",
        ),
    )
)  # fmt: skip

LOOPS_ACT_WITH: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    **dict.fromkeys(("current_gain", "current_time"), ("loop", LOOPS[1:])),
    **dict.fromkeys(("velocity_gain", "velocity_time", "velocity_weight"), ("loop", LOOPS[2:])),
    "position_gain": ("loop", LOOPS[3:]),
    "current_limit": ("current_limiter", ("on",)),
}


def servo_loops(values: Mapping[str, float], options: Mapping[str, str]) -> Sequence[Loop]:
    """Loops that the option ``loop`` closes, the innermost first.

    ::

        voltage            = K_i (e + integral(e)/T_i),               e = current_reference - current
        current_reference  = K_v (b r - velocity + integral(e)/T_v),  e = r - velocity, r = velocity_reference
        velocity_reference = K_p (position_reference - position)
    """
    makers = (_current_loop, _velocity_loop, _position_loop)
    return [make(values, options) for make in makers[: LOOPS.index(options["loop"])]]


def tuned_gains(values: Mapping[str, float], *, inertia: float) -> dict[str, float]:
    """Gains by the textbook's rules, for a current loop whose lags sum up to the converter's time T.

    ::

        current    magnitude optimum    K_i = L/(2 T)             T_i = L/R          closed: T_c = 2 T
        velocity   symmetrical optimum  K_v = J/(2 K_t T_c)       T_v = 4 T_c        b = 0 for its filter
        position   no overshoot         K_p = 1/(4 T_v)

    Kessler's rules (Regelungstechnik 1955 and 1958), as in Leonhard, Control of Electrical Drives, and Schröder,
    Elektrische Antriebe - Regelung von Antriebssystemen. The back-EMF is taken for slow, as there.

    Parameters
    ----------
    values
        Parameters of the drive, SI; those of the loops aren't read.
    inertia
        All of it at the shaft, kg m^2.

    Examples
    --------
    >>> motor = {"resistance": 1.0, "inductance": 2e-3, "torque_constant": 0.1, "converter_time": 1.5e-4}
    >>> round(tuned_gains(motor, inertia=1e-4)["position_gain"], 3)
    208.333
    """
    # Time constant of the closed current loop, and of the filter that the velocity loop needs.
    current_s = 2 * values["converter_time"]
    velocity_s = 4 * current_s
    return {
        "current_gain": values["inductance"] / current_s,
        "current_time": values["inductance"] / values["resistance"],
        "velocity_gain": inertia / (2 * values["torque_constant"] * current_s),
        "velocity_time": velocity_s,
        "velocity_weight": 0.0,
        "position_gain": 1 / (4 * velocity_s),
    }


def _current_loop(values: Mapping[str, float], _options: Mapping[str, str]) -> Loop:
    return _pi_loop(
        CURRENT_REFERENCE, CURRENT, VOLTAGE, gain=values["current_gain"], time_s=values["current_time"], weight=1.0
    )


def _velocity_loop(values: Mapping[str, float], options: Mapping[str, str]) -> Loop:
    limit = limit_law(limit=values["current_limit"]) if options["current_limiter"] == "on" else None
    loop = _pi_loop(
        VELOCITY_REFERENCE,
        VELOCITY,
        CURRENT_REFERENCE,
        gain=values["velocity_gain"],
        time_s=values["velocity_time"],
        weight=values["velocity_weight"],
    )
    return replace(loop, limit=limit)


def _position_loop(values: Mapping[str, float], _options: Mapping[str, str]) -> Loop:
    gain = values["position_gain"]
    # No integral: the way from velocity to position integrates already.
    controller = StateSpace(
        a=np.zeros((0, 0)),
        b=np.zeros((0, 2)),
        c=np.zeros((1, 0)),
        d=np.array([[gain, -gain]]),
        inputs=(POSITION_REFERENCE, POSITION),
        outputs=(VELOCITY_REFERENCE,),
        states=(),
    )
    return Loop(controller=controller)


def _pi_loop(
    reference: Terminal, measured: Terminal, command: Terminal, *, gain: float, time_s: float, weight: float
) -> Loop:
    """PI with a weighted reference; its state is the integral part of the command.

    What a limit takes off the command drives the integral back within T_i (Åström and Hägglund, PID Controllers,
    1995, section 3.5: back-calculation).
    """
    # With the gain in the state's rate, the state is a command: what a limit takes away has its unit.
    rate = gain / time_s
    controller = StateSpace(
        a=np.zeros((1, 1)),
        b=np.array([[rate, -rate]]),
        c=np.ones((1, 1)),
        d=np.array([[weight * gain, -gain]]),
        inputs=(reference, measured),
        outputs=(command,),
        states=(f"{measured.name}_integral",),
    )
    return Loop(controller=controller, tracking=(1 / time_s,))
