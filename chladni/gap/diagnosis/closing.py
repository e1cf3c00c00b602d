"""How far the gap closes on samples that no fit saw."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.contest import held_gap
from chladni.gap.records.diagnosis import Closing, HeldOut
from chladni.gap.records.noise_floor import NoiseFloor

Matrix = NDArray[np.float64]
Mask = NDArray[np.bool_]
_DRAWS = 400


def closing_of(
    study: Study, noise: NoiseFloor, before: Matrix, tuned: Matrix, after: Matrix, *, cross_sensor: bool, seed: int
) -> Closing:
    """Compare three simulations with the measurement on held-out samples.

    Parameters
    ----------
    noise
        The floor, as far as what is believed leaves it.
    before, tuned, after
        ``[output, sample]`` of the nominal model, with best parameters, with parameters and effects.
    cross_sensor
        Whether `after` is each sensor as the others predict it.
    seed
        Of the bootstrap over blocks.
    """
    measured, held = study.measurement.outputs, study.held
    gaps = [held_gap(measured, one, held) for one in (before, tuned, after)]
    floor = study.noise_gap(noise)
    # What the noise itself is uncertain by is no gap.
    doubt = floor * (float(np.max(noise.std)) + 0.02)
    return Closing(
        before=gaps[0],
        tuned=gaps[1],
        after=gaps[2],
        noise=floor,
        closed=_closed(gaps[0], gaps[2], floor, doubt),
        interval=_interval(study, before, after, floor, doubt, seed),
        held_out=tuple(_stretches(study, held)),
        by="cross_sensor" if cross_sensor else "free_run" if study.windows is None else "windows",
        horizon_s=study.horizon_s,
    )


def _closed(before: float, after: float, noise: float, doubt: float) -> float | None:
    if not np.isfinite(before) or before - noise <= doubt:
        return None
    return float(np.clip((before - after) / (before - noise), 0.0, 1.0))


def _interval(
    study: Study, before: Matrix, after: Matrix, noise: float, doubt: float, seed: int
) -> tuple[float, float] | None:
    """95 % interval by drawing held-out blocks with replacement (Kuensch 1989)."""
    measured = study.measurement.outputs
    size = np.maximum(np.mean(measured[:, study.held] ** 2, axis=1, keepdims=True), 1e-300)
    blocks = [slice(start, stop) for start, stop in _runs(study.held)]
    if len(blocks) < 3:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        powers = np.array(
            [[np.sum((measured - one)[:, block] ** 2 / size) for one in (before, after)] for block in blocks]
        )
    lengths = np.array([(block.stop - block.start) * len(measured) for block in blocks])
    if not np.all(np.isfinite(powers)):
        return None
    drawn = np.random.default_rng(seed).integers(0, len(blocks), (_DRAWS, len(blocks)))
    root = np.sqrt(powers[drawn].sum(axis=1) / lengths[drawn].sum(axis=1)[:, None])
    found = [_closed(float(one), float(other), noise, doubt) for one, other in root]
    shares = [one for one in found if one is not None]
    if len(shares) < 0.9 * _DRAWS:
        return None
    low, high = np.quantile(shares, (0.025, 0.975))
    return float(low), float(high)


def _runs(held: Mask) -> Sequence[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(np.int8), [0]])))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def _stretches(study: Study, held: Mask) -> list[HeldOut]:
    rate, log = study.measurement.sample_rate_hz, study.measurement.log
    return [HeldOut(log=log, start_s=start / rate, end_s=stop / rate) for start, stop in _runs(held)]
