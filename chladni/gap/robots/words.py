"""Words for robots: what each adds to the missing torque, as columns of numbers to be found."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from chladni.gap.robots.torques import ALL_COMMANDS, Torques
from chladni.robots.dynamics import inertial_numbers
from chladni.robots.robot import Robot, RobotJoint
from chladni.signals.arrays import Real

WORLD = "world"
#: Of its usual speed: where Stribeck's rise ends, in turn.
_STRIBECK = (0.05, 0.15, 0.4)
#: Quantiles of the drive's torque at which a limit is tried.
_LIMITS = (0.8, 0.9, 0.96)
#: Half the period of a servo's loop at 1 kHz.
LOOP_S = 5e-4
#: Standard deviations of what words are about, before a log is seen: a gain, a delay (s), a lag (s), a reading (rad),
#: a tilt (rad), a mass over the link's own, friction a load, and a payload over the heaviest link, at so many metres.
_GAIN, _DELAY_S, _LAG_S, _READING, _TILT, _MASS, _BY_LOAD = 0.3, 0.01, 0.02, 0.05, 0.1, 0.5, 0.3
_PAYLOAD, _REACH_M = 0.3, 0.1
#: Zero-g offset of an accelerometer, m/s^2, one sigma: sensors of robots are within two or three hundredths of g.
_ZERO_G = 0.1
#: The same of its delay, s: low-pass filters of such sensors take 2 to 20 ms by their data sheets.
_IMU_S = 0.005
#: One over a gain, less one, of a drive that gives ten times what it's asked for.
_MOST_GAIN = -0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A number of a term.

    Attributes
    ----------
    scale
        Standard deviation before the log is seen: what would be a usual part of the torque.
    least
        What it can't be below, beside the nominal one.
    nominal
        What the description believes, which is added when it's told.
    """

    name: str
    unit: str
    scale: float
    least: float = -np.inf
    nominal: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Term:
    """A word at a site, with the columns of its numbers.

    Attributes
    ----------
    word, site, variant
        What, where, and which form.
    columns
        ``[number, joint, coarse]``: missing torque a unit of each number.
    numbers
        One a column.
    rows
        Of the joints whose law this idealises; none where the physics is exact.
    """

    word: str
    site: str
    columns: Real
    numbers: tuple[Number, ...]
    rows: tuple[int, ...] = ()
    variant: str | None = None

    @property
    def key(self) -> tuple[str, str]:
        """Word and site."""
        return self.word, self.site

    @property
    def scale(self) -> Real:
        """``[number]``."""
        return np.array([one.scale for one in self.numbers])

    @property
    def least(self) -> Real:
        """``[number]``."""
        return np.array([one.least for one in self.numbers])

    @property
    def nominal(self) -> Real:
        """``[number]``."""
        return np.array([one.nominal for one in self.numbers])

    def holds(self, other: "Term") -> bool:
        """Whether this is another law with more numbers, of which the first are the other's."""
        count = len(other.numbers)
        return len(self.numbers) > count and np.array_equal(self.columns[:count], other.columns)


Maker = Callable[[Torques], Iterator[Term]]


def all_terms(torques: Torques) -> list[Term]:
    """Give every word at every site of a robot."""
    return [term for make in _MAKERS for term in make(torques)]


def _at(torques: Torques, row: int, *columns: Real) -> Real:
    found = np.zeros((len(columns), *torques.missing.shape))
    found[:, row] = columns
    return found


def _rms(values: Real) -> float:
    return float(np.sqrt(np.mean(values**2))) + 1e-12


def _usual(torques: Torques, row: int) -> float:
    """Torque that a joint usually gives."""
    return max(float(np.std(torques.drive[row])), float(torques.highest_noise[row]))


def _units(joint: RobotJoint) -> tuple[str, str, str]:
    """Of a force, a damping and a stiffness."""
    return ("N m", "N m s/rad", "N m/rad") if joint.kind == "hinge" else ("N", "N s/m", "N/m")


def _law(
    torques: Torques, row: int, word: str, columns: tuple[Real, ...], *numbers: Number, variant: str | None = None
) -> Term:
    """A law of one joint."""
    return Term(
        word=word, site=torques.joints[row].name, columns=_at(torques, row, *columns), numbers=numbers, rows=(row,),
        variant=variant,
    )  # fmt: skip


def _friction(torques: Torques) -> Iterator[Term]:
    for row, joint in torques.rows:
        usual, speed = _usual(torques, row), _rms(torques.velocity[row])
        force, damping, _ = _units(joint)
        sign, fast = torques.sign[row], torques.fast_velocity[row]
        dry = Number(name="force", unit=force, scale=usual, least=-joint.friction, nominal=joint.friction)
        law = partial(_law, torques, row)
        yield law("coulomb_friction", (sign,), dry)
        wet = Number(
            name="coefficient", unit=damping, scale=usual / speed, least=-joint.damping, nominal=joint.damping
        )
        yield law("viscous_friction", (torques.velocity[row],), wet)
        unit = f"{force} s^2/rad^2" if joint.kind == "hinge" else "N s^2/m^2"
        square = Number(name="coefficient", unit=unit, scale=usual / speed**2, least=0.0)
        yield law("quadratic_damping", (torques.smooth(fast * np.abs(fast)),), square)
        # What the drive gives holds the friction itself: the load is what the motion needs.
        carried = np.abs(torques.of_joints(torques.need.torque)[row]) * sign
        by_load = Number(name="coefficient", unit="1", scale=_BY_LOAD, least=0.0)
        yield law("load_friction", (sign, carried), dry, by_load)
        for share in _STRIBECK:
            fades = np.exp(-((fast / (share * speed)) ** 2))
            rise = Number(name="rise", unit=force, scale=usual, least=0.0)
            columns = (sign, torques.smooth(torques.fast_sign[row] * fades))
            yield law("stribeck_friction", columns, dry, rise, variant=f"{share:g}")


def _coupled(torques: Torques) -> Iterator[Term]:
    """Friction of the sum or difference of two speeds in a wrist: its last motor drives through the joint before."""
    robot = torques.robot
    inner = {one for one in torques.joints for other in torques.joints if robot.is_behind(one, other)}
    for row, (one, other) in enumerate(pairwise(torques.joints)):
        if not (one.kind == other.kind == "hinge" and robot.is_behind(one, other)) or other in inner:
            continue
        usual = min(_usual(torques, row), _usual(torques, row + 1))
        for sense, variant in ((1.0, "sum"), (-1.0, "difference")):
            fast = torques.fast_velocity[row] + sense * torques.fast_velocity[row + 1]
            smooth = torques.velocity[row] + sense * torques.velocity[row + 1]
            sign = torques.smooth(np.tanh(fast / np.hypot(*torques.slow[row : row + 2])))
            dry = Number(name="force", unit="N m", scale=usual, least=0.0)
            wet = Number(name="coefficient", unit="N m s/rad", scale=usual / _rms(smooth), least=0.0)
            for word, law, number in (("coulomb_friction", sign, dry), ("viscous_friction", smooth, wet)):
                columns = _at(torques, row, law) + sense * _at(torques, row + 1, law)
                yield Term(
                    word=word, site=f"{one.name}~{other.name}", columns=columns, numbers=(number,),
                    rows=(row, row + 1), variant=variant,
                )  # fmt: skip


def _springs(torques: Torques) -> Iterator[Term]:
    for row, joint in torques.rows:
        usual, mean = _usual(torques, row), float(np.mean(torques.position[row]))
        travel = _rms(torques.position[row] - mean)
        force, _, stiffness = _units(joint)
        yield Term(
            word="joint_spring", site=joint.name, rows=(row,),
            columns=_at(torques, row, torques.position[row], np.ones_like(torques.position[row])),
            numbers=(
                Number(name="stiffness", unit=stiffness, scale=usual / travel, least=0.0),
                Number(name="torque", unit=force, scale=usual * (1.0 + abs(mean) / travel)),
            ),
        )  # fmt: skip


def _inertia(torques: Torques) -> Iterator[Term]:
    for row, joint in torques.rows:
        number = Number(
            name="inertia", unit="kg m^2" if joint.kind == "hinge" else "kg", least=-joint.armature,
            nominal=joint.armature, scale=_usual(torques, row) / _rms(torques.acceleration[row]),
        )  # fmt: skip
        columns = _at(torques, row, torques.acceleration[row])
        yield Term(word="armature", site=joint.name, columns=columns, numbers=(number,))


def _drives(torques: Torques) -> Iterator[Term]:
    for row, joint in torques.rows:
        # In units of what was asked the motion needs 1/gain times its torque: so no gain explains all by being small.
        over = Number(name="over_gain", unit="1", scale=_GAIN, least=_MOST_GAIN, nominal=1.0)
        columns = _at(torques, row, torques.wanted[row])
        yield Term(word="gain_error", site=joint.name, columns=columns, numbers=(over,))
    if torques.by_effort:
        return
    yield from _commands(torques)
    for row, joint in torques.rows:
        lagging = torques.smooth(np.gradient(torques.fast_drive[row], 1.0 / torques.log.sample_rate_hz))
        lag = Number(name="time_constant", unit="s", scale=_LAG_S, least=0.0)
        yield Term(word="lag", site=joint.name, columns=_at(torques, row, lagging), numbers=(lag,))
        for share in _LIMITS:
            limit = float(np.quantile(np.abs(torques.fast_drive[row]), share))
            cut = torques.fast_drive[row] - np.clip(torques.fast_drive[row], -limit, limit)
            yield Term(
                word="saturation", site=joint.name, columns=_at(torques, row, torques.smooth(cut)),
                # All of what is beyond a limit is missing; the part tells how well the limit was tried.
                numbers=(Number(name="part", unit="1", scale=1.0, least=0.5),),
                variant=f"{limit:.3g} {_units(joint)[0]}",
            )  # fmt: skip


def _commands(torques: Torques) -> Iterator[Term]:
    if torques.log.command_kind != "position":
        return
    believed, common = torques.robot.delay_s, torques.late_s.get(ALL_COMMANDS, 0.0)
    delay = Number(name="delay", unit="s", scale=_DELAY_S, least=-believed, nominal=believed)
    yield Term(word="delay", site=ALL_COMMANDS, columns=torques.late(0.0, common)[None], numbers=(delay,))
    for row, joint in torques.rows:
        late = torques.late(common, torques.late_s.get(joint.name, 0.0))
        delay = Number(name="delay", unit="s", scale=_DELAY_S, least=-believed - common)
        yield Term(word="delay", site=joint.name, columns=_at(torques, row, late[row]), numbers=(delay,))
        damped = torques.kd[row] * torques.velocity[row]
        yield Term(
            word="controller_gain", site=joint.name,
            columns=_at(torques, row, torques.wanted[row] + damped, damped),
            numbers=(
                Number(name="over_kp", unit="1", scale=_GAIN, least=_MOST_GAIN, nominal=1.0),
                Number(name="kd_over_kp", unit="1", scale=_GAIN),
            ),
        )  # fmt: skip


def _readings(torques: Torques) -> Iterator[Term]:
    number = Number(name="offset", unit="rad", scale=_READING)
    for row, joint in torques.rows:
        columns = torques.offset[row][None]
        yield Term(word="encoder_offset", site=joint.name, columns=columns, numbers=(number,), variant="of the log")
        if not torques.by_effort and torques.kp[row] > 0:
            columns = _at(torques, row, np.full(torques.missing.shape[1], torques.kp[row]))
            yield Term(
                word="encoder_offset", site=joint.name, columns=columns, numbers=(number,), variant="of the drive"
            )


def _bodies(torques: Torques) -> Iterator[Term]:
    angles = tuple(Number(name=name, unit="rad", scale=_TILT) for name in ("about_x", "about_y", "about_z"))
    if torques.base is None:
        yield Term(word="gravity_tilt", site=WORLD, columns=torques.tilt, numbers=angles[:2])
    elif torques.log.imu is not None:
        # Which way is down an IMU tells.
        yield Term(word="misalignment", site=torques.log.imu.site, columns=torques.turned, numbers=angles)
    numbers = inertial_numbers(torques.robot)
    columns = torques.of_joints(np.moveaxis(torques.need.regressor, (2, 3), (0, 1)))
    usual = _PAYLOAD * float(np.max(numbers[:, 0]))
    load = (
        Number(name="mass", unit="kg", scale=usual, least=0.0),
        *(Number(name=f"moment_{axis}", unit="kg m", scale=usual * _REACH_M) for axis in "xyz"),
    )
    moved = {joint.link for joint in torques.robot.joints}
    for link, name in enumerate(torques.robot.links):
        reach = columns[link, :4]
        if not np.any(reach):
            continue
        # What is fixed to a link moves as one with it: a payload on it is one on the link.
        if name in moved:
            point = np.einsum(
                "p,pjk->jk", _moments_of_point(torques.centre_m.get(name, np.zeros(3))), columns[link, 4:]
            )
            whole = np.concatenate([reach[:1] + point, reach[1:]])
            yield Term(word="payload", site=name, columns=whole, numbers=load)
        if numbers[link, 0] > 0:
            whole = np.einsum("p,pjk->jk", numbers[link], columns[link])
            mass = Number(name="mass", unit="1", scale=_MASS, least=-1.0)
            yield Term(word="parameter", site=f"{name}.mass", columns=whole[None], numbers=(mass,))


def _moments_of_point(centre: Real) -> Real:
    """Moments of inertia of a unit of mass at a place, about the origin: xx, yy, zz, xy, xz, yz."""
    x, y, z = centre
    return np.array([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])


def tolerances(torques: Torques) -> tuple[Real, list[str]]:
    """Give columns ``[number, joint, coarse]``, of a standard deviation each, and names of what tolerances allow."""
    tolerance = torques.robot.tolerance
    found = list(_of_links(torques))
    for row, joint in torques.rows:
        if joint.armature > 0:
            own = joint.armature * torques.acceleration[row]
            found.append((f"{joint.name}.armature", tolerance.inertia * _at(torques, row, own)[0]))
        if tolerance.friction > 0:
            found.append((f"{joint.name}.friction", tolerance.friction * _at(torques, row, torques.sign[row])[0]))
        if tolerance.gains > 0 and not torques.by_effort and torques.log.command_kind == "position":
            damped = torques.kd[row] * torques.velocity[row]
            both = _at(torques, row, torques.wanted[row] + damped, damped) * tolerance.gains
            found += zip((f"{joint.name}.kp", f"{joint.name}.kd"), both, strict=True)
    if torques.base is not None:
        # What an accelerometer reads at rest is off by a constant, and filters of an IMU take their time.
        found += zip(("imu.x", "imu.y", "imu.z"), _ZERO_G * torques.carried[:3], strict=True)
        found.append(("imu.late", _IMU_S * torques.late_base))
    if not torques.by_effort and torques.log.command_kind == "position":
        # A digital servo holds what it reads for a period.
        found.append(("loop", -LOOP_S * torques.loop))
    if torques.by_effort and torques.log.command is not None and torques.log.command_kind == "position":
        # Efforts are sampled while commands are held: always just after a step, or just before it.
        between = torques.smooth(np.nan_to_num(torques.command() - torques.log.command))
        for row, joint in torques.rows:
            stiffness = torques.kp[row] or _usual(torques, row) / _rms(
                torques.position[row] - np.mean(torques.position[row])
            )
            found.append((f"{joint.name}.hold", _at(torques, row, stiffness * between[row])[0]))
    columns = np.array([column for _, column in found]).reshape(-1, *torques.missing.shape)
    return columns, [name for name, _ in found]


def _of_links(torques: Torques) -> Iterator[tuple[str, Real]]:
    """Relative errors of mass, centre of mass and moments of inertia of every link that moves."""
    regressor = torques.of_joints(np.moveaxis(torques.need.regressor, (2, 3), (0, 1)))
    for changes, columns, link in zip(tolerated_inertia(torques.robot), regressor, torques.robot.links, strict=True):
        if np.any(changes) and np.any(columns):
            for name, column in zip(INERTIAL_NAMES, np.einsum("np,pjk->njk", changes, columns), strict=True):
                yield f"{link}.{name}", column


INERTIAL_NAMES = ("mass", "x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz")


def tolerated_inertia(robot: Robot) -> Real:
    """Give ``[link, number, 10]``: by how much each of `INERTIAL_NAMES` may change the inertial numbers, one sigma.

    The mass changes them all; a first moment or an inertia itself alone.
    """
    found = np.zeros((len(robot.links), len(INERTIAL_NAMES), len(INERTIAL_NAMES)))
    for changes, own in zip(found, inertial_numbers(robot), strict=True):
        # About the link's origin; a body is as long as its inertia over its mass says.
        mass, inertia = own[0], float(np.sum(own[4:7])) / 2.0
        if mass > 0:
            np.fill_diagonal(changes, [0.0, *[np.sqrt(mass * inertia)] * 3, *[inertia] * 6])
            changes[0] = own
    return robot.tolerance.inertia * found


_MAKERS: tuple[Maker, ...] = (_friction, _coupled, _springs, _inertia, _drives, _readings, _bodies)
