"""A mass moved by a piston: what the pneumatic and the hydraulic motor share."""

from collections.abc import Mapping, Sequence

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.drives.end_stops import end_stops
from chladni.models.drives.equations import PlacedPort, Sum, compile_equations
from chladni.models.drives.validity import Limit
from chladni.signals.errors import ModelError

#: Joint between housing and piston, and the body that it moves.
JOINT, BODY = "piston", "axis"

FLOW = Terminal(name="flow", unit="m^3/s")
LOAD = Terminal(name="load", unit="N")
DISPLACEMENT = Terminal(name="displacement", unit="m")
VELOCITY = Terminal(name="velocity", unit="m/s")
ACCELERATION = Terminal(name="acceleration", unit="m/s^2")
PRESSURE_DROP = Terminal(name="pressure_drop", unit="Pa")


def piston_rates(
    *, active_area: float, capacity: float, reduced_mass: float, leakage: float, viscous_loss: float, flow: str
) -> dict[str, Sum]:
    """Rates of displacement z, velocity v and pressure drop dp.

    ::

        Q    = A v + a_m dp + c d(dp)/dt      flow balance: leakage a_m, capacity c = V/(chi p) or V/E
        A dp = m dv/dt + b_m v + F            force balance: F the load and what resists at the joint

    `flow` names the signal Q.
    """
    force = {
        "pressure_drop": active_area / reduced_mass,
        "velocity": -viscous_loss / reduced_mass,
        # The load resists; a joint's laws resist too; what acts on the body or helps the load has its own sign.
        "load": -1.0 / reduced_mass,
        "actuation:load": -1.0 / reduced_mass,
        f"joint:{JOINT}": -1.0 / reduced_mass,
        f"body:{BODY}": 1.0 / reduced_mass,
    }
    # Solved for the pressure's rate: the capacity is a spring between flow and motion.
    balance = {
        flow: 1.0 / capacity,
        "actuation:flow": 1.0 / capacity,
        "velocity": -active_area / capacity,
        "pressure_drop": -leakage / capacity,
    }
    return {"displacement": {"velocity": 1.0}, "velocity": force, "pressure_drop": balance}


def piston_ports(viscous_loss: float, laws: Sequence[PortLaw]) -> tuple[PlacedPort, ...]:
    """Joint with its viscous loss, moving body, and the places where load and flow act."""
    # The viscous loss is in the equations; the port only says it to laws that need it.
    return (
        _placed(Port(name=JOINT, kind="joint", damping=viscous_loss), laws),
        _placed(Port(name=BODY, kind="body")),
        _placed(Port(name="load", kind="actuation")),
        _placed(Port(name="flow", kind="actuation", unit="m^3/s")),
    )


def _placed(port: Port, laws: Sequence[PortLaw] = ()) -> PlacedPort:
    return PlacedPort(port=port, displacement={"displacement": 1.0}, velocity={"velocity": 1.0}, laws=tuple(laws))


def piston_plant(
    *,
    active_area: float,
    capacity: float,
    reduced_mass: float,
    leakage: float,
    viscous_loss: float,
    laws: Sequence[PortLaw],
) -> CompiledModel:
    """Compile a piston that the flow acts on directly; the parameters are those of `piston_rates`."""
    rates = piston_rates(
        active_area=active_area,
        capacity=capacity,
        reduced_mass=reduced_mass,
        leakage=leakage,
        viscous_loss=viscous_loss,
        flow="flow",
    )
    return compile_equations(
        rates=rates,
        inputs=(FLOW, LOAD),
        outputs=(DISPLACEMENT, VELOCITY, ACCELERATION, PRESSURE_DROP),
        signals={"acceleration": rates["velocity"]},
        ports=piston_ports(viscous_loss, laws),
    )


def stroke_ends(values: Mapping[str, float]) -> tuple[float, float]:
    """Displacements of both ends, counted from the start.

    Raises
    ------
    ModelError
        When the piston would start outside its stroke.
    """
    # Displacements count from the start, where all states are zero.
    start, stroke = values["start_position"], values["stroke"]
    if start > stroke:
        raise ModelError(f"start_position: {start:g} m lies beyond the stroke of {stroke:g} m; start inside")
    return -start, stroke - start


def stop_laws(values: Mapping[str, float], options: Mapping[str, str]) -> tuple[PortLaw, ...]:
    """Stops at both ends of the stroke when the option ``end_stops`` is on."""
    # Asked first, so that a start outside the stroke is refused with and without stops.
    low, high = stroke_ends(values)
    if options["end_stops"] == "off":
        return ()
    return (end_stops(low=low, high=high, stiffness=values["stop_stiffness"], damping=values["stop_damping"]),)


def motion_limits(values: Mapping[str, float], options: Mapping[str, str]) -> tuple[Limit, ...]:
    """Stroke, flow and load."""
    low, high = stroke_ends(values)
    stopped = options["end_stops"] == "on"
    # A stop gives way by its force over its stiffness; that's no leaving of the stroke.
    slack = 0.01 * values["stroke"] if stopped else 0.0
    why = (
        "the stops gave way by more than 1 % of the stroke" if stopped else "the stroke ends there (no end stops on)"
    )
    rated = values["rated_flow"]
    return (
        Limit(signal="displacement", low=low - slack, high=high + slack, unit="cm", what="displacement", why=why),
        Limit(signal="flow", low=-rated, high=rated, unit="cm^3/s", what="flow", why="beyond the rated flow"),
        Limit(
            signal="load",
            low=-values["rated_load"],
            high=values["rated_load"],
            unit="N",
            what="load",
            why="beyond the rated load",
        ),
    )
