"""A motion at a lone joint, as a diagnosis hands it to an effect's trials."""

import numpy as np

from chladni.gap.simulators.effects_around import lone_joint
from chladni.models.core.port import Port
from chladni.models.effects.trial import TrialMotion

RATE_HZ, SAMPLES = 1000.0, 4000


def along_joint(displacement, *, stiffness=0.0, force=None) -> TrialMotion:
    """What is known of a joint that moves so."""
    joint = Port(name="j", kind="joint", stiffness=stiffness)
    return TrialMotion(
        name="j", kind="joint", compiled=lone_joint(joint),
        force=np.zeros_like(displacement) if force is None else force,
        displacement=displacement, velocity=np.gradient(displacement) * RATE_HZ, sample_rate_hz=RATE_HZ,
        frequency_hz=np.fft.rfftfreq(displacement.size, 1 / RATE_HZ)[1:],
        believed=np.ones(displacement.size // 2), spectrum=lambda signal: np.fft.rfft(signal)[1:],
        band_hz=(1.0, 100.0), outputs={}, position_at=lambda _: displacement,
    )  # fmt: skip
