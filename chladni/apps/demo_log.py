"""A robot arm's log with known truth: shaken at the tool, measured on every body."""

from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.models.structures.robot_arm import robot_arm
from chladni.models.structures.structure import NaturalModes, Structure
from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

SAMPLE_RATE_HZ = 1000.0
DURATION_S = 60.0
SHAKEN = "tool"
FORCE_RMS_N = 8.0
FORCE_BAND_HZ = (2.0, 300.0)
SENSOR_NOISE = 0.01
FAN_HZ, FAN_AMPLITUDE = 120.0, 0.05
LOST_FROM_S, LOST_TO_S, LOST_SENSOR = 20.0, 20.25, "wrist"
START_TIME_NS = 1_760_000_000_000_000_000
SEED = 1787  # the year of Chladni's "Entdeckungen über die Theorie des Klanges"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DemoLog:
    """The made log and everything that is true of it.

    Attributes
    ----------
    series
        Force and accelerations, a topic each, the lost stretch marked invalid.
    structure
        The arm that moved.
    modes
        Its natural modes in closed form.
    """

    series: tuple[TimeSeries, ...]
    structure: Structure
    modes: NaturalModes

    @property
    def reference(self) -> str:
        """Name of the force channel."""
        return force_channel().name

    def accelerance(self, body: str, frequency_hz: Real) -> Complex:
        """Exact acceleration of a body over the force, ``[frequency]`` in (m/s^2)/N."""
        row, column = self.structure.body_index(body), self.structure.body_index(SHAKEN)
        return np.asarray(self.structure.accelerance(frequency_hz)[row, column], dtype=np.complex128)


def force_channel() -> Channel:
    """Channel of the shaker's force."""
    return Channel(name="/shaker.wrench.force.x", unit="N", point=SHAKEN, direction=(1.0, 0.0, 0.0), role="reference")


def acceleration_channel(body: str) -> Channel:
    """Channel of a body's accelerometer."""
    return Channel(name=f"/{body}.accel.linear.x", unit="m/s^2", point=body, direction=(1.0, 0.0, 0.0))


def make_demo_log() -> DemoLog:
    """Simulate the arm for a minute, with sensor noise, a fan on the base and a stretch of lost messages."""
    rng = np.random.default_rng(SEED)
    structure = robot_arm()
    samples = int(DURATION_S * SAMPLE_RATE_HZ)
    force = _band_limited_noise(rng, samples) * FORCE_RMS_N
    motion = structure.acceleration(force, at=SHAKEN, sample_rate_hz=SAMPLE_RATE_HZ)
    motion[structure.body_index("base")] += FAN_AMPLITUDE * np.sin(
        2 * pi * FAN_HZ * np.arange(samples) / SAMPLE_RATE_HZ
    )
    motion += SENSOR_NOISE * motion.std(axis=1, keepdims=True) * rng.standard_normal(motion.shape)
    series = [_series(force_channel(), force)]
    series += [
        _series(acceleration_channel(body.name), row) for body, row in zip(structure.bodies, motion, strict=True)
    ]
    return DemoLog(series=tuple(series), structure=structure, modes=structure.natural_modes())


def setup_text(structure: Structure) -> str:
    """Give the setup file that says where the sensors sit."""
    points = [
        f'[[point]]\nname = "{body.name}"\nposition = [{", ".join(str(axis) for axis in body.position)}]\n'
        for body in structure.bodies
    ]
    channels = [(force_channel(), "reference")]
    channels += [(acceleration_channel(body.name), "response") for body in structure.bodies]
    tables = [
        f'[[channel]]\npath = "{channel.name}"\npoint = "{channel.point}"\ndirection = "+x"\nrole = "{role}"\n'
        for channel, role in channels
    ]
    names = ", ".join(f'"{body.name}"' for body in structure.bodies)
    return "\n".join(['format = "chladni.setup/1"\n', *points, *tables, f"[[line]]\npoints = [{names}]\n"])


def _series(channel: Channel, values: Real) -> TimeSeries:
    valid = np.ones((1, values.size), dtype=bool)
    if channel.point == LOST_SENSOR and channel.role == "response":
        valid[0, round(LOST_FROM_S * SAMPLE_RATE_HZ) : round(LOST_TO_S * SAMPLE_RATE_HZ)] = False
    return TimeSeries(
        values=np.where(valid, values, np.nan),
        valid=None if valid.all() else valid,
        sample_rate_hz=SAMPLE_RATE_HZ,
        start_time_ns=START_TIME_NS,
        channels=(channel,),
    )


def _band_limited_noise(rng: np.random.Generator, samples: int) -> Real:
    frequency_hz = np.fft.rfftfreq(samples, 1 / SAMPLE_RATE_HZ)
    inside = (frequency_hz >= FORCE_BAND_HZ[0]) & (frequency_hz <= FORCE_BAND_HZ[1])
    lines = rng.standard_normal(frequency_hz.size) + 1j * rng.standard_normal(frequency_hz.size)
    noise = np.fft.irfft(np.where(inside, lines, 0.0), n=samples)
    return np.asarray(noise / noise.std(), dtype=np.float64)
