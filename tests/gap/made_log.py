"""A structure and the log that it would give: what the tests of the gap's plant and tuning share."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfilt

from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.integrator.integrator import Integrator
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput

RATE_HZ = 1024.0
#: Every effect.
WORDS = tuple(CATALOGUE.values())


def chain(masses: Sequence[float], stiffnesses: Sequence[float], dampings: Sequence[float], at: int = 0):
    count = len(masses)
    return StructureModel(
        name="chain",
        structure=Structure(
            bodies=tuple(Body(name=f"b{i}", mass=float(masses[i])) for i in range(count)),
            joints=tuple(
                Joint(
                    name=f"j{i}", between=("ground" if i == 0 else f"b{i - 1}", f"b{i}"),
                    stiffness=float(stiffnesses[i]), damping=float(dampings[i]),
                )
                for i in range(count)
            ),
        ),
        inputs=(StructureInput(name="hammer", at=f"b{at}"),),
        outputs=tuple(StructureOutput(name=f"a{i}", measures="acceleration", at=f"b{i}") for i in range(count)),
    )  # fmt: skip


def three_bodies():
    """Modes at 29, 81 and 117 Hz, damped by 1 to 3 %."""
    return chain([2.0, 2.5, 3.0], [5e5, 6e5, 4e5], [40.0, 60.0, 50.0], at=2)


def damper():
    """On a rig that prescribes its stroke, its force seen: nothing in it moves by itself."""
    return StructureModel(
        name="damper",
        structure=Structure(
            bodies=(Body(name="rod", mass=1.0),),
            joints=(Joint(name="seal", between=("ground", "rod"), stiffness=1000.0, damping=3200.0),),
        ),
        inputs=(StructureInput(name="stroke", at="rod", kind="displacement"),),
        outputs=(StructureOutput(name="force", measures="force", at="seal"),),
    )


def band_noise(samples: int, seed: int = 0, rms: float = 100.0):
    rng = np.random.default_rng(seed)
    return rms * sosfilt(butter(4, 150.0, fs=RATE_HZ, output="sos"), rng.standard_normal((1, samples)))


def white_floor(rms):
    rms = np.asarray(rms, dtype=np.float64)
    count = rms.size
    return NoiseFloor(
        rms=rms, whitening=np.ones((count, 1)), innovation_rms=rms, method=("quiet band",) * count,
        std=np.full(count, 0.1), upper_bound=np.zeros(count, dtype=bool),
    )  # fmt: skip


def problem_of(run, floor):
    """The log of a run beside the linear part of its model, on all lines."""
    log = run.measurement
    return LinearProblem(run.model, log, floor, run.tunables, all_lines(log.samples, log.sample_rate_hz))


def measured(model, signals, *, noise=0.01, seed=0, initial=None, outputs=None, offset=0.0, rate_hz=RATE_HZ):
    """The log of a run with white noise, and its floor."""
    compiled = model.compile()
    found = Integrator(compiled, rate_hz, tolerance=1e-9).run(signals, initial=initial).outputs
    chosen = list(range(len(found))) if outputs is None else outputs
    found = found[chosen]
    rms = noise * found.std(axis=1)
    # Not the numbers that `band_noise` makes an input of: noise that follows the input is none.
    found = found + rms[:, None] * np.random.default_rng([seed, 1]).standard_normal(found.shape) + offset
    terminals = [compiled.outputs[place] for place in chosen]
    log = Measurement(
        log="made", sample_rate_hz=rate_hz, inputs=signals, outputs=found,
        input_names=tuple(one.name for one in compiled.inputs),
        output_names=tuple(one.name for one in terminals),
        output_units=tuple(one.unit for one in terminals),
    )  # fmt: skip
    return log, white_floor(rms)
