"""Poles of all orders, their stability and shapes from 60 frequency responses, against sdypy-EMA.

Both sides find the poles of 60 orders, compare each order with the one below, choose a pole for each of ten modes and
fit its modal constants in all functions with an upper and a lower residual. chladni also weighs every line by its
standard deviation and chooses by clustering, where sdypy-EMA is told ten frequencies to choose at; sdypy-EMA also
keeps the reconstructed functions, which chladni computes on the way.
"""

import contextlib
import io
import os
import time
import warnings
from statistics import median

import numpy as np
from random_modes import RandomModes, accelerances, random_modes

from chladni.modal.experimental.plscf import polyreference_poles
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.poles.pole_selection import select_poles
from chladni.modal.poles.stabilisation import pole_status
from chladni.signals.frequency_response import FrequencyResponse

RESPONSES, LINES, ORDERS, MODES, TOP_HZ, NOISE = 60, 2048, 60, 10, 1024.0, 0.01
ROUNDS = 25
# Order k of ours has k complex coefficients at positive frequencies, order k of theirs 2 k real ones: as many poles.
Times = dict[str, float]


def ours(response: FrequencyResponse) -> tuple[np.ndarray, Times]:
    """Poles ``[mode]`` and the time of each step; the choice among the poles is made by clustering."""
    begun = time.perf_counter()
    table = polyreference_poles(response, max_order=ORDERS)
    poles = time.perf_counter()
    pole_status(table)
    selection = select_poles(table)
    stable = time.perf_counter()
    least_squares_frequency_domain(response, selection.pole)
    shapes = time.perf_counter()
    return selection.pole, {"poles": poles - begun, "stability": stable - poles, "shapes": shapes - stable}


def theirs(response: FrequencyResponse, modes: RandomModes) -> tuple[np.ndarray, Times]:
    """The same by sdypy-EMA, which is told the frequencies to choose poles at."""
    from sdypy.EMA import Model

    begun = time.perf_counter()
    model = Model(
        response.values[:, 0],
        response.frequency_hz,
        lower=float(response.frequency_hz[1]),
        upper=TOP_HZ,
        pol_order_high=ORDERS,
        frf_form="accelerance",
    )
    model.get_poles(show_progress=False)
    poles = time.perf_counter()
    model.select_closest_poles(list(modes.frequency_hz))
    stable = time.perf_counter()
    model.get_constants()
    shapes = time.perf_counter()
    chosen = np.array([model.all_poles[order][row] for order, row in model.pole_ind])
    return chosen, {"poles": poles - begun, "stability": stable - poles, "shapes": shapes - stable}


def worst(found: np.ndarray, truth: np.ndarray) -> float:
    """Largest relative error of a natural frequency, each mode having its own pole."""
    nearest = np.argmin(np.abs(found - truth[:, None]), axis=1)
    assert len(set(nearest)) == len(truth), "two modes share a pole"
    return float(np.max(np.abs(np.abs(found[nearest]) / np.abs(truth) - 1)))


def main() -> None:
    modes = random_modes(MODES, responses=RESPONSES, references=1, top_hz=TOP_HZ)
    response = accelerances(modes, lines=LINES, top_hz=TOP_HZ, noise=NOISE)
    runs: dict[str, list[Times]] = {"chladni": [], "sdypy-EMA": []}
    errors = {}
    works = [("chladni", lambda: ours(response)), ("sdypy-EMA", lambda: theirs(response, modes))]
    # sdypy-EMA warns that the last line lies above the last of the response, and shows its progress.
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        for name, work in works:
            # The first run imports what it needs.
            errors[name] = worst(work()[0], modes.poles)
        for _ in range(ROUNDS):
            for name, work in works:
                runs[name].append(work()[1])
            # What one leaves behind, such as threads that still spin, must not always hit the same other.
            works.reverse()
    assert errors["chladni"] < 3e-4, "the frequencies aren't those of the modes"
    assert errors["sdypy-EMA"] < 3e-4, "the frequencies aren't those of the modes"
    print(f"{RESPONSES} responses x {LINES} lines, {MODES} modes, {100 * NOISE:.0f} % noise, orders to {ORDERS}\n")
    print("| work | chladni | sdypy-EMA | ratio, median of pairs | lowest to highest | ratio of the fastest |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for steps in (("poles",), ("stability",), ("shapes",), ("poles", "stability", "shapes")):
        mine, peer = ([sum(times[step] for step in steps) for times in runs[name]] for name in runs)
        ratios = [b / a for a, b in zip(mine, peer, strict=True)]
        row = [f"{1e3 * median(mine):.1f} ms", f"{1e3 * median(peer):.1f} ms", f"{median(ratios):.1f}"]
        spread = f"{min(ratios):.1f} to {max(ratios):.1f} | {min(peer) / min(mine):.1f}"
        print(f"| {', '.join(steps)} | {' | '.join(row)} | {spread} |")
    print(f"\nworst natural frequency, relative: {errors['chladni']:.1e} and {errors['sdypy-EMA']:.1e}")
    threads = os.environ.get("OPENBLAS_NUM_THREADS", "as many as cores")
    print(f"{ROUNDS} rounds, BLAS threads: {threads}. On an idle machine:")
    print("    python benchmarks/bench_plscf.py")
    print("and where other programs run, which waiting threads of BLAS would fight for the cores:")
    print("    OPENBLAS_NUM_THREADS=1 python benchmarks/bench_plscf.py")


if __name__ == "__main__":
    main()
