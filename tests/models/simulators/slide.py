"""A mass on a spring and a damper, in MuJoCo, in plain Python and as a model of ours: three that must agree."""

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port, Terminal
from chladni.models.simulators.callable_simulator import callable_simulator
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput

MASS, STIFFNESS, DAMPING = 2.0, 800.0, 4.0
RATE_HZ = 200.0


def mjcf(step_s=1 / RATE_HZ, integrator="implicitfast"):
    return f"""
<mujoco model="slide">
  <option timestep="{step_s!r}" integrator="{integrator}" gravity="0 0 0"/>
  <worldbody>
    <body name="cart">
      <joint name="guide" type="slide" axis="1 0 0" stiffness="{STIFFNESS}" damping="{DAMPING}"/>
      <geom type="box" size=".1 .1 .1" mass="{MASS}"/>
      <site name="here"/>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="guide"/></actuator>
  <sensor>
    <jointpos name="place" joint="guide"/><jointvel name="speed" joint="guide"/>
    <accelerometer name="acc" site="here"/>
  </sensor>
  <keyframe><key name="pulled" qpos="0.05"/></keyframe>
</mujoco>
"""


def model():
    """The same as a model of ours."""
    return StructureModel(
        name="slide",
        structure=Structure(
            bodies=(Body(name="cart", mass=MASS),),
            joints=(Joint(name="guide", between=("ground", "cart"), stiffness=STIFFNESS, damping=DAMPING),),
        ),
        inputs=(StructureInput(name="push", at="cart"),),
        outputs=(
            StructureOutput(name="place", measures="displacement", at="cart"),
            StructureOutput(name="speed", measures="velocity", at="cart"),
        ),
    )


def in_python():
    """The same as a function, stepped like MuJoCo's Euler with implicit damping."""

    def respond(inputs, sample_rate_hz, values, joint_laws):
        step_s = 1 / sample_rate_hz
        d = s = 0.0
        outputs = np.zeros((2, inputs.shape[1]))
        for sample, force in enumerate(inputs[0]):
            outputs[:, sample] = d, s
            resisting = joint_laws["guide"](d, s, sample * step_s) if "guide" in joint_laws else 0.0
            s += step_s * (force - resisting - values["stiffness"] * d - DAMPING * s) / (MASS + step_s * DAMPING)
            d += step_s * s
        return outputs

    return callable_simulator(
        respond,
        name="slide",
        inputs=(Terminal(name="push", unit="N"),),
        outputs=(Terminal(name="place", unit="m"), Terminal(name="speed", unit="m/s")),
        joints=(Port(name="guide", kind="joint", stiffness=STIFFNESS, damping=DAMPING),),
        parameters=Parameters(
            (Parameter(name="stiffness", value=STIFFNESS, unit="N/m", low=100.0, high=5000.0, minimum=0.0),)
        ),
    )


def held(samples):
    """Random force whose samples are held for eight steps, so that what runs between two hardly matters."""
    steps = np.random.default_rng(1).normal(size=samples // 8 + 1)
    return 20.0 * np.repeat(steps, 8)[None, :samples]


def smooth(samples, rate_hz):
    """A force of a few low tones."""
    time_s = np.arange(samples) / rate_hz
    return 15.0 * (np.sin(2 * np.pi * 1.3 * time_s) + np.sin(2 * np.pi * 2.9 * time_s + 1.0))[None, :]
