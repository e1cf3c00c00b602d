"""Linear pneumatic motor (S1): a piston driven by a flow of air."""

from collections.abc import Mapping, Sequence

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.piston import (
    ACCELERATION,
    DISPLACEMENT,
    FLOW,
    LOAD,
    PRESSURE_DROP,
    VELOCITY,
    motion_limits,
    piston_plant,
    stop_laws,
)
from chladni.models.drives.seal_friction import seal_friction
from chladni.models.drives.validity import Limit
from chladni.signals.errors import ModelError

# The paper's units: 1 daN/cm^2 is 1 bar, 1 daN s^2/cm is 1000 kg, 1 cm^5/(daN s) is 0.1 cm^5/(N s).
_PARAMETERS = Parameters(
    (
        Parameter(
            name="active_area", value=70e-4, unit="m^2", low=50e-4, high=80e-4, minimum=1e-6, maximum=1.0,
            symbol="A", shown_unit="cm^2", tolerance=0.01, meaning="area of the piston that the pressure acts on",
        ),
        # Both chambers and the hoses count: what the paper's V holds.
        Parameter(
            name="air_volume", value=750e-6, unit="m^3", low=500e-6, high=1000e-6, minimum=1e-9, maximum=1.0,
            symbol="V", shown_unit="cm^3", meaning="volume of air that is compressed, held constant",
        ),
        Parameter(
            name="reduced_mass", value=300.0, unit="kg", low=100.0, high=600.0, minimum=1e-3, maximum=1e6,
            symbol="m", meaning="all moving mass, reduced to the axis",
        ),
        # Seals and valves scatter: nobody knows a leakage within a tenth.
        Parameter(
            name="leakage", value=0.45e-11, unit="m^5/(N s)", low=0.2e-11, high=0.7e-11, minimum=0.0, maximum=1e-6,
            symbol="a_m", shown_unit="cm^5/(N s)", tolerance=0.3, meaning="gradient of leakage with pressure",
        ),
        Parameter(
            name="viscous_loss", value=1300.0, unit="N s/m", low=800.0, high=1800.0, minimum=0.0, maximum=1e7,
            symbol="b_m", shown_unit="N s/cm", tolerance=0.2, meaning="gradient of friction force with velocity",
        ),
        Parameter(
            name="adiabatic_exponent", value=1.4, low=1.0, high=1.67, minimum=1.0, maximum=1.67, symbol="chi",
            tolerance=0.01, meaning="1 for slow (isothermal), 1.4 for fast (adiabatic) changes of air",
        ),
        # The paper gives 4 to 6 daN/cm^2 for the pressure drop; as p of p V^chi = const it's taken for absolute.
        Parameter(
            name="pressure", value=5e5, unit="Pa", low=4e5, high=6e5, minimum=1e3, maximum=1e8, symbol="p",
            shown_unit="bar", role="function", meaning="absolute pressure p in p V^chi = const",
        ),
        Parameter(
            name="stroke", value=0.35, unit="m", low=0.3, high=0.4, minimum=1e-4, maximum=10.0, symbol="z",
            shown_unit="cm", tolerance=0.001, meaning="from one end to the other",
        ),
        # From the middle, so that an excitation to both sides doesn't begin in a stop.
        Parameter(
            name="start_position", value=0.175, unit="m", low=0.0, high=0.4, minimum=0.0, maximum=10.0,
            shown_unit="cm", role="function", meaning="distance from the rear end at the start",
        ),
        # Rated numbers don't act: they are what a simulation is flagged against.
        Parameter(
            name="rated_flow", value=100e-6, unit="m^3/s", low=20e-6, high=100e-6, minimum=0.0, maximum=1.0,
            symbol="Q", shown_unit="cm^3/s", role="function", meaning="largest flow of the supply; beyond is flagged",
        ),
        Parameter(
            name="rated_load", value=300.0, unit="N", low=100.0, high=300.0, minimum=0.0, maximum=1e6, symbol="F_r",
            role="function", meaning="largest resisting force; beyond is flagged",
        ),
        # Steel on steel would be stiffer; with this the contact lasts for milliseconds, and gives way by micrometres.
        Parameter(
            name="stop_stiffness", value=1e8, unit="N/m", low=1e6, high=1e9, minimum=1.0, maximum=1e12,
            shown_unit="kN/mm", tolerance=0.5, meaning="of each end stop",
        ),
        Parameter(
            name="stop_damping", value=5e4, unit="N s/m", low=0.0, high=1e6, minimum=0.0, maximum=1e9,
            tolerance=0.5, meaning="of each end stop while it's touched",
        ),
    )
)  # fmt: skip


#: Pressure drop, as a share of p, up to which the linear capacity V/(chi p) stands for p V^chi = const.
LINEAR_SHARE = 0.2


#: Of the standard atmosphere, Pa: seals feel the pressure above it, the air's spring the absolute one.
AMBIENT = 101325.0


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> CompiledModel:
    compiled = piston_plant(
        active_area=values["active_area"],
        capacity=values["air_volume"] / (values["adiabatic_exponent"] * values["pressure"]),
        reduced_mass=values["reduced_mass"],
        leakage=values["leakage"],
        viscous_loss=values["viscous_loss"],
        laws=stop_laws(values, options),
    )
    if options["seal_friction"] == "off":
        return compiled
    try:
        friction = seal_friction(values["pressure"] - AMBIENT, active_area=values["active_area"])
    except ModelError as error:
        # The motor's pressure is absolute; whoever gave 5 bar must not wonder why 4 are spoken of.
        raise ModelError(f"pressure = {values['pressure'] / 1e5:g} bar absolute: {error}") from error
    return friction.attach(compiled)


def _limits(values: Mapping[str, float], options: Mapping[str, str]) -> Sequence[Limit]:
    believed = LINEAR_SHARE * values["pressure"]
    share = f"beyond {100 * LINEAR_SHARE:.0f} % of the absolute pressure the air is no longer a linear spring"
    pressure = Limit(
        signal="pressure_drop", low=-believed, high=believed, unit="bar", what="pressure drop", why=share
    )
    return (*motion_limits(values, options), pressure)


#: z/Q = A / (s [V m/(chi p) s^2 + (V b_m/(chi p) + m a_m) s + (A^2 + a_m b_m)]), equation 2 of the paper.
PNEUMATIC_MOTOR = DriveKind(
    name="pneumatic-motor",
    title="Linear pneumatic motor",
    parameters=_PARAMETERS,
    inputs=(FLOW, LOAD),
    outputs=(DISPLACEMENT, VELOCITY, ACCELERATION, PRESSURE_DROP),
    options=(
        Option(name="end_stops", meaning="stops at both ends of the stroke"),
        Option(name="seal_friction", meaning="friction of the seals as measured on a smaller cylinder"),
    ),
    build=_build,
    limits=_limits,
    acts_with={"stop_stiffness": ("end_stops", ("on",)), "stop_damping": ("end_stops", ("on",))},
)
