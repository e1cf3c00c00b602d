"""Table 1 of the paper beside the influence coefficients of its own transfer function, where they agree best."""

import argparse
import time
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import differential_evolution

from chladni.models.analysis.behaviour import behaviour
from chladni.models.analysis.influence import PAPER_BEHAVIOUR, influence
from chladni.models.core.reading import InfluenceTable
from chladni.models.instruments.pneumatic_motor import INSTRUMENT

ROWS = ("active_area", "air_volume", "reduced_mass")
LETTERS = ("A", "V", "m")
COLUMNS = ("t_r", "a_max", "nu_r", "nu_c")
# Table 1 as printed, without signs: R_PCF of each row, then R_PCD of each column; C = R_PCD/R_PCF.
PAPER_CHANGE = (0.15, 0.40, 1.0)
PAPER = np.array([[0.28, 0.11, 0.30, 1.0], [0.50, 0.11, 0.25, 0.16], [0.33, 0.22, 0.25, 0.33]])
PAPER_C = np.array([[1.86, 0.73, 2.0, 6.66], [1.25, 0.275, 0.625, 0.4], [0.33, 0.22, 0.25, 0.33]])
# The area falls, volume and mass grow: the signs under which most cells come near.
CHANGES = {"active_area": -0.15, "air_volume": 0.40, "reduced_mass": 1.0}
# Has no source in the transfer function, and would only drag the search along.
LEFT_OUT = (0, 3)
WITHIN = 0.25

# The best point found inside the paper's ranges by the search of definitions that seed.md reports.
REPORTED = {
    "active_area": 61e-4, "air_volume": 705e-6, "reduced_mass": 108.0,
    "viscous_loss": 1780.0, "pressure": 4.1e5, "leakage": 0.45e-11,
}  # fmt: skip
# Every variant, changed ones too, stays inside the paper's ranges.
SEARCHED = {
    "active_area": (50e-4 / 0.85, 80e-4), "air_volume": (500e-6, 1000e-6 / 1.4), "reduced_mass": (100.0, 300.0),
    "viscous_loss": (800.0, 1800.0), "pressure": (4e5, 6e5), "leakage": (0.2e-11, 0.7e-11),
}  # fmt: skip


def closed_form(point: Mapping[str, float]) -> np.ndarray:
    """First velocity peak, largest acceleration a unit flow, damped and critical frequency, of equation 2."""
    area, mass = point["active_area"], point["reduced_mass"]
    capacity = point["air_volume"] / (1.4 * point["pressure"])
    stiff = area**2 + point["leakage"] * point["viscous_loss"]
    decay = (capacity * point["viscous_loss"] + mass * point["leakage"]) / (2 * capacity * mass)
    critical = np.sqrt(stiff / (capacity * mass))
    if decay >= critical:
        return np.full(4, np.nan)
    damped = np.sqrt(critical**2 - decay**2)
    fastest = np.arctan2(damped, decay) / damped
    largest = area / (capacity * mass * damped) * np.exp(-decay * fastest) * np.sin(damped * fastest)
    return np.array([np.pi / damped, largest, damped / (2 * np.pi), critical / (2 * np.pi)])


def relative_changes(point: Mapping[str, float]) -> np.ndarray:
    initial = closed_form(point)
    final = np.array([closed_form({**point, name: point[name] * (1 + CHANGES[name])}) for name in ROWS])
    return np.abs((initial - final) / initial)


def mismatch(point: Mapping[str, float]) -> float:
    """Root mean square of ours/paper - 1 over the cells that the transfer function can give."""
    ours = relative_changes(point)
    if not np.all(np.isfinite(ours)):
        return 10.0
    away = ours / PAPER - 1
    away[LEFT_OUT] = 0.0
    return float(np.sqrt(np.sum(away**2) / (PAPER.size - 1)))


def best_point(seed: int) -> dict[str, float]:
    found = differential_evolution(
        lambda x: mismatch(dict(zip(SEARCHED, x, strict=True))), list(SEARCHED.values()), rng=seed, tol=1e-10
    )
    return dict(zip(SEARCHED, (float(x) for x in found.x), strict=True))


def with_damping(point: Mapping[str, float], wanted: float) -> dict[str, float]:
    """Raise the viscous loss until the pair has the wanted damping ratio: that leaves the paper's range."""
    values = dict(point)
    for _ in range(50):
        values["viscous_loss"] *= wanted / damping(values)
    return values


def damping(point: Mapping[str, float]) -> float:
    found = behaviour(INSTRUMENT.model(point).compile(), from_input="flow", to_output="velocity").value(
        "damping_ratio"
    )
    assert found is not None
    return found


def words(ratio: float) -> str:
    if abs(ratio - 1) <= WITHIN:
        return "agrees"
    return "near" if abs(ratio - 1) <= 2 * WITHIN else "**disagrees**"


def report(title: str, point: Mapping[str, float]) -> None:
    table = influence(
        INSTRUMENT, point, parameters=ROWS, behaviour_names=PAPER_BEHAVIOUR, changes=CHANGES, to_output="velocity"
    )
    leaving = [name for name, value in point.items() if not INSTRUMENT.parameters[name].with_value(value).usual]
    outside = f"; outside the paper's range: {', '.join(leaving)}" if leaving else "; all inside the paper's ranges"
    print(f"\n### {title}\n")
    print(
        f"A {1e4 * point['active_area']:.1f} cm², V {1e6 * point['air_volume']:.0f} cm³, "
        f"m {point['reduced_mass'] / 1000:.3f} daN s²/cm, b {point['viscous_loss'] / 1000:.2f} daN s/cm, "
        f"p {point['pressure'] / 1e5:.2f} bar absolute, a {1e11 * point['leakage']:.2f} cm⁵/(daN s); "
        f"damping ratio **{damping(point):.3f}**{outside}; "
        f"RMS of ours/paper - 1 without A/nu_c {mismatch(point):.3f}, "
        f"{count_near(table)} of 11 cells within a quarter.\n"
    )
    print("| cell | R_PCF | paper R, C | ours R, C (finite) | d ln/d ln | ours/paper | |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row, name in enumerate(LETTERS):
        for column, behaves in enumerate(COLUMNS):
            print(line(table, row, column, f"{name}/{behaves}"))


def line(table: InfluenceTable, row: int, column: int, cell: str) -> str:
    ours, coefficient = table.relative_change[row, column], table.finite[row, column]
    ratio = abs(ours) / PAPER[row, column]
    return (
        f"| {cell} | {table.change[row]:+.2f} | {PAPER[row, column]:.2f}, {PAPER_C[row, column]:.3g} "
        f"| {ours:+.3f}, {coefficient:+.3f} | {table.log_derivative[row, column]:+.3f} "
        f"| {ratio:.2f} | {words(ratio)} |"
    )


def count_near(table: InfluenceTable) -> int:
    ratios = np.abs(table.relative_change) / PAPER
    near = np.abs(ratios - 1) <= WITHIN
    near[LEFT_OUT] = False
    return int(near.sum())


def exactness(points: Sequence[Mapping[str, float]]) -> float:
    """Largest relative difference of behaviour from the closed forms."""
    worst = 0.0
    for point in points:
        full = {**INSTRUMENT.parameters.numbers(), **point}
        table = influence(INSTRUMENT, full, parameters=ROWS, behaviour_names=PAPER_BEHAVIOUR, to_output="velocity")
        exact = closed_form(full)
        ours = table.nominal / np.array([1, INSTRUMENT.step_size, 1, 1])
        worst = max(worst, float(np.abs(ours / exact - 1).max()))
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args().seed
    best = best_point(seed)
    free = with_damping(REPORTED, 0.57)
    print("Definitions: response = velocity after a step of flow; t_r = time of its first peak; a_max = largest")
    print("acceleration; nu_r = damped frequency; nu_c = frequency at which z/Q has a phase of -180 degrees.")
    print("R = (initial - final)/initial, C = R_PCD/R_PCF; the paper prints no signs.")
    report("Best point of the search (differential evolution, all variants inside the paper's ranges)", best)
    report("The point reported before, inside the ranges", REPORTED)
    report("Damping ratio 0.57, by a larger viscous loss", free)
    print(f"\nBehaviour against the closed forms: {exactness([best, REPORTED, free]):.1e} relative at most.")
    started = time.perf_counter()
    for _ in range(10):
        influence(INSTRUMENT)
    print(f"One table of {len(INSTRUMENT.parameters)} parameters: {(time.perf_counter() - started) * 100:.0f} ms.")


if __name__ == "__main__":
    main()
