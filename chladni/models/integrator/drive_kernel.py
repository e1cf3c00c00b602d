"""Kernel: inputs of a step that is part of the interval between two samples."""

from typing import NamedTuple

from chladni.models.integrator.machine_code import inlined_code
from chladni.models.integrator.plane import Integers1, Numbers1, Numbers2
from chladni.signals.arrays import Real


class Drive(NamedTuple):
    """Inputs: ``rows [sample, width]`` of the steps, and how they run inside, see `Hold`.

    ``line [column]`` is the place of each straight column among the straight ones.
    """

    rows: Numbers2
    rate: Integers1
    line: Integers1
    straight: Integers1
    kinked: Integers1
    kink_at: Numbers1


@inlined_code
def fill_inputs(drive: Drive, inputs: Real, sample: int, part: float, share: float, step_s: float) -> None:
    """Row of the step that begins at `part` of the interval after `sample` and takes a `share` of it."""
    for place in range(inputs.size):
        inputs[place] = drive.rows[sample, place]
    if share == 1.0:
        return
    m, lines = drive.rate.size, drive.straight.size
    for column in range(m):
        # Taylor's series along the rates up to a straight line: for a plain input it's the line itself.
        factor, power, place, value = 1.0, 0.0, column, drive.rows[sample, column]
        while drive.rate[place] >= 0:
            place = drive.rate[place]
            power += 1.0
            factor *= part * step_s / power
            value += factor * drive.rows[sample, place]
        inputs[column] = value + factor * part / (power + 1.0) * drive.rows[sample, m + drive.line[place]]
    for line in range(lines):
        inputs[m + line] *= share
    _fill_kinks(drive, inputs, sample, part, share)


@inlined_code
def _fill_kinks(drive: Drive, inputs: Real, sample: int, part: float, share: float) -> None:
    m, kinks = drive.rate.size, drive.kinked.size
    first = m + drive.straight.size
    for kink in range(kinks):
        change, jump = drive.rows[sample, first + kink], drive.rows[sample, first + kinks + kink]
        since = part - drive.kink_at[kink]
        inside = since <= 0.0 < since + share
        inputs[first + kink] = share * change if inside else 0.0
        inputs[first + kinks + kink] = jump if inside else 0.0
        if since > 0.0:
            inputs[drive.kinked[kink]] += since * change + jump
            inputs[m + drive.line[drive.kinked[kink]]] += share * change
