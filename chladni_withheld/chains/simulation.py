"""Simulates a plan with true numbers and hidden effects: what its sensors would give without noise."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from chladni.signals.errors import EstimateError
from chladni_withheld.chains.equations import (
    FLOOR,
    Assembly,
    Machine,
    added,
    begin_drive,
    begin_structure,
    command,
    effects_at,
    empty_machine,
    fastest,
    finish_drive,
    finish_structure,
    motion,
    write_motion,
)
from chladni_withheld.chains.excitations import Drive
from chladni_withheld.chains.hidden_effects import (
    acting_place,
    at_body,
    at_joint,
    through_actuator,
    through_sensor,
    tone_name,
)
from chladni_withheld.chains.plan import Bench, Hidden, Output, Plan


def unseen_signals(effects: Sequence[Hidden]) -> list[str]:
    """Name what drives the machine and isn't in the log."""
    tones = [tone_name(one) for one in effects if one.law == "tone"]
    return [*tones, *([FLOOR] if any(one.effect == "base_vibration" for one in effects) else [])]


def built(plan: Plan, numbers: Mapping[str, float], effects: Sequence[Hidden] = (), *, watched: bool = False,
          ) -> Machine:  # fmt: skip
    """Give the machine's equations; its outputs are those of the plan.

    Parameters
    ----------
    watched
        Whether displacement and speed of each joint, and what acts at each input, are outputs too:
        ``JOINT.d``, ``JOINT.s``, ``INPUT.u``, ``INPUT.x`` (where it acts).
    """
    machine = empty_machine(plan, numbers, unseen_signals(effects))
    begin, finish = (begin_drive, finish_drive) if plan.drive else (begin_structure, finish_structure)
    begin(machine)
    _place_bodies(machine, effects)
    _place_inputs(machine, effects)
    for joint in plan.joints:
        for hidden in effects_at(effects, joint.name):
            at_joint(machine, hidden)
    finish(machine)
    write_motion(machine)
    _place_outputs(machine, effects)
    if watched:
        _watch(machine)
    return machine


def _place_bodies(machine: Machine, effects: Sequence[Hidden]) -> None:
    for body in machine.plan.bodies:
        for hidden in effects_at(effects, body):
            at_body(machine, hidden)


def _place_inputs(machine: Machine, effects: Sequence[Hidden]) -> None:
    loop = machine.plan.loop
    for one in machine.plan.inputs:
        signal = {one.name: 1.0}
        if loop is not None and one.name == loop.drives:
            sensor = next(each for each in machine.plan.outputs if each.name == loop.feedback)
            gains = [hidden.numbers["gain"] for hidden in effects_at(effects, sensor.name) if hidden.law == "factor"]
            position = motion(machine, sensor)
            speed = motion(machine, _rate_of(sensor))
            # A wrong gain of the sensor is seen by the controller; anything else at it is kept out of loops.
            for gain in gains:
                position, speed = added((gain, position)), added((gain, speed))
            signal = command(machine, loop, position, speed)
            machine.assembly.outputs[one.name] = dict(signal)
        for hidden in effects_at(effects, one.name):
            signal = through_actuator(machine, hidden, signal)
        machine.acting[one.name] = signal


def _rate_of(sensor: Output) -> Output:
    return replace(sensor, measures="velocity")


def _place_outputs(machine: Machine, effects: Sequence[Hidden]) -> None:
    clean = {one.name: motion(machine, one) for one in machine.plan.outputs}
    for one in machine.plan.outputs:
        signal = clean[one.name]
        for hidden in effects_at(effects, one.name):
            if hidden.law == "share":
                signal = added((1.0, signal), (hidden.numbers["coefficient"], clean[hidden.source]))
            else:
                signal = through_sensor(machine, hidden, signal)
        machine.assembly.outputs[one.name] = signal


def _watch(machine: Machine) -> None:
    for joint in machine.plan.joints:
        d, s = machine.stretch(joint)
        machine.assembly.outputs |= {f"{joint.name}.d": d, f"{joint.name}.s": s}
    if "force" in machine.signals:
        machine.assembly.outputs["drive.force"] = machine.signals["force"]
    for one in machine.plan.inputs:
        machine.assembly.outputs[f"{one.name}.u"] = dict(machine.acting[one.name])
        machine.assembly.outputs[f"{one.name}.x"] = acting_place(machine, one.name)[0]


Matrix = NDArray[np.float64]

LEAST_STEPS, MOST_STEPS = 16, 1024
#: Angle that the fastest state turns in a step: at 0.25 a step's error is below 1e-5 of it.
_LARGEST_ANGLE = 0.25


def steps_for(assembly: Assembly, interval: float) -> int:
    """Give a number of steps a sample at which the linear part is exact to a few parts in a million."""
    wanted = max(LEAST_STEPS, ceil(fastest(assembly, interval) * interval / _LARGEST_ANGLE))
    # Powers of two, so that halving and shifts by parts of a sample stay whole.
    return min(1 << (wanted - 1).bit_length(), MOST_STEPS)


def integrate(assembly: Assembly, signals: Matrix, interval: float, *, start_s: float = 0.0, steps: int) -> Matrix:
    """Give ``[output, sample]``, from rest at the first sample.

    Parameters
    ----------
    signals
        ``[input, sample]``, in the order of ``assembly.inputs``; straight lines join the samples.
    interval
        Seconds between samples.
    start_s
        Time of the first sample, for laws that know the time.
    steps
        Runge-Kutta steps a sample.

    Raises
    ------
    EstimateError
        When the motion leaves all bounds.
    """
    from chladni_withheld.chains.kernel import march

    arrays = assembly.arrays(interval, steps)
    y = np.full((len(assembly.outputs), signals.shape[1]), np.nan)
    driven = np.ascontiguousarray(signals, dtype=np.float64)
    fine = march(
        driven, interval, steps, np.zeros(arrays.states), arrays.system, arrays.law, arrays.observed, start_s, y
    )
    if not fine:
        raise EstimateError("the hidden motion grows without bound; draw the case again")
    return y


def respond(assembly: Assembly, signals: Matrix, interval: float) -> Matrix:
    """Give what `integrate` gives for a machine without laws and shifts, exactly and many times faster.

    Inputs that run along straight lines make the step from sample to sample a matrix (G. F. Franklin, J. D. Powell,
    M. Workman, Digital Control of Dynamic Systems, section 4.3: the triangle hold).
    """
    from chladni_withheld.chains.kernel import recur

    arrays = assembly.arrays(interval, 1)
    a, b, inputs = arrays.system
    n = a.shape[0]
    block = np.zeros((n + 2 * inputs, n + 2 * inputs))
    block[:n, :n], block[:n, n : n + inputs] = a * interval, b * interval
    block[n : n + inputs, n + inputs :] = np.eye(inputs)
    powers = expm(block)
    now, slope = powers[:n, n : n + inputs], powers[:n, n + inputs :]
    states = np.zeros((signals.shape[1], n))
    driven = np.ascontiguousarray(signals, dtype=np.float64)
    recur(np.ascontiguousarray(powers[:n, :n]), now - slope, np.ascontiguousarray(slope), driven, states)
    c, d, _ = arrays.observed
    return np.asarray(c @ states.T + d @ driven)


def perform(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden] = (), *,
            steps: int | None = None, watched: bool = False) -> dict[str, Matrix]:  # fmt: skip
    """Simulate a bench and give the log's samples of each output, before noise and converters.

    Parameters
    ----------
    steps
        A sample; as many as the linear part needs if None.
    watched
        See `building.built`.

    Raises
    ------
    EstimateError
        When the motion grows without bound.
    """
    machine = built(bench.plan, numbers, effects, watched=watched)
    interval, count = 1.0 / bench.rate_hz, drive.signals.shape[1]
    rows = [_unseen(effects, name, bench, drive) for name in unseen_signals(effects)]
    signals = np.vstack([drive.signals, *rows]) if rows else drive.signals
    assembly = machine.assembly
    if not effects and not assembly.laws:
        y = respond(assembly, signals, interval)
    else:
        steps = steps_for(assembly, interval) if steps is None else steps
        y = integrate(assembly, signals, interval, start_s=-drive.before * interval, steps=steps)
    if count != drive.before + bench.samples and np.isnan(y[:, -1]).all():
        raise EstimateError("the hidden motion was not simulated to its end")
    # A clock that is late shows the machine at rest before its start.
    shown = np.nan_to_num(y[:, drive.before : drive.before + bench.samples])
    return dict(zip(machine.assembly.outputs, shown, strict=True))


def measured(bench: Bench) -> list[str]:
    """Names of what the log holds as outputs: a loop's own command, then the sensors."""
    loop = bench.plan.loop
    return [*([] if loop is None else [loop.drives]), *(one.name for one in bench.plan.outputs)]


def settled(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], *,
            within: float) -> tuple[int, dict[str, Matrix]] | None:  # fmt: skip
    """Simulate with twice as many steps again and again, until the outputs change by less than `within`, pooled RMS.

    Gives the last number of steps a sample and what came of it; None when it never settles: a motion that depends on
    the last digit of everything can't be compared with any simulation.
    """
    steps = steps_for(built(bench.plan, numbers, effects).assembly, 1.0 / bench.rate_hz)
    coarse = _tried(bench, numbers, drive, effects, steps)
    while steps < MOST_STEPS:
        steps *= 2
        fine = _tried(bench, numbers, drive, effects, steps)
        if coarse is not None and fine is not None and pooled_change(bench, coarse, fine) < within:
            return steps, fine
        coarse = fine
    return None


def _tried(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], steps: int,
           ) -> dict[str, Matrix] | None:  # fmt: skip
    try:
        return perform(bench, numbers, drive, effects, steps=steps)
    except EstimateError:
        # Too few steps for a stiff contact look like a motion without bound.
        return None


def rms(values: Matrix) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def pooled_change(bench: Bench, before: Mapping[str, Matrix], after: Mapping[str, Matrix]) -> float:
    """RMS over all outputs of the change over each one's own RMS."""
    names = measured(bench)
    shares = [rms(after[name] - before[name]) / max(rms(before[name]), 1e-300) for name in names]
    return float(np.sqrt(np.mean(np.square(shares))))


def _unseen(effects: Sequence[Hidden], name: str, bench: Bench, drive: Drive) -> Matrix:
    """Samples of a driving signal that the log doesn't hold."""
    hidden = next(
        one for one in effects if (one.effect == "base_vibration" if name == FLOOR else name == f"{one.site}.tone")
    )
    count, n = drive.signals.shape[1], hidden.numbers
    rng = np.random.default_rng(int(n["seed"]))
    if name == FLOOR:
        return _shaped_noise(rng, count, bench.rate_hz, n)
    times = (np.arange(count) - drive.before) / bench.rate_hz
    wander = n["wander"] * np.cumsum(rng.standard_normal(count)) / np.sqrt(bench.rate_hz)
    return np.asarray(n["amplitude"] * np.sin(2 * np.pi * n["frequency"] * times + n["phase"] + wander))


def _shaped_noise(rng: np.random.Generator, count: int, rate_hz: float, n: Mapping[str, float]) -> Matrix:
    """Noise of RMS `level` from `low` to `high` whose density goes with a power of frequency."""
    frequency = np.fft.rfftfreq(count, 1.0 / rate_hz)
    lines = rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)
    inside = (frequency >= n["low"]) & (frequency <= n["high"])
    weight = np.where(inside, (np.maximum(frequency, n["low"]) / n["low"]) ** (0.5 * n["tilt"]), 0.0)
    noise = np.fft.irfft(lines * weight, n=count)
    return np.asarray(n["level"] * noise / rms(noise))
