"""From a log to a transfer function with error bars, on a robot arm whose truth is known."""

import tempfile
from pathlib import Path

import chladni
from chladni import make_demo_log


def main() -> None:
    """Write the arm's log, read it back, and print where the tool resonates."""
    arm = make_demo_log()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.mcap"
        chladni.write_mcap(arm.series, path)
        with chladni.open_log(path) as log:
            print(f"{len(log.channels)} channels:", ", ".join(channel.name for channel in log.channels))
            response = chladni.frf(
                log, references=arm.reference, responses="/tool.accel.linear.x", resolution_hz=0.25
            )
    account = response.provenance
    print(f"{account.estimator}, {account.effective_averages:.0f} effective averages of {account.segment_s:g} s")
    for peak in chladni.find_response_peaks(response):
        print(
            f"{peak.frequency_hz:7.2f} Hz +- {peak.frequency_std_hz:.2f}   "
            f"{peak.height:6.3f} +- {peak.height_std:.3f} {peak.unit}"
        )
    print("true natural frequencies:", ", ".join(f"{f:.2f}" for f in arm.modes.frequency_hz), "Hz")


if __name__ == "__main__":
    main()
