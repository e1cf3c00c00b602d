"""How often the 95 % intervals of modes hold the truth, automatic choice of poles included."""

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
# Two processes share two cores; threads of BLAS in each would only get into each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import chladni
from tests.modal import truth

CHAIN = truth.chain()
HALF_INTERVAL = 1.959964
NOISE = 0.01


def one(task: tuple[int, int, float]) -> list[np.ndarray] | None:
    """Errors in sigmas of frequency, damping, Re and Im of shapes; None when not all five are found."""
    seed, cycles, force_noise = task
    rng = np.random.default_rng([9, seed])
    series = truth.record(CHAIN, cycles=cycles, rng=rng, noise=NOISE, force_noise=force_noise)
    modes = chladni.identify_modes(series, references=truth.FORCE.format(0))
    if modes.frequency_hz.size != 5:
        return None
    free = modes.shape_std.real > 0
    moved, std = (modes.shapes - CHAIN.unit_shapes)[free], modes.shape_std[free]
    return [
        (modes.frequency_hz - CHAIN.frequency_hz) / modes.frequency_std_hz,
        (modes.damping_ratio - CHAIN.damping_ratio) / modes.damping_std,
        moved.real / std.real,
        moved.imag / std.imag,
    ]


def report(pool: ProcessPoolExecutor, runs: int, cycles: int, force_noise: float) -> None:
    """Print the table of one kind of noise."""
    tasks = [(seed, cycles, force_noise) for seed in range(runs)]
    results = list(pool.map(one, tasks, chunksize=5))
    found = [result for result in results if result is not None]
    where = "every channel" if force_noise else "the responses"
    print(f"five-mass chain, {NOISE:.0%} noise on {where}, {cycles} cycles, resolution as chosen for modes")
    print(f"all five modes found in {len(found)} of {runs} runs\n")
    print("| quantity | 95 % intervals hold the truth | each mode | std of error in sigmas | mean |")
    print("| --- | ---: | --- | ---: | ---: |")
    for name, errors in zip(
        ("frequency", "damping", "shape, real", "shape, imaginary"), zip(*found, strict=True), strict=True
    ):
        inside = np.abs(np.array(errors)) < HALF_INTERVAL
        # Each mode has four free components of its shape.
        each = inside.mean(axis=0).reshape(5, -1).mean(axis=1)
        print(
            f"| {name} | {inside.mean():.1%} | {', '.join(f'{share:.1%}' for share in each)} | "
            f"{np.std(errors):.3f} | {np.mean(errors):+.3f} |"
        )
    print()


def main() -> None:
    """Print the tables."""
    # A campaign takes long: each table is shown when it's known, to a file as well.
    sys.stdout.reconfigure(line_buffering=True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--cycles", type=int, default=4000)
    options = parser.parse_args()
    with ProcessPoolExecutor(2) as pool:
        for force_noise in (NOISE, 0.0):
            report(pool, options.runs, options.cycles, force_noise)


if __name__ == "__main__":
    main()
