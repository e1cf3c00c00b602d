"""What a bench's sensors would give without noise, with and without hidden effects."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.gap.blind.building import built, unseen_signals
from chladni.gap.blind.equations import FLOOR
from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.integration import MOST_STEPS, integrate, respond, steps_for
from chladni.gap.blind.plan import Bench, Hidden
from chladni.signals.errors import EstimateError

Matrix = NDArray[np.float64]


def perform(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden] = (), *,
            steps: int | None = None, watched: bool = False) -> dict[str, Matrix]:  # fmt: skip
    """Simulate a bench and give the log's samples of each output, before noise and converters.

    Parameters
    ----------
    steps
        A sample; as many as the linear part needs if None.
    watched
        See `building.built`.

    Raises
    ------
    EstimateError
        When the motion grows without bound.
    """
    machine = built(bench.plan, numbers, effects, watched=watched)
    interval, count = 1.0 / bench.rate_hz, drive.signals.shape[1]
    rows = [_unseen(effects, name, bench, drive) for name in unseen_signals(effects)]
    signals = np.vstack([drive.signals, *rows]) if rows else drive.signals
    assembly = machine.assembly
    if not effects and not assembly.laws:
        y = respond(assembly, signals, interval)
    else:
        steps = steps_for(assembly, interval) if steps is None else steps
        y = integrate(assembly, signals, interval, start_s=-drive.before * interval, steps=steps)
    if count != drive.before + bench.samples and np.isnan(y[:, -1]).all():
        raise EstimateError("the hidden motion was not simulated to its end")
    # A clock that is late shows the machine at rest before its start.
    shown = np.nan_to_num(y[:, drive.before : drive.before + bench.samples])
    return dict(zip(machine.assembly.outputs, shown, strict=True))


def measured(bench: Bench) -> list[str]:
    """Names of what the log holds as outputs: a loop's own command, then the sensors."""
    loop = bench.plan.loop
    return [*([] if loop is None else [loop.drives]), *(one.name for one in bench.plan.outputs)]


def settled(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], *,
            within: float) -> tuple[int, dict[str, Matrix]] | None:  # fmt: skip
    """Simulate with twice as many steps again and again, until the outputs change by less than `within`, pooled RMS.

    Gives the last number of steps a sample and what came of it; None when it never settles: a motion that depends on
    the last digit of everything can't be compared with any simulation.
    """
    steps = steps_for(built(bench.plan, numbers, effects).assembly, 1.0 / bench.rate_hz)
    coarse = _tried(bench, numbers, drive, effects, steps)
    while steps < MOST_STEPS:
        steps *= 2
        fine = _tried(bench, numbers, drive, effects, steps)
        if coarse is not None and fine is not None and pooled_change(bench, coarse, fine) < within:
            return steps, fine
        coarse = fine
    return None


def _tried(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], steps: int,
           ) -> dict[str, Matrix] | None:  # fmt: skip
    try:
        return perform(bench, numbers, drive, effects, steps=steps)
    except EstimateError:
        # Too few steps for a stiff contact look like a motion without bound.
        return None


def rms(values: Matrix) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def pooled_change(bench: Bench, before: Mapping[str, Matrix], after: Mapping[str, Matrix]) -> float:
    """RMS over all outputs of the change over each one's own RMS."""
    names = measured(bench)
    shares = [rms(after[name] - before[name]) / max(rms(before[name]), 1e-300) for name in names]
    return float(np.sqrt(np.mean(np.square(shares))))


def _unseen(effects: Sequence[Hidden], name: str, bench: Bench, drive: Drive) -> Matrix:
    """Samples of a driving signal that the log doesn't hold."""
    hidden = next(
        one for one in effects if (one.effect == "base_vibration" if name == FLOOR else name == f"{one.site}.tone")
    )
    count, n = drive.signals.shape[1], hidden.numbers
    rng = np.random.default_rng(int(n["seed"]))
    if name == FLOOR:
        return _shaped_noise(rng, count, bench.rate_hz, n)
    times = (np.arange(count) - drive.before) / bench.rate_hz
    wander = n["wander"] * np.cumsum(rng.standard_normal(count)) / np.sqrt(bench.rate_hz)
    return np.asarray(n["amplitude"] * np.sin(2 * np.pi * n["frequency"] * times + n["phase"] + wander))


def _shaped_noise(rng: np.random.Generator, count: int, rate_hz: float, n: Mapping[str, float]) -> Matrix:
    """Noise of RMS `level` from `low` to `high` whose density goes with a power of frequency."""
    frequency = np.fft.rfftfreq(count, 1.0 / rate_hz)
    lines = rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)
    inside = (frequency >= n["low"]) & (frequency <= n["high"])
    weight = np.where(inside, (np.maximum(frequency, n["low"]) / n["low"]) ** (0.5 * n["tilt"]), 0.0)
    noise = np.fft.irfft(lines * weight, n=count)
    return np.asarray(n["level"] * noise / rms(noise))
