"""A magnetorheological damper in a press, taken for a viscous one: what its model forgot, current by current.

Needs ``mr_0A.mcap`` and the other ``mr_*`` logs, and ``models/``, in the folder that CHLADNI_DATA names, or in
../shared/data. A path as argument takes the picture of the last log, such as ``damper.png``.
"""

import os
import sys
from pathlib import Path

import numpy as np

import chladni
from chladni import Diagnosis, Model, explained_model

POSITION, FORCE = "/damper.position[0]", "/damper.effort[0]"
#: Name of the log, and the seconds of it that are diagnosed: some strokes tell as much as all.
LOGS = {"mr_0A": 12.0, "mr_0.5A": 12.0, "mr_1A": 12.0, "mr_10mm_1A": 5.0}


def force_error(model: Model, series: chladni.TimeSeries) -> float:
    """Error of the simulated force over the RMS of the measured one."""
    outputs = chladni.simulate(model, series).outputs
    missed = series.values[series.index(FORCE)] - outputs.values[outputs.index(FORCE)]
    return float(np.std(missed) / np.std(series.values[series.index(FORCE)]))


def alternatives(found: Diagnosis) -> str:
    """Name the first effects that were weighed, with the error that each leaves."""
    return ", ".join(f"{one.effect} {one.gap:.1%}" for one in found.ranking[:3] if one.gap is not None)


def main() -> None:
    """Print what each log says, and the force error on the whole log, also beyond what the diagnosis saw."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not all((data / f"{name}.mcap").exists() for name in LOGS):
        print(f"{data} lacks {', '.join(LOGS)}; set CHLADNI_DATA to the folder of measured logs")
        return
    nominal = chladni.load_model(data / "models" / "mr_damper.toml")
    found = None
    for name, end_s in LOGS.items():
        with chladni.open_log(data / f"{name}.mcap") as log:
            series = log.read([POSITION, FORCE])
        found = chladni.diagnose_gap(nominal, series.window(end_s=end_s))
        explained = explained_model(nominal, found)
        print(f"{name}: {found.summary()[0]}")
        print(f"  weighed, with the error left: {alternatives(found)}")
        before, after = force_error(nominal, series), force_error(explained, series)
        print(f"  force error on all {series.duration_s:.1f} s: nominal {before:.0%}, explained {after:.1%}")
    if found is not None and len(sys.argv) > 1:
        found.plot().figure.savefig(sys.argv[1], dpi=200)
        print("picture:", sys.argv[1])


if __name__ == "__main__":
    main()
