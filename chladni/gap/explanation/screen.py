"""Screening: every trial along the recovered motion, weighed on all sensors by linear regression."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from chladni.gap.calibration import OUTSIDE, PRECISION, RANK, RIDGE, RUNAWAY
from chladni.gap.explanation.trial import SiteTrial
from chladni.gap.location.profile import Elimination, Profile, bounded_minimum
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.side_by_side import side_by_side
from chladni.models.effects.trial import Force, Numbers, Shape
from chladni.signals.arrays import Complex, Real


class HeldSite:
    """Residual of a whole record at held parameters ``z``, and what forces at a site print of it.

    Forces at other sites may be anything meanwhile.
    """

    def __init__(self, problem: LinearProblem, z: Real, site: Site, others: Sequence[Site] = ()) -> None:
        view = problem.view(z)
        self.problem, self.z, self.site, self.others = problem, z, site, tuple(others)
        self.pattern = problem.pattern(view, site)
        self.out = Elimination([problem.pattern(view, one) for one in others], problem.transients(view))
        self.residual = np.asarray((problem.measured - view.forced()) * problem.weight, dtype=np.complex128)
        self.rest = self.out.rest(self.residual)

    def printed(self, spectra: Complex) -> Real:
        """``[signal, number]``: what forces of these spectra ``[signal, line]`` print, without transients."""
        if not len(spectra):
            return np.zeros((0, self.rest.size))
        return self.out.rest(np.asarray(self.pattern * spectra[:, None, None], dtype=np.complex128))

    def unexplained(self, force: Force) -> Real:
        """``[number]``: the residual without what has no free amplitude."""
        return self.rest if force.fixed is None else self.rest - self.printed(force.fixed[None])[0]

    def amplitudes(self, force: Force) -> Real:
        """Best ``[amplitude]`` of a force by linear regression."""
        basis = self.printed(force.basis)
        size = np.linalg.norm(basis, axis=1)
        size[size == 0] = 1.0
        found = np.linalg.lstsq((basis / size[:, None]).T, self.unexplained(force), rcond=RANK)[0]
        return np.asarray(found / size, dtype=np.float64)

    def with_force(self, force: Force, amplitudes: Real) -> Profile:
        """Give the profile with a force of known amplitudes at the site; the others' and transients refitted."""
        spectrum = np.tensordot(amplitudes, force.basis, axes=1)
        spectrum = spectrum if force.fixed is None else spectrum + force.fixed
        acting = np.asarray(spectrum, dtype=np.complex128)[None]
        transient, free = self.out.unknowns(self.residual - self.pattern * acting[None])
        left = self.unexplained(force) - amplitudes @ self.printed(force.basis)
        return Profile(
            sites=(self.site, *self.others),
            z=self.z,
            transient=transient,
            forces=(acting, *free),
            misfit=float(left @ left),
            expected=float(self.problem.scale),
            prior=float(self.z @ self.z),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Screened:
    """A trial with its amplitudes.

    Attributes
    ----------
    trial, shape, values
        Which, and the effect's parameters.
    misfit
        ``sum |rest|^2`` whitened over outputs and lines, with parameters and transients refitted.
    expected
        What noise alone would leave.
    z
        Where the parameters go.
    """

    trial: SiteTrial
    shape: Shape
    values: Numbers
    misfit: float
    expected: float
    z: Real

    @property
    def chi(self) -> float:
        """Misfit over what noise alone leaves."""
        return self.misfit / self.expected

    @property
    def cost(self) -> float:
        """Negative log likelihood with prior and a penalty for each number (Schwarz 1978), but for constants."""
        return (
            self.misfit + float(self.z @ self.z) / 2 + 0.5 * self.trial.form.parameters * float(np.log(self.expected))
        )


class Regression:
    """Least squares of columns on a whitened residual, with the parameters refitted beside them.

    ``slopes [parameter, number]`` are those of the parameters, ``z [parameter]`` where these are, in units of their
    tolerance.
    """

    def __init__(self, rest: Real, slopes: Real, z: Real, limit: float | Real) -> None:
        self.rest, self.slopes, self.z, self.limit = rest, slopes, z, limit
        # Parameters with their prior are eliminated once; each trial then costs a few inner products. Scaled, and
        # with a floor on what nothing determines: beside a transient that runs away slopes may be of any size.
        normal = slopes @ slopes.T + np.eye(len(slopes)) / 2
        self._size = np.sqrt(np.diag(normal))
        scaled = normal / self._size / self._size[:, None] + RIDGE * np.eye(len(slopes))
        self._factor = cho_factor(scaled) if len(slopes) else None

    def solved(self, basis: Real, rest: Real | None = None) -> tuple[Real, float, Real]:
        """Give the amplitudes of ``[column, number]``, the misfit that they leave, and the parameters with them.

        The rest ``[number]`` is by default that of the regression.
        """
        rest = self.rest if rest is None else rest
        size = np.linalg.norm(basis, axis=1)
        unit = basis[size > 0] / size[size > 0, None]
        own, to_slopes, cross = unit @ rest, self.slopes @ rest - self.z / 2, self.slopes @ unit.T
        shift, moved = self._eliminated(cross), self._eliminated(to_slopes)
        scaled = np.linalg.lstsq(unit @ unit.T - cross.T @ shift, own - cross.T @ moved, rcond=RANK)[0]
        step = moved - shift @ scaled
        if np.any(np.abs(self.z + step) > self.limit):
            scaled, step = self._bounded(unit, rest)
        left = rest - scaled @ unit - step @ self.slopes
        amplitudes = np.zeros(len(basis))
        amplitudes[size > 0] = scaled / size[size > 0]
        return amplitudes, float(left @ left), self.z + step

    def _eliminated(self, toward: Real) -> Real:
        """Best step of the parameters toward ``[parameter]`` or ``[parameter, column]``."""
        if self._factor is None:
            return np.zeros_like(toward)
        scale = self._size if toward.ndim == 1 else self._size[:, None]
        return np.asarray(cho_solve(self._factor, toward / scale) / scale, dtype=np.float64)

    def _bounded(self, unit: Real, rest: Real) -> tuple[Real, Real]:
        """Amplitudes and step of the parameters where these may not leave their tolerance."""
        both = np.vstack([unit, self.slopes])
        count, size = len(unit), len(self.slopes)
        free = np.concatenate([np.zeros(count), np.full(size, 0.5)])
        normal = both @ both.T + np.diag(free) + RIDGE * np.eye(count + size)
        toward = both @ rest
        toward[count:] -= self.z / 2
        low = np.concatenate([np.full(count, -np.inf), -self.limit - self.z])
        high = np.concatenate([np.full(count, np.inf), self.limit - self.z])
        found = bounded_minimum(normal, toward, low, high)
        return found[:count], found[count:]


class Screen:
    """Regression of a residual on the forces of trials at one site.

    Parameters
    ----------
    problem
        Of the whole record.
    found
        Profile of the place: its parameters, transient and force are where the linearisation is made.
    others
        Sites whose force may be anything meanwhile.
    limit
        Bounds on the parameters, in sigmas of their tolerances.
    """

    def __init__(
        self,
        problem: LinearProblem,
        found: Profile,
        site: Site,
        *,
        others: Sequence[Site] = (),
        limit: float | Real = OUTSIDE,
    ) -> None:
        self.problem, self.site, self.others, self.limit = problem, site, tuple(others), limit
        self.z = found.z
        self._held = HeldSite(problem, found.z, site, others)
        forces = list(zip(found.sites, found.forces, strict=True))
        slopes = self._held.out.rest(problem.slopes(found.z, found.transient, forces))
        self._regression = Regression(self._held.rest, slopes, found.z, limit)

    def run(self, trials: Iterable[SiteTrial]) -> list[Screened]:
        """Weigh trials on their grids; those whose amplitudes make no such effect are left out."""

        def best(trial: SiteTrial) -> Screened | None:
            tried = (self.weigh(trial, shape) for shape in trial.form.grid)
            return min((one for one in tried if one is not None), key=lambda one: one.cost, default=None)

        return [one for one in side_by_side(best, [*trials]) if one is not None]

    def refined(self, start: Screened) -> Screened:
        """Search what enters nonlinearly from the best point of the grid (Nelder and Mead 1965)."""
        if not start.shape:
            return start

        def cost(shape: Real) -> float:
            found = self.weigh(start.trial, tuple(shape.tolist()))
            return found.cost if found is not None else RUNAWAY

        size = len(start.shape)
        simplex = np.array([start.shape] * (size + 1))
        simplex[1:] += 0.15 * np.eye(size)
        best = minimize(
            cost, np.array(start.shape), method="Nelder-Mead",
            options={"initial_simplex": simplex, "maxfev": 18 * size + 12, "fatol": PRECISION},
        )  # fmt: skip
        found = self.weigh(start.trial, tuple(np.asarray(best.x).tolist()))
        return found if found is not None and found.cost < start.cost else start

    def weigh(self, trial: SiteTrial, shape: Shape) -> Screened | None:
        """Regress on one shape of a trial; None when no amplitudes make this effect."""
        force = trial.form.build(shape)
        basis, rest = self._held.printed(force.basis), self._held.unexplained(force)
        # A law that ran away along the recovered motion prints nothing that could be weighed.
        if not (np.all(np.abs(basis) < RUNAWAY) and np.all(np.abs(rest) < RUNAWAY)):
            return None
        amplitudes, misfit, z = self._regression.solved(basis, rest)
        values = trial.form.values(shape, amplitudes)
        if values is None or not np.all(np.isfinite(list(values.values()))):
            return None
        expected = float(self.problem.scale)
        return Screened(trial=trial, shape=shape, values=values, misfit=misfit, expected=expected, z=z)
