"""References: where the robot is told to be, at any time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from chladni_withheld.case import Matrix
from chladni_withheld.robots.descriptions import Description

Rng = np.random.Generator
#: ``reference(t_s)`` gives ``[joint, time]``, rad.
Reference = Callable[[Matrix], Matrix]


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """What a reference may use: the pose it moves about, and the largest way from it and speed of each joint."""

    centre: Matrix
    reach: Matrix
    speed: Matrix


def draw_room(rng: Rng, robot: Description) -> Room:
    """A pose inside the middle of all ranges, ways that stay inside of them, and speeds that people dare."""
    middle, half = 0.5 * (robot.low + robot.high), 0.5 * (robot.high - robot.low)
    centre = middle + rng.uniform(-0.45, 0.45, middle.size) * half
    reach = np.minimum(0.5 * half, rng.uniform(0.35, 0.9) * np.ones(middle.size))
    speed = np.minimum(0.6 * robot.speed, rng.uniform(0.7, 2.2) * np.ones(middle.size))
    return Room(centre=centre, reach=reach, speed=speed)


def draw_reference(rng: Rng, room: Room, length_s: float) -> tuple[str, Reference]:
    """A trajectory in one of the ways that people use, and its word."""
    word = str(rng.choice(["fourier", "multisine", "point_to_point"]))
    made = {"fourier": _fourier, "multisine": _multisine, "point_to_point": _points}[word](rng, room, length_s)
    return word, made


def _fourier(rng: Rng, room: Room, length_s: float) -> Reference:
    """Harmonics of one period, J. Swevers and others, IEEE Transactions on Robotics and Automation 13 (1997)."""
    period_s = length_s / rng.integers(1, 3)
    return _sines(rng, room, np.arange(1, int(rng.integers(4, 8))) / period_s)


def _multisine(rng: Rng, room: Room, _length_s: float) -> Reference:
    return _sines(rng, room, np.sort(rng.uniform(0.1, rng.uniform(0.8, 1.8), 8)))


def _sines(rng: Rng, room: Room, hz: Matrix) -> Reference:
    joints = room.centre.size
    omega = 2.0 * np.pi * hz
    parts = rng.normal(size=(2, joints, hz.size)) / np.sqrt(omega)
    grid = np.linspace(0.0, 4.0 / hz[0], 4000)

    def at(t: Matrix, order: int = 0) -> Matrix:
        turned = np.outer(omega, t) + 0.5 * np.pi * order
        found: Matrix = (parts[0] * omega**order) @ np.sin(turned) + (parts[1] * omega**order) @ np.cos(turned)
        return found

    most = np.maximum(np.abs(at(grid)).max(axis=1) / room.reach, np.abs(at(grid, 1)).max(axis=1) / room.speed)
    return lambda t: room.centre[:, None] + at(t) / most[:, None]


def _points(rng: Rng, room: Room, length_s: float) -> Reference:
    """Moves of a fifth-order polynomial from pose to pose, with rests between; all joints arrive together."""
    times, poses = [-10.0], [room.centre]
    begin_s, pose = 0.0, room.centre
    while begin_s < length_s + 10.0:
        goal = room.centre + rng.uniform(-1.0, 1.0, pose.size) * room.reach
        # The polynomial's fastest is 15/8 of its mean.
        takes_s = max(0.4, float(np.max(1.875 * np.abs(goal - pose) / room.speed)) * rng.uniform(1.0, 1.6))
        times += [begin_s, begin_s + takes_s]
        poses += [pose, goal]
        begin_s, pose = begin_s + takes_s + rng.uniform(0.05, 0.5), goal
    ends, held = np.array(times), np.array(poses).T

    def at(t: Matrix) -> Matrix:
        place = np.clip(np.searchsorted(ends, t, "right") - 1, 0, ends.size - 2)
        share = np.clip((t - ends[place]) / (ends[place + 1] - ends[place]), 0.0, 1.0)
        smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        found: Matrix = held[:, place] + (held[:, place + 1] - held[:, place]) * smooth
        return found

    return at
