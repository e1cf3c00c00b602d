"""All causes by the names of their draws."""

from collections.abc import Callable, Mapping

from chladni_withheld.robots.at_joints import (
    armature,
    backlash,
    coulomb,
    elasticity,
    encoder_offset,
    hysteresis,
    joint_spring,
    load_friction,
    one_sided_stop,
    quadratic,
    ripple,
    stribeck,
    viscous,
)
from chladni_withheld.robots.at_links import coupled_friction, coupled_spring, gravity_tilt, payload, push
from chladni_withheld.robots.at_servos import (
    common_delay,
    controller_gain,
    dead_zone,
    gain,
    joint_delay,
    saturation,
)
from chladni_withheld.robots.cause import Cause, Stage
from chladni_withheld.robots.excitation import Rng

Draw = Callable[[Rng, Stage, int], Cause]
#: Words of the contract; `delay` is drawn in two ways.
CAUSES: Mapping[str, Draw] = {
    "coulomb_friction": coulomb,
    "stribeck_friction": stribeck,
    "hysteresis": hysteresis,
    "load_friction": load_friction,
    "viscous_friction": viscous,
    "quadratic_damping": quadratic,
    "common_delay": common_delay,
    "joint_delay": joint_delay,
    "gain_error": gain,
    "controller_gain": controller_gain,
    "saturation": saturation,
    "dead_zone": dead_zone,
    "payload": payload,
    "armature": armature,
    "joint_elasticity": elasticity,
    "backlash": backlash,
    "joint_spring": joint_spring,
    "one_sided_stop": one_sided_stop,
    "ripple": ripple,
    "encoder_offset": encoder_offset,
    "gravity_tilt": gravity_tilt,
}
#: What no word says.
OUTSIDE_CAUSES: Mapping[str, Draw] = {
    "push": push, "coupled_spring": coupled_spring, "coupled_friction": coupled_friction,
}  # fmt: skip
