"""Words of links, of readings and of the world; and what tolerances allow for."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from chladni.gap.records.diagnosis import PARAMETER
from chladni.gap.robots.term import Number, Term, at_row
from chladni.gap.robots.torques import Torques
from chladni.robots.dynamics import inertial_numbers
from chladni.signals.arrays import Real

WORLD = "world"
#: Variant of an encoder's offset: the log's reading, not the loop's.
OF_THE_LOG = "of the log"
#: Standard deviations before a log is seen: a reading (rad), a tilt (rad), a mass over the link's own.
_READING, _TILT, _MASS = 0.05, 0.1, 0.5
#: A payload over the heaviest link, at so many metres.
_PAYLOAD, _REACH_M = 0.3, 0.1
#: Radius of gyration of what is carried, m, before a log is seen.
_EXTENT_M = 0.05
#: Times that reach: where nothing that is carried has its centre.
_FAR = 3.0


def readings(torques: Torques) -> Iterator[Term]:
    """Encoders whose zero is elsewhere."""
    number = Number(name="offset", unit="rad", scale=_READING)
    for row, joint in torques.rows:
        make = partial(_offset, torques, row)
        yield Term(word="encoder_offset", site=joint.name, make=make, numbers=(number,), variant=OF_THE_LOG)
        if (torques.two_sided or not torques.by_effort) and torques.kp[row] > 0:
            pulled = np.full(torques.missing.shape[1], torques.kp[row])
            make = partial(at_row, torques, torques.servo_row(row), pulled)
            yield Term(word="encoder_offset", site=joint.name, make=make, numbers=(number,), variant="of the drive")


def _offset(torques: Torques, row: int) -> Real:
    return torques.offset(row)[None]


def bodies(torques: Torques) -> Iterator[Term]:
    """Tilt, and wrong masses."""
    angles = tuple(Number(name=name, unit="rad", scale=_TILT) for name in ("about_x", "about_y", "about_z"))
    if torques.base is None:
        yield Term(word="gravity_tilt", site=WORLD, make=lambda: torques.tilt, numbers=angles[:2])
    elif torques.log.imu is not None:
        # Which way is down an IMU tells.
        yield Term(word="misalignment", site=torques.log.imu.site, make=lambda: torques.turned_imu, numbers=angles)
    mass = Number(name="mass", unit="1", scale=_MASS, least=-1.0)
    for name, own, columns in _links(torques):
        if own[0] > 0:
            make = partial(_of_whole, own, columns)
            heavier = partial(_added, torques, name, partial(_of_whole, own))
            yield Term(word=PARAMETER, site=f"{name}.mass", make=make, numbers=(mass,), inertia=heavier)


def _of_whole(own: Real, columns: Real) -> Real:
    return np.tensordot(own, columns, 1)[None]


def _added(torques: Torques, link: str, of_columns: Callable[[Real], Real]) -> Real:
    """Inertia between joints that numbers of a link add, by what makes columns of them."""
    return of_columns(torques.inertia_of_links[torques.robot.links.index(link)])


def payloads(torques: Torques) -> Iterator[Term]:
    """Masses that links carry, with the inertia of a ball about where their centres were found to be."""
    heavy = _PAYLOAD * float(np.max(inertial_numbers(torques.robot)[:, 0]))
    load = (
        Number(name="mass", unit="kg", scale=heavy, least=0.0),
        *(Number(name=f"moment_{axis}", unit="kg m", scale=heavy * _REACH_M) for axis in "xyz"),
        Number(name="inertia", unit="kg m^2", scale=heavy * _EXTENT_M**2, least=0.0),
    )
    moved = {joint.link for joint in torques.robot.joints}
    for name, _, columns in _links(torques):
        # What is fixed to a link moves as one with it: a payload on it is one on the link.
        if name in moved:
            of_columns = partial(_of_ball, torques.guesses.centre_m.get(name, np.zeros(3)))
            heavier = partial(_added, torques, name, of_columns)
            make = partial(of_columns, columns)
            yield Term(word="payload", site=name, make=make, numbers=load, reach=_FAR * _REACH_M, inertia=heavier)


def _of_ball(centre_m: Real, columns: Real) -> Real:
    """``[5, ...]`` of ``[10, ...]``: of a mass, its three moments and the inertia about its centre."""
    point = columns[:4] + np.tensordot(_slopes_of_point(centre_m), columns[4:], 1)
    return np.concatenate([point, np.sum(columns[4:7], axis=0, keepdims=True)])


def _links(torques: Torques) -> Iterator[tuple[str, Real, Real]]:
    """Names, inertial numbers and columns of those links that the log's joints feel."""
    columns = torques.of_joints(np.moveaxis(torques.need.regressor, (2, 3), (0, 1)))
    for name, own, each in zip(torques.robot.links, inertial_numbers(torques.robot), columns, strict=True):
        if np.any(each[:4]):
            yield name, own, each


def _slopes_of_point(centre: Real) -> Real:
    """``[4, 6]``: by how much a point's moments of inertia (xx, yy, zz, xy, xz, yz) grow with mass and first moment.

    Of ``(h.h 1 - h h') / m`` about the origin, at h = m centre. It's of first degree in both, so that slopes make all
    of it.
    """
    outer = np.outer(centre, centre)
    slopes = [np.trace(outer) * -np.eye(3) + outer]
    for along, axis in zip(centre, np.eye(3), strict=True):
        slopes.append(2.0 * along * np.eye(3) - np.outer(axis, centre) - np.outer(centre, axis))
    return np.array([one[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]] for one in slopes])
