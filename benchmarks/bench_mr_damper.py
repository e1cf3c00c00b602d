"""The MR damper against its logs: errors of the paper's law and of the extension, fitted and held out, and the speed.

`--starts N` (2) sets how many starts each fit takes; `--ship` prints the coefficients that `mr_shipped.py` holds.
"""

import argparse
import os
import time
from collections.abc import Sequence
from pathlib import Path

from chladni.io.log import open_log
from chladni.models.drives.mr_coefficients import MrCoefficients
from chladni.models.drives.mr_damper_fit import MrFit, fit_mr_damper, mr_error
from chladni.models.drives.mr_record import MrRecord, mr_record
from chladni.models.drives.mr_shipped import MEASURED_DAMPER, MEASURED_DAMPER_ASYMMETRIC

LOGS = {"0 A": ("mr_0A", 0.0), "0.5 A": ("mr_0.5A", 0.5), "1 A": ("mr_1A", 1.0), "10 mm, 1 A": ("mr_10mm_1A", 1.0)}
POSITION, VELOCITY, FORCE = "/damper.position[0]", "/damper.velocity[0]", "/damper.effort[0]"
# Percent of RMS force, in the order of the logs.
ALONE, EXTENDED, LINEAR = (10.0, 6.6, 7.0, 5.1), (7.0, 4.6, 4.7, 3.4), {"0.5 A": 8.0, "1 A": 10.0}
PAPER = "near 5 %"


def main() -> None:
    """Print the tables."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--starts", type=int, default=2)
    arguments.add_argument("--ship", action="store_true")
    chosen = arguments.parse_args()
    folder = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    records = [record(folder / f"{file}.mcap", name, current) for name, (file, current) in LOGS.items()]
    for each in records:
        print(f"- {each.name}: " + "; ".join(each.notes))
    if chosen.ship:
        ship(records, chosen.starts)
        return
    print(
        f"\nErrors are RMS error over RMS force, and over peak to peak, in percent; the paper states {PAPER}, of what"
    )
    print("it doesn't say. Every fit starts from rest, over all samples, transients included.\n")
    alone(records, chosen.starts)
    linear(records, chosen.starts)
    shipped(records)


def record(path: Path, name: str, current_a: float) -> MrRecord:
    with open_log(path) as log:
        series = log.read([POSITION, VELOCITY, FORCE])
    return mr_record(series, current_a=current_a, position=POSITION, velocity=VELOCITY, force=FORCE, name=name)


def alone(records: list[MrRecord], starts: int) -> None:
    """A log at a time."""
    print("A log at a time; k1 free, then k1 >= 0 (no joint runs away):\n")
    print("| log | law | k1 | of RMS | at most | of peak to peak | paper | at a bound | time [s] |")
    print("| --- | --- | --- | ---: | ---: | ---: | --- | --- | ---: |")
    for asymmetry, limits in ((False, ALONE), (True, EXTENDED)):
        for lowest_k1 in (None, 0.0):
            for each, limit in zip(records, limits, strict=True):
                fit, seconds = timed([each], asymmetry=asymmetry, lowest_k1=lowest_k1, starts=starts)
                error, law = fit.errors[0], "extended" if asymmetry else "paper"
                sign, bounds = "free" if lowest_k1 is None else ">= 0", ", ".join(fit.at_bounds) or "-"
                print(
                    f"| {each.name} | {law} | {sign} | {100 * error.of_rms_force:.2f} | {limit} | "
                    f"{100 * error.of_peak_to_peak:.2f} | {PAPER} | {bounds} | {seconds:.0f} |"
                )


def linear(records: list[MrRecord], starts: int) -> None:
    """Fitted on 0 A and 10 mm 1 A, linear in current; the other two are predicted."""
    print("\nFitted on 0 A and on 10 mm, 1 A, linear in current; 0.5 A and 1 A at 25 mm held out:\n")
    print("| log | law | of RMS | at most | of peak to peak | paper |\n| --- | --- | ---: | ---: | ---: | --- |")
    for asymmetry in (False, True):
        fit, _ = timed([records[0], records[3]], order=1, asymmetry=asymmetry, starts=starts)
        for each in records:
            limit = LINEAR.get(each.name, "fitted") if not asymmetry or each.name not in LINEAR else "-"
            row(each, "extended" if asymmetry else "paper", fit.coefficients, str(limit))


def shipped(records: list[MrRecord]) -> None:
    """The coefficients of the instrument."""
    print("\nThe instrument's coefficients: all four logs at once, second order in current, k1 >= 0:\n")
    print("| log | law | of RMS | at most | of peak to peak | paper |\n| --- | --- | ---: | ---: | ---: | --- |")
    for law, coefficients in (("paper", MEASURED_DAMPER), ("extended", MEASURED_DAMPER_ASYMMETRIC)):
        for each in records:
            row(each, law, coefficients, "-")


def row(record: MrRecord, law: str, coefficients: MrCoefficients, limit: str) -> None:
    error = mr_error(coefficients, record)
    print(
        f"| {record.name} | {law} | {100 * error.of_rms_force:.2f} | {limit} | "
        f"{100 * error.of_peak_to_peak:.2f} | {PAPER} |"
    )


def timed(
    records: Sequence[MrRecord],
    *,
    order: int | None = None,
    asymmetry: bool,
    lowest_k1: float | None = 0.0,
    starts: int,
) -> tuple[MrFit, float]:
    start = time.perf_counter()
    fit = fit_mr_damper(records, order=order, asymmetry=asymmetry, lowest_k1=lowest_k1, starts=starts)
    return fit, time.perf_counter() - start


def ship(records: list[MrRecord], starts: int) -> None:
    """Print what the product holds."""
    for asymmetry in (False, True):
        fit, seconds = timed(records, asymmetry=asymmetry, starts=starts)
        print(f"\n{fit.coefficients}\nat bounds: {fit.at_bounds}; starts {fit.starts}; {seconds:.0f} s")


if __name__ == "__main__":
    main()
