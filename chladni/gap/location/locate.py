"""Where the gap comes from: every place profiled, the best ones to the end."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from chladni.gap.calibration import (
    ALIKE,
    CLEARLY,
    CYCLES,
    CYCLES_ASKED,
    FAINT_WISH,
    FEWEST_SAMPLES,
    FLOOR_BANDS,
    FORMS,
    GAINED,
    HARDLY_ANY,
    LEADS,
    LESS,
    LITTLE,
    LOCATED,
    PLACES,
    RIDGE,
    SAME,
    SEGMENTS,
)
from chladni.gap.comparison.doubts import modes_of
from chladni.gap.comparison.whitening import noise_floor_of
from chladni.gap.location.profile import Profile, Projection, profile_at, profiled
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Place, Site, placed, sites_of
from chladni.gap.plant.record_lines import RecordLines, all_lines, segment_lines, telling_lines
from chladni.gap.plant.tunable import Scaled
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.side_by_side import side_by_side
from chladni.models.core.model import Model
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Located:
    """One place, or two that act together, with the profile on the whole record's lines."""

    places: tuple[Place, ...]
    profile: Profile


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """What location found.

    Attributes
    ----------
    problem
        On the record's telling lines, with the noise as it shows behind the best place.
    tuned
        Profile without any force: the parameters alone.
    ranked
        The places that were followed, by rising misfit.
    segments
        The problems on segments, short ones first.
    shares
        Share of the misfit beyond noise that an unknown force at each site explains, by name; empty with one
        sensor, which can't tell sites apart.
    places
        All, by rising misfit of a first look.
    """

    problem: LinearProblem
    tuned: Profile
    ranked: tuple[Located, ...]
    segments: tuple[LinearProblem, ...]
    shares: dict[str, float]
    places: tuple[Place, ...]

    @property
    def best(self) -> Located | None:
        """The place that explains most, None when there are too few sensors to tell."""
        return self.ranked[0] if self.ranked else None


def locate(
    model: Model, measurement: Measurement, noise: NoiseFloor, tunables: Scaled, start_z: Real | None = None
) -> Location:
    """Profile an unknown force at every place of a model.

    Parameters are refitted within their tolerance under each hypothesis, so that a tuning that swallowed part of an
    effect can't mislead; they begin at ``start_z [parameter]``, zero without. With one sensor any force explains
    anything: then every place is handed on.
    """
    whole = LinearProblem(
        model, measurement, noise, tunables, all_lines(measurement.samples, measurement.sample_rate_hz)
    )
    start = np.zeros(len(tunables.names)) if start_z is None else start_z
    segments, tuned = _tuned_on_segments(model, whole, start)
    view = segments[-1].view(tuned.z)
    places = placed(view, sites_of(view.compiled, measurement.output_names), measurement.output_names, noise)
    record = whole.on(_telling(whole))
    plain = profiled(record, (), tuned.z)
    rough = _roughly((*segments, record), plain, places, start)
    ranked = _followed(record, _tied(rough, LOCATED))
    if ranked and ranked[0].profile.expected > 1 and ranked[0].profile.chi < LESS * plain.chi:
        record = record.with_noise(noise_behind(record, ranked[0].profile))
        ranked = _followed(record, _tied(ranked, FORMS))
        plain = profiled(record, (), plain.z)
    return Location(
        problem=record,
        tuned=plain,
        ranked=tuple(ranked),
        segments=segments,
        shares=_shares(plain, rough),
        places=tuple(one.places[0] for one in rough),
    )


def located_pairs(location: Location) -> list[Located]:
    """Profile forces at two places at a time; by rising misfit, none with one sensor.

    Two sensors don't tell pairs apart, since any two forces explain both; what is between them is whether the forces
    follow laws. The first few, and those that explain as much, are paired with every other place too: beside the
    strongest force that of a second one may explain nothing alone.
    """
    problem = location.problem
    if len(problem.measured) < 2:
        return []
    followed = list(location.ranked[:LOCATED])
    level = sum(one.profile.chi < ALIKE * followed[0].profile.chi for one in followed)
    leading = min(max(LEADS, level), PLACES)
    known = {one.places[0] for one in followed}
    pairs = [(one, other.places[0]) for place, one in enumerate(followed) for other in followed[place + 1 :]]
    pairs += [(one, other) for one in followed[:leading] for other in location.places if other not in known]
    found = []
    for first, second in pairs:
        sites = (first.places[0].sites[0], second.sites[0])
        profile = profiled(problem, sites, first.profile.z, share=GAINED)
        found.append(Located(places=(first.places[0], second), profile=profile))
    return _by_misfit(found)


def _tuned_on_segments(model: Model, whole: LinearProblem, start: Real) -> tuple[tuple[LinearProblem, ...], Profile]:
    measurement = whole.measurement
    if whole.starts_known:
        return (whole,), tuned_stepwise([whole], start)
    period = measurement.sample_rate_hz / lowest_hz(model, measurement)
    problems = []
    for periods in SEGMENTS:
        length = int(np.clip(periods * period, 2 * FEWEST_SAMPLES, measurement.samples // 2))
        lines = segment_lines(length, samples=measurement.samples, sample_rate_hz=measurement.sample_rate_hz)
        problems.append(whole.on(lines))
    return tuple(problems), tuned_stepwise(problems, start)


def tuned_stepwise(
    problems: Sequence[LinearProblem], z: Real, limit: float | Real | None = None, sites: Sequence[Site] = ()
) -> Profile:
    """Fit the parameters on one problem after another, each starting where the one before ended, the last one finely.

    Forces at the sites may be anything meanwhile; the limit is that of `profiled`.
    """
    limit = problems[0].limits(z) if limit is None else limit
    for problem in problems[:-1]:
        z = profiled(problem, sites, z, limit=limit, share=LITTLE).z
    return profiled(problems[-1], sites, z, limit=limit)


def lowest_hz(model: Model, measurement: Measurement) -> float:
    """Lowest frequency of an oscillation that the record holds several times."""
    turning = modes_of(model.compile())
    heard = turning[turning > CYCLES / measurement.duration_s]
    return float(heard.min()) if heard.size else CYCLES_ASKED / measurement.duration_s


def _roughly(
    problems: Sequence[LinearProblem], plain: Profile, places: Sequence[Place], start: Real
) -> list[Located]:
    """Profile every place in a few steps; by rising misfit on the whole record, the last of the problems.

    An effect may have led a tuning without it far from the right parameters, so each place finds its own, on segments
    first. But they don't rank: the states at the start of each segment would explain most of what an effect does.
    """
    if len(problems[-1].measured) < 2:
        return [Located(places=(place,), profile=replace(plain, sites=(place.sites[0],))) for place in places]

    def roughly(place: Place) -> Located:
        sites, z = (place.sites[0],), start
        for problem in problems[:-1]:
            z = profiled(problem, sites, z, share=LITTLE).z
        found = [profiled(problems[-1], sites, each, share=LITTLE) for each in (z, plain.z)]
        return Located(places=(place,), profile=min(found, key=lambda one: one.cost))

    return _by_misfit(side_by_side(roughly, _worth_a_profile(problems[-1], plain, places)))


def _worth_a_profile(problem: LinearProblem, plain: Profile, places: Sequence[Place]) -> list[Place]:
    """Leave out pairs of bodies that explain little at the tuned parameters, of which a model has many."""
    pairs = [place for place in places if all(site.kind == "pair" for site in place.sites)]
    found = side_by_side(lambda place: profile_at(problem, (place.sites[0],), plain.z).misfit, pairs)
    kept = [pairs[place] for place in np.argsort(found, kind="stable")[:LOCATED]]
    return [place for place in places if place not in pairs or place in kept]


def _followed(record: LinearProblem, rough: Sequence[Located]) -> list[Located]:
    """Profile places to the end."""
    # With one sensor all patterns are one place: nothing is known of it but that it explains all.
    return _by_misfit([replace(one, profile=profiled(record, one.profile.sites, one.profile.z)) for one in rough])


def _by_misfit(found: Sequence[Located]) -> list[Located]:
    return sorted(found, key=lambda one: one.profile.chi)


def _tied(rough: list[Located], least: int) -> list[Located]:
    """Keep the first few, and those behind them that are as good."""
    # Less than noise isn't better than noise: beside a floor that is too high others make use of what is spare.
    tied = sum(one.profile.chi < CLEARLY * max(rough[0].profile.chi, 1.0) for one in rough)
    return rough[: min(max(least, tied), 2 * LOCATED)]


def _telling(whole: LinearProblem) -> RecordLines:
    power = np.sum(np.abs(whole.measured * whole.weight) ** 2, axis=(0, 1))
    measurement = whole.measurement
    return telling_lines(power, samples=measurement.samples, sample_rate_hz=measurement.sample_rate_hz)


def _shares(tuned: Profile, rough: Sequence[Located]) -> dict[str, float]:
    return {
        site.name: explained_share(tuned.chi, one.profile.chi)
        for one in rough
        # With one sensor no force was fitted anywhere: any would explain all, and none more than another.
        if one.profile.forces
        for site in one.places[0].sites
    }


def explained_share(without: float, chi: float) -> float:
    """Give the share of the misfit beyond noise that forces, or causes, explain, 0 to 1.

    Both are mean squares over what noise alone leaves, without any of them and with them.
    """
    return float(np.clip((without - max(chi, 1.0)) / max(without - 1.0, RIDGE), 0.0, 1.0))


def sites_at(located: Located) -> Sequence[tuple[Site, tuple[Site, ...]]]:
    """Give each site with those of the other place, whose force is free while the site's laws are weighed."""
    if len(located.places) == 1:
        return [(site, ()) for site in located.places[0].sites]
    first, second = located.places
    return [(site, (second.sites[0],)) for site in first.sites] + [(site, (first.sites[0],)) for site in second.sites]


def noise_behind(problem: LinearProblem, found: Profile) -> NoiseFloor:
    """Estimate the noise again, under the hypothesis that forces of any shape act at the sites of a profile.

    What is left off the patterns has, in sensor j, the variance ``sum_k |P_jk|^2 s_k^2`` with P the projector off the
    patterns and s_k^2 the noise of sensor k (whitened by the former estimate): a small non-negative least-squares
    problem in each band (minimum norm quadratic unbiased estimation, Rao 1971). A floor is lowered, never raised:
    the estimates before hold distortion that the force explains.
    """
    measurement = problem.measurement
    whole = problem.on(all_lines(measurement.samples, measurement.sample_rate_hz))
    view = whole.view(found.z)
    patterns = [whole.pattern(view, site) for site in found.sites]
    out = Projection(patterns)
    residual = (whole.measured - view.response(found.transient, ())) * whole.weight
    left = np.abs(out.away(residual)[:, 0]) ** 2
    size = len(left)
    spread = np.abs(out.away(np.broadcast_to(np.eye(size)[:, :, None, None], (size, size, 1, left.shape[1])))) ** 2
    edges = np.linspace(0, left.shape[1], FLOOR_BANDS + 1).astype(np.int64)
    factor = np.ones((size, left.shape[1]))
    for low, high in itertools.pairwise(edges):
        matrix = spread[:, :, 0, low:high].mean(axis=2).T
        # A sensor that the patterns take whole says nothing of its noise: a faint wish keeps it as it was.
        wish = FAINT_WISH * np.eye(size)
        found_power = nnls(
            np.vstack([matrix, wish]), np.concatenate([left[:, low:high].mean(axis=1), np.diag(wish)])
        )[0]
        # Few sensors hardly tell whose a residual is: one's a little lower and another's higher would lower both.
        lower = np.where(found_power < LESS, np.maximum(found_power, HARDLY_ANY**2), 1.0)
        factor[:, low:high] = lower[:, None]
    former = problem.noise
    # What no model follows a machine to is in the weight beside the noise, and may be in what is left: no one knows.
    density = np.minimum(factor / whole.weight[:, 0] ** 2, former.density(whole.lines.cycles))
    return noise_floor_of(
        np.pad(density, ((0, 0), (1, 1 - measurement.samples % 2)), mode="edge"),
        samples=measurement.samples,
        freedom=np.full(size, 2.0 * left.shape[1]),
        method=tuple(
            "explained residual" if np.mean(one) < 1 / SAME else old
            for one, old in zip(factor, former.method, strict=True)
        ),
        upper_bound=former.upper_bound,
        scale=np.std(measurement.outputs, axis=1),
    )
