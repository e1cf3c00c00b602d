"""Kernel: MuJoCo's steps with laws at joints, called by the addresses of MuJoCo's own functions."""

from typing import Any, NamedTuple

import numpy as np
from numba import types

from chladni.models.integrator.machine_code import call_law, caller, machine_code, part_code
from chladni.models.simulators.joint_law import LEAST_STATE, NUDGE
from chladni.signals.arrays import Real, Whole

#: Velocity or acceleration beyond all physics, SI, before MuJoCo takes it for a mistake at 1e10.
LARGEST = 1e8
#: Of a law's force: what its search ends at, which takes a few steps and never so many.
_ROUNDING, _MOST_STEPS = 1e-9, 60

_WORD = types.int64
_STEP: Any = caller(_WORD(_WORD, _WORD))
_SOLVE: Any = caller(_WORD(_WORD, _WORD, _WORD, _WORD, types.int32))


class Simulated(NamedTuple):
    """MuJoCo's memory, which it moves while it runs, and its functions.

    Attributes
    ----------
    address
        ``[9]`` of the model, the data, ``mj_step1``, ``mj_fwdActuation``, ``mj_fwdAcceleration``, ``mj_solveM``,
        ``mj_step2``, `column`, `unit`.
    command, velocity, position, applied, smooth, sensors
        MuJoCo's ``ctrl``, ``qvel``, ``qpos``, ``qfrc_applied``, ``qacc_smooth``, ``sensordata``.
    damping
        ``[dof]``: what MuJoCo treats implicitly.
    unit, column
        ``[dof]`` work space: a unit force, and the accelerations that it makes.
    """

    address: Whole
    command: Real
    velocity: Real
    position: Real
    applied: Real
    smooth: Real
    sensors: Real
    damping: Real
    unit: Real
    column: Real


class Laws(NamedTuple):
    """Laws at joints.

    Attributes
    ----------
    table
        ``[law, 4]``: address of the function, address of its numbers, first state, number of states.
    first
        ``[joint + 1]`` first law of each joint.
    dof, place
        ``[joint]`` index of the joint's velocity and position.
    rest
        ``[joint]`` position where the joint's spring is at rest.
    state, trial, rates, nudged
        ``[law state]``; `rates` and `nudged` are work space.
    address
        ``[3]`` of `trial`, `rates` and `nudged`.
    """

    table: Whole
    first: Whole
    dof: Whole
    place: Whole
    rest: Real
    state: Real
    trial: Real
    rates: Real
    nudged: Real
    numbers: Real
    address: Whole


class Record(NamedTuple):
    """What is kept of a run: ``outputs [output, sample]``, and ``[joint, sample]`` of the joints.

    ``rows [output]`` are places in MuJoCo's sensor data.
    """

    outputs: Real
    rows: Whole
    displacement: Real
    motion: Real
    force: Real


@part_code
def advanced_force(laws: Laws, joint: int, d: float, s: float, t: float, step_s: float) -> float:
    """Force of a joint's laws when a step ends with this motion; `trial` takes the states there.

    States move by one linearly implicit step each: bristles bend within microns.
    """
    force = 0.0
    for law in range(laws.first[joint], laws.first[joint + 1]):
        function, numbers = laws.table[law, 0], laws.table[law, 1]
        start, count = laws.table[law, 2], laws.table[law, 3]
        trial, rates, nudged = (
            laws.address[0] + 8 * start,
            laws.address[1] + 8 * start,
            laws.address[2] + 8 * start,
        )
        for place in range(start, start + count):
            laws.trial[place] = laws.nudged[place] = laws.state[place]
        if count > 0:
            call_law(function, d, s, t, numbers, nudged, rates)
        for place in range(start, start + count):
            value, rate = laws.state[place], laws.rates[place]
            nudge = NUDGE * max(abs(value), LEAST_STATE)
            laws.nudged[place] = value + nudge
            call_law(function, d, s, t, numbers, nudged, rates)
            slope = min((laws.rates[place] - rate) / nudge, 0.0)
            laws.nudged[place] = value
            # Other states' rates are asked anew at the common starting point.
            call_law(function, d, s, t, numbers, nudged, rates)
            laws.trial[place] = value + step_s * rate / (1.0 - step_s * slope)
        force += call_law(function, d, s, t, numbers, trial, rates)
    return force


@part_code
def implicit_force(
    laws: Laws, joint: int, d: float, s: float, t: float, step_s: float, free: float, mobility: float
) -> float:
    """Force F of the motion that follows: ``s+ = s + step_s (free - mobility F(s+))``, so that friction sticks.

    The displacement stays that of the step's start, as MuJoCo's own springs have it: the step takes no energy.

    By regula falsi with Illinois' halving (Dahlquist & Björck, *Numerical Methods*, section 6.2).
    """
    drop = step_s * mobility
    high = s + step_s * free
    force = advanced_force(laws, joint, d, high, t, step_s)
    over = drop * force
    # A force that rises with speed has its root between the free velocity and the one that its force there gives.
    low = high - over
    force = advanced_force(laws, joint, d, low, t, step_s)
    under = low - s - step_s * free + drop * force
    size = abs(over)
    if over * under >= 0.0:
        # It falls with speed by more than the inertia in one step: what it is at the explicit step must do.
        return force
    side = 0
    for _ in range(_MOST_STEPS):
        middle = (low * over - high * under) / (over - under)
        force = advanced_force(laws, joint, d, middle, t, step_s)
        left = middle - s - step_s * free + drop * force
        if abs(left) <= _ROUNDING * size:
            break
        if left * over > 0.0:
            high, over = middle, left
            # An end that stays a second time counts half, or it would stay for ever.
            under *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, under = middle, left
            over *= 0.5 if side == -1 else 1.0
            side = -1
    return force


@part_code
def answer_to_unit(mujoco: Simulated, dof: int) -> None:
    """Fill `column` with the accelerations that a unit force at one joint makes."""
    mujoco.unit[dof] = 1.0
    _SOLVE(
        mujoco.address[5],
        (
            mujoco.address[0],
            mujoco.address[1],
            mujoco.address[7],
            mujoco.address[8],
            np.int32(1),
        ),
    )
    mujoco.unit[dof] = 0.0


@part_code
def resist(mujoco: Simulated, laws: Laws, t: float, step_s: float) -> bool:
    """Set the generalised forces of the laws for the step that begins, joint after joint; False when they explode."""
    _STEP(mujoco.address[3], (mujoco.address[0], mujoco.address[1]))
    _STEP(mujoco.address[4], (mujoco.address[0], mujoco.address[1]))
    for joint in range(laws.dof.size):
        if laws.first[joint] == laws.first[joint + 1]:
            continue
        dof = laws.dof[joint]
        answer_to_unit(mujoco, dof)
        # MuJoCo adds the joint's damping to the inertia, by the step's length.
        heavier = 1.0 + step_s * mujoco.damping[dof] * mujoco.column[dof]
        d = mujoco.position[laws.place[joint]] - laws.rest[joint]
        force = implicit_force(
            laws,
            joint,
            d,
            mujoco.velocity[dof],
            t + step_s,
            step_s,
            mujoco.smooth[dof] / heavier,
            mujoco.column[dof] / heavier,
        )
        for law in range(laws.first[joint], laws.first[joint + 1]):
            start = laws.table[law, 2]
            for place in range(start, start + laws.table[law, 3]):
                laws.state[place] = laws.trial[place]
        mujoco.applied[dof] = -force
        for other in range(mujoco.smooth.size):
            mujoco.smooth[other] -= mujoco.column[other] * force
        # Beyond 1e10 MuJoCo would start anew by itself.
        if not abs(mujoco.smooth[dof]) < LARGEST:
            return False
    return True


@part_code
def keep(mujoco: Simulated, laws: Laws, record: Record, sample: int) -> None:
    """Write down what the first step of a sample saw."""
    for row in range(record.rows.size):
        record.outputs[row, sample] = mujoco.sensors[record.rows[row]]
    for joint in range(laws.dof.size):
        record.force[joint, sample] = -mujoco.applied[laws.dof[joint]]


@part_code
def runs_away(mujoco: Simulated) -> bool:
    """Whether a velocity is beyond all physics, or no number."""
    largest = 0.0
    for dof in range(mujoco.velocity.size):
        # Written so that NaN counts.
        if not abs(mujoco.velocity[dof]) <= largest:
            largest = abs(mujoco.velocity[dof])
    return not largest < LARGEST


@machine_code
def run(mujoco: Simulated, laws: Laws, record: Record, inputs: Real, rows: Whole, steps: int, step_s: float) -> int:
    """Simulate sample by sample, each input held until the next; give the samples done, fewer when it runs away.

    ``inputs [input, sample]`` go to ``rows [input]`` of MuJoCo's ``ctrl``; each sample has so many steps.
    """
    busy = laws.first[-1] > 0
    samples: int = inputs.shape[1]
    for sample in range(samples):
        for row in range(rows.size):
            mujoco.command[rows[row]] = inputs[row, sample]
        for joint in range(laws.dof.size):
            record.displacement[joint, sample] = mujoco.position[laws.place[joint]] - laws.rest[joint]
            record.motion[joint, sample] = mujoco.velocity[laws.dof[joint]]
        for step in range(steps):
            for joint in range(laws.dof.size):
                mujoco.applied[laws.dof[joint]] = 0.0
            _STEP(mujoco.address[2], (mujoco.address[0], mujoco.address[1]))
            if busy and not resist(mujoco, laws, (sample * steps + step) * step_s, step_s):
                return sample
            _STEP(mujoco.address[6], (mujoco.address[0], mujoco.address[1]))
            if step == 0:
                keep(mujoco, laws, record, sample)
        if runs_away(mujoco):
            return sample
    return samples
