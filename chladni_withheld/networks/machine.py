"""A true machine: a network and all that its model doesn't hold, moved by its inputs and recorded."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import sosfilt

from chladni_withheld.networks.excitation import Grid, Signal
from chladni_withheld.networks.laws import PARAMETERS, Elements, integrate
from chladni_withheld.networks.network import GROUND, Matrix, Network, Sensor

Rows = dict[str, Matrix]
"""What sensors show, by their names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """A force that resists between two ends, by one of the `laws`."""

    code: int
    first: int
    second: int
    numbers: tuple[float, ...]
    joint: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Satellite:
    """A body that the model doesn't know, on a spring and damper; `host` counts on from the model's bodies."""

    host: int
    mass: float
    stiffness: float
    damping: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """What acts between two ends beside the joints: stiffness, damping, and inertia of their relative motion."""

    first: int
    second: int
    stiffness: float = 0.0
    damping: float = 0.0
    inertia: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Addition:
    """What a hidden effect adds to a machine and to its log; each is equal to itself alone.

    Attributes
    ----------
    elements, satellites, links
        To the mechanics.
    skew
        Pairs of bodies with a gyroscopic coefficient, N s/m: the first's speed pushes the second, and back.
    pushes
        Forces on bodies that no log holds, ``(body, [2 steps + 1])``.
    floor
        Acceleration of the ground that no log holds, ``[2 steps + 1]``.
    actuators
        What becomes of a command before it acts, by the input's name.
    recorders
        What becomes of an input's signal before it's sampled.
    wiring
        What becomes of the sensors' signals before they are sampled, of all at once; second argument: their rate.
    clocks
        At what times a sensor is sampled that should be at the given ones.
    converters
        What becomes of a sensor's samples, with their noise.
    """

    elements: tuple[Element, ...] = ()
    satellites: tuple[Satellite, ...] = ()
    links: tuple[Link, ...] = ()
    skew: tuple[tuple[int, int, float], ...] = ()
    pushes: tuple[tuple[int, Matrix], ...] = ()
    floor: Matrix | None = None
    actuators: Mapping[str, Callable[[Signal], Signal]] = field(default_factory=dict)
    recorders: Mapping[str, Callable[[Signal], Signal]] = field(default_factory=dict)
    wiring: Callable[[Rows, float], Rows] | None = None
    clocks: Mapping[str, Callable[[Matrix], Matrix]] = field(default_factory=dict)
    converters: Mapping[str, Callable[[Matrix], Matrix]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A log without noise.

    Attributes
    ----------
    inputs, outputs
        ``[input, sample]`` and ``[output, sample]``.
    acting
        Of each addition, the share of time in which its elements act: slide, touch; 1 where that means nothing.
    """

    inputs: Matrix
    outputs: Matrix
    acting: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorder:
    """What all channels have in common: the grid, and the filter before the converters, if there is one.

    `anti_alias` holds second-order sections at the integrator's rate.
    """

    grid: Grid
    anti_alias: Matrix | None = None

    def sampled(self, values: Matrix) -> Matrix:
        """Samples of the log, of values at all steps."""
        passed = values if self.anti_alias is None else sosfilt(self.anti_alias, values)
        sampled: Matrix = passed[self.grid.before * self.grid.over :: self.grid.over][: self.grid.samples]
        return sampled

    def sampled_at(self, values: Matrix, times_s: Matrix) -> Matrix:
        """Values at other times than the log's, within run-in and log."""
        passed = values if self.anti_alias is None else sosfilt(self.anti_alias, values)
        at = times_s / self.grid.step_s + self.grid.before * self.grid.over
        read: Matrix = CubicSpline(np.arange(len(passed)), passed)(at.clip(0, len(passed) - 1))
        return read


def record(
    network: Network, additions: Sequence[Addition], drives: Sequence[Signal], recorder: Recorder
) -> Recording:
    """Move the machine from rest through run-in and log, and sample what its recorder gets."""
    grid = recorder.grid
    acting_drives = list(drives)
    shown_drives = list(drives)
    for addition in additions:
        for number, drive in enumerate(network.drives):
            acting_drives[number] = addition.actuators.get(drive.name, _same)(acting_drives[number])
            shown_drives[number] = addition.recorders.get(drive.name, _same)(shown_drives[number])
    readings, acting = _moved(network, additions, acting_drives, grid)
    rows = {sensor.name: readings[number] for number, sensor in enumerate(network.sensors)}
    for addition in additions:
        rows = addition.wiring(rows, 1 / grid.step_s) if addition.wiring else rows
    outputs = np.array([_sampled(name, row, additions, recorder) for name, row in rows.items()])
    inputs = [recorder.sampled(signal.values[:-1:2]) for signal in shown_drives]
    return Recording(inputs=np.array(inputs), outputs=outputs, acting=acting)


def converted(network: Network, additions: Sequence[Addition], outputs: Matrix) -> Matrix:
    """Pass outputs with their noise through the converters."""
    rows = list(outputs)
    for addition in additions:
        for number, sensor in enumerate(network.sensors):
            if sensor.name in addition.converters:
                rows[number] = addition.converters[sensor.name](rows[number])
    return np.array(rows)


def _same(signal: Signal) -> Signal:
    return signal


def _sampled(name: str, row: Matrix, additions: Sequence[Addition], recorder: Recorder) -> Matrix:
    clocks = [addition.clocks[name] for addition in additions if name in addition.clocks]
    if not clocks:
        return recorder.sampled(row)
    times_s: Matrix = np.arange(recorder.grid.samples) / recorder.grid.rate_hz
    for clock in clocks:
        times_s = clock(times_s)
    return recorder.sampled_at(row, times_s)


def _moved(
    network: Network, additions: Sequence[Addition], drives: Sequence[Signal], grid: Grid
) -> tuple[Matrix, tuple[float, ...]]:
    mass, damping, stiffness = assembled(network, additions)
    inverse = np.linalg.inv(mass)
    bodies = len(mass)
    elements = [element for addition in additions for element in addition.elements]
    columns, signals, jumps = _all_inputs(network, additions, drives, mass)
    flow = np.hstack([-inverse @ stiffness, -inverse @ damping, inverse @ columns])
    ends = [_direction(element.first, element.second, bodies) for element in elements]
    push = inverse @ np.array(ends).reshape(-1, bodies).T
    view = _view(network, elements, bodies, len(signals), _floor_rows(network, additions))
    readings, acted = integrate(
        np.ascontiguousarray(flow), np.ascontiguousarray(push), _arrays(elements), view, np.array(signals),
        np.array(jumps), -grid.before / grid.rate_hz, grid.step_s,
    )  # fmt: skip
    owners = np.repeat(np.arange(len(additions)), [len(addition.elements) for addition in additions])
    acting = tuple(
        float(acted[owners == number].mean()) if addition.elements else 1.0
        for number, addition in enumerate(additions)
    )
    return readings, acting


def assembled(network: Network, additions: Sequence[Addition]) -> tuple[Matrix, Matrix, Matrix]:
    """Mass, damping, stiffness of the network with its satellites and links, ``[body, body]``."""
    satellites = [satellite for addition in additions for satellite in addition.satellites]
    known = len(network.bodies)
    bodies = known + len(satellites)
    mass, damping, stiffness = (np.zeros((bodies, bodies)) for _ in range(3))
    for matrix, of_network in zip((mass, damping, stiffness), network.matrices(), strict=True):
        matrix[:known, :known] = of_network
    links = [link for addition in additions for link in addition.links]
    for number, satellite in enumerate(satellites, start=known):
        mass[number, number] = satellite.mass
        links.append(
            Link(first=satellite.host, second=number, stiffness=satellite.stiffness, damping=satellite.damping)
        )
    for link in links:
        pattern = np.outer(*2 * (_direction(link.first, link.second, bodies),))
        mass += link.inertia * pattern
        damping += link.damping * pattern
        stiffness += link.stiffness * pattern
    for first, second, coefficient in (entry for addition in additions for entry in addition.skew):
        damping[first, second] -= coefficient
        damping[second, first] += coefficient
    return mass, damping, stiffness


def _direction(first: int, second: int, bodies: int) -> Matrix:
    ends = np.zeros(bodies)
    if second != GROUND:
        ends[second] += 1.0
    if first != GROUND:
        ends[first] -= 1.0
    return ends


def _arrays(elements: Sequence[Element]) -> Elements:
    numbers = np.zeros((len(elements), PARAMETERS))
    for row, element in enumerate(elements):
        numbers[row, : len(element.numbers)] = element.numbers
    codes = np.array([element.code for element in elements], dtype=np.int64)
    ends = np.array([(element.first, element.second) for element in elements], dtype=np.int64).reshape(-1, 2)
    return codes, ends, numbers


def _all_inputs(
    network: Network, additions: Sequence[Addition], drives: Sequence[Signal], mass: Matrix
) -> tuple[Matrix, list[Matrix], list[bool]]:
    """Columns of forces, signals, and which of these jump: the inputs, then floors and pushes that no log holds."""
    bodies = len(mass)
    # A moving ground acts on all that has inertia, satellites too, as a force seen from the ground.
    shaken = -mass @ np.ones(bodies)
    columns = [
        shaken if drive.where == "ground" else np.append(network.place(drive), np.zeros(bodies - len(network.bodies)))
        for drive in network.drives
    ]
    signals, jumps = [signal.values for signal in drives], [signal.jumps for signal in drives]
    for addition in additions:
        hidden = [] if addition.floor is None else [(shaken, addition.floor)]
        hidden += [(_direction(GROUND, body, bodies), values) for body, values in addition.pushes]
        columns += [column for column, _ in hidden]
        signals += [values for _, values in hidden]
        jumps += [False] * len(hidden)
    return np.stack(columns, axis=1), signals, jumps


def _floor_rows(network: Network, additions: Sequence[Addition]) -> list[int]:
    """Rows of those inputs that are accelerations of the ground, in the order of `_all_inputs`."""
    rows = [number for number, drive in enumerate(network.drives) if drive.where == "ground"]
    row = len(network.drives)
    for addition in additions:
        if addition.floor is not None:
            rows.append(row)
            row += 1
        row += len(addition.pushes)
    return rows


def _view(network: Network, elements: Sequence[Element], bodies: int, inputs: int, floors: Sequence[int]) -> Matrix:
    """What sensors show, as `integrate` asks for it: accelerometers at bodies feel the ground's motion too."""
    view = np.zeros((len(network.sensors), 3 * bodies + len(elements) + inputs))
    for row, sensor in enumerate(network.sensors):
        place = np.append(network.place(sensor), np.zeros(bodies - len(network.bodies)))
        if sensor.measures == "force":
            _view_force(view[row], network, elements, sensor, place)
            continue
        part = ("displacement", "velocity", "acceleration").index(sensor.measures)
        view[row, part * bodies : (part + 1) * bodies] = place
        if sensor.measures == "acceleration" and sensor.where == "body":
            view[row, [3 * bodies + len(elements) + floor for floor in floors]] = 1.0
    return view


def _view_force(row: Matrix, network: Network, elements: Sequence[Element], sensor: Sensor, place: Matrix) -> None:
    joint, bodies = network.joints[sensor.at], len(place)
    row[:bodies] = joint.stiffness * place
    row[bodies : 2 * bodies] = joint.damping * place
    for number, element in enumerate(elements):
        row[3 * bodies + number] = float(element.joint == sensor.at)
