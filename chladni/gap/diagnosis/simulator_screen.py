"""Which effects, where, could explain what a simulator misses: one run each, judged by linear regression."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from chladni.gap.diagnosis.simulator_runs import EFFECTIVE_SAMPLES, SimulatorRuns, can_act, weights
from chladni.gap.diagnosis.simulator_starts import SiteScales, starts
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

#: How far beyond the run's own strength the regression may follow its straight line.
_LARGEST_FACTOR = 4.0
#: Friction for the first runs: as a share of the largest input, then until it changes the outputs visibly.
_FIRST_FORCE, _FORCE_RUNS, _CREEP = 0.02, 8, 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Screened(Value):
    """Effects that were run, and how well they explain what is missed.

    Attributes
    ----------
    effects
        One or two, with the values they ran with.
    gain
        Nats by which the log is likelier with them, parameters moved along and strengths scaled, on all samples.
    """

    effects: tuple[AttachedEffect, ...]
    gain: float

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def names(self) -> tuple[tuple[str, str], ...]:
        """Effect and site of each effect, in a fixed order."""
        return tuple(sorted((each.effect, each.site) for each in self.effects))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Screening(Value):
    """Result of `screen`.

    Attributes
    ----------
    singles, pairs
        By falling gain; each effect and site (or pair of them) once, with its best values.
    scales
        What is large and small at each site.
    """

    singles: tuple[Screened, ...]
    pairs: tuple[Screened, ...]
    scales: tuple[SiteScales, ...]

    def __post_init__(self) -> None:
        self._freeze()


def screen(
    runs: SimulatorRuns,
    kinds: Sequence[EffectKind],
    z: Real,
    known: Sequence[AttachedEffect] = (),
    *,
    progress: Callable[[float], None],
    only: str | None = None,
) -> Screening:
    """Run every effect at every site once for each start, and regress what is missed on the change it makes.

    Parameters
    ----------
    runs
        The simulator and the log.
    kinds
        Effects to try.
    z, known
        Where to start from: parameters in sigmas, and effects that are in already.
    progress
        Called with the share that is done.
    only
        One site to try effects at; every site when None.
    """
    true = runs.true_outputs(z, known)
    base = runs.outputs_of(true, known)
    missed = runs.over_noise(runs.measurement.outputs - base)
    scales = site_scales(runs, z, known, missed, only)
    regression = _Regression.of(missed, runs.slopes(z, known, base), z)
    tried = [effect for site in scales if only in (None, site.name) for effect in _tries(runs, kinds, site, known)]
    found = []
    for count, effect in enumerate(tried):
        progress(count / len(tried))
        change = _change(runs, z, known, effect, true, base)
        if change is not None:
            found.append((effect, regression.projected(change)))
    return Screening(singles=_singles(regression, found), pairs=_pairs(regression, found), scales=scales)


def site_scales(
    runs: SimulatorRuns, z: Real, known: Sequence[AttachedEffect], missed: Real, only: str | None = None
) -> tuple[SiteScales, ...]:
    """Give what is large and small at each site."""
    simulator, log = runs.wrapped.simulator, runs.measurement
    tone_hz = [_strongest_hz(row, log.sample_rate_hz) for row in missed]
    found = [
        *(
            _signal_scales(runs, "input", each.name, row)
            for each, row in zip(simulator.inputs, log.inputs, strict=True)
        ),
        *(
            replace(_signal_scales(runs, "output", name, row), tone_hz=tone)
            for name, row, tone in zip(log.output_names, log.outputs, tone_hz, strict=True)
        ),
    ]
    for motion in runs.motions(z, known) if simulator.joints else ():
        still = SiteScales(
            name=motion.name,
            kind="joint",
            amplitude=float(np.std(motion.displacement)),
            rate=float(np.std(motion.velocity)),
            force=_FIRST_FORCE * float(np.max(np.abs(log.inputs), initial=0.0)),
            tone_hz=1.0,
            interval_s=1 / log.sample_rate_hz,
            duration_s=log.duration_s,
        )
        # Where nothing moves no law of motion acts.
        if only in (None, motion.name) and still.amplitude > 0 and still.rate > 0 and still.force > 0:
            found.append(replace(still, force=_visible_force(runs, z, known, missed, still)))
    return tuple(each for each in found if each.amplitude > 0)


def _signal_scales(runs: SimulatorRuns, kind: str, name: str, row: Real) -> SiteScales:
    rate_hz = runs.measurement.sample_rate_hz
    return SiteScales(
        name=name,
        kind="input" if kind == "input" else "output",
        amplitude=float(np.max(np.abs(row))),
        rate=float(np.max(np.abs(np.diff(row)), initial=0.0)) * rate_hz,
        force=0.0,
        tone_hz=1.0,
        interval_s=1 / rate_hz,
        duration_s=runs.measurement.duration_s,
    )


def _strongest_hz(row: Real, rate_hz: float) -> float:
    power = np.abs(np.fft.rfft(row * np.hanning(row.size))) ** 2
    return float(np.fft.rfftfreq(row.size, 1 / rate_hz)[1 + int(np.argmax(power[1:]))])


def _visible_force(
    runs: SimulatorRuns, z: Real, known: Sequence[AttachedEffect], missed: Real, site: SiteScales
) -> float:
    """Friction that changes the outputs by about half of what is missed (and by more than the noise)."""
    base = runs.simulated(z, known)
    wanted = max(0.5 * float(np.sqrt(np.mean(missed**2))), 1.0)
    force = site.force
    kind, resisting = next((one, one.clues.resisting) for one in CATALOGUE.values() if one.clues.resisting)
    for _ in range(_FORCE_RUNS):
        values = resisting(force, _CREEP * site.rate)
        try:
            friction = attached(kind, site.name, values)
            change = runs.over_noise(runs.simulated(z, [*known, friction]) - base)
        except ModelError:
            force *= 0.1
            continue
        size = float(np.sqrt(np.mean(change**2)))
        if 0.5 < size / wanted < 2.0:
            break
        force *= float(np.clip(wanted / max(size, 1e-30), 0.05, 20.0))
    return force


def _tries(
    runs: SimulatorRuns, kinds: Sequence[EffectKind], site: SiteScales, known: Sequence[AttachedEffect]
) -> Iterator[AttachedEffect]:
    others = [name for name in runs.measurement.output_names if name != site.name]
    taken = {(effect.effect, effect.site) for effect in known}
    for kind in kinds:
        if site.kind not in kind.sites or (kind.name, site.name) in taken or (kind.needs_source and not others):
            continue
        # Variants differ too little to be told apart by a screen; the fit tries them.
        for effect in starts(kind, kind.variants[0], site, others):
            if can_act(runs, effect):
                yield effect


def _change(
    runs: SimulatorRuns,
    z: Real,
    known: Sequence[AttachedEffect],
    effect: AttachedEffect,
    true: Real,
    base: Real,
) -> Real | None:
    """``[output, sample]`` over the noise; None where the simulation diverges or nothing changes."""
    effects = [*known, effect]
    try:
        # What acts on sensors needs no run.
        changed = (
            runs.outputs_of(true, effects)
            if effect.site in runs.wrapped.sites("output")
            else runs.simulated(z, effects)
        )
    except ModelError:
        return None
    change = runs.over_noise(changed - base)
    return change if np.any(change) and np.all(np.isfinite(change)) else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Regression:
    """Least squares with the parameters free along their prior: weighted, and the slopes projected out.

    Attributes
    ----------
    weight
        ``[output, 1]``.
    basis
        ``[row, parameter]`` orthonormal, of slopes over samples and of the prior's rows below them.
    prior
        ``[parameter]`` rows of the prior for what is missed: how far from nominal it starts.
    missed
        ``[row]`` what no parameter explains of what is missed.
    """

    weight: Real
    basis: Real
    prior: Real
    missed: Real

    @classmethod
    def of(cls, missed: Real, slopes: Real, z: Real) -> "_Regression":
        weight = weights(np.mean(missed**2, axis=1), missed.shape[1])[:, None]
        stacked = np.vstack([(weight * slopes).reshape(z.size, -1).T, np.eye(z.size)])
        basis = np.linalg.qr(stacked)[0] if z.size else np.zeros((missed.size, 0))
        # Moving a parameter by p costs (z + p)^2: the rows below want p = -z.
        rows = np.concatenate([(weight * missed).ravel(), -z])
        return cls(weight=weight, basis=basis, prior=z, missed=rows - basis @ (basis.T @ rows))

    def projected(self, change: Real) -> Real:
        """``[row]`` of a change that no parameter could make."""
        rows = np.concatenate([(self.weight * change).ravel(), np.zeros(self.prior.size)])
        return np.asarray(rows - self.basis @ (self.basis.T @ rows))

    def gain(self, explained: float) -> float:
        """Nats for a drop of the weighted sum of squares: all channels weigh alike, so it's one logarithm."""
        before = float(self.missed @ self.missed)
        channels = self.weight.size
        left = max(before - explained, 1e-12 * before)
        return 0.5 * EFFECTIVE_SAMPLES * channels * float(np.log(before / left)) if before > 0 else 0.0


_Found = Sequence[tuple[AttachedEffect, Real]]


def _singles(regression: _Regression, found: _Found) -> tuple[Screened, ...]:
    best: dict[tuple[str, str], Screened] = {}
    for effect, change in found:
        factor = _factor(float(change @ regression.missed), float(change @ change))
        explained = factor * (2 * float(change @ regression.missed) - factor * float(change @ change))
        _keep(best, Screened(effects=(effect,), gain=regression.gain(explained)))
    return tuple(sorted(best.values(), key=lambda each: -each.gain))


def _factor(product: float, square: float) -> float:
    """Strength over the one that was run; never negative, and not far beyond it."""
    return float(np.clip(product / square, 0.0, _LARGEST_FACTOR)) if square > 0 else 0.0


def _pairs(regression: _Regression, found: _Found) -> tuple[Screened, ...]:
    best: dict[tuple[tuple[str, str], ...], Screened] = {}
    changes = np.array([change for _, change in found])
    if len(found) < 2:
        return ()
    gram, products = changes @ changes.T, changes @ regression.missed
    for first, second in combinations(range(len(found)), 2):
        one, other = found[first][0], found[second][0]
        if one.site == other.site:
            continue
        own = gram[np.ix_((first, second), (first, second))]
        wanted = products[[first, second]]
        determinant = own[0, 0] * own[1, 1] - own[0, 1] ** 2
        if determinant <= 1e-6 * own[0, 0] * own[1, 1]:
            continue
        factors = np.array(
            [own[1, 1] * wanted[0] - own[0, 1] * wanted[1], own[0, 0] * wanted[1] - own[0, 1] * wanted[0]]
        )
        factors /= determinant
        # With one of them turned around it's no pair.
        if factors.min() <= 0 or factors.max() > _LARGEST_FACTOR:
            continue
        pair = Screened(effects=(one, other), gain=regression.gain(float(factors @ wanted)))
        if pair.names not in best or best[pair.names].gain < pair.gain:
            best[pair.names] = pair
    return tuple(sorted(best.values(), key=lambda each: -each.gain))


def _keep(best: dict[tuple[str, str], Screened], found: Screened) -> None:
    key = (found.effects[0].effect, found.effects[0].site)
    if key not in best or best[key].gain < found.gain:
        best[key] = found
