"""A small machine with a hidden cause, measured: the ground truth of the diagnosis's tests."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ = 1000.0
#: A word for each kind of site. The whole catalogue beside a cause is weighed where that is the claim.
ONE_OF_EACH_KIND = frozenset({"coulomb_friction", "hardening_stiffness", "saturation", "gain_error", "time_offset"})


def all_but(*words: str) -> frozenset[str]:
    """Words of the catalogue to leave out, so that these and one of each kind take part."""
    return frozenset(CATALOGUE) - ONE_OF_EACH_KIND - set(words)


def among_few(*words: str) -> pytest.MarkDecorator:
    """Run a test among these words and one of each kind, and by hand among the whole catalogue: `out` is left out."""
    whole = pytest.param(frozenset(), id="catalogue", marks=pytest.mark.nightly)
    return pytest.mark.parametrize("out", [pytest.param(all_but(*words), id="few"), whole])


def arm() -> StructureModel:
    """Column, arm and wrist on a chain of joints, driven at the wrist, an accelerometer on each."""
    names = ("column", "arm", "wrist")
    stiffness, damping = (4.0e5, 2.0e5, 1.0e5), (60.0, 40.0, 25.0)
    joints = ("shoulder", "elbow", "hand")
    ends = (("ground", "column"), ("column", "arm"), ("arm", "wrist"))
    return StructureModel(
        name="arm",
        structure=Structure(
            bodies=tuple(Body(name=name, mass=mass) for name, mass in zip(names, (8.0, 4.0, 2.0), strict=True)),
            joints=tuple(
                Joint(name=name, between=between, stiffness=k, damping=c)
                for name, between, k, c in zip(joints, ends, stiffness, damping, strict=True)
            ),
        ),
        inputs=(StructureInput(name="shaker", at="wrist"),),
        outputs=tuple(StructureOutput(name=f"acc_{name}", measures="acceleration", at=name) for name in names),
    )


def measured(
    effects: Sequence[AttachedEffect] = (),
    *,
    seconds: float = 8.0,
    noise: float = 0.01,
    seed: int = 0,
    off: dict[str, float] | None = None,
    colour: float = 0.0,
    model: StructureModel | None = None,
    force: Real | None = None,
) -> Measurement:
    """Simulate the real machine and measure it.

    Parameters
    ----------
    noise
        Over the RMS of each output.
    off
        True values of parameters over the nominal ones; by default each is off by a few per cent.
    colour
        Coefficient of a first-order autoregressive noise; 0 for white.
    force
        ``[sample]`` of the shaker, N; low-passed noise by default.
    """
    rng = np.random.default_rng(seed)
    nominal = model or arm()
    factors = (
        off if off is not None else {name: float(np.exp(0.03 * rng.standard_normal())) for name in nominal.parameters}
    )
    real = nominal.with_values({name: nominal.parameters[name].value * factor for name, factor in factors.items()})
    count = round(seconds * RATE_HZ)
    force = low_passed(200.0 * rng.standard_normal(count)) if force is None else force
    series = TimeSeries(
        values=force[None], sample_rate_hz=RATE_HZ, channels=(Channel(name="shaker", unit="N", role="reference"),)
    )
    outputs = chladni.simulate(real.with_effects(tuple(effects)), series).outputs.values
    rms = np.std(outputs, axis=1, keepdims=True)
    return Measurement(
        log="log.mcap",
        sample_rate_hz=RATE_HZ,
        inputs=force[None],
        outputs=outputs + noise * rms * _coloured(rng.standard_normal(outputs.shape), colour),
        input_names=("shaker",),
        output_names=tuple(one.name for one in nominal.outputs),
        output_units=("m/s^2",) * len(nominal.outputs),
    )


def with_outputs(measurement: Measurement, names: Sequence[str]) -> Measurement:
    """Keep some of the outputs."""
    rows = [measurement.output_names.index(name) for name in names]
    return replace(
        measurement,
        outputs=measurement.outputs[rows],
        output_names=tuple(names),
        output_units=tuple(measurement.output_units[row] for row in rows),
    )


def low_passed(signal: Real) -> Real:
    spectrum = np.fft.rfft(signal)
    frequency_hz = np.fft.rfftfreq(signal.size, 1 / RATE_HZ)
    return np.asarray(np.fft.irfft(spectrum / (1 + (frequency_hz / 200.0) ** 4), signal.size))


def _coloured(white: Real, colour: float) -> Real:
    found = white.copy()
    for sample in range(1, white.shape[1]):
        found[:, sample] += colour * found[:, sample - 1]
    return found * np.sqrt(1 - colour**2)
