"""A robot's driving module as a block scheme: the project's own, since the paper prints neither plant nor topology.

From the paper (section 3, equation 4) are the regulator ``H_R(s) = 0.9 (9.9 s + 1)/(3 s)``, which is a PI with the
gain 2.97 and the integral time 9.9 s, and the correction ``H_c(s) = 1/(0.7 s + 1)``. It's printed so, and called
PDT1: a PDT1 whose derivative time is zero. Everything else (motor, gear, elastic shaft, arm, tachometer, position
loop) is chosen so that the printed values are good ones: the regulator's zero at 9.9 s cancels the drive's own lag,
and what stays is an integrator with the correction's lag of 0.7 s, at a damping ratio near 0.7.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.step_response import step_response
from chladni.models.core.instrument import Instrument, Option
from chladni.models.core.model import Model
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import Terminal
from chladni.models.core.reading import Chart, Curve
from chladni.models.elements import declare
from chladni.models.elements.element import Element
from chladni.models.schemes.block import Block, element_block
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.schemes.scheme_output import SchemeOutput

#: Step of the reference that the page begins with, in rad/s or rad.
STEP_SIZE = 0.1
#: Name and title of the page's own chart.
WITH_LOAD = ("step.with-load", "Step of the reference with and without load")
#: Switches of the page, and the blocks that each one switches.
SWITCHES: Mapping[str, tuple[str, ...]] = {
    "regulator": ("regulator",),
    "correction": ("correction",),
    "load": ("load_torque",),
    "position_loop": ("position_regulator", "position_feedback"),
}

# Constants that several blocks share; a scheme knows them as the gains of those blocks.
_SHARED = Parameters(
    (
        declare.constant("torque_constant", 0.05, "N m/A", "k_m", "torque over current, and voltage over speed"),
        declare.constant("gear_ratio", 100.0, "1", "n", "speed of the motor over that of the arm"),
        declare.constant("tachometer_constant", 0.02, "V s/rad", "k_t", "voltage of the tachometer over its speed"),
    )
)


@cache
def robot_scheme(*, position_loop: bool = False) -> SchemeModel:
    """Give the scheme at its defaults.

    ::

        reference -> position_regulator -> set_value -> regulator -> correction -> amplifier -> armature -> torque
                  -> motor -> gear -> shaft -> arm -> position

    Loops: back-EMF about armature and motor, the shaft's torque on the motor, the arm's speed on the shaft, the
    tachometer about the regulator, and the position about all of it.
    """
    km, n, kt = (_SHARED[name].value for name in ("torque_constant", "gear_ratio", "tachometer_constant"))
    return SchemeModel(
        name="robot-module",
        blocks=(
            element_block("position_regulator", "p", "+reference", "-position_feedback", gain=0.1),
            element_block("set_value", "p", "position_regulator", gain=n * kt),
            element_block("regulator", "pi", "+set_value", "-tachometer", gain=2.97, integral_time=9.9),
            element_block("correction", "pdt1", "regulator", gain=1.0, derivative_time=0.0, time_constant=0.7),
            element_block("amplifier", "p", "correction", gain=12.0),
            element_block("armature", "rl-current", "+amplifier", "-back_emf", resistance=12.0, inductance=0.01),
            element_block("torque", "p", "armature", gain=km),
            element_block("motor", "inertia", "+torque", "-shaft_reaction", inertia=2e-3, damping=1e-4),
            element_block("back_emf", "p", "motor", gain=km),
            element_block("tachometer", "pt1", "motor", gain=kt, time_constant=5e-3),
            element_block("gear", "p", "motor", gain=1 / n),
            element_block("shaft", "shaft", "+gear", "-arm", stiffness=2e4, damping=20.0),
            element_block("shaft_reaction", "p", "shaft", gain=1 / n),
            element_block("load_torque", "p", "load", gain=0.5, when_off="cut", unit="N m"),
            element_block("arm", "inertia", "+shaft", "-load_torque", inertia=20.0, damping=1.0),
            element_block("position", "i", "arm", gain=1.0),
            element_block("position_feedback", "p", "position", gain=1.0, when_off="cut"),
        ),
        inputs=(
            Terminal(name="reference", unit="rad" if position_loop else "rad/s"),
            Terminal(name="load", unit="1"),
        ),
        outputs=(SchemeOutput(name="arm"), SchemeOutput(name="position", unit="rad")),
    )


def _own(scheme: SchemeModel) -> Parameters:
    """Knobs: the shared constants, and every number of a block that isn't one of them."""
    shared = set(_gains(_SHARED.numbers()))
    kept = (item for name, item in scheme.parameters.items() if name not in shared | {"position_feedback.gain"})
    return Parameters((*_SHARED.values(), *kept))


def _gains(shared: Mapping[str, float]) -> dict[str, float]:
    """What the shared constants are in the scheme."""
    km, n, kt = shared["torque_constant"], shared["gear_ratio"], shared["tachometer_constant"]
    return {
        "torque.gain": km,
        "back_emf.gain": km,
        "gear.gain": 1 / n,
        "shaft_reaction.gain": 1 / n,
        "tachometer.gain": kt,
        "set_value.gain": n * kt,
    }


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> SchemeModel:
    numbers = {name: value for name, value in values.items() if name not in _SHARED}
    scheme = robot_scheme(position_loop=options["position_loop"] == "on").with_values(numbers)
    gains = _gains(values)
    # What follows from a knob within its range is usual, whatever one gain alone would be.
    scheme = replace(
        scheme, blocks=tuple(_with_gain(block, gains.get(f"{block.name}.gain")) for block in scheme.blocks)
    )
    return scheme.switched({block: options[name] == "on" for name, blocks in SWITCHES.items() for block in blocks})


def _with_gain(block: Block, gain: float | None) -> Block:
    if gain is None or not isinstance(block.content, Element):
        return block
    return replace(block, content=block.content.with_usual_value("gain", gain))


def _with_and_without_load(model: Model) -> tuple[Chart, ...]:
    """Paper's comparison: the answer to the reference alone, and to reference and load stepping together."""
    compiled = model.compile()
    # The reference is an angle only while the position loop is closed.
    output = "position" if compiled.inputs[0].unit == "rad" else "arm"
    path = linear_path(compiled, from_input="reference", to_outputs=(output,))
    alone = step_response(path, size=STEP_SIZE)
    load_path = linear_path(compiled, from_input="load", to_outputs=(output,))
    load = step_response(load_path, seconds=float(alone.time_s[0, -1]))
    added = np.interp(alone.time_s[0], load.time_s[0], load.values[0])
    unit = alone.outputs[0].unit
    return (
        Chart(
            name=WITH_LOAD[0],
            title=WITH_LOAD[1],
            x_label="time [s]",
            y_label=f"{output} [{unit}]",
            curves=(
                Curve(label="without load", x=alone.time_s[0], y=alone.values[0]),
                Curve(label="with load", x=alone.time_s[0], y=alone.values[0] + added),
            ),
        ),
    )


INSTRUMENT = Instrument(
    name="robot-module",
    title="Driving module of a robot as a block scheme (the project's own)",
    parameters=_own(robot_scheme()),
    build=_build,
    options=(
        Option(name="regulator", default="on", meaning="the paper's PI in the velocity loop; off: gain 1"),
        Option(name="correction", default="on", meaning="the paper's H_c; off: gain 1"),
        Option(name="load", default="on", meaning="whether the input load acts on the arm as a torque"),
        Option(name="position_loop", meaning="closes a position loop around the velocity loop"),
    ),
    step_input="reference",
    step_output="arm",
    step_size=STEP_SIZE,
    extra_charts=_with_and_without_load,
    extra_titles=(WITH_LOAD,),
    load_input="load",
    views=("step", "bode", "nyquist", "poles", "root-locus", "influence"),
)
