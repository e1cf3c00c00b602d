"""Frequency responses of structures in closed form, with noise of known size."""

from dataclasses import replace

import numpy as np

from chladni.models.structures.structure import Body, Joint, Structure
from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance

UNITS = {0: "m", 1: "m/s", 2: "m/s^2"}
X = (1.0, 0.0, 0.0)


def chain(stiffnesses=(4e4, 5e4, 3e4, 6e4, 4.5e4), *, mass=2.0, damping_s=1e-4):
    """Bodies m1, m2, ... between springs, the first of them to the ground; dampers are `damping_s` times springs."""
    names = [f"m{row}" for row in range(1, len(stiffnesses) + 1)]
    return Structure(
        bodies=tuple(Body(name=name, mass=mass * (1 + 0.1 * row)) for row, name in enumerate(names)),
        joints=tuple(
            Joint(name=f"j{row}", between=ends, stiffness=stiffness, damping=damping_s * stiffness)
            for row, (ends, stiffness) in enumerate(
                zip(zip(("ground", *names), names, strict=False), stiffnesses, strict=True)
            )
        ),
    )


def one_mass(frequency_hz=20.0, damping_ratio=0.01, mass=2.0):
    omega = 2 * np.pi * frequency_hz
    joint = Joint(
        name="j", between=("ground", "m1"), stiffness=mass * omega**2, damping=2 * damping_ratio * mass * omega
    )
    return Structure(bodies=(Body(name="m1", mass=mass),), joints=(joint,))


def functions(
    structure, frequency_hz, *, references=("m1",), responses=None, order=2, noise=0.0, seed=0, averages=100.0
):
    """Functions times (j omega)^order with independent noise on each line, of sigma `noise` times their RMS."""
    answers = [body.name for body in structure.bodies] if responses is None else list(responses)
    rows, columns = ([structure.body_index(name) for name in names] for names in (answers, references))
    exact = structure.receptance(frequency_hz)[np.ix_(rows, columns)] * (2j * np.pi * frequency_hz) ** order
    random = np.random.default_rng(seed)
    std = noise * np.sqrt(np.mean(np.abs(exact) ** 2, axis=2, keepdims=True)) * np.ones(frequency_hz.size)
    values = exact + std * (random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape))
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=std,
        coherence=np.ones((len(rows), frequency_hz.size)),
        excited=frequency_hz > 0,
        responses=tuple(Channel(name=f"/{name}.x", unit=UNITS[order], point=name, direction=X) for name in answers),
        references=tuple(
            Channel(name=f"/force_{name}", unit="N", point=name, direction=X, role="reference") for name in references
        ),
        provenance=Provenance(effective_averages=averages),
    )


def reversed_channel(channel):
    """The same channel mounted the other way round."""
    return replace(channel, direction=tuple(-part for part in channel.direction))
