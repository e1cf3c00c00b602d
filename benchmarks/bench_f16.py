"""The F-16's torsion peak at four levels by default settings, beside the published values."""

import os
from pathlib import Path

import chladni

PUBLISHED = {1: (7.324, 0.258), 3: (7.275, 0.233), 5: (7.227, 0.097), 7: (7.227, 0.075)}
FORCE, PAYLOAD = "/shaker.wrench.force.z", "/payload_rail.accel.linear.z"


def main() -> None:
    """Print the table."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    print("| level | torsion peak [Hz] | published | height [(m/s²)/N] | published | peaks outside 2 to 15 Hz |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for level, (frequency_hz, height) in PUBLISHED.items():
        with chladni.open_log(data / f"f16_level{level}.mcap") as log:
            response = chladni.frf(log, references=FORCE, responses=PAYLOAD)
        peaks = chladni.find_response_peaks(response)
        torsion = max((peak for peak in peaks if 6.8 < peak.frequency_hz < 7.8), key=lambda peak: peak.height)
        outside = sum(not 2.0 <= peak.frequency_hz <= 15.0 for peak in peaks)
        print(
            f"| {level} | {torsion.frequency_hz:.3f} | {frequency_hz} | {torsion.height:.3f} | {height} | {outside} |"
        )


if __name__ == "__main__":
    main()
