"""DC servo drive (S3): armature, rotor, gear with load, voltage limit, and its control loops."""

from collections.abc import Mapping, Sequence

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port, PortKind, Terminal
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.equations import PlacedPort, Sum, compile_equations
from chladni.models.drives.limit_law import limit_law
from chladni.models.drives.servo_loops import (
    CURRENT,
    CURRENT_REFERENCE,
    LOOP_PARAMETERS,
    LOOPS,
    LOOPS_ACT_WITH,
    POSITION,
    POSITION_REFERENCE,
    VELOCITY,
    VELOCITY_REFERENCE,
    VOLTAGE,
    servo_loops,
    tuned_gains,
)
from chladni.models.drives.signal_ports import with_limit
from chladni.models.drives.validity import Limit

#: Joint between housing and rotor, and the rotor with all that turns with it.
JOINT, BODY = "shaft", "rotor"

LOAD_TORQUE = Terminal(name="load_torque", unit="N m")
TORQUE = Terminal(name="torque", unit="N m")
ACCELERATION = Terminal(name="acceleration", unit="rad/s^2")

_MOTOR_PARAMETERS = (
    Parameter(
        name="resistance", value=1.0, unit="ohm", low=0.2, high=5.0, minimum=1e-6, maximum=1e6, symbol="R",
        tolerance=0.1, meaning="of the armature, which warms up",
    ),
    # The defaults are those of a motor of a few hundred watts: 2 ms electrical, 10 ms mechanical time constant.
    Parameter(
        name="inductance", value=2e-3, unit="V s/A", low=2e-4, high=2e-2, minimum=1e-9, maximum=1e3, symbol="L",
        shown_unit="mV s/A", tolerance=0.1, meaning="of the armature; 1 mV s/A is 1 mH",
    ),
    Parameter(
        name="torque_constant", value=0.1, unit="N m/A", low=0.02, high=0.5, minimum=1e-9, maximum=1e4, symbol="K_t",
        meaning="torque for a unit of current",
    ),
    # Apart from the torque constant, because iron losses and catalogues make the two differ.
    Parameter(
        name="back_emf", value=0.1, unit="V s/rad", low=0.02, high=0.5, minimum=0.0, maximum=1e4, symbol="K_e",
        meaning="voltage for a unit of velocity; equal to the torque constant but for losses",
    ),
    Parameter(
        name="inertia", value=1e-4, unit="kg m^2", low=1e-5, high=1e-3, minimum=1e-12, maximum=1e6, symbol="J",
        meaning="of the rotor",
    ),
    Parameter(
        name="viscous_loss", value=1e-4, unit="N m s/rad", low=0.0, high=1e-3, minimum=0.0, maximum=1e4, symbol="b",
        tolerance=0.3, meaning="gradient of friction torque with velocity",
    ),
    # The load is that of the rotor behind the gear, which textbooks call matched.
    Parameter(
        name="gear_ratio", value=10.0, low=1.0, high=160.0, minimum=1e-3, maximum=1e6, symbol="n", tolerance=0.0,
        meaning="turns of the motor for one of the load",
    ),
    Parameter(
        name="load_inertia", value=1e-2, unit="kg m^2", low=0.0, high=1.0, minimum=0.0, maximum=1e9, symbol="J_L",
        meaning="behind the gear, which is stiff",
    ),
    # Cycle time and half a cycle of the pulse width: 10 kHz.
    Parameter(
        name="converter_time", value=1.5e-4, unit="s", low=5e-5, high=1e-3, minimum=1e-7, maximum=1.0, symbol="T",
        shown_unit="ms", tolerance=0.2, meaning="lag of the power stage: one and a half of its cycles",
    ),
    Parameter(
        name="voltage_limit", value=48.0, unit="V", low=12.0, high=320.0, minimum=1e-6, maximum=1e6, tolerance=0.05,
        role="function", meaning="of the power stage",
    ),
    # Above the limit of the reference, beyond which the current shoots by a few percent.
    Parameter(
        name="rated_current", value=25.0, unit="A", low=2.0, high=50.0, minimum=1e-6, maximum=1e5, role="function",
        meaning="largest current; beyond is flagged",
    ),
    Parameter(
        name="rated_speed", value=400.0, unit="rad/s", low=100.0, high=600.0, minimum=1e-3, maximum=1e5,
        shown_unit="rpm", role="function", meaning="largest velocity; beyond is flagged",
    ),
)  # fmt: skip

_ACTS_WITH = {
    **LOOPS_ACT_WITH,
    **dict.fromkeys(("gear_ratio", "load_inertia"), ("gear", ("on",))),
    "converter_time": ("converter_lag", ("on",)),
    "voltage_limit": ("voltage_limiter", ("on",)),
}


def _gear(values: Mapping[str, float], options: Mapping[str, str]) -> tuple[float, float]:
    """Ratio, and inertia at the shaft."""
    if options["gear"] == "off":
        return 1.0, values["inertia"]
    ratio = values["gear_ratio"]
    return ratio, values["inertia"] + values["load_inertia"] / ratio**2


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> CompiledModel:
    ratio, inertia = _gear(values, options)
    # The torque of the load counts on its side of the gear.
    torque = {"torque": 1.0, "velocity": -values["viscous_loss"], "load_torque": -1 / ratio}
    # What helps the load stands on its side of the gear; the joint and the body stand at the shaft.
    ports = {"actuation:load_torque": -1 / ratio, f"joint:{JOINT}": -1.0, f"body:{BODY}": 1.0}
    acceleration = {name: share / inertia for name, share in {**torque, **ports}.items()}
    armature = {
        _applied(options): 1 / values["inductance"],
        "current": -values["resistance"] / values["inductance"],
        "velocity": -values["back_emf"] / values["inductance"],
    }
    signals = {"torque": {"current": values["torque_constant"]}, "acceleration": acceleration}
    compiled = compile_equations(
        rates={"position": {"velocity": 1.0}, "velocity": acceleration, "current": armature, **_lag(values, options)},
        inputs=(VOLTAGE, LOAD_TORQUE),
        outputs=(CURRENT, TORQUE, ACCELERATION, VELOCITY, POSITION),
        signals=signals,
        ports=_ports(values["viscous_loss"], ratio),
    )
    # In front of the power stage, whose lag smooths what is left.
    if options["voltage_limiter"] == "off":
        return compiled
    return with_limit(compiled, "voltage", limit_law(limit=values["voltage_limit"]))


def _applied(options: Mapping[str, str]) -> str:
    return "armature_voltage" if options["converter_lag"] == "on" else "voltage"


def _lag(values: Mapping[str, float], options: Mapping[str, str]) -> dict[str, Sum]:
    if options["converter_lag"] == "off":
        return {}
    rate = 1 / values["converter_time"]
    return {"armature_voltage": {"voltage": rate, "armature_voltage": -rate}}


def _ports(viscous_loss: float, ratio: float) -> tuple[PlacedPort, ...]:
    places: tuple[tuple[str, PortKind, float], ...] = (
        (JOINT, "joint", 1.0),
        (BODY, "body", 1.0),
        ("load_torque", "actuation", 1 / ratio),
    )
    return tuple(
        PlacedPort(
            port=Port(
                name=name, kind=kind, unit="N m", displacement_unit="rad",
                damping=viscous_loss if kind == "joint" else 0.0,
            ),
            displacement={"position": side},
            velocity={"velocity": side},
        )
        for name, kind, side in places
    )  # fmt: skip


def _limits(values: Mapping[str, float], _options: Mapping[str, str]) -> Sequence[Limit]:
    return tuple(
        Limit(signal=signal, low=-values[name], high=values[name], unit=unit, what=signal, why=f"beyond the {words}")
        for signal, name, unit, words in (
            ("current", "rated_current", "A", "rated current"),
            ("velocity", "rated_speed", "rpm", "rated speed"),
        )
    )


def _remarks(_values: Mapping[str, float], options: Mapping[str, str]) -> Sequence[str]:
    # Not refused: on a page the loop is switched apart from the limiter.
    if options["current_limiter"] == "on" and options["loop"] not in ("velocity", "position"):
        return ("current_limiter is on, but limits nothing: it acts with loop velocity or position",)
    return ()


#: omega/U = K_t / (L J s^2 + (L b + R J) s + R b + K_t K_e) without converter lag, gear and loops.
DC_SERVO = DriveKind(
    name="dc-servo",
    title="DC servo drive",
    parameters=Parameters((*_MOTOR_PARAMETERS, *LOOP_PARAMETERS.items_in_order)),
    inputs=(VOLTAGE, CURRENT_REFERENCE, VELOCITY_REFERENCE, POSITION_REFERENCE, LOAD_TORQUE),
    outputs=(CURRENT, TORQUE, ACCELERATION, VELOCITY, POSITION),
    options=(
        Option(name="loop", choices=LOOPS, default="open", meaning="outermost loop that is closed"),
        Option(name="gear", meaning="a stiff gear with a load"),
        Option(name="converter_lag", meaning="the power stage follows with a time constant"),
        Option(name="voltage_limiter", meaning="the power stage gives its voltage at most"),
        Option(name="current_limiter", meaning="the velocity loop asks for its current at most"),
    ),
    build=_build,
    loops=servo_loops,
    limits=_limits,
    remarks=_remarks,
    law_words={"voltage_limit": "the voltage limit", "current_reference_limit": "the current limit"},
    acts_with=_ACTS_WITH,
)


def tuned(values: Mapping[str, float], options: Mapping[str, str]) -> dict[str, float]:
    """Give gains of all loops by the rules of `tuned_gains`, for the motor with its gear and load.

    `values` holds all parameters of the kind, SI.
    """
    _, inertia = _gear(values, options)
    return tuned_gains(values, inertia=inertia)
