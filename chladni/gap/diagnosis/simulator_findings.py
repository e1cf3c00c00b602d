"""What a search around a simulator found, as a diagnosis says it."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chladni.gap.comparison.shares import (
    band_shares,
    channel_gaps,
    gap_map,
    pooled_gap,
    regime_shares,
    relative_residual,
)
from chladni.gap.diagnosis.closing import explained_power
from chladni.gap.diagnosis.completeness import completeness_of, known_share
from chladni.gap.diagnosis.simulator_fit import HARD_BOUND, SimulatorFit
from chladni.gap.diagnosis.simulator_runs import EFFECTIVE_SAMPLES
from chladni.gap.diagnosis.simulator_search import SimulatorSearch
from chladni.gap.records.diagnosis import (
    PARAMETER,
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
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.files.site_units import compiled_site_units
from chladni.signals.arrays import Real

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


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorFindings:
    """A search, put into words.

    Attributes
    ----------
    search
        What was fitted.
    noise
        The floor.
    remarks
        Sentences on the log.
    seed
        Of the bootstrap.
    step_error
        How far half the simulator's step moves the best explanation, as a gap; None where it can't tell.
    """

    search: SimulatorSearch
    noise: NoiseFloor
    remarks: tuple[str, ...]
    seed: int
    step_error: float | None

    def diagnosis(self) -> Diagnosis:
        """Give all of it."""
        runs, verdict = self.search.runs, self.verdict
        chosen = self.chosen
        return Diagnosis(
            model=runs.wrapped.simulator.name,
            logs=(runs.measurement.log,),
            verdict=verdict,
            causes=self.causes(),
            ranking=self.ranking(),
            where=self.where(self.search.nominal),
            left=self.where(self.search.tuned.outputs) if verdict == "unknown" else None,
            gap=self.closing(),
            tuned_parameters=self.parameters(chosen),
            naive=self.naive(),
            remarks=(*self.remarks, *self.limits()),
            advice=self.advice(),
            signals=self.signals(),
        )

    @property
    def verdict(self) -> Verdict:
        """What is said in one word."""
        found, runs = self.search, self.search.runs
        if self.loosened:
            return "parameters"
        if found.best is found.tuned:
            return "none" if runs.gap(found.tuned.outputs) < _NO_GAP * self.floor else "unknown"
        explained = self.share_closed(found.best) >= _EXPLAINED and not self.within_step
        return "effect" if explained else "unknown"

    @property
    def within_step(self) -> bool:
        """Whether the best effects move the outputs less than the simulator's own step does."""
        found, runs = self.search, self.search.runs
        return self.step_error is not None and self.step_error > runs.gap(found.tuned.outputs) - runs.gap(
            found.best.outputs
        )

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
        """Each hypothesis with its share of the evidence, less what speaks for a cause that isn't among them."""
        # Further effects that weren't worth it say nothing about those that were.
        most = max(len(self.search.best.effects), 1)
        fits = [self.search.tuned, *(fit for fit in self.search.fits if len(fit.effects) <= most)]
        evidence = np.array([fit.log_evidence for fit in fits])
        odds = np.exp(evidence - evidence.max())
        complete = [self.complete(fit) if fit.effects else 1.0 for fit in fits]
        return list(zip(fits, (odds / odds.sum() * np.array(complete)).tolist(), strict=True))

    def complete(self, fit: SimulatorFit) -> float:
        """Probability that the effects of a fit, or its values where it has none, are all of the cause."""
        search = self.search
        lowest = np.min([one.powers for one in (search.tuned, search.loose, *search.fits)], axis=0)
        floor, tuned = np.minimum(lowest, 1.0), search.tuned.powers
        return known_share(tuned, floor) * completeness_of(
            tuned, fit.powers, floor, exact=all(one.kind.clues.exact for one in fit.effects)
        )

    def probability(self, effect: str, site: str) -> float:
        """Give the probability of all hypotheses with this cause together."""
        return float(sum(share for fit, share in self.probabilities() if (effect, site) in fit.names))

    def causes(self) -> tuple[Cause, ...]:
        """Give what the verdict names."""
        verdict, found = self.verdict, self.search
        if verdict == "parameters":
            moved = [place for place, z in enumerate(found.loose.z) if abs(z) > HARD_BOUND]
            numbers, share = self.parameters(found.loose), self.explained
            names = [found.runs.tunables.names[place] for place in moved]
            odds = float(1 / (1 + np.exp(found.best.log_evidence - found.loose.log_evidence)))
            probability = odds * self.complete(found.loose)
            # Of several values that move together no fit tells what each is worth.
            share = share if len(names) == 1 else None
            return tuple(_wrong_value(name, numbers[name], probability, share) for name in names)
        if verdict != "effect":
            return ()
        return tuple(self.cause(place, effect) for place, effect in enumerate(found.best.effects))

    def cause(self, place: int, effect: AttachedEffect) -> Cause:
        """Put one effect of the best hypothesis into words."""
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
            share=self.share(effect),
        )

    @property
    def explained(self) -> float | None:
        """Share of the power that tuning leaves beyond the noise, see `Closing`."""
        runs, tuned, chosen = self.search.runs, self.search.tuned, self.chosen
        if chosen is tuned or not self._is_certain(runs.gap(tuned.outputs)):
            return None
        gaps = [runs.gap(one.outputs) for one in (tuned, tuned, chosen)]
        return explained_power(*gaps, noise=self.floor)

    def share(self, effect: AttachedEffect) -> float | None:
        """Share of the gap that one effect of the best hypothesis explains, see `Cause`."""
        runs, best, explained = self.search.runs, self.search.best, self.explained
        others = tuple(each for each in best.names if each != (effect.effect, effect.site))
        if explained is None or not others:
            return explained
        beside = [fit for fit in self.search.fits if fit.names == others]
        if not beside:
            return None
        left = max(beside, key=lambda fit: fit.log_evidence)
        gaps = [runs.gap(one.outputs) for one in (left, self.search.tuned, best)]
        return explained_power(*gaps, noise=self.floor)

    def _is_certain(self, gap: float) -> bool:
        """Whether a gap lies above its own uncertainty; below it closes by chance."""
        return gap - self.floor > 2 * self.floor * float(np.max(self.noise.std))

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
        """Give each effect and site with its best hypothesis, by falling probability."""
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
                        beside=tuple(
                            Candidate(effect=word, site=other)
                            for word, other in fit.names
                            if (word, other) != (effect, site)
                        ),
                    ),
                )
        for screened in self.search.singles:
            ((effect, site),) = screened.names
            unfitted = Ranked(effect=effect, site=site, probability=0.0, gap=None, log_evidence=None)
            rows.setdefault((effect, site), unfitted)
        return tuple(sorted(rows.values(), key=lambda each: -each.probability)[:_LISTED])

    def where(self, simulated: Real) -> Where:
        """Say where the gap to a simulation lies."""
        runs, log = self.search.runs, self.search.runs.measurement
        residual = log.outputs - simulated
        motions = runs.motions(np.zeros(len(runs.tunables.names)), ()) if runs.wrapped.simulator.joints else ()
        variables = {
            f"{motion.name}.{word}": signal
            for motion in motions
            for word, signal in (("displacement", motion.displacement), ("velocity", motion.velocity))
        }
        return Where(
            channels=channel_gaps(residual, log.outputs, self.noise, output_names=log.output_names),
            bands=band_shares(residual, log.outputs, sample_rate_hz=log.sample_rate_hz, noise=self.noise),
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
        """Say how far the gap closes on held-out blocks."""
        found, runs = self.search, self.search.runs
        stages = [runs.gap(one) for one in (found.nominal, found.tuned.outputs, self.chosen.outputs)]
        before, tuned, after = stages
        certain = self._is_certain(before)
        return Closing(
            before=before,
            tuned=tuned,
            after=after,
            noise=self.floor,
            closed=float(np.clip((before - after) / (before - self.floor), 0, 1)) if certain else None,
            interval=self.interval() if certain else None,
            held_out=self.held_out(),
            explained=self.explained,
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
        """Give the held-out blocks in seconds."""
        log = self.search.runs.measurement
        rate_hz = log.sample_rate_hz
        return tuple(
            HeldOut(log=log.log, start_s=each.start / rate_hz, end_s=each.stop / rate_hz) for each in self.blocks()
        )

    def parameters(self, fit: SimulatorFit) -> Mapping[str, FittedNumber]:
        """Give the tuned numbers; without `std` where the log says no more than the tolerance did."""
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
        """Give sentences on what limits the answer."""
        told = ["effects at bodies and the ground can't be wrapped around a simulator and were not tried"]
        if not self.search.runs.wrapped.simulator.joints:
            told.append("the simulator names no joints, so that friction and play were not tried")
        if self.step_error is not None and self.step_error > self.floor:
            told.append(
                f"half the simulator's step moves its outputs by {self.step_error:.1%}, more than the noise of "
                f"{self.floor:.1%}; shorten the step, or part of this answer is the step's"
            )
        held = [name for name, one in self.parameters(self.chosen).items() if one.std is None]
        if held:
            told.append(f"this log doesn't determine {', '.join(held)}")
        return tuple(told)

    def advice(self) -> str | None:
        """Give a sentence for the verdicts that name no cause."""
        if self.verdict == "none":
            return "The simulator agrees with the log within the noise."
        if self.verdict != "unknown":
            return None
        if self.search.best is not self.search.tuned and self.within_step:
            return "The simulator's own step moves its outputs more than any effect does; shorten the step."
        closed = max(self.share_closed(self.search.best), 0.0)
        return (
            f"No effect at an input, output or joint explains the gap: the best closes {closed:.0%} of what tuning "
            "left. Something is missing inside the simulator, or its parameters need wider tolerances."
        )

    def signals(self) -> GapSignals:
        """Give what pictures draw."""
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
            noise_density=self.noise.one_sided(log.sample_rate_hz),
            map_time_s=times_s,
            map_frequency_hz=frequency_hz,
            gap_map=before_map,
            gap_map_after=after_map,
        )


def _wrong_value(name: str, number: FittedNumber, probability: float, share: float | None) -> Cause:
    return Cause(
        effect=PARAMETER,
        site=name,
        probability=probability,
        group=(name,),
        alternatives=(),
        parameters={name.rpartition(".")[2]: number},
        share=share,
    )
