"""Diagnosis of a simulator that isn't ours: which effects around it bring it to the log."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chladni.gap.comparison.measuring import measurement_of
from chladni.gap.comparison.noise_estimate import estimate_noise, noise_of_residual, smaller_floor
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.comparison.shares import (
    band_shares,
    channel_gaps,
    gap_map,
    pooled_gap,
    regime_shares,
    relative_residual,
)
from chladni.gap.diagnosis.simulator_fit import HARD_BOUND, SimulatorFit
from chladni.gap.diagnosis.simulator_runs import EFFECTIVE_SAMPLES, SimulatorRuns
from chladni.gap.diagnosis.simulator_search import SimulatorSearch, search
from chladni.gap.records.diagnosis import (
    Candidate,
    Cause,
    Closing,
    Diagnosis,
    FittedNumber,
    GapSignals,
    HeldOut,
    Ranked,
    SiteShare,
    Verdict,
    Where,
)
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.simulators.signal_model import SignalModel
from chladni.gap.simulators.simulator import Simulator
from chladni.gap.simulators.wrapped_simulator import WrappedSimulator
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.files.site_units import compiled_site_units
from chladni.signals.time_series import TimeSeries

Matrix = NDArray[np.float64]
#: A gap this close to the noise is none; explained is what closes this share of the rest.
_NO_GAP, _EXPLAINED = 1.15, 0.9
#: Nats by which parameters beyond their tolerance must beat those inside, and everything else.
_CLEARLY = 5.0
#: Hypotheses this close to the best, in nats, are told beside it.
_CLOSE = 3.0
#: A parameter whose uncertainty is this share of its tolerance wasn't determined by the log.
_UNDETERMINED = 0.9
_RESAMPLED = 500
_LISTED = 20


def diagnose_simulator(
    simulator: Simulator,
    recording: TimeSeries,
    *,
    log: str = "log",
    own_effects: Sequence[EffectKind] = (),
    leave_out: Sequence[str] = (),
    seed: int = 0,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Say which unmodelled effect, at an input, output or joint of a simulator, explains what a log shows.

    The simulator runs freely from its own start with the log's inputs; of parameters and effects those are chosen
    that explain blocks of the log which no fit saw (docs/methods/other-simulators.md).

    Parameters
    ----------
    simulator
        From `mujoco_simulator`, `callable_simulator`, or of your own.
    recording
        The log's channels on one grid, as `Log.read` gives them.
    log
        Its name, for people.
    own_effects
        Effects beside the catalogue's.
    leave_out
        Words that don't take part.
    seed
        Of the bootstrap.
    progress
        Called with what is being done, and the share of it that is done.

    Returns
    -------
    Diagnosis
        As for a model of ours; without `restoring_force`, which takes equations.

    Raises
    ------
    LogError
        When an input's channel is missing, or no output was measured.
    ModelError
        When units don't fit, or the simulator diverges.
    EstimateError
        When the log is shorter than 3 s.
    """
    measurement, remarks = measurement_of(SignalModel(simulator=simulator), recording, log=log)
    measurement = with_period(measurement)
    noise = estimate_noise(measurement)
    kinds = [kind for kind in (*CATALOGUE.values(), *own_effects) if kind.name not in leave_out]
    runs = SimulatorRuns.of(simulator, measurement, noise)
    found = search(runs, kinds, progress=progress or _silent)
    # What is left in the end is an upper bound too, and where a linear fit took distortion for noise, the lower one.
    left = noise_of_residual(measurement.outputs - found.best.outputs, sample_rate_hz=measurement.sample_rate_hz)
    return _Told(search=found, noise=smaller_floor(noise, left), remarks=remarks, seed=seed).diagnosis()


def explained_simulator(
    simulator: Simulator, diagnosis: Diagnosis, *, own_effects: Sequence[EffectKind] = ()
) -> WrappedSimulator:
    """Give the simulator as a diagnosis says that the machine is: tuned, and with the causes that it names.

    Parameters
    ----------
    simulator, diagnosis
        What was diagnosed, and what came of it.
    own_effects
        Those that took part.

    Raises
    ------
    ModelError
        When the diagnosis is another simulator's.
    """
    own = {kind.name: kind for kind in own_effects}
    effects = [
        attached(
            own.get(cause.effect, cause.effect),
            cause.site,
            {name: number.value for name, number in cause.parameters.items()},
            variant=cause.variant,
            source=cause.source,
        )
        for cause in diagnosis.causes
        if cause.effect != "parameter"
    ]
    values = {name: number.value for name, number in diagnosis.tuned_parameters.items()}
    return WrappedSimulator(simulator=simulator, values=values, effects=tuple(effects))


def _silent(_doing: str, _share: float) -> None:
    """Nobody listens."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Told:
    """A search, put into words."""

    search: SimulatorSearch
    noise: NoiseFloor
    remarks: tuple[str, ...]
    seed: int

    def diagnosis(self) -> Diagnosis:
        runs, verdict = self.search.runs, self.verdict
        chosen = self.chosen
        return Diagnosis(
            model=runs.wrapped.simulator.name,
            logs=(runs.measurement.log,),
            verdict=verdict,
            causes=self.causes(),
            ranking=self.ranking(),
            where=self.where(),
            gap=self.closing(),
            tuned_parameters=self.parameters(chosen),
            naive=self.naive(),
            remarks=(*self.remarks, *self.limits()),
            advice=self.advice(),
            signals=self.signals(),
        )

    @property
    def verdict(self) -> Verdict:
        found, runs = self.search, self.search.runs
        if self.loosened:
            return "parameters"
        if found.best is found.tuned:
            return "none" if runs.gap(found.tuned.outputs) < _NO_GAP * self.floor else "unknown"
        return "effect" if self.share_closed(found.best) >= _EXPLAINED else "unknown"

    @property
    def floor(self) -> float:
        """The noise, over the RMS of what was measured on held-out blocks."""
        runs = self.search.runs
        measured = runs.measurement.outputs[:, ~runs.training]
        return pooled_gap(np.broadcast_to(self.noise.rms[:, None], measured.shape), measured)

    @property
    def loosened(self) -> bool:
        """Whether parameters beyond their tolerance, and nothing else, explain the log."""
        found = self.search
        beyond = bool(np.any(np.abs(found.loose.z) > HARD_BOUND))
        rivals = max(found.tuned.log_evidence, found.best.log_evidence)
        explains = self.search.runs.gap(found.loose.outputs) < _NO_GAP * self.floor
        return beyond and found.loose.log_evidence > rivals + _CLEARLY and explains

    @property
    def chosen(self) -> SimulatorFit:
        """What the verdict says the machine is."""
        verdict = self.verdict
        if verdict == "parameters":
            return self.search.loose
        return self.search.best if verdict == "effect" else self.search.tuned

    def share_closed(self, fit: SimulatorFit) -> float:
        """Share of the tuned simulator's gap beyond the noise that a fit closes."""
        runs, tuned = self.search.runs, self.search.tuned
        whole = runs.gap(tuned.outputs) - self.floor
        return (runs.gap(tuned.outputs) - runs.gap(fit.outputs)) / whole if whole > 0 else 0.0

    def probabilities(self) -> list[tuple[SimulatorFit, float]]:
        """Each hypothesis with its share of the evidence."""
        # Further effects that weren't worth it say nothing about those that were.
        most = max(len(self.search.best.effects), 1)
        fits = [self.search.tuned, *(fit for fit in self.search.fits if len(fit.effects) <= most)]
        evidence = np.array([fit.log_evidence for fit in fits])
        odds = np.exp(evidence - evidence.max())
        return list(zip(fits, (odds / odds.sum()).tolist(), strict=True))

    def probability(self, effect: str, site: str) -> float:
        return float(sum(share for fit, share in self.probabilities() if (effect, site) in fit.names))

    def causes(self) -> tuple[Cause, ...]:
        verdict, found = self.verdict, self.search
        if verdict == "parameters":
            moved = [place for place, z in enumerate(found.loose.z) if abs(z) > HARD_BOUND]
            numbers = self.parameters(found.loose)
            names = [found.runs.tunables.names[place] for place in moved]
            probability = float(1 / (1 + np.exp(found.best.log_evidence - found.loose.log_evidence)))
            return tuple(_wrong_value(name, numbers[name], probability) for name in names)
        if verdict != "effect":
            return ()
        return tuple(self.cause(place, effect) for place, effect in enumerate(found.best.effects))

    def cause(self, place: int, effect: AttachedEffect) -> Cause:
        close = self.close_to(effect)
        sites = [each.site for each in close if each.effect == effect.effect]
        units = compiled_site_units(SignalModel(simulator=self.search.runs.wrapped.simulator).compile())[effect.site]
        names = effect.kind.parameters_of(effect.variant)
        return Cause(
            effect=effect.effect,
            site=effect.site,
            probability=self.probability(effect.effect, effect.site),
            group=(effect.site, *sites),
            alternatives=tuple(each for each in close if each.effect != effect.effect),
            parameters={
                name: FittedNumber(
                    value=effect.values[name], std=self.search.best.std(place, name), unit=units.of(one.unit)
                )
                for name, one in names.items()
            },
            variant=effect.variant,
            source=effect.source,
        )

    def close_to(self, effect: AttachedEffect) -> list[Candidate]:
        """Other causes that explain the log about as well in this one's place."""
        best = self.search.best
        rest = sorted(each for each in best.names if each != (effect.effect, effect.site))
        found = []
        for fit in self.search.fits:
            (others, own) = ([each for each in fit.names if each in rest], [e for e in fit.names if e not in rest])
            near = best.log_evidence - fit.log_evidence < _CLOSE
            if near and len(own) == 1 and others == rest and own[0] != (effect.effect, effect.site):
                found.append(Candidate(effect=own[0][0], site=own[0][1]))
        return list(dict.fromkeys(found))

    def ranking(self) -> tuple[Ranked, ...]:
        rows: dict[tuple[str, str], Ranked] = {}
        runs = self.search.runs
        for fit in sorted(self.search.fits, key=lambda each: -each.log_evidence):
            for effect, site in fit.names:
                rows.setdefault(
                    (effect, site),
                    Ranked(
                        effect=effect,
                        site=site,
                        probability=self.probability(effect, site),
                        gap=runs.gap(fit.outputs),
                        log_evidence=fit.log_evidence,
                    ),
                )
        for screened in self.search.singles:
            ((effect, site),) = screened.names
            unfitted = Ranked(effect=effect, site=site, probability=0.0, gap=None, log_evidence=None)
            rows.setdefault((effect, site), unfitted)
        return tuple(sorted(rows.values(), key=lambda each: -each.probability)[:_LISTED])

    def where(self) -> Where:
        runs, log = self.search.runs, self.search.runs.measurement
        residual = log.outputs - self.search.nominal
        motions = runs.motions(np.zeros(len(runs.tunables.names)), ()) if runs.wrapped.simulator.joints else ()
        variables = {
            f"{motion.name}.{word}": signal
            for motion in motions
            for word, signal in (("displacement", motion.displacement), ("velocity", motion.velocity))
        }
        return Where(
            channels=channel_gaps(residual, log.outputs, self.noise, output_names=log.output_names),
            bands=band_shares(residual, log.outputs, sample_rate_hz=log.sample_rate_hz),
            sites=self.sites(),
            regimes=regime_shares(residual, log.outputs, variables),
        )

    def sites(self) -> tuple[SiteShare, ...]:
        """Share of what tuning left that the best effect at each site explains, by the screen."""
        channels = self.search.runs.floor.size
        shares: dict[str, float] = {}
        for screened in self.search.singles:
            site = screened.effects[0].site
            share = float(-np.expm1(-2 * screened.gain / (EFFECTIVE_SAMPLES * channels)))
            shares[site] = max(shares.get(site, 0.0), share)
        ordered = sorted(shares.items(), key=lambda each: -each[1])
        return tuple(SiteShare(name=name, share=share) for name, share in ordered)

    def closing(self) -> Closing:
        found, runs = self.search, self.search.runs
        stages = [runs.gap(one) for one in (found.nominal, found.tuned.outputs, self.chosen.outputs)]
        before, tuned, after = stages
        # Below its own uncertainty a gap closes by chance.
        certain = before - self.floor > 2 * self.floor * float(np.max(self.noise.std))
        return Closing(
            before=before,
            tuned=tuned,
            after=after,
            noise=self.floor,
            closed=float(np.clip((before - after) / (before - self.floor), 0, 1)) if certain else None,
            interval=self.interval() if certain else None,
            held_out=self.held_out(),
        )

    def interval(self) -> tuple[float, float]:
        """Bootstrap over held-out blocks."""
        log = self.search.runs.measurement
        blocks = self.blocks()
        rows = []
        for outputs in (self.search.nominal, self.chosen.outputs):
            power = np.mean(relative_residual(log.outputs - outputs, log.outputs) ** 2, axis=0)
            rows.append([float(np.sum(power[block])) for block in blocks])
        sums = np.array([*rows, [block.stop - block.start for block in blocks]])
        rng = np.random.default_rng(self.seed)
        drawn = sums[:, rng.integers(len(blocks), size=(_RESAMPLED, len(blocks)))].sum(axis=2)
        before, after = np.sqrt(drawn[:2] / drawn[2])
        closed = np.clip((before - after) / np.maximum(before - self.floor, 1e-12), 0, 1)
        low, high = np.quantile(closed, (0.025, 0.975))
        return float(low), float(high)

    def blocks(self) -> list[slice]:
        """Samples of each held-out block."""
        training = self.search.runs.training
        edges = [0, *(np.flatnonzero(np.diff(training)) + 1).tolist(), training.size]
        return [slice(start, end) for start, end in pairwise(edges) if not training[start]]

    def held_out(self) -> tuple[HeldOut, ...]:
        log = self.search.runs.measurement
        rate_hz = log.sample_rate_hz
        return tuple(
            HeldOut(log=log.log, start_s=each.start / rate_hz, end_s=each.stop / rate_hz) for each in self.blocks()
        )

    def parameters(self, fit: SimulatorFit) -> Mapping[str, FittedNumber]:
        tunables = self.search.runs.tunables
        values = tunables.values(fit.z)
        found = {}
        for place, name in enumerate(tunables.names):
            sigma = float(np.sqrt(fit.covariance[place, place]))
            std = sigma * float(tunables.tolerance[place]) * abs(values[name])
            found[name] = FittedNumber(
                value=values[name],
                std=std if sigma < _UNDETERMINED else None,
                unit=tunables.units[place],
                nominal=float(tunables.nominal[place]),
            )
        return found

    def naive(self) -> Candidate | None:
        """Give the single effect with the smallest error on all samples."""
        runs = self.search.runs
        single = [fit for fit in self.search.fits if len(fit.effects) == 1]
        if not single:
            return None
        best = min(
            single, key=lambda fit: float(np.sum(runs.over_noise(runs.measurement.outputs - fit.outputs) ** 2))
        )
        ((effect, site),) = best.names
        return Candidate(effect=effect, site=site)

    def limits(self) -> tuple[str, ...]:
        told = ["effects at bodies and the ground can't be wrapped around a simulator and were not tried"]
        if not self.search.runs.wrapped.simulator.joints:
            told.append("the simulator names no joints, so that friction and play were not tried")
        held = [name for name, one in self.parameters(self.chosen).items() if one.std is None]
        if held:
            told.append(f"this log doesn't determine {', '.join(held)}")
        return tuple(told)

    def advice(self) -> str | None:
        if self.verdict == "none":
            return "The simulator agrees with the log within the noise."
        if self.verdict != "unknown":
            return None
        closed = max(self.share_closed(self.search.best), 0.0)
        return (
            f"No effect at an input, output or joint explains the gap: the best closes {closed:.0%} of what tuning "
            "left. Something is missing inside the simulator, or its parameters need wider tolerances."
        )

    def signals(self) -> GapSignals:
        log = self.search.runs.measurement
        after = self.chosen.outputs
        times_s, frequency_hz, before_map = gap_map(
            log.outputs - self.search.nominal, log.outputs, log.sample_rate_hz
        )
        _, _, after_map = gap_map(log.outputs - after, log.outputs, log.sample_rate_hz)
        return GapSignals(
            log=log.log,
            sample_rate_hz=log.sample_rate_hz,
            output_names=log.output_names,
            output_units=log.output_units,
            measured=log.outputs,
            before=self.search.nominal,
            after=after,
            noise_rms=self.noise.rms,
            map_time_s=times_s,
            map_frequency_hz=frequency_hz,
            gap_map=before_map,
            gap_map_after=after_map,
        )


def _wrong_value(name: str, number: FittedNumber, probability: float) -> Cause:
    return Cause(
        effect="parameter",
        site=name,
        probability=probability,
        group=(name,),
        alternatives=(),
        parameters={name.rpartition(".")[2]: number},
    )
