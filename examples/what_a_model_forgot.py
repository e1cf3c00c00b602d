"""A robot arm's model beside the log of a machine whose elbow rubs.

The machine is simulated, with parameters that are a few per cent off and noise on its sensors: the truth is known.
A folder as argument takes ``arm.toml`` and ``arm.mcap``, for ``chladni gap arm.toml arm.mcap``.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import chladni
from chladni import Multisine, StructureModel, arm_model

SECONDS, RATE_HZ, NOISE = 8.0, 1000.0, 0.01
FRICTION_N = 8.0


def model_of_the_arm() -> StructureModel:
    """Give the arm with the channels that its log will have: topics with one value each."""
    model = arm_model()
    return replace(
        model,
        inputs=tuple(replace(one, channel=f"/{one.name}.value") for one in model.inputs),
        outputs=tuple(replace(one, channel=f"/{one.name}.value") for one in model.outputs),
    )


def log_of_the_machine() -> chladni.TimeSeries:
    """Simulate the arm with friction in its elbow."""
    rng = np.random.default_rng(7)
    model = model_of_the_arm()
    off = {name: one.value * float(np.exp(0.03 * rng.standard_normal())) for name, one in model.parameters.items()}
    machine = model.with_values(off).with_effects(
        [chladni.attached("coulomb_friction", "elbow", {"force": FRICTION_N}, variant="bristle")]
    )
    push = Multisine(rms=40.0, period_s=4.0, band_hz=(5.0, 120.0))
    run = chladni.simulate(machine, push, duration_s=SECONDS, sample_rate_hz=RATE_HZ, seed=2)
    measured = run.outputs.values
    noise = NOISE * measured.std(axis=1, keepdims=True) * rng.normal(size=measured.shape)
    return replace(
        run.outputs,
        values=np.vstack([run.inputs.values, measured + noise]),
        channels=run.inputs.channels + run.outputs.channels,
    )


def main() -> None:
    """Print the answer beside the truth."""
    model, log = model_of_the_arm(), log_of_the_machine()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        chladni.write_model(model, folder / "arm.toml")
        chladni.write_mcap(log, folder / "arm.mcap")
    found = chladni.diagnose_gap(model, log)
    for sentence in found.summary():
        print(sentence)
    print(f"truth: Coulomb friction of {FRICTION_N:g} N at elbow, every parameter off by some per cent")


if __name__ == "__main__":
    main()
