"""SSI-cov against pyOMA-2: poles of all orders without and with error bars, and whether both agree."""

import argparse
import logging
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pyoma2.algorithms import SSI
from pyoma2.setup import SingleSetup
from scipy.signal import lfilter

from chladni.modal.operational.correlation import correlation_functions
from chladni.modal.operational.ssi import decompose, order_models, pole_table, subspace_poles
from chladni.modal.operational.ssi_uncertainty import ErrorPropagation, all_pole_deviations, shape_std
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

CHANNELS, SAMPLES, RATE_HZ = 12, 60_000, 20.0
BLOCK_ROWS, MAX_ORDER, BLOCKS = 20, 60, 50
# The order of twelve modes: above it pyOMA-2's error bars of some poles are several times their scatter.
TRUE_ORDER = 2 * CHANNELS
DAMPING, NOISE = 0.01, 0.05


@dataclass(frozen=True)
class Structure:
    """A chain of twelve masses: frequencies and shapes in closed form."""

    frequency_hz: np.ndarray
    shapes: np.ndarray


def chain() -> Structure:
    tie = 2 * np.eye(CHANNELS) - np.eye(CHANNELS, k=1) - np.eye(CHANNELS, k=-1)
    tie[-1, -1] = 1
    squares, shapes = np.linalg.eigh(tie)
    return Structure(frequency_hz=3 * np.sqrt(squares), shapes=shapes)


def record(structure: Structure, seed: int) -> np.ndarray:
    """``[channel, sample]`` responses to white noise on every mode, with noise of the sensors."""
    rng = np.random.default_rng(seed)
    modal = []
    for frequency_hz in structure.frequency_hz:
        omega = 2 * np.pi * frequency_hz
        step = np.exp((-DAMPING + 1j * np.sqrt(1 - DAMPING**2)) * omega / RATE_HZ)
        modal.append(lfilter([1], [1, -step], rng.standard_normal(SAMPLES).astype(complex)).real)
    values = structure.shapes @ np.array(modal)
    return values + NOISE * values.std() * rng.standard_normal(values.shape)


def peer(values: np.ndarray, *, uncertainty: bool) -> SSI:
    setup = SingleSetup(values.T, fs=RATE_HZ)
    algorithm = SSI(name="ssi", method="cov", br=BLOCK_ROWS, ordmax=MAX_ORDER, calc_unc=uncertainty, nb=BLOCKS)
    setup.add_algorithms(algorithm)
    setup.run_by_name("ssi")
    return algorithm


def ours(series: TimeSeries, *, uncertainty: bool) -> PoleTable:
    """Poles and shapes of orders 1 to 60, as the peer's; with error bars also those of the shapes of the last order.

    The peer gives the shapes of all orders error bars, of which a person looks at those of a few poles.
    """
    correlations = correlation_functions(series, lags=2 * BLOCK_ROWS - 1, blocks=BLOCKS if uncertainty else 10)
    orders = range(1, MAX_ORDER + 1)
    if not uncertainty:
        return subspace_poles(correlations, block_rows=BLOCK_ROWS, orders=orders)
    decomposition = decompose(correlations, block_rows=BLOCK_ROWS, max_order=MAX_ORDER)
    models = list(order_models(decomposition, orders))
    deviations = all_pole_deviations(correlations, decomposition, models)
    propagation = ErrorPropagation(correlations, decomposition)
    for pole in range(models[-1].kept.size):
        shape_std(propagation.shape(models[-1], pole))
    return pole_table(
        decomposition,
        models,
        orders,
        frequency_std_hz=deviations.frequency_std_hz,
        damping_std=deviations.damping_std,
    )


def alternated(rounds: int, works: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Shortest time of each work; they take turns, so that both see the same load of the machine."""
    shortest = dict.fromkeys(works, float("inf"))
    for _ in range(rounds):
        for name, work in works.items():
            begun = time.perf_counter()
            work()
            shortest[name] = min(shortest[name], time.perf_counter() - begun)
    return shortest


def agreement(structure: Structure, table: PoleTable, algorithm: SSI, order: int) -> tuple[float, np.ndarray]:
    """Largest difference of frequencies in our sigmas, and ratios of our sigma to the peer's, at one order."""
    rows = np.flatnonzero(table.order == order)
    theirs_hz, theirs_std = algorithm.result.Fn_poles[:, order], algorithm.result.Fn_poles_std[:, order]
    apart, ratios = [], []
    for frequency_hz in structure.frequency_hz:
        row = rows[np.argmin(np.abs(table.frequency_hz[rows] - frequency_hz))]
        place = np.nanargmin(np.abs(theirs_hz - frequency_hz))
        apart.append(abs(table.frequency_hz[row] - theirs_hz[place]) / table.frequency_std_hz[row])
        ratios.append(table.frequency_std_hz[row] / theirs_std[place])
    return max(apart), np.array(ratios)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="rounds without error bars")
    parser.add_argument("--rounds-with", type=int, default=2, help="rounds with error bars")
    options = parser.parse_args()
    logging.disable(logging.WARNING)
    warnings.simplefilter("ignore")
    structure = chain()
    values = record(structure, 0)
    series = TimeSeries(
        values=values,
        sample_rate_hz=RATE_HZ,
        channels=tuple(Channel(name=f"/{row}", unit="m/s^2") for row in range(CHANNELS)),
    )
    plain = alternated(
        options.rounds,
        {"ours": lambda: ours(series, uncertainty=False), "peer": lambda: peer(values, uncertainty=False)},
    )
    barred = alternated(
        options.rounds_with,
        {"ours": lambda: ours(series, uncertainty=True), "peer": lambda: peer(values, uncertainty=True)},
    )
    apart, ratios = agreement(structure, ours(series, uncertainty=True), peer(values, uncertainty=True), TRUE_ORDER)
    print(f"{CHANNELS} channels x {SAMPLES} samples, {BLOCK_ROWS} block rows, orders 1 to {MAX_ORDER}\n")
    print("| work | chladni | pyOMA-2 | ratio |")
    print("| --- | ---: | ---: | ---: |")
    for name, times in (("poles and shapes", plain), (f"with error bars from {BLOCKS} blocks", barred)):
        print(f"| {name} | {times['ours']:.3f} s | {times['peer']:.3f} s | {times['peer'] / times['ours']:.1f} |")
    print(f"| largest difference of the twelve frequencies at order {TRUE_ORDER}, in sigmas | | | {apart:.2f} |")
    print(
        f"| sigma over pyOMA-2's there, lowest to highest of twelve | | | {ratios.min():.2f} to {ratios.max():.2f} |"
    )


if __name__ == "__main__":
    main()
