"""The integrator against SciPy on five bodies with a Bouc-Wen joint: accuracy, time, and the first call."""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parents[1]))

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.integrator import Integrator
from chladni.models.structures.robot_arm import robot_arm
from tests.models.integrator.systems import bouc_wen, compiled_structure, law

RATE_HZ, SAMPLES, BODIES = 10_000.0, 100_000, 5
#: Samples on which both sides are held against a much tighter run.
CHECKED = 5_000
FIRST_CALL = """
import sys, time
begin = time.perf_counter()
import numpy as np
from tests.models.integrator.systems import bouc_wen, compiled_structure, law
from chladni.models.structures.robot_arm import robot_arm
import chladni.models.integrator.integrator as integrator
imported = time.perf_counter()
compiled = compiled_structure(robot_arm(), force_at="tool", laws=(law(3, bouc_wen, 20.0, 1e-3, 2.0, state=(0.0,)),))
integrator.integrate(compiled, np.ones((1, 100)), 1e4)
called = time.perf_counter()
def own(d, s, t, parameters, state, rates):
    return parameters[0] * d * abs(d)
from chladni.models.core.port_law import PortLaw
from dataclasses import replace
mine = replace(compiled, laws=(PortLaw(port=3, function=own, parameters=(1e3,)),))
integrator.integrate(mine, np.ones((1, 100)), 1e4)
print(imported - begin, called - imported, time.perf_counter() - called)
"""


def model() -> CompiledModel:
    return compiled_structure(robot_arm(), force_at="tool", laws=(law(3, bouc_wen, 20.0, 1e-3, 2.0, state=(0.0,)),))


def excitation(count: int) -> np.ndarray:
    """``[1, sample]`` random force of 50 N from 2 to 200 Hz."""
    spectrum = np.fft.rfft(np.random.default_rng(3).standard_normal(count))
    frequency_hz = np.fft.rfftfreq(count, 1 / RATE_HZ)
    spectrum[(frequency_hz < 2) | (frequency_hz > 200)] = 0
    force = np.fft.irfft(spectrum, count)
    return 50 * force[None] / force.std()


def peer(compiled: CompiledModel, signals: np.ndarray, tolerance: float) -> np.ndarray:
    """``[state, sample]`` by LSODA, its right-hand side in NumPy with everything precomputed."""
    a, b, g = compiled.a, compiled.b[:, 0], compiled.g[:, 3]
    row_d, row_s = compiled.displacement_state[3], compiled.velocity_state[3]
    parameters, force, last = compiled.laws[0].parameters, signals[0], signals.shape[1] - 2
    rate = [0.0]

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        place = t * RATE_HZ
        k = min(int(place), last)
        u = force[k] + (force[k + 1] - force[k]) * (place - k)
        x = y[:10]
        f = bouc_wen(row_d @ x, row_s @ x, t, parameters, y[10:], rate)
        result = np.empty(11)
        result[:10] = a @ x + b * u + g * f
        result[10] = rate[0]
        return result

    times = np.arange(signals.shape[1]) / RATE_HZ
    scale = np.array([1e-4] * 5 + [1e-2] * 5 + [1.0])
    found = solve_ivp(
        rates, (0, times[-1]), np.zeros(11), method="LSODA", t_eval=times, rtol=tolerance, atol=tolerance * scale
    )
    return found.y[:10]


def error(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found - truth) ** 2, axis=1) / np.mean(truth**2, axis=1)).max())


def matched(run: Callable[[float], np.ndarray], truth: np.ndarray, tolerances: list[float]) -> tuple[float, float]:
    """Loosest tolerance whose error is at most 1e-6, and that error."""
    for tolerance in tolerances:
        found = error(run(tolerance), truth)
        if found <= 1e-6:
            return tolerance, found
    return tolerances[-1], found


def seconds(calls: list[Callable[[], object]], times: int) -> list[float]:
    """Median processor time of each; they take turns, so that what else the machine does meets all of them."""
    taken: list[list[float]] = [[] for _ in calls]
    for _ in range(times):
        for place, call in enumerate(calls):
            # The second of two calls: the first finds the processor's memory full of the other program.
            call()
            begin = time.process_time()
            call()
            taken[place].append(time.process_time() - begin)
    return [float(np.median(each)) for each in taken]


def first_calls() -> list[tuple[str, list[float]]]:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": folder, "PYTHONPATH": str(Path(__file__).parents[1])}
        for name in ("nothing cached", "from cache"):
            done = subprocess.run(
                [sys.executable, "-c", FIRST_CALL], env=environment, capture_output=True, text=True, check=True
            )
            rows.append((name, [float(word) for word in done.stdout.split()]))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=7)
    repeats = parser.parse_args().repeats
    compiled, signals = model(), excitation(SAMPLES)
    short = signals[:, :CHECKED]
    truth = Integrator(compiled, RATE_HZ, tolerance=1e-12).run(short).states

    tolerances = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]
    ours, our_error = matched(
        lambda tolerance: Integrator(compiled, RATE_HZ, tolerance=tolerance).run(short).states, truth, tolerances
    )
    theirs, their_error = matched(
        lambda tolerance: peer(compiled, short, tolerance), truth, [1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11]
    )
    integrator = Integrator(compiled, RATE_HZ, tolerance=ours)
    usual = Integrator(compiled, RATE_HZ)
    run_s, usual_s, peer_s = seconds(
        [lambda: integrator.run(signals), lambda: usual.run(signals), lambda: peer(compiled, short, theirs)], repeats
    )
    peer_s *= SAMPLES / CHECKED
    print(f"five bodies, one Bouc-Wen joint (n = 2), {SAMPLES} samples at {RATE_HZ:g} Hz")
    print(f"processor time, medians of {repeats}")
    print("| program | tolerance | error | seconds | body-steps/s |")
    print("| --- | --- | --- | --- | --- |")
    for name, tolerance, found, taken in (
        ("chladni, error matched", ours, our_error, run_s),
        ("chladni, default", 1e-7, error(usual.run(short).states, truth), usual_s),
        (f"LSODA (from {CHECKED} samples)", theirs, their_error, peer_s),
    ):
        print(f"| {name} | {tolerance:.0e} | {found:.1e} | {taken:.4g} | {BODIES * SAMPLES / taken:.3g} |")
    print(f"LSODA over chladni: {peer_s / run_s:.0f} matched, {peer_s / usual_s:.0f} at the default tolerance")
    print("\n| first call in a fresh process | import s | call s | a further law s |\n| --- | --- | --- | --- |")
    for name, (imported, called, own) in first_calls():
        print(f"| {name} | {imported:.2f} | {called:.2f} | {own:.2f} |")


if __name__ == "__main__":
    main()
