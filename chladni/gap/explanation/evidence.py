"""Evidence: how probable a hypothesis makes a log; noise, details of its laws and its own freedom are allowed for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from chladni.gap.calibration import DETAILS, DOUBT, ELSEWHERE, OPEN, SIGMAS, SIZE, SLIP, UNUSUAL, USUAL, ZERO
from chladni.gap.location.profile import Elimination, Profile, Projection, Shared
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.linear_view import View
from chladni.gap.plant.places import printed_alike, sites_of, way_to
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.effect_scale import effect_numbers
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.signals.arrays import Complex, Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Left:
    """What a fit leaves on the telling lines of a log, as whitened energy; noise alone leaves the expected one.

    Attributes
    ----------
    along, along_expected
        Of it what a force at the sites of laws with details could print.
    across, across_expected
        The rest.
    force
        Energy along the same that the fit leaves without those laws: its parameters and linear words beside them.
    doubt
        Share of the expected energy that the noise is uncertain by.
    sites
        Of laws with details, or places where these print alike: each differs from the machine's in its own way.
    outputs
        Energy of each output over what noise leaves there; empty where outputs aren't told apart.
    along_outputs
        Of `along_expected` each output's; empty where that's all alike.
    own, own_force
        ``[site]`` of what is beyond the noise along, and of `force`, what a force at each site is of it. They add up
        to more than one where forces must work against each other to leave so little; all alike where empty.
    """

    along: float
    along_expected: float
    across: float
    across_expected: float
    force: float
    doubt: float = DOUBT
    sites: int = 1
    outputs: tuple[float, ...] = ()
    along_outputs: tuple[float, ...] = ()
    own: tuple[float, ...] = ()
    own_force: tuple[float, ...] = ()

    def at(self, level: ArrayLike) -> Self:
        """Give the same where the noise has another share of the floor, ``[output]`` or of all."""
        own = np.array(self.along_outputs) if self.along_outputs else np.full(np.size(level), self.along_expected)
        own = own * (self.along_expected / max(own.sum(), ZERO))
        rest = (self.along_expected + self.across_expected) / own.size - own
        return replace(self, along_expected=float(np.sum(level * own)), across_expected=float(np.sum(level * rest)))

    @property
    def over_noise(self) -> float:
        """Energy over what noise leaves."""
        return (self.along + self.across) / (self.along_expected + self.across_expected)

    @property
    def details(self) -> float:
        """Share of the laws' force, as RMS, that the laws leave beyond noise; 0 without such laws."""
        beyond = max(self.along - self.along_expected, 0.0)
        return float(np.sqrt(beyond / max(self.force - self.along_expected, beyond, ZERO)))

    @property
    def beyond(self) -> float:
        """Energy beyond the noise."""
        return max(self.along - self.along_expected, 0.0) + max(self.across - self.across_expected, 0.0)

    @property
    def elsewhere(self) -> float:
        """Nats of what no force at the sites could print, whatever the floor may be wrong by."""
        noise = self.across_expected
        return _student(_beyond_doubt(self.across - noise, self.doubt * noise), ELSEWHERE)

    @property
    def unexplained(self) -> float:
        """Nats of what neither noise, wrong as the floor may be, nor usual details of the laws account for."""
        found = self.elsewhere
        for beyond, doubted, force in self._of_sites():
            # Where no force without the laws is known, of windows, no detail is usual.
            usual = OPEN**2 * force if np.isfinite(force) else 0.0
            found += _student(_beyond_doubt(beyond - usual, doubted), UNUSUAL, usual)
        return found

    @property
    def log_likelihood(self) -> float:
        """Nats, but for what all hypotheses share.

        Of noise alone it's the misfit. What goes beyond that by D independent numbers of unknown size is
        ``-D ln(1 + misfit/D)`` (Student's distribution: a Gaussian discrepancy whose scale is integrated out): few
        numbers for usual details of each law, more for what it leaves of its force beyond, most for all else.
        """
        across = self.across_expected
        nats = _student(_told(self.across - across, self.doubt * across), ELSEWHERE)
        for beyond, doubted, force in self._of_sites():
            usual = USUAL**2 * force
            unusual = _told(beyond - usual, doubted)
            nats += _student(_told(min(beyond, usual), doubted), DETAILS)
            nats += _student(unusual, UNUSUAL, usual) if unusual else 0.0
        return -nats

    @property
    def flatness(self) -> tuple[float, float]:
        """How many times flatter the likelihood is around a fit than noise alone would make it, along and across.

        Of ``D ln(1 + m/D)`` the curvature is that of m over ``1 + m/D``.
        """
        along = np.mean([_told(beyond, doubted) for beyond, doubted, _ in self._of_sites()])
        across = _told(self.across - self.across_expected, self.doubt * self.across_expected)
        return 1.0 + float(along) / DETAILS, 1.0 + across / ELSEWHERE

    def _of_sites(self) -> list[tuple[float, float, float]]:
        """Of each site the energy beyond the noise, what the noise there is uncertain by, and that of the force."""
        noise, alike = self.along_expected, (1.0 / max(self.sites, 1),) * max(self.sites, 1)
        force = max(self.force - noise, 0.0)
        rows = zip(self.own or alike, self.own_force or alike, strict=True)
        return [(own * (self.along - noise), own * self.doubt * noise, of * force) for own, of in rows]


def _student(energy: float, numbers: float, usual: float = 0.0) -> float:
    return numbers * float(np.log1p(energy / (usual + numbers)))


def _told(beyond: float, doubted: float) -> float:
    """What the noise may be more by says little; what is far beyond that counts in full."""
    return beyond**2 / (beyond + doubted) if beyond > 0 else 0.0


def _beyond_doubt(beyond: float, doubted: float) -> float:
    """Nats at least, when a Gaussian floor may be wrong by its doubt: the square of that over two, up to all."""
    return beyond**2 / (beyond + 2.0 * doubted**2) if beyond > 0 else 0.0


def highest_level(noise: NoiseFloor) -> Real:
    """``[output]`` share of a floor that the noise has at most: two doubts more."""
    return np.asarray(1.0 + SIGMAS * (2.0 * noise.std + DOUBT), dtype=np.float64)


def doubt_of(noise: NoiseFloor) -> float:
    """Share of its power that a floor is uncertain by."""
    return float(2.0 * np.max(noise.std)) + DOUBT


def left_of(problem: LinearProblem, run: FreeRun, fit: OutputErrorFit, detailed: Sequence[str]) -> Left:
    """Split what a fit leaves into what its laws' details could print, and the rest.

    Parameters
    ----------
    problem
        Of the record: its lines and noise.
    detailed
        Names of the sites of laws with details.
    """
    measurement, lines = problem.measurement, problem.lines
    weight = problem.weight
    linear = tuple(one for one in fit.effects if one.kind.linear)
    # What an exact word beside them explains is no force of theirs, of which details could be a share.
    exact = tuple(one for one in linear if one.kind.clues.exact)
    view, plain = (problem.beside(fit.z, run.compiled(fit.z, effects)) for effects in (linear, exact))
    missed = measurement.outputs - fit.outputs
    missed[:, : run.unknown_at_start(fit.z, fit.effects)] = 0.0
    residual = lines.spectrum(missed) * weight
    missing = np.asarray((problem.measured - plain.forced()) * weight, dtype=np.complex128)
    found, sites = _split(view, measurement.output_names, detailed, weight, residual)
    without, _ = _split(plain, measurement.output_names, detailed, weight, missing)
    count, taken = lines.index.size, sum(found.taken)
    return Left(
        along=found.whole - found.rest,
        along_expected=taken,
        across=found.rest,
        across_expected=max(float(residual.size) - taken, 0.0),
        force=without.whole - without.rest,
        doubt=doubt_of(problem.noise),
        sites=sites,
        outputs=tuple((np.sum(np.abs(residual) ** 2, axis=(1, 2)) / count).tolist()),
        along_outputs=found.taken,
        own=_shares(found.own, found.whole - found.rest, taken),
        own_force=_shares(without.own, without.whole - without.rest, sum(without.taken)),
    )


def _shares(own: Real, energy: float, noise: float) -> tuple[float, ...]:
    """Energies of forces as shares of what all of them print together beyond the noise; one alone has all."""
    whole = float(own.sum())
    if own.size < 2 or not whole:
        return ()
    # Noise prints along all of them as well: of what it hides nothing is known to work against another.
    against = max((whole + noise) / max(energy, noise), 1.0)
    return tuple((against * own / whole).tolist())


def left_by_force(problem: LinearProblem, tuned: Profile, found: Profile) -> Left:
    """Give what a force of any shape at some sites leaves; `tuned` is the profile without."""
    along, noise = max(tuned.misfit - found.misfit, 0.0), tuned.expected - found.expected
    return Left(
        along=along,
        along_expected=noise,
        across=found.misfit,
        across_expected=found.expected,
        # Of a force of any shape nothing is unusual.
        force=np.inf,
        doubt=doubt_of(problem.noise),
        sites=len(found.sites),
        along_outputs=found.taken,
        own=_shares(np.array(found.own), along, noise),
    )


def _split(
    view: View, outputs: Sequence[str], names: Sequence[str], weight: Real, residual: Complex
) -> tuple[Shared, int]:
    """Share a residual among forces at some sites, and count the places of these."""
    sites = [site for site in sites_of(view.compiled, outputs) if site.name in names]
    printed = [view.pattern(way_to(view, site, outputs))[:, None] * weight for site in sites]
    # Laws that print alike leave the details of one force: nothing tells whose they are.
    patterns = [printed[alike[0]] for alike in printed_alike(printed, view.rounding)]
    transients = view.transients()[:, :, None] * weight
    if len(patterns) > 1:
        return Projection(patterns).shared(Elimination([], transients).settled(residual)), len(patterns)
    plain, out = (Elimination(some, transients) for some in ([], patterns))
    whole, rest = (float(np.sum(one.rest(residual) ** 2)) for one in (plain, out))
    return Shared(whole=whole, rest=rest, taken=out.taken, own=np.zeros(len(patterns))), len(patterns)


def freedom_nats(
    run: FreeRun, fit: OutputErrorFit, fitted: Sequence[Sequence[str]], freed: Sequence[str], left: Left
) -> float:
    """Nats that numbers cost which a log narrows down, by Laplace's approximation.

    ``1/2 sum ln min(l, 1)`` with l the eigenvalues of the numbers' covariance over their spread before: what a log
    doesn't narrow down costs nothing. The covariance is noise's, and wider where more than noise is `left`: along for
    the numbers of laws with details, else across.
    """
    effects = effect_numbers(fit.effects, fitted or None)
    count = len(fit.covariance) - len(effects)
    tunables = run.tunables
    places = [tunables.names.index(name) for name in freed] if count else []
    chosen = [*places, *range(count, len(fit.covariance))]
    if not chosen:
        return 0.0
    along, across = left.flatness
    flat = [across] * len(places)
    flat += [across if fit.effects[one.effect].kind.clues.exact else along for one in effects]
    before = np.concatenate([SLIP / tunables.tolerance[places], np.full(len(effects), SIZE)]) / np.sqrt(flat)
    over = fit.covariance[np.ix_(chosen, chosen)] / before / before[:, None]
    return float(0.5 * np.sum(np.log(np.clip(np.linalg.eigvalsh(over), ZERO, 1.0))))
