"""Resonances narrower than the lines they are seen on, with and without noise: found, and none invented."""

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
# Two processes share two cores; threads of BLAS in each would only get into each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import chladni
from benchmarks.random_modes import RandomModes, accelerances
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance

STEPS_HZ = (0.5, 1.0, 2.0, 4.0)
LINES = 400
# Ratios: the bounds of damping, and what is asked of the answer.
LEAST_DAMPING, MOST_DAMPING = 1e-4, 2e-3
FREQUENCY_WITHIN, DAMPING_WITHIN = 1e-3, 0.1
# Nearer to each other, in lines, two modes are one peak; nearer to an end, a mode has one flank.
APART, MARGIN = 12, 12
NOISE = 0.01


@dataclass(frozen=True, kw_only=True)
class Case:
    """Functions in closed form and the modes in them."""

    seed: int
    step_hz: float
    noise: str
    known: bool
    modes: RandomModes
    response: FrequencyResponse


def make_case(seed: int) -> Case:
    """Draw 3 to 6 modes on lines 0.5 to 4 Hz apart; no noise, of each line's magnitude, or of the function's RMS."""
    rng = np.random.default_rng([33, seed])
    step_hz = STEPS_HZ[seed % len(STEPS_HZ)]
    count, responses, references = int(rng.integers(3, 7)), int(rng.integers(1, 6)), int(rng.integers(1, 4))
    # Two functions at least, as every test has; one more tells what the first has in a node.
    responses = max(responses, 3 - references)
    modes = RandomModes(
        frequency_hz=step_hz * _places(count, rng),
        damping_ratio=np.exp(rng.uniform(np.log(LEAST_DAMPING), np.log(MOST_DAMPING), count)),
        shapes=rng.choice([-1, 1], (count, responses)) * rng.uniform(0.2, 1, (count, responses)),
        drives=rng.choice([-1, 1], (count, references)) * rng.uniform(0.2, 1, (count, references)),
    )
    noise = ("of each line", "of the RMS")[rng.integers(2)] if rng.integers(2) else "none"
    exact = accelerances(modes, lines=LINES, top_hz=LINES * step_hz, noise=0.0)
    known = bool(noise != "none" and rng.integers(2))
    return Case(
        seed=seed,
        step_hz=step_hz,
        noise=noise,
        known=known,
        modes=modes,
        response=_measured(exact, noise, known, rng),
    )


def _places(count: int, rng: np.random.Generator) -> np.ndarray:
    """Places in lines, none nearer to another than `APART`."""
    while True:
        places = np.sort(rng.uniform(MARGIN, LINES - MARGIN, count))
        if np.all(np.diff(places) >= APART):
            return places


def _measured(exact: FrequencyResponse, noise: str, known: bool, rng: np.random.Generator) -> FrequencyResponse:
    """Functions as a file holds them, without averages, coherence or std unless that is `known`."""
    magnitude = np.abs(exact.values)
    level = np.sqrt(np.mean(magnitude**2, axis=2, keepdims=True)) if noise == "of the RMS" else magnitude
    std = np.zeros(magnitude.shape) if noise == "none" else NOISE * level / np.sqrt(2) * np.ones(magnitude.shape)
    scatter = rng.standard_normal(std.shape) + 1j * rng.standard_normal(std.shape)
    file = Provenance(estimator="as in the file", window="boxcar")
    return replace(
        exact,
        values=exact.values + std * scatter,
        std=std if known else np.full(std.shape, np.inf),
        coherence=np.full(exact.coherence.shape, np.nan),
        provenance=exact.provenance if known else file,
    )


def judged(case: Case, modes: ModeSet) -> tuple[str, float, float]:
    """What is wrong, empty when nothing is, with the largest errors of frequency and, where asked for, damping."""
    true = case.modes
    if modes.frequency_hz.size != true.frequency_hz.size:
        found = ", ".join(f"{frequency_hz:.2f}" for frequency_hz in modes.frequency_hz)
        return f"{true.frequency_hz.size} modes {true.frequency_hz.round(2)}, found {found or 'none'}", np.nan, np.nan
    frequency = np.max(np.abs(modes.frequency_hz / true.frequency_hz - 1))
    wide = 2 * true.damping_ratio * true.frequency_hz >= case.step_hz
    damping = np.max(np.abs(modes.damping_ratio / true.damping_ratio - 1)[wide], initial=0.0)
    wrong = [f"frequency by {frequency:.2%}"] if frequency > FREQUENCY_WITHIN else []
    wrong += [f"damping by {damping:.1%}"] if damping > DAMPING_WITHIN else []
    return ", ".join(wrong), float(frequency), float(damping)


def one(seed: int) -> tuple[Case, str, float, float]:
    """Make a case, identify it, judge it."""
    case = make_case(seed)
    return case, *judged(case, chladni.identify_modes(case.response))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first case")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.runs)
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(one, seeds, chunksize=5))
    print("| noise of 1 % | cases | right | largest error of frequency | of damping, a line or more wide |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for noise in ("none", "of each line", "of the RMS"):
        for known in (False, True):
            rows = [row for row in results if row[0].noise == noise and row[0].known == known]
            if rows:
                worst = [np.nanmax([row[place] for row in rows]) for place in (2, 3)]
                right = sum(not row[1] for row in rows)
                name = f"{noise}, std {'known' if known else 'not known'}"
                print(f"| {name} | {len(rows)} | {right} | {worst[0]:.4%} | {worst[1]:.2%} |")
    print(f"\nright: {sum(not wrong for _, wrong, _, _ in results)} of {len(results)}")
    for case, wrong, _, _ in results:
        if wrong:
            print(f"- seed {case.seed}, {case.step_hz:g} Hz lines, noise {case.noise}: {wrong}")


if __name__ == "__main__":
    main()
