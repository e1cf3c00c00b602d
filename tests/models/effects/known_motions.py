"""A motion at a lone joint, as a diagnosis hands it to an effect's trials."""

import numpy as np

from chladni.models.core.port import Port
from chladni.models.effects.trial import TrialMotion
from chladni.models.simulators.wrapped_simulator import equations

RATE_HZ, SAMPLES = 1000.0, 4000


def along(kind, signal, *, force=None, compiled=None, name="s", outputs=None) -> TrialMotion:
    """What is known of a motion, or of a signal, at a site."""
    return TrialMotion(
        name=name, kind=kind,
        compiled=compiled if compiled is not None else equations(ports=(Port(name="j", kind="joint"),)),
        force=np.zeros_like(signal) if force is None else force,
        displacement=signal, velocity=np.gradient(signal) * RATE_HZ, sample_rate_hz=RATE_HZ,
        frequency_hz=np.fft.rfftfreq(signal.size, 1 / RATE_HZ)[1:], believed=np.ones(signal.size // 2),
        spectrum=lambda one: np.fft.rfft(one)[1:], band_hz=(1.0, 100.0), outputs=outputs or {},
        position_at=lambda _: signal,
    )  # fmt: skip


def weighed(trials, motion, force):
    """Values of the form that explains most of a force, and the share of its power that it leaves."""
    wanted, found = motion.spectrum(force), []
    for trial in trials:
        for shape in trial.grid:
            part = trial.build(shape)
            rest = wanted if part.fixed is None else wanted - part.fixed
            columns = np.hstack([part.basis.real, part.basis.imag]).T
            amplitudes = np.linalg.lstsq(columns, np.hstack([rest.real, rest.imag]), rcond=None)[0]
            values = trial.values(shape, amplitudes)
            if values is not None:
                left = np.sum(np.abs(rest - amplitudes @ part.basis) ** 2) / np.sum(np.abs(wanted) ** 2)
                found.append((float(left), values))
    left, values = min(found, key=lambda one: one[0])
    return values, left


def along_joint(displacement, *, stiffness=0.0, force=None) -> TrialMotion:
    """What is known of a joint that moves so."""
    joint = Port(name="j", kind="joint", stiffness=stiffness)
    return along("joint", displacement, force=force, compiled=equations(ports=(joint,)), name="j")
