"""What each input did between its samples, told from the log: evidence of a linear fit for each hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.location.profile import profiled
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.neighbours import Scaled
from chladni.gap.plant.record_lines import RecordLines, all_lines
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port import HOLDS, HoldKind
from chladni.signals.arrays import Complex, Real

#: Bands of lines of each output whose scatter is that of what a model misses, and lines that are looked at.
_BANDS, _LINES = 24, 3000
#: Nats by which a hold must lead: odds of 1000 to one, since all that follows stands on it.
BEYOND_DOUBT = float(np.log(1000.0))


#: Samples by which a signal that is held lags behind its samples.
_LATE_BY: Mapping[HoldKind, float] = {"zoh": 0.5, "foh": 0.0, "band_limited": 0.0}
#: No parameter of a model has a name like this.
_LATE = "outputs late"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToldHold:
    """What the log says of one input.

    Attributes
    ----------
    name
        The input's.
    nats
        Log likelihood of each hold less that of the best.
    hold
        The best one where it leads beyond doubt, else None.
    """

    name: str
    nats: Mapping[HoldKind, float]
    hold: HoldKind | None


@dataclass(frozen=True, slots=True)
class _Late:
    """A model all of whose outputs are late: implements `Varied`."""

    model: Model
    late_s: float = 0.0

    def with_values(self, values: Mapping[str, float]) -> "_Late":
        own = {name: value for name, value in values.items() if name != _LATE}
        return _Late(self.model.with_values(own), values.get(_LATE, self.late_s))

    def compile(self) -> CompiledModel:
        compiled = self.model.compile()
        return replace(compiled, output_offsets_s=tuple(one + self.late_s for one in compiled.output_offsets_s))


class _WithLateness:
    """Parameters and the lateness of `_Late`, by samples: implements `Scaled`."""

    def __init__(self, tunables: Scaled, sample_rate_hz: float) -> None:
        self._tunables, self._rate_hz = tunables, sample_rate_hz
        self.names = (*tunables.names, _LATE)

    def values(self, z: Real) -> Mapping[str, float]:
        return {**self._tunables.values(z[:-1]), _LATE: float(z[-1]) / self._rate_hz}


def told_holds(
    model: Model, measurement: Measurement, noise: NoiseFloor, tunables: Scaled, z: Real
) -> tuple[ToldHold, ...]:
    """Tell how the inputs of a log run between their samples, one after another.

    Under each hold the parameters are tuned anew, and each other hold is held against that on bands of lines of each
    output. What the parameters, even outside of their tolerances, the ends of the record, and a time by which all
    outputs are late could do instead counts for no hold. Inputs whose hold the model states, which never move, or
    whose rate acts too, are left as they are.

    Parameters
    ----------
    model
        Nominal; ``model.with_holds({one.name: one.hold for one in told if one.hold})`` takes what was told.
    z
        ``[parameter]`` where the fits begin, near where the parameters are tuned to.

    Returns
    -------
    tuple of ToldHold
        One for each input that was asked about, in the order of the model's inputs.
    """
    lines = _spread_lines(measurement)
    told: list[ToldHold] = []
    for terminal, signal in zip(model.compile().inputs, measurement.inputs, strict=True):
        if terminal.hold is not None or terminal.derivatives or not np.any(signal != signal[0]):
            continue
        scaled = _WithLateness(tunables, measurement.sample_rate_hz)
        problems = [
            LinearProblem(_Late(model.with_holds({terminal.name: hold})), measurement, noise, scaled, lines)
            for hold in HOLDS
        ]
        nats = _nats(problems, np.append(z, 0.0))
        found = ToldHold(name=terminal.name, nats=dict(zip(HOLDS, nats.tolist(), strict=True)), hold=_leader(nats))
        told.append(found)
        if found.hold is not None:
            model = model.with_holds({found.name: found.hold})
    return tuple(told)


def _spread_lines(measurement: Measurement) -> RecordLines:
    """Lines evenly over the record's: what tells a hold is at high frequencies, wherever the power is."""
    every = all_lines(measurement.samples, measurement.sample_rate_hz)
    places = np.unique(np.linspace(0, every.index.size - 1, min(_LINES, every.index.size)).astype(np.int64))
    return RecordLines(
        index=every.index[places], samples=measurement.samples, sample_rate_hz=measurement.sample_rate_hz
    )


def _nats(problems: Sequence[LinearProblem], z: Real) -> Real:
    """``[hold]`` log likelihood less that of the best.

    On the straight way from one hold to another, at 0 and 1, the log lies somewhere. What the bands of all outputs
    scatter about that place is its variance, so that what is missing in the model, which knows no hold, doubts all
    holds alike; and how far the log is from the better hold, it may be from any. Where nothing fits, each hold finds
    the log near itself: so the better one must also leave less, see `_less`.
    """
    count = len(problems)
    # From where the best ends all others are near: but for half a sample they are alike where the machine moves most.
    tuned = [profiled(problem, (), z, iterations=4) for problem in problems]
    first = min(range(count), key=lambda own: tuned[own].cost)
    views = [_seen_from(problems, own, _moved(tuned[first].z, first, own)) for own in range(count)]
    leads = np.array(
        [
            [
                0.0 if a is b else min(_lead(*a.places[row]), _less(a.power, b.power, a.lines))
                for row, b in enumerate(views)
            ]
            for a in views
        ]
    )
    best = int(np.argmax(leads.min(axis=1)))
    return np.asarray(0.0 - leads[best])


def _lead(place: float, variance: float) -> float:
    """Log likelihood of 0 over 1."""
    return (1 - 2 * place) / (2 * (variance + place**2))


def _less(own: Real, other: Real, lines: float) -> float:
    """Log likelihood of one hold over another by the ``[output, band]`` power that they leave, over the noise's.

    In each band its variance is unknown, but not below the noise's, as in the fits. Where neither comes down to the
    noise something is missing in that band: its lines count by the share that noise has in it.
    """
    missed = [np.where(power > 1, 1 + np.log(np.maximum(power, 1.0)), power) for power in (own, other)]
    return float(np.sum(lines / np.maximum(np.minimum(own, other), 1.0) * (missed[1] - missed[0])))


@dataclass(frozen=True, slots=True, kw_only=True)
class _View:
    """Where the parameters are best for one hold: place of the log on the way to each, its variance, power left."""

    places: list[tuple[float, float]]
    power: Real
    lines: float


def _seen_from(problems: Sequence[LinearProblem], own: int, z: Real) -> _View:
    problem = problems[own]
    found = profiled(problem, (), z, iterations=4)
    here = problem.response(found.z, found.transient, ())
    nuisances = np.concatenate(
        [problem.slopes(found.z, found.transient, ()), problem.transients(problem.view(found.z))]
    )
    basis = np.linalg.qr(_unit(_real(nuisances)).T)[0]
    left = _real(problem.measured * problem.weight - here)
    lines = problem.lines.index.size / _BANDS
    power = np.array([_sums(row) for row in (left**2).reshape(len(here), -1)]) / lines
    places = []
    for place, other in enumerate(problems):
        apart = _real(other.response(_moved(found.z, own, place), found.transient, ()) - here)
        free, rest = (each - basis @ (basis.T @ each) for each in (apart, left))
        places.append(_placed(free, rest, power))
    return _View(places=places, power=power, lines=lines)


def _moved(z: Real, own: int, other: int) -> Real:
    """Parameters under another hold, with which the outputs are as late as under the own."""
    found = z.copy()
    found[-1] += _LATE_BY[HOLDS[own]] - _LATE_BY[HOLDS[other]]
    return found


def _real(spectra: Complex) -> Real:
    """``[..., number]`` real and imaginary parts of ``[..., output, 1, line]``."""
    flat = np.ascontiguousarray(spectra.reshape(*spectra.shape[:-3], -1))
    return np.asarray(flat.view(np.float64))


def _unit(rows: Real) -> Real:
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(np.divide(rows, size, out=np.zeros_like(rows), where=size > 0))


def _placed(apart: Real, left: Real, power: Real) -> tuple[float, float]:
    """Where ``left [number]`` lies on the way ``apart [number]``, and the variance of that."""
    size, along = (
        np.concatenate([_sums(row) for row in each.reshape(len(power), -1)]) for each in (apart**2, left * apart)
    )
    # Half of a line's power is that of one of its two numbers.
    information = 2 * size / np.maximum(power.ravel(), 1.0)
    total = information.sum()
    if total == 0:
        return 0.5, 1.0
    share = np.divide(along, size, out=np.zeros_like(size), where=size > 0)
    place = information @ share / total
    variance = np.sum(information**2 * (share - place) ** 2) / total**2
    return float(place), float(variance + 1 / total)


def _sums(row: Real) -> Real:
    return np.array([part.sum() for part in np.array_split(row, _BANDS)])


def _leader(nats: Sequence[float] | Real) -> HoldKind | None:
    second, first = np.argsort(nats)[-2:]
    return HOLDS[first] if nats[int(first)] - nats[int(second)] > BEYOND_DOUBT else None
