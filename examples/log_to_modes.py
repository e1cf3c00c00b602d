"""From a measured log to validated modes: an aircraft under a shaker, and a building in the wind.

Needs ``f16_level1.mcap`` and ``palisaden.mcap`` in the folder that CHLADNI_DATA names, or in ../shared/data.
"""

import os
from pathlib import Path

import chladni


def main() -> None:
    """Print the modes of both, what is to be distrusted, and how far their shapes resemble each other."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    for name, operational in (("f16_level1.mcap", False), ("palisaden.mcap", True)):
        if not (data / name).exists():
            print(f"{data / name} is not there; set CHLADNI_DATA to the folder of measured logs")
            continue
        with chladni.open_log(data / name) as log:
            report(name, chladni.identify_modes(log, operational=operational))


def report(name: str, modes: chladni.ModeSet) -> None:
    """Print a table of modes with their error bars, and the checks."""
    checks = chladni.validate(modes)
    print(f"{name}: {modes.frequency_hz.size} modes by {modes.provenance.estimator}")
    for row in range(modes.frequency_hz.size):
        print(
            f"  {modes.frequency_hz[row]:8.4f} ± {modes.frequency_std_hz[row]:.4f} Hz   "
            f"{modes.damping_ratio[row]:6.2%} ± {modes.damping_std[row]:.2%}   MPC {checks.mpc[row]:.2f}"
        )
    if modes.fit is not None:
        print(f"  synthesised functions are {modes.fit.error:.1%} from the measured ones")
    print("  AutoMAC\n   ", str(checks.auto_mac.round(2)).replace("\n", "\n    "))
    for finding in checks.findings:
        print("  -", finding)


if __name__ == "__main__":
    main()
