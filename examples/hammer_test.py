"""An impact test on a measured log: which hits are rejected and why, and where the structure resonates.

Needs ``hammer.mcap`` in the folder that CHLADNI_DATA names, or in ../shared/data.
"""

import os
from pathlib import Path

import chladni


def main() -> None:
    """Print rejected hits and the peaks of H1."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not (data / "hammer.mcap").exists():
        print(f"{data / 'hammer.mcap'} is not there; set CHLADNI_DATA to the folder of measured logs")
        return
    with chladni.open_log(data / "hammer.mcap") as log:
        response = chladni.frf(log, references="/daq.hammer", responses="/daq.response")
    print(f"{response.provenance.averages} hits averaged")
    for note in response.provenance.notes:
        print("-", note)
    for peak in chladni.find_response_peaks(response, count=12):
        print(f"{peak.frequency_hz:8.1f} Hz   {peak.height:8.2f}")


if __name__ == "__main__":
    main()
