"""Where a machine without a model is nonlinear: at which sensor, or between which two."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from chladni.gap.calibration import BLOCK, CLEARLY, COVERAGE, DRAWS, FAR, LINES_A_TERM
from chladni.gap.comparison.outside_band import products_outside
from chladni.gap.location.level_change import LevelChange, level_change
from chladni.gap.location.modal_paths import ModalPaths, modal_paths
from chladni.gap.location.path_fits import one_direction_share, pattern_losses, unseen_losses
from chladni.gap.location.sensor_location import SensorLocation, SensorSite
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Index, Mask, Real
from chladni.signals.mode_set import ModeSet


def locate_between_sensors(
    measurements: Sequence[Measurement], modes: ModeSet, *, driving_point: str, seed: int = 0
) -> SensorLocation:
    """Say which motion a force that the lowest level's linear model lacks follows, and where it could act.

    The modal model of the lowest level stands in for a simulation. What the responses at higher levels differ from
    it by is printed by forces f at one place along that place's path g, ``change = g(w) F(w)``, whatever linear
    share of f the model holds already: a joint's own stiffness and damping scale g, and don't turn it. Two questions
    are asked of each sensor, and of each two of them:

    - *motion*: how much of the change a static law of the motion there explains, along any path that the modes
      allow, on lines which the fit hasn't seen;
    - *pattern*: how much a force of any shape explains along the path that reciprocity gives.

    Every line counts alike. Near a resonance all sensors move alike and the change is largest, so that its power
    says much of that mode and nothing of the place.

    Parameters
    ----------
    measurements
        See `level_change`.
    modes
        Of the lowest level, from the input to the same outputs.
    driving_point
        Output at the force.
    seed
        Of the bootstrap.

    Raises
    ------
    EstimateError
        When measurements or modes don't go together.
    """
    change = level_change(measurements)
    paths = modal_paths(
        modes, change.frequency_hz, outputs=change.outputs, driving_point=driving_point, order=change.order
    )
    # The highest level is where a nonlinearity is loudest.
    loudest = max(measurements, key=lambda one: float(np.std(one.inputs)))
    whole = SensorLocation(
        force=change.force_name,
        level=tuple(float(one) for one in change.level),
        sites=(),
        one_direction=float("nan"),
        odd=0.0,
        even=0.0,
        outside=products_outside(loudest),
    )
    told = _telling(change)
    if told.sum() < LINES_A_TERM * len(paths.free()):
        return whole
    return _located(whole, change, paths, told, np.random.default_rng(seed))


def _located(
    whole: SensorLocation, change: LevelChange, paths: ModalPaths, told: Mask, rng: np.random.Generator
) -> SensorLocation:
    lines = change.change[:, :, told]
    weight = 1 / np.sqrt(np.sum(np.abs(lines) ** 2, axis=(0, 1)))
    weighted, near, places = lines * weight, paths.on(told), _places(change.outputs)
    blocks = near.free()
    forces = [change.forces_of(direction) for _, direction in places]
    acting = [one[:, :, told] * weight for one, _ in forces]
    motion = [unseen_losses(blocks, one, weighted) for one in acting]
    pattern = [float(np.mean(pattern_losses(near, direction, weighted))) for _, direction in places]
    sites = _sites([names for names, _ in places], motion, pattern, rng)
    best = int(np.argmin([one.mean() for one in motion]))
    odd = forces[best][1]
    # A kind that predicts worse than nothing explains nothing; the other doesn't gain by that.
    only_odd, only_even = (
        max(1 - float(np.mean(unseen_losses(blocks, acting[best][:, kind], weighted))), 0.0)
        for kind in (slice(odd), slice(odd, None))
    )
    return replace(
        whole,
        sites=tuple(sorted(sites, key=lambda one: -one.motion)),
        one_direction=one_direction_share(weighted),
        odd=sites[best].motion - only_even,
        even=sites[best].motion - only_odd,
    )


def _sites(
    names: Sequence[tuple[str, ...]], motion: Sequence[Real], pattern: Sequence[float], rng: np.random.Generator
) -> list[SensorSite]:
    drawn = _draws(motion[0].size, rng)
    low, high = _interval(motion, drawn)
    followed = _rivals(motion, drawn)
    return [
        SensorSite(
            names=name,
            motion=1 - float(np.mean(motion[place])),
            interval=(float(low[place]), float(high[place])),
            pattern=1 - pattern[place],
            motion_rival=bool(followed[place]),
            pattern_rival=pattern[place] <= CLEARLY * min(pattern),
        )
        for place, name in enumerate(names)
    ]


def _places(outputs: Sequence[str]) -> list[tuple[tuple[str, ...], Real]]:
    """Names, and the direction over the sensors, of each sensor and of each two."""
    one = np.eye(len(outputs))
    single = [((name,), one[row]) for row, name in enumerate(outputs)]
    pairs = [((outputs[a], outputs[b]), one[a] - one[b]) for a, b in combinations(range(len(outputs)), 2)]
    return [*single, *pairs]


def _telling(change: LevelChange) -> Mask:
    noise = np.sum(change.noise[1:] + change.noise[0], axis=(0, 1))
    return np.asarray(np.sum(np.abs(change.change) ** 2, axis=(0, 1)) > FAR * noise)


def _draws(lines: int, rng: np.random.Generator) -> Index:
    """``[draw, line]`` of whole blocks."""
    blocks = lines // BLOCK
    first = rng.integers(0, blocks, (DRAWS, blocks)) * BLOCK
    return np.asarray((first[:, :, None] + np.arange(BLOCK)).reshape(DRAWS, -1))


def _interval(losses: Sequence[Real], drawn: Index) -> tuple[Real, Real]:
    """Ends ``[place]`` of the 95 % interval of the share explained."""
    shares = np.array([1 - one[drawn].mean(axis=1) for one in losses])
    return np.quantile(shares, (1 - COVERAGE) / 2, axis=1), np.quantile(shares, (1 + COVERAGE) / 2, axis=1)


def _rivals(losses: Sequence[Real], drawn: Index) -> Mask:
    """Places that the draws can't tell from the best one, itself included."""
    means = np.array([one[drawn].mean(axis=1) for one in losses])
    best = means[int(np.argmin([one.mean() for one in losses]))]
    return np.asarray(np.mean(means <= best, axis=1) > (1 - COVERAGE) / 2)
