"""Poles and modes of 300 responses x 5 references x 4096 lines, orders to 100: time and memory."""

import resource
import time

import numpy as np
from random_modes import RandomModes, accelerances, random_modes

from chladni.modal.experimental.plscf import polyreference_poles
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.signals.frequency_response import FrequencyResponse

RESPONSES, REFERENCES, LINES, ORDER, MODES, TOP_HZ, NOISE = 300, 5, 4096, 100, 40, 2048.0, 0.01


def large_set() -> tuple[RandomModes, FrequencyResponse]:
    """The modes and their accelerances."""
    modes = random_modes(MODES, responses=RESPONSES, references=REFERENCES, top_hz=TOP_HZ)
    return modes, accelerances(modes, lines=LINES, top_hz=TOP_HZ, noise=NOISE)


def peak_gigabytes() -> float:
    """Largest resident memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def main() -> None:
    modes, response = large_set()
    before = peak_gigabytes()
    begun = time.perf_counter()
    table = polyreference_poles(response, max_order=ORDER)
    elapsed_s = time.perf_counter() - begun
    highest = table.pole[table.order == ORDER]
    worst = np.max(np.min(np.abs(highest - modes.poles[:, None]), axis=1) / np.abs(modes.poles))
    assert worst < 1e-3, "the poles aren't those of the modes"
    print(f"{RESPONSES} responses x {REFERENCES} references x {LINES} lines, {MODES} modes\n")
    print("| work | time | peak memory | of which data and their making |")
    print("| --- | ---: | ---: | ---: |")
    print(
        f"| poles, {table.orders.size} orders to {ORDER} | {elapsed_s:.1f} s | {peak_gigabytes():.2f} GB | "
        f"{before:.2f} GB |"
    )
    begun = time.perf_counter()
    found = PolyReferenceLeastSquares(max_order=ORDER).identify(response)
    elapsed_s = time.perf_counter() - begun
    assert found.frequency_hz.size == MODES, "the modes aren't all there, or there are others"
    print(
        f"| whole identification: {MODES} modes | {elapsed_s:.1f} s | {peak_gigabytes():.2f} GB | {before:.2f} GB |"
    )
    print(f"\nworst pole at order {ORDER}: {worst:.1e} (relative)")


if __name__ == "__main__":
    main()
