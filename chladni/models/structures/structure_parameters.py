"""Every number of a structure as a named parameter, and a structure with other numbers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import inf

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.structures.controller import FILTER, Controller
from chladni.models.structures.structure import Body, Joint, Structure

#: A knob goes from the value divided by this to the value times this.
SPAN = 4.0
DEFAULT_TOLERANCE = 0.05

Units = Mapping[str, str]


def inertia_key(body: Body) -> str:
    """Word of a body's inertia: ``mass``, or ``inertia`` when it rotates."""
    return "mass" if body.motion == "translation" else "inertia"


def structure_parameters(
    structure: Structure,
    controllers: Sequence[tuple[Controller, Units]],
    *,
    tolerances: Mapping[str, float],
    default_tolerance: float = DEFAULT_TOLERANCE,
) -> Parameters:
    """Declare the numbers of a structure and its controllers.

    Parameters
    ----------
    controllers
        Each with the units of its numbers, by the last part of their names: ``{"kp": "1/s", "gain": "N/V"}``.
    tolerances
        By name of the parameter, one sigma over the value.
    """
    declared = [*_bodies(structure), *_joints(structure)]
    for controller, units in controllers:
        declared.extend(_controller(controller, units))
    return Parameters(tuple(replace(one, tolerance=tolerances.get(one.name, default_tolerance)) for one in declared))


def with_numbers(structure: Structure, values: Mapping[str, float]) -> Structure:
    """Give the structure with the numbers of `values`, by the name of the parameter."""
    bodies = tuple(_body_with(body, values) for body in structure.bodies)
    joints = tuple(_joint_with(joint, values) for joint in structure.joints)
    return structure.with_parts(bodies, joints)


def controller_with_numbers(controller: Controller, values: Mapping[str, float]) -> Controller:
    """Give the controller with the numbers of `values`, by the name of the parameter."""
    name = controller.name
    return replace(
        controller,
        gains={key: values.get(f"{name}.{key}", gain) for key, gain in controller.gains.items()},
        num=_coefficients(f"{name}.num", controller.num, values),
        den=_coefficients(f"{name}.den", controller.den, values),
        gain=values.get(f"{name}.gain", controller.gain),
        limit=None if controller.limit is None else values.get(f"{name}.limit", controller.limit),
    )


def _body_with(body: Body, values: Mapping[str, float]) -> Body:
    mass = values.get(f"{body.name}.{inertia_key(body)}", body.mass)
    return body if mass == body.mass else replace(body, mass=mass)


def _joint_with(joint: Joint, values: Mapping[str, float]) -> Joint:
    stiffness = values.get(f"{joint.name}.stiffness", joint.stiffness)
    damping = values.get(f"{joint.name}.damping", joint.damping)
    # A fit changes one number at a time: the rest stays as it is.
    if (stiffness, damping) == (joint.stiffness, joint.damping):
        return joint
    return replace(joint, stiffness=stiffness, damping=damping)


def usual_range(value: float, others: Iterable[float] = ()) -> tuple[float, float]:
    """Range that a knob spans around a value; around zero, up to the largest of the `others`, or 1.

    Examples
    --------
    >>> usual_range(2.0), usual_range(0.0, [3.0]), usual_range(-2.0)
    ((0.5, 8.0), (0.0, 3.0), (-8.0, -0.5))
    """
    # A free guide may be given a spring as stiff as its neighbours have.
    if value == 0:
        return 0.0, max(others, default=0.0) or 1.0
    ends = value / SPAN, value * SPAN
    return min(ends), max(ends)


def _bodies(structure: Structure) -> list[Parameter]:
    declared = []
    for body in structure.bodies:
        low, high = usual_range(body.mass)
        unit = "kg" if body.motion == "translation" else "kg m^2"
        declared.append(
            Parameter(
                name=f"{body.name}.{inertia_key(body)}", value=body.mass, unit=unit, low=low, high=high, minimum=0.0,
                symbol="m" if body.motion == "translation" else "J", meaning=f"{inertia_key(body)} of {body.name}",
            )
        )  # fmt: skip
    return declared


def _joints(structure: Structure) -> list[Parameter]:
    declared = []
    stiffness, damping = [j.stiffness for j in structure.joints], [j.damping for j in structure.joints]
    for joint in structure.joints:
        turns = structure.motion_of(joint) == "rotation"
        for key, symbol, value, others, unit in (
            ("stiffness", "k", joint.stiffness, stiffness, "N m/rad" if turns else "N/m"),
            ("damping", "c", joint.damping, damping, "N m s/rad" if turns else "N s/m"),
        ):
            low, high = usual_range(value, others)
            declared.append(
                Parameter(
                    name=f"{joint.name}.{key}", value=value, unit=unit, low=low, high=high, minimum=0.0,
                    symbol=symbol, meaning=f"{key} of {joint.name}",
                )
            )  # fmt: skip
    return declared


def _controller(controller: Controller, units: Units) -> list[Parameter]:
    # Coefficients are named by their power of s, which stays when a further one is put in front.
    numbers = {**controller.gains}
    for key, coefficients in (("num", controller.num), ("den", controller.den)):
        numbers.update({f"{key}{len(coefficients) - 1 - place}": one for place, one in enumerate(coefficients)})
    numbers["gain"] = controller.gain
    if controller.limit is not None:
        numbers["limit"] = controller.limit
    declared = []
    for key, value in numbers.items():
        low, high = usual_range(value)
        declared.append(
            Parameter(
                name=f"{controller.name}.{key}", value=value, unit=units.get(key, "1"), low=low, high=high,
                minimum=0.0 if key in (FILTER, "limit") else -inf, symbol=key, role="function",
                meaning=f"{key} of {controller.name}",
            )
        )  # fmt: skip
    return declared


def _coefficients(prefix: str, coefficients: tuple[float, ...], values: Mapping[str, float]) -> tuple[float, ...]:
    last = len(coefficients) - 1
    return tuple(values.get(f"{prefix}{last - place}", one) for place, one in enumerate(coefficients))
