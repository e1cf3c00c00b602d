"""Equations of the drives, written from their balances: a piston moved by air or oil, a servo motor."""

from collections.abc import Callable, Mapping

from chladni.gap.blind.assembly import Sum, added
from chladni.gap.blind.equations import Machine

#: Joint and body of each kind of drive, and the parameter that holds the body's inertia.
PARTS: Mapping[str, tuple[str, str, str]] = {
    "pneumatic-motor": ("piston", "axis", "reduced_mass"),
    "hydraulic-motor": ("piston", "axis", "reduced_mass"),
    "dc-servo": ("shaft", "rotor", "inertia"),
}


def begin_drive(machine: Machine) -> None:
    """Add the moving body with its viscous loss, and what the drive's force is."""
    joint, body, inertia = PARTS[machine.plan.drive]
    n = machine.numbers
    machine.new_body(body, n[inertia])
    machine.resist(machine.plan.joint(joint), added((n["viscous_loss"], machine.velocity(body))))
    if machine.plan.drive == "dc-servo":
        force, signals = added((n["torque_constant"], {"current": 1.0})), {"current": {"current": 1.0}}
        machine.signals |= {"torque": force, **signals}
    else:
        force = added((n["active_area"], {"pressure_drop": 1.0}))
        machine.signals["pressure_drop"] = {"pressure_drop": 1.0}
    machine.signals["force"] = force
    machine.push(body, force)


def finish_drive(machine: Machine) -> None:
    """Let the inputs act, and write the rates of what isn't a motion."""
    _FINISH[machine.plan.drive](machine)


def _load(machine: Machine, name: str) -> None:
    """A load resists."""
    if name in machine.acting:
        machine.push(PARTS[machine.plan.drive][1], added((-1.0, machine.acting[name])))


def _piston(machine: Machine, capacity: float, flow: Sum) -> None:
    """``Q = A v + a_m dp + c d(dp)/dt``."""
    n = machine.numbers
    machine.assembly.rates["pressure_drop"] = added(
        (1.0 / capacity, flow),
        (-n["active_area"] / capacity, machine.velocity("axis")),
        (-n["leakage"] / capacity, {"pressure_drop": 1.0}),
    )
    _load(machine, "load")


def _pneumatic(machine: Machine) -> None:
    n = machine.numbers
    _piston(machine, n["air_volume"] / (n["adiabatic_exponent"] * n["pressure"]), machine.acting["flow"])


def _hydraulic(machine: Machine) -> None:
    n, command = machine.numbers, machine.acting["flow"]
    flow: Sum = command
    if machine.plan.options.get("valve_lag") == "on":
        spool = {"spool": 1.0}
        machine.assembly.rates["spool"] = added((1 / n["valve_time"], command), (-1 / n["valve_time"], spool))
        flow = spool
    _piston(machine, n["oil_volume"] / n["bulk_modulus"], flow)


def _servo(machine: Machine) -> None:
    """Armature, and around it the loops that are closed, the innermost last."""
    n, current, speed = machine.numbers, {"current": 1.0}, machine.velocity("rotor")
    voltage: Sum
    if machine.plan.options.get("loop") == "position":
        position = added((1.0, machine.acting["position_reference"]), (-1.0, machine.displacement("rotor")))
        wanted_speed = added((n["position_gain"], position))
        wanted_current = _pi(machine, "speed_part", n["velocity_gain"], n["velocity_time"], wanted_speed, speed,
                             weight=n["velocity_weight"])  # fmt: skip
        voltage = _pi(machine, "current_part", n["current_gain"], n["current_time"], wanted_current, current)
    else:
        voltage = machine.acting["voltage"]
    machine.assembly.rates["current"] = added(
        (1.0 / n["inductance"], voltage),
        (-n["resistance"] / n["inductance"], current),
        (-n["back_emf"] / n["inductance"], speed),
    )
    _load(machine, "load_torque")


def _pi(machine: Machine, state: str, gain: float, time_s: float, wanted: Sum, found: Sum, *, weight: float = 1.0,
        ) -> dict[str, float]:  # fmt: skip
    """``gain (weight r - y + integral(r - y)/time)``."""
    machine.assembly.rates[state] = added((gain / time_s, wanted), (-gain / time_s, found))
    return added((weight * gain, wanted), (-gain, found), (1.0, {state: 1.0}))


_FINISH: Mapping[str, Callable[[Machine], None]] = {
    "pneumatic-motor": _pneumatic,
    "hydraulic-motor": _hydraulic,
    "dc-servo": _servo,
}
