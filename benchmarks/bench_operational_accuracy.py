"""Modes from responses alone against structures known in closed form: errors, coverage, false and missed modes."""

import argparse
import os
import sys
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
# Two processes share two cores; threads of BLAS in each would only get into each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import chladni
from chladni.modal.operational.subspace import CovarianceDrivenSubspace
from chladni.signals.channel import Channel
from chladni.signals.mode_set import ModeSet
from chladni.signals.time_series import TimeSeries
from tests.modal.truth import ModalTruth, ambient_record, chain, mac

PUBLISHED_HZ = (1.88202, 2.42170, 2.68704)
PUBLISHED_DAMPING = (0.0157, 0.0150, 0.0153)
# Ten-minute segments of the building's record, over 3.
SEGMENT_STD_HZ = (1.2e-3, 2.2e-3, 1.8e-3)


@dataclass(frozen=True)
class Campaign:
    """What many records of one structure gave: rows of modes found, and records with missed or extra modes."""

    frequency_error: np.ndarray
    damping_error: np.ndarray
    damping_z: np.ndarray
    frequency_z: np.ndarray
    shape_z: np.ndarray
    mac: np.ndarray
    runs: int
    missed: int
    extra: int


def matched(modes: ModeSet, truth: ModalTruth) -> list[int] | None:
    """Row of each true mode, None when one is missing or there twice."""
    rows = [np.flatnonzero(np.abs(modes.frequency_hz / hz - 1) < 0.03) for hz in truth.frequency_hz]
    return [int(row[0]) for row in rows] if all(row.size == 1 for row in rows) else None


def shape_deviations(modes: ModeSet, row: int, true: np.ndarray) -> np.ndarray:
    """Real and imaginary parts of all components but the one that is 1, in sigmas."""
    shape, std = modes.shapes[row], modes.shape_std[row]
    largest = int(np.argmax(np.abs(shape)))
    off, free = shape - true / true[largest], np.arange(shape.size) != largest
    return np.concatenate([off.real[free] / std.real[free], off.imag[free] / std.imag[free]])


def one_record(run: int, *, truth: ModalTruth, cycles: int, noise: float, seed: int) -> tuple[list, list, int] | None:
    """Numbers of each mode, deviations of its shape, and extra modes; None when a mode is missing."""
    record = ambient_record(truth, cycles=cycles, rng=np.random.default_rng([seed, run]), noise=noise)
    modes = CovarianceDrivenSubspace().identify(record)
    found = matched(modes, truth)
    if found is None:
        return None
    rows, shape_z = [], []
    for mode, row in enumerate(found):
        off_hz = modes.frequency_hz[row] - truth.frequency_hz[mode]
        off_damping = modes.damping_ratio[row] - truth.damping_ratio[mode]
        rows.append(
            (
                off_hz / truth.frequency_hz[mode],
                off_damping / truth.damping_ratio[mode],
                off_damping / modes.damping_std[row],
                off_hz / modes.frequency_std_hz[row],
                mac(modes.shapes[row], truth.shapes[mode]),
            )
        )
        shape_z.append(shape_deviations(modes, row, truth.shapes[mode]))
    return rows, shape_z, modes.frequency_hz.size - truth.frequency_hz.size


def campaign(pool: Executor, truth: ModalTruth, *, runs: int, cycles: int, noise: float, seed: int) -> Campaign:
    """Identify the modes of many records without a word of advice."""
    one = partial(one_record, truth=truth, cycles=cycles, noise=noise, seed=seed)
    found = [result for result in pool.map(one, range(runs)) if result is not None]
    columns = np.array([row for rows, _, _ in found for row in rows]).reshape(-1, 5).T
    shape_z = np.array([one for _, shapes, _ in found for one in shapes])
    extra = sum(extra > 0 for _, _, extra in found)
    return Campaign(*columns[:4], shape_z, columns[4], runs, runs - len(found), extra)


def false_mode(run: int, channels: int) -> bool:
    """Whether any mode is claimed in white noise."""
    noise = np.random.default_rng([3, channels, run]).standard_normal((channels, 20_000))
    names = tuple(Channel(name=f"/{row}", unit="m/s^2") for row in range(channels))
    record = TimeSeries(values=noise, sample_rate_hz=100.0, channels=names)
    return CovarianceDrivenSubspace().identify(record).frequency_hz.size > 0


def accuracy_rows(pool: Executor, runs: int) -> list[tuple[str, str, str]]:
    found = campaign(pool, chain(), runs=runs, cycles=20_000, noise=0.01, seed=1)
    return [
        ("chain, 20 000 cycles, 1 % noise: largest error of frequency", _percent(found.frequency_error), "0.1 %"),
        ("largest error of damping", _percent(found.damping_error), "10 %"),
        ("largest error of damping in predicted sigmas", f"{np.abs(found.damping_z).max():.2f}", "3"),
        ("lowest MAC", f"{found.mac.min():.5f}", "0.99"),
        ("records with a missed mode; with an extra one", f"{found.missed}; {found.extra} of {runs}", "0; 0"),
    ]


def coverage_rows(pool: Executor, runs: int) -> list[tuple[str, str, str]]:
    found = campaign(pool, chain(), runs=runs, cycles=2000, noise=0.01, seed=2)
    named = (("frequency", found.frequency_z), ("damping", found.damping_z), ("shape components", found.shape_z))
    return [
        (f"95 % intervals of {name}, {runs} records of 2000 cycles", f"{np.mean(np.abs(z) < 1.96):.1%}", "92 to 98 %")
        for name, z in named
    ] + [("of these, records with a missed mode; with an extra one", f"{found.missed}; {found.extra}", "")]


def false_rows(pool: Executor, runs: int) -> list[tuple[str, str, str]]:
    rows = []
    for channels in (3, 6, 12):
        false = sum(pool.map(partial(false_mode, channels=channels), range(runs)))
        rows.append((f"white noise, {channels} channels: records with any mode", f"{false} of {runs}", "0"))
    found = campaign(pool, chain(), runs=runs, cycles=20_000, noise=1.0, seed=4)
    return [
        *rows,
        ("chain at 0 dB: records with all five modes", f"{runs - found.missed} of {runs}", "95 %"),
        ("of these, with an extra mode", f"{found.extra}", ""),
    ]


def building_rows(_pool: Executor, _runs: int) -> list[tuple[str, str, str]]:
    folder = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    path = folder / "palisaden.mcap"
    if not path.exists():
        return [("eight-storey building", f"skipped: no {path}", "")]
    (record,) = chladni.open_log(path).read_groups(None)
    modes = CovarianceDrivenSubspace().identify(record)
    rows = []
    for hz, damping, std_hz in zip(PUBLISHED_HZ, PUBLISHED_DAMPING, SEGMENT_STD_HZ, strict=True):
        row = int(np.argmin(np.abs(modes.frequency_hz - hz)))
        frequency = f"{modes.frequency_hz[row]:.4f} ± {modes.frequency_std_hz[row]:.4f} Hz"
        found = f"{frequency}, {modes.damping_ratio[row]:.2%} ± {modes.damping_std[row]:.2%}"
        asked = f"0.3 %, 0.3 points, sigma {0.7 * std_hz * 1e3:.1f} to {2 * std_hz * 1e3:.1f} mHz"
        rows.append((f"building, published {hz} Hz, {damping:.2%}", found, asked))
    others = [f"{hz:.3f}" for hz in modes.frequency_hz[modes.frequency_hz > 3]]
    return [*rows, ("further modes", f"{', '.join(others) or 'none'} Hz", "real ones")]


def _percent(errors: np.ndarray) -> str:
    return f"{np.abs(errors).max():.3%}"


PARTS = {"building": building_rows, "accuracy": accuracy_rows, "coverage": coverage_rows, "false": false_rows}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="records of each campaign; 500 for coverage in full")
    parser.add_argument("--part", choices=PARTS, action="append", help="only this part; may be repeated")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    chosen = parser.parse_args(arguments)
    print("| what | found | asked |")
    print("| --- | --- | --- |")
    with ProcessPoolExecutor(chosen.workers) as pool:
        for part in chosen.part or PARTS:
            for what, value, asked in PARTS[part](pool, chosen.runs):
                print(f"| {what} | {value} | {asked} |", flush=True)


if __name__ == "__main__":
    main()
