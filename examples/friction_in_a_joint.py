"""What friction in a joint does to a measured resonance: the same arm simulated with and without it.

The log that a test rig would give is simulated, so that its truth is known; the analysis is that of any log.
"""

from dataclasses import replace

import numpy as np

import chladni
from chladni import Multisine, arm_model

SECONDS, RATE_HZ = 40.0, 1000.0


def main() -> None:
    """Print the first resonance seen at three levels of excitation, with and without friction in the elbow."""
    arm = arm_model()
    friction = chladni.attached("coulomb_friction", "elbow", {"force": 4.0})
    truth = arm.modes()
    print(f"first mode of the linear arm: {truth.frequency_hz[0]:.3f} Hz, {truth.damping_ratio[0]:.2%}")
    for name, model in (("without friction", arm), ("with 4 N of Coulomb friction", arm.with_effects([friction]))):
        print(name)
        for level_n in (1.0, 4.0, 16.0):
            excitation = Multisine(rms=level_n, period_s=8.0, band_hz=(5.0, 100.0))
            run = chladni.simulate(model, excitation, duration_s=SECONDS, sample_rate_hz=RATE_HZ, seed=1)
            tool, push = run.outputs.select(["acc_tool"]), run.inputs.select(["push"])
            both = replace(tool, values=np.vstack([push.values, tool.values]), channels=push.channels + tool.channels)
            modes = chladni.identify_modes(both, references="push", band_hz=(15.0, 40.0), count=1)
            for frequency_hz, damping in zip(modes.frequency_hz, modes.damping_ratio, strict=True):
                print(f"  pushed with {level_n:4.0f} N RMS: {frequency_hz:7.3f} Hz, damping {damping:6.2%}")


if __name__ == "__main__":
    main()
