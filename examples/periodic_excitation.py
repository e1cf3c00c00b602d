"""Why the window matters: the F-16's sharp torsion peak with whole periods, and with a Hann window.

Needs ``f16_level1.mcap`` in the folder that CHLADNI_DATA names, or in ../shared/data.
"""

import os
from pathlib import Path

import numpy as np

import chladni

FORCE, PAYLOAD = "/shaker.wrench.force.z", "/payload_rail.accel.linear.z"


def main() -> None:
    """Print the peak both ways, and what the analyser says about it."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not (data / "f16_level1.mcap").exists():
        print(f"{data / 'f16_level1.mcap'} is not there; set CHLADNI_DATA to the folder of measured logs")
        return
    with chladni.open_log(data / "f16_level1.mcap") as log:
        periods = chladni.frf(log, references=FORCE, responses=PAYLOAD)
        windowed = chladni.frf(log, references=FORCE, responses=PAYLOAD, window="hann", resolution_hz=400 / 8192)
    for name, response in (("whole periods", periods), ("Hann window", windowed)):
        excited = response.excited & (response.frequency_hz > 7.0) & (response.frequency_hz < 7.6)
        print(f"{name}: peak {np.abs(response.values[0, 0, excited]).max():.3f} {response.unit(0, 0)}")
        for note in response.provenance.notes:
            print("  -", note)


if __name__ == "__main__":
    main()
