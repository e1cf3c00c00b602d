"""From contestants to named causes: groups, alternatives, probabilities, fitted numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from chladni.gap.calibration import NAMED, UNWEIGHED, ZERO
from chladni.gap.diagnosis.closing import explained_power
from chladni.gap.diagnosis.study import Study
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.diagnosis import Candidate, Cause, Closing, Correlation, FittedNumber, Ranked
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.files.site_units import compiled_site_units, known_site, units_at


def causes_named(study: Study, causes: Causes) -> tuple[Cause, ...]:
    """Give the causes that a verdict names; of several the one first that alone leaves least."""
    if causes.verdict not in ("effect", "parameters"):
        return ()
    if causes.shaken is not None:
        shaken = causes.shaken
        return (_unweighed(shaken.effect, "ground", shaken.parameters, group=shaken.group),)
    found: list[Cause] = []
    if causes.best is not causes.tuned:
        places = range(len(causes.best.hypothesis.named))
        told = [
            _cause(study, causes, place) for place in sorted(places, key=lambda place: _left_alone(causes, place))
        ]
        found += [one for one in told if one.probability >= NAMED]
    if causes.verdict == "effect" and study.stepping is not None:
        taken = {one.site for one in found if one.effect == study.stepping.name}
        steps = {site: one.step for site, one in study.lattices.items() if site not in taken}
        found += _by_samples(study, study.stepping, steps)
    if causes.constants and study.of_constant is not None:
        found += _by_samples(study, study.of_constant, causes.constants)
    return tuple(found)


def _by_samples(study: Study, kind: EffectKind, values: Mapping[str, float]) -> list[Cause]:
    """Causes of one number that samples themselves show, by the names of their outputs."""
    (name,) = kind.required
    units = dict(zip(study.measurement.output_names, study.measurement.output_units, strict=True))
    return [
        _unweighed(kind.name, site, {name: FittedNumber(value=one, std=None, unit=units[site])})
        for site, one in values.items()
    ]


def ranking_of(causes: Causes, causes_said: Sequence[Cause]) -> tuple[Ranked, ...]:
    """Give every candidate once, by falling probability; what wasn't weighed keeps what it was told with."""
    said = {(one.effect, one.site): one.probability for one in causes_said}
    rows = {
        key: Ranked(effect=key[0], site=key[1], probability=probability, gap=None, log_evidence=None)
        for key, probability in said.items()
    }
    # By falling evidence: the first that names a candidate is its best form.
    for one in reversed(causes.ranked):
        for candidate in one.hypothesis.named:
            key = (candidate.effect, candidate.site)
            own = causes.belief.probability(candidate)
            rows[key] = Ranked(
                effect=key[0],
                site=key[1],
                probability=own if candidate in causes.best.hypothesis.named else said.get(key, own),
                gap=one.gap,
                log_evidence=causes.belief.evidence(one),
                beside=tuple(other for other in one.hypothesis.named if other != candidate),
            )
    return tuple(sorted(rows.values(), key=lambda row: -row.probability))


def naive_of(causes: Causes) -> Candidate | None:
    """Give what the largest drop in RMS alone would name."""
    singles = [one for one in causes.ranked if len(one.hypothesis.named) == 1]
    return min(singles, key=lambda one: one.gap).hypothesis.named[0] if singles else None


def tuned_numbers(study: Study, fit: OutputErrorFit) -> dict[str, FittedNumber]:
    """Give every tuned parameter with its standard deviation; None for those that the log doesn't determine."""
    tunables = study.contest.run.tunables
    rows = zip(tunables.names, tunables.nominal, fit.parameter_std, tunables.units, strict=True)
    return {
        name: FittedNumber(
            value=float(fit.values[name]),
            std=None if name in fit.undetermined or not np.isfinite(std) else float(std),
            unit=unit,
            nominal=float(nominal),
        )
        for name, nominal, std, unit in rows
    }


def _cause(study: Study, causes: Causes, place: int) -> Cause:
    best = causes.best
    candidate = best.hypothesis.named[place]
    alike = causes.belief.alike(candidate)
    words = tuple(dict.fromkeys(one.effect for one in alike))
    effect = best.fit.effects[place] if place < len(best.fit.effects) else None
    return Cause(
        effect=candidate.effect,
        site=candidate.site,
        # Of the word at any of the sites that it's told for, or of all words that it's told with.
        probability=causes.belief.probability(*alike),
        group=tuple(one.site for one in alike if one.effect == candidate.effect),
        alternatives=tuple(one for one in causes.belief.in_its_place(candidate) if one.effect != candidate.effect),
        parameters=_numbers(study, best, place),
        variant=effect.variant if effect is not None else None,
        source=effect.source if effect is not None else None,
        probability_of=words if len(words) > 1 else (),
    )


def _left_alone(causes: Causes, place: int) -> float:
    """Least that one of the believed causes leaves when it's the only one."""
    candidate = causes.best.hypothesis.named[place]
    return min((one.chi for one in causes.ranked if one.hypothesis.named == (candidate,)), default=np.inf)


def _numbers(study: Study, found: Contestant, place: int) -> dict[str, FittedNumber]:
    if place >= len(found.fit.effects):
        # Of a wrong value the number stands among the tuned ones.
        return {}
    effect, std = found.fit.effects[place], found.fit.effect_std[place]
    units = compiled_site_units(study.model.compile())
    there = units_at(effect.site, units) if known_site(effect.site, units) else None
    return {
        name: FittedNumber(
            value=float(one.value), std=_finite(std.get(name)), unit=one.unit if there is None else there.of(one.unit)
        )
        for name, one in effect.parameters.items()
    }


def _finite(std: float | None) -> float | None:
    return float(std) if std is not None and np.isfinite(std) else None


def _unweighed(effect: str, site: str, numbers: Mapping[str, FittedNumber], *, group: tuple[str, ...] = ()) -> Cause:
    return Cause(
        effect=effect,
        site=site,
        probability=UNWEIGHED,
        group=tuple(dict.fromkeys([site, *group])),
        alternatives=(),
        parameters=numbers,
    )


def correlation_of(tunables: Tunables, fit: OutputErrorFit) -> Correlation | None:
    """Correlate the errors of the tuned parameters, those that the fit's effects leave free with them.

    ``r_ij = C_ij / sqrt(C_ii C_jj)`` with C the covariance of the logarithms over the tolerances, log and tolerances
    taken together; to first order that of the values too.

    Returns
    -------
    Correlation or None
        None where nothing was tuned.
    """
    count = len(tunables.names)
    if not np.any(fit.parameter_std):
        return None
    covariance = fit.covariance[:count, :count]
    std = np.sqrt(np.maximum(np.diag(covariance), ZERO))
    matrix = np.clip(covariance / std[:, None] / std, -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return Correlation(names=tunables.names, matrix=matrix)


def with_shares(causes: Causes, said: Sequence[Cause], gap: Closing) -> tuple[Cause, ...]:
    """Give the causes that a verdict names with their shares of the gap; see `Cause`.

    One cause has all that is explained. Of several each has what comes back when only the others are named, by the
    best fit of those; without such a fit nothing tells.
    """
    return tuple(replace(one, share=_share(causes, one, gap)) for one in said)


def _share(causes: Causes, cause: Cause, gap: Closing) -> float | None:
    if causes.shaken is not None:
        return gap.explained
    candidate, named = Candidate(effect=cause.effect, site=cause.site), set(causes.best.hypothesis.named)
    # A sensor's steps were told by what it reads, not by a fit.
    if gap.explained is None or candidate not in named:
        return None
    others = named - {candidate}
    if not others:
        return gap.explained
    left = next((one.gap for one in causes.ranked if set(one.hypothesis.named) == others), None)
    return None if left is None else explained_power(left, gap.tuned, gap.after, noise=gap.noise)
