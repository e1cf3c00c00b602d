"""Linear hydraulic motor (S2): a piston driven by oil, with servo valve, PD2 correction and position loop."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.equations import compile_equations
from chladni.models.drives.loop import Loop
from chladni.models.drives.pd2 import PD2_PARAMETERS, pd2
from chladni.models.drives.piston import (
    ACCELERATION,
    DISPLACEMENT,
    FLOW,
    LOAD,
    PRESSURE_DROP,
    VELOCITY,
    motion_limits,
    piston_ports,
    piston_rates,
    stop_laws,
)
from chladni.models.drives.servo_valve import VALVE, VALVE_ACTS_WITH, VALVE_PARAMETERS, valve_equations
from chladni.models.drives.validity import Limit

#: Flow into the motor, behind the valve.
MOTOR_FLOW = Terminal(name="motor_flow", unit="m^3/s")
#: Wanted displacement, when the position loop is closed.
REFERENCE = Terminal(name="reference", unit="m")

#: Share of the supply pressure that the load may take: above it a valve gives much less flow than at no load
#: (Merritt, Hydraulic Control Systems, 1967, chapter 5: flow goes with sqrt(1 - p_L/p_s)).
LOADED_SHARE = 2.0 / 3.0

_OWN_PARAMETERS = (
    Parameter(
        name="active_area", value=10e-4, unit="m^2", low=5e-4, high=20e-4, minimum=1e-6, maximum=1.0,
        symbol="A", shown_unit="cm^2", tolerance=0.01, meaning="area of the piston that the pressure acts on",
    ),
    Parameter(
        name="oil_volume", value=100e-6, unit="m^3", low=50e-6, high=300e-6, minimum=1e-9, maximum=1.0,
        symbol="V", shown_unit="cm^3",
        meaning="volume of oil in the flow balance: a quarter of all oil for equal chambers, piston at the middle",
    ),
    # Oil without air has 1.6 GPa and more; half a percent of air takes a quarter of it at 20 bar.
    Parameter(
        name="bulk_modulus", value=1.4e9, unit="Pa", low=1.2e9, high=1.6e9, minimum=1e7, maximum=1e10, symbol="E",
        shown_unit="GPa", tolerance=0.1, meaning="of mineral oil with some air",
    ),
    Parameter(
        name="reduced_mass", value=300.0, unit="kg", low=100.0, high=600.0, minimum=1e-3, maximum=1e6,
        symbol="m", meaning="all moving mass, reduced to the axis",
    ),
    # Chosen so that the damping ratio is near 0.1, as valve-controlled cylinders have.
    Parameter(
        name="leakage", value=3e-12, unit="m^5/(N s)", low=1e-12, high=1e-11, minimum=0.0, maximum=1e-6,
        symbol="a_m", shown_unit="cm^5/(N s)", tolerance=0.3,
        meaning="leakage of the motor and loss of flow of the valve, per pressure",
    ),
    Parameter(
        name="viscous_loss", value=2000.0, unit="N s/m", low=500.0, high=5000.0, minimum=0.0, maximum=1e7,
        symbol="b_m", shown_unit="N s/cm", tolerance=0.2, meaning="gradient of friction force with velocity",
    ),
    # Doesn't act: the valve's flow is linear in its command, and this says up to which load.
    Parameter(
        name="supply_pressure", value=140e5, unit="Pa", low=70e5, high=250e5, minimum=1e4, maximum=1e9, symbol="p_s",
        shown_unit="bar", role="function", meaning="of the pump; the load may take two thirds of it",
    ),
    Parameter(
        name="stroke", value=0.4, unit="m", low=0.1, high=1.0, minimum=1e-4, maximum=10.0, symbol="z",
        shown_unit="cm", tolerance=0.001, meaning="from one end to the other",
    ),
    # From the middle, so that an excitation to both sides doesn't begin in a stop.
    Parameter(
        name="start_position", value=0.2, unit="m", low=0.0, high=1.0, minimum=0.0, maximum=10.0,
        shown_unit="cm", role="function", meaning="distance from the rear end at the start",
    ),
    # Acts through dead zone and saturation; without them it's only flagged.
    Parameter(
        name="rated_flow", value=400e-6, unit="m^3/s", low=100e-6, high=1000e-6, minimum=1e-9, maximum=1.0,
        symbol="Q", shown_unit="cm^3/s", role="function", meaning="what the valve gives fully open",
    ),
    Parameter(
        name="rated_load", value=5000.0, unit="N", low=1000.0, high=10000.0, minimum=0.0, maximum=1e7, symbol="F_r",
        role="function", meaning="largest resisting force; beyond is flagged",
    ),
    Parameter(
        name="stop_stiffness", value=1e8, unit="N/m", low=1e6, high=1e9, minimum=1.0, maximum=1e12,
        shown_unit="kN/mm", tolerance=0.5, meaning="of each end stop",
    ),
    Parameter(
        name="stop_damping", value=5e4, unit="N s/m", low=0.0, high=1e6, minimum=0.0, maximum=1e9,
        tolerance=0.5, meaning="of each end stop while it's touched",
    ),
    # A third of the gain at which the default drive becomes unstable.
    Parameter(
        name="position_gain", value=0.015, unit="m^2/s", low=0.001, high=0.05, minimum=0.0, maximum=1e3, symbol="K_p",
        tolerance=0.0, meaning="flow for a unit of position error; over A it's the gain of the velocity",
    ),
)  # fmt: skip

_PARAMETERS = Parameters((*_OWN_PARAMETERS, *VALVE_PARAMETERS.items_in_order, *PD2_PARAMETERS.items_in_order))


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> CompiledModel:
    rates = piston_rates(
        active_area=values["active_area"],
        capacity=values["oil_volume"] / values["bulk_modulus"],
        reduced_mass=values["reduced_mass"],
        leakage=values["leakage"],
        viscous_loss=values["viscous_loss"],
        flow="motor_flow",
    )
    # What the piston takes is the flow behind the valve; an ideal valve hands the command on.
    valve_rates, valve_signals, valve_ports = valve_equations(values, options, command="flow")
    return compile_equations(
        rates={**rates, **valve_rates},
        inputs=(FLOW, LOAD),
        outputs=(DISPLACEMENT, VELOCITY, ACCELERATION, PRESSURE_DROP, MOTOR_FLOW),
        signals={**valve_signals, "acceleration": rates["velocity"]},
        ports=(*piston_ports(values["viscous_loss"], stop_laws(values, options)), *valve_ports),
    )


def _loops(values: Mapping[str, float], options: Mapping[str, str]) -> Sequence[Loop]:
    loops = []
    # The correction stands next to the valve, so that it works in the loop as well as alone.
    if options["correction"] == "pd2":
        loops.append(Loop(controller=_correction(values)))
    if options["loop"] == "position":
        loops.append(Loop(controller=_position_loop(values["position_gain"])))
    return loops


def _correction(values: Mapping[str, float]) -> StateSpace:
    correction = pd2(
        gain=values["pd2_gain"],
        derivative_s=values["pd2_derivative"],
        second_derivative_s2=values["pd2_second_derivative"],
        filter_s=values["pd2_filter"],
        entry=FLOW,
        exit_=FLOW,
    )
    # Its states get names that tell them from those of other elements.
    return replace(correction, states=tuple(f"pd2_{number}" for number in range(1, 1 + len(correction.states))))


def _position_loop(gain: float) -> StateSpace:
    """``command = flow + K_p (reference - displacement)``; the flow stays as an input that is added."""
    return StateSpace(
        a=np.zeros((0, 0)),
        b=np.zeros((0, 3)),
        c=np.zeros((1, 0)),
        d=np.array([[1.0, gain, -gain]]),
        inputs=(FLOW, REFERENCE, DISPLACEMENT),
        outputs=(FLOW,),
        states=(),
    )


def _limits(values: Mapping[str, float], options: Mapping[str, str]) -> Sequence[Limit]:
    loaded = LOADED_SHARE * values["supply_pressure"]
    pressure = Limit(
        signal="pressure_drop",
        low=-loaded,
        high=loaded,
        unit="bar",
        what="pressure drop",
        why="above two thirds of the supply pressure the valve gives less flow than the model's",
    )
    rated = values["rated_flow"]
    flow = Limit(
        signal="motor_flow",
        low=-rated,
        high=rated,
        unit="cm^3/s",
        what="flow through the valve",
        why="beyond the rated flow, which the valve gives fully open",
    )
    # The command may be more: a correction or a loop makes another flow of it.
    moving = [limit for limit in motion_limits(values, options) if limit.signal != "flow"]
    return (*moving, pressure, flow)


#: z/Q = A / (s [V m/E s^2 + (V b_m/E + m a_m) s + (A^2 + a_m b_m)]).
HYDRAULIC_MOTOR = DriveKind(
    name="hydraulic-motor",
    title="Linear hydraulic motor",
    parameters=_PARAMETERS,
    inputs=(FLOW, REFERENCE, LOAD),
    outputs=(DISPLACEMENT, VELOCITY, ACCELERATION, PRESSURE_DROP, MOTOR_FLOW),
    options=(
        Option(name="valve_lag", meaning="the spool of the valve follows with a time constant"),
        Option(name="dead_zone", meaning="the spool overlaps its ports"),
        Option(name="saturation", meaning="the valve gives its rated flow at most"),
        Option(name="correction", choices=("off", "pd2"), meaning="PD2 in front of the valve"),
        Option(name="loop", choices=("open", "position"), default="open", meaning="proportional loop on position"),
        Option(name="end_stops", meaning="stops at both ends of the stroke"),
    ),
    build=_build,
    loops=_loops,
    limits=_limits,
    law_words={VALVE: "the valve's dead zone or saturation"},
    acts_with={
        **VALVE_ACTS_WITH,
        **dict.fromkeys(PD2_PARAMETERS, ("correction", ("pd2",))),
        "position_gain": ("loop", ("position",)),
        "stop_stiffness": ("end_stops", ("on",)),
        "stop_damping": ("end_stops", ("on",)),
    },
)
