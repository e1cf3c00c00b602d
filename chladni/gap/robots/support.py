"""Whether a base that floats is in the air, or stands on legs whose ground no log tells of."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.ndimage import binary_dilation

from chladni.gap.robots.motion import LEAST
from chladni.gap.robots.torques import Torques
from chladni.robots.dynamics import inertial_numbers, needed_torque
from chladni.robots.machine import about_centre
from chladni.robots.robot import Robot
from chladni.signals.arrays import Index, Real
from chladni.signals.errors import LogError

#: Of its weight: a robot whose legs carry more stands on them.
_STANDS = 0.5


def require_in_the_air(torques: Torques) -> None:
    """Refuse a robot that stands: its joints would seem to lack what the ground gives.

    Whatever holds it elsewhere does no harm: the IMU tells what the joints feel of it.

    Raises
    ------
    LogError
        With the longest time in the air.
    """
    if torques.base is None:
        return
    width = max(round(LEAST / torques.cutoff_hz * torques.rate_hz), 1)
    starts = np.arange(0, max(torques.kept.size - width, 0) + 1, width)
    shares = _shares(torques, [slice(a, a + width) for a in starts])
    stands = shares > _STANDS
    if not stands.any():
        return
    # Feet come down amid a span.
    first, last = _longest(np.flatnonzero(~binary_dilation(stands)))
    time_s = torques.log.time_s[torques.kept]
    raise LogError(
        f"{torques.log.log}: {torques.robot.name} stands on its last links for "
        f"{np.count_nonzero(stands) * width / torques.rate_hz:.3g} s, with forces that no log tells; "
        + (
            f"choose what is in the air by --start and --end, as from {time_s[starts[first]]:.3g} to "
            f"{time_s[starts[last] + width - 1]:.3g} s after the first state"
            if first <= last
            else "record it held by its base, its legs in the air"
        )
    )


def _longest(places: Index) -> tuple[int, int]:
    """First and last of the longest run of numbers that follow one another; the last before the first of none."""
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    found = max(runs, key=len)
    return (int(found[0]), int(found[-1])) if found.size else (0, -1)


def _shares(torques: Torques, spans: Sequence[slice]) -> Real:
    """``[span]``: share of what holds the robot that seems to come through its last links' tips; 0 of a fall.

    It's what the joints miss, in units of the torque that the whole force would make there.
    """
    robot, base, held = torques.robot, torques.base, torques.held
    if base is None or held is None:
        return np.zeros(len(spans))
    model = robot.model
    whole = float(np.sum(model.body_mass[model.body_rootid == 1 + robot.links.index(base.link)]))
    weight = whole * float(np.linalg.norm(model.opt.gravity))
    # A mass at a tip that feels what holds the base presses as that does.
    still = np.zeros((model.nv, torques.kept.size))
    felt = still.copy()
    felt[base.dof : base.dof + 3] = held[:3] + np.array(model.opt.gravity)[:, None]
    regressor = needed_torque(robot, torques.all_positions, still, felt).regressor
    columns = np.array([_at_tip(robot, link, torques, regressor) for link in _last_links(robot)])[:, torques.driven]
    missing, found = torques.missing[: len(torques.joints)][torques.driven], np.zeros(len(spans))
    for place, span in enumerate(spans):
        if np.sqrt(np.mean(np.sum(held[:3, span] ** 2, axis=0))) < _STANDS * weight:
            continue
        presses = columns[..., span].reshape(len(columns), -1).T
        found[place] = -float(np.sum(np.linalg.lstsq(presses, missing[:, span].ravel(), rcond=None)[0]))
    return found


def _at_tip(robot: Robot, link: int, torques: Torques, regressor: Real) -> Real:
    """``[joint, coarse]``: torque of a unit of mass at a link's tip."""
    point = np.concatenate([[1.0], _tip(inertial_numbers(robot)[link])])
    return torques.of_joints(np.einsum("p,dsp->ds", point, regressor[:, :, link, :4]))


def _last_links(robot: Robot) -> Iterator[int]:
    """Links that joints move, and behind which there's no joint."""
    model, moved = robot.model, {1 + robot.links.index(one.link) for one in robot.joints}
    before = set[int]()
    for body in moved:
        above = int(model.body_parentid[body])
        while above:
            before.add(above)
            above = int(model.body_parentid[above])
    return (body - 1 for body in sorted(moved - before))


def _tip(numbers: Real) -> Real:
    """End of a link, m: of the rod from its joint that has its centre of mass and its inertia."""
    if numbers[0] <= 0:
        return np.zeros(3)
    mass, centre, inertia = about_centre(numbers)
    way = float(np.linalg.norm(centre))
    half = float(np.sqrt(3.0 * np.linalg.eigvalsh(inertia)[-1] / mass))
    return np.asarray(centre * (1.0 + half / way)) if way > 0 else centre
