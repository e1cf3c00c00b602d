"""Unknown forces profiled out: what is left of a residual when forces at given sites may be anything."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.optimize import lsq_linear

from chladni.gap.calibration import MOST_STEPS, PROFILE_STEPS, RANK, RIDGE, ROUNDING, SHORTER, SLIGHT, ZERO
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.signals.arrays import Complex, Real

_Promise = tuple[Real, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Fit of the bounded parameters under the hypothesis that forces of any shape act at some sites.

    Attributes
    ----------
    z
        Parameters in units of their tolerance.
    transient
        ``[state, segment]``.
    forces
        ``[segment, line]`` at each site.
    misfit
        ``sum |what is left|^2`` over outputs and lines, whitened: expected to be (outputs - sites) x lines.
    expected
        That number.
    prior
        ``z'z``.
    taken
        Of each output the energy of its noise that the forces take; empty without any.
    own
        ``[site]`` see `Shared`; empty where that wasn't asked, or of one force alone.
    """

    sites: tuple[Site, ...]
    z: Real
    transient: Real
    forces: tuple[Complex, ...]
    misfit: float
    expected: float
    prior: float
    taken: tuple[float, ...] = ()
    own: tuple[float, ...] = ()

    @property
    def chi(self) -> float:
        """Misfit over what noise alone leaves."""
        return self.misfit / self.expected

    @property
    def cost(self) -> float:
        """Minus twice the log posterior, but for constants."""
        return 2.0 * self.misfit + self.prior


@dataclass(frozen=True, slots=True, kw_only=True)
class Shared:
    """A residual as forces at some sites share it, that know nothing of each other.

    Attributes
    ----------
    whole, rest
        Energy of the residual without transients, and of what the forces leave of it.
    taken
        Of each output the energy of its noise that the forces take.
    own
        ``[site]`` energy that each prints alone, beyond its noise of one: of forces that print almost alike far more
        than all of them together.
    """

    whole: float
    rest: float
    taken: tuple[float, ...]
    own: Real


class Projection:
    """Takes from whitened spectra what forces of any shape at some sites can print.

    Patterns are ``[output, 1, line]`` of each site.
    """

    def __init__(self, patterns: Sequence[Complex]) -> None:
        self._unit = _orthonormal(patterns)
        self._patterns = np.asarray(patterns, dtype=np.complex128)

    @property
    def taken(self) -> tuple[float, ...]:
        """Of each output the energy of its noise that the forces take; empty without any."""
        if not self._unit:
            return ()
        found: list[float] = np.sum(np.abs(np.array(self._unit)[:, :, 0]) ** 2, axis=(0, 2)).tolist()
        return tuple(found)

    def away(self, spectra: Complex) -> Complex:
        """Take the forces from ``[..., output, segment, line]``."""
        for known in self._unit:
            share = np.einsum("ol,...osl->...sl", known[:, 0].conj(), spectra)
            printed = known * share[..., None, :, :]
            # In its memory: fresh memory takes as long as the arithmetic.
            spectra = np.subtract(spectra, printed, out=printed)
        return spectra

    def shared(self, left: Complex) -> Shared:
        """Split a residual ``[output, segment, line]`` without transients among the forces, and the rest.

        Forces know nothing of each other: each is Gaussian, with the power of its own that makes the residual most
        probable (variance components by majorising and minimising: Zhou, Hu, Zhou and Lange 2019). What only forces
        that work against each other could print stays with the rest.
        """
        unit, gram = self._units()
        toward = np.einsum("aol,oml->lam", unit.conj(), left)
        power = np.full(len(unit), float(np.sum(np.abs(left) ** 2)) / left[0].size / len(unit))
        for _ in range(MOST_STEPS):
            _, shapes, over, beside = _beside_noise(gram, toward, power)
            expected = np.mean(np.einsum("lak,lk->la", np.abs(shapes) ** 2, over / (1.0 + over)), axis=0)
            found = np.mean(np.abs(beside) ** 2, axis=(0, 2))
            power = power * np.sqrt(found / np.maximum(expected, ZERO))
        root, shapes, over, beside = _beside_noise(gram, toward, power)
        rest = left - np.einsum("aol,lam->oml", unit, root[:, None] * beside)
        forms = np.einsum("aol,lak->olk", unit, root[:, None] * shapes)
        return Shared(
            whole=float(np.sum(np.abs(left) ** 2)),
            rest=float(np.sum(np.abs(rest) ** 2)),
            taken=tuple(np.sum(np.abs(forms) ** 2 / (1.0 + over), axis=(1, 2)).tolist()),
            own=np.asarray(power * left[0].size, dtype=np.float64),
        )

    def _units(self) -> tuple[Complex, Complex]:
        """``[site, output, line]`` patterns of energy one, and ``[line, site, site]`` their products."""
        size = np.sqrt(np.sum(np.abs(self._patterns) ** 2, axis=1, keepdims=True))
        unit = (self._patterns / np.where(size > 0, size, 1.0))[:, :, 0]
        return unit, np.einsum("aol,bol->lab", unit.conj(), unit)


class Elimination(Projection):
    """Takes transients ``[state, output, 1, line]`` from whitened spectra, too; see `Projection`."""

    def __init__(self, patterns: Sequence[Complex], transients: Complex) -> None:
        super().__init__(patterns)
        self._transients = transients
        stacked = _real(self.away(transients))[:, 0]
        size = np.sqrt(np.einsum("sn,sn->s", stacked, stacked))
        self._scale = np.where(size > 0, 1.0 / np.where(size > 0, size, 1.0), 0.0)
        self._basis, self._upper = qr(
            (stacked * self._scale[:, None]).T, mode="economic", overwrite_a=True, check_finite=False
        )
        # Columns that print nothing, or the same as others, add nothing to what is taken away.
        left, values, _ = np.linalg.svd(self._upper)
        kept = left[:, : values.size][:, values > RANK * max(values.max(initial=0.0), ZERO)]
        self._kept = kept @ kept.T

    def rest(self, spectra: Complex) -> Real:
        """Take forces and transients; give real numbers ``[..., number]``."""
        real = _real(self.away(spectra))
        printed = (real @ self._basis @ self._kept) @ self._basis.T
        left = np.subtract(real, printed, out=printed)
        return np.asarray(left.reshape(*spectra.shape[:-3], -1), dtype=np.float64)

    def unknowns(self, residual: Complex) -> tuple[Real, list[Complex]]:
        """Best transients ``[state, segment]`` and forces ``[segment, line]`` for a residual."""
        # What a force could print as well (a blow at the very start) is left to the force: of a transient that is
        # told by a thousandth of itself, noise would make almost anything.
        size = np.sqrt(np.sum(np.abs(self._transients) ** 2, axis=(1, 2, 3)))
        scale = np.where(size > 0, 1.0 / np.where(size > 0, size, 1.0), 0.0)
        ratio = np.where(self._scale > 0, scale / np.where(self._scale > 0, self._scale, 1.0), 0.0)
        printed = self._basis.T @ _real(self.away(residual)).T
        scaled = np.linalg.lstsq(self._upper * ratio, printed, rcond=SLIGHT)[0]
        transient = np.asarray(scaled * scale[:, None], dtype=np.float64)
        if not len(self._patterns):
            return transient, []
        return transient, list(_forces(self._patterns, self._without(transient, residual)))

    def settled(self, residual: Complex) -> Complex:
        """Take the best transients, beside forces of any shape, from ``[output, segment, line]``."""
        return self._without(self.unknowns(residual)[0], residual)

    def _without(self, transient: Real, residual: Complex) -> Complex:
        """A residual but for transients ``[state, segment]``."""
        printed = np.einsum("sol,sm->oml", self._transients[:, :, 0], transient, optimize=True)
        return np.asarray(residual - printed, dtype=np.complex128)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fit:
    """A profile with what it was found by."""

    profile: Profile
    out: Elimination
    residual: Complex


def _beside_noise(gram: Complex, toward: Complex, power: Real) -> tuple[Real, Complex, Real, Complex]:
    """Forces of some power beside a noise of one, from their patterns' products with each other and a residual.

    RMS ``[site]``; shapes ``[line, site, form]`` that print apart, and ``[line, form]`` energy of each over noise;
    ``[line, site, segment]`` most probable forces over their RMS.
    """
    root = np.sqrt(power)
    over, shapes = np.linalg.eigh(root[:, None] * gram * root)
    # Where forces print alike, rounding makes a bit less than nothing of what differs.
    over = np.maximum(over, 0.0)
    forms = np.einsum("lka,lam->lkm", shapes.conj().swapaxes(1, 2), root[:, None] * toward)
    return root, shapes, over, np.einsum("lak,lkm->lam", shapes, forms / (1.0 + over)[:, :, None])


def _forces(patterns: Complex, left: Complex) -> Complex:
    """Least squares ``[site, segment, line]`` of ``left [output, segment, line]`` along the patterns."""
    flat = patterns[:, :, 0]
    gram = np.einsum("aol,bol->lab", flat.conj(), flat)
    right = np.einsum("aol,oml->lam", flat.conj(), left)
    tiny = RIDGE * np.trace(gram, axis1=1, axis2=2).real
    tiny[tiny == 0] = 1.0
    found = np.linalg.solve(gram + tiny[:, None, None] * np.eye(len(flat)), right)
    return np.asarray(np.moveaxis(found, 0, -1), dtype=np.complex128)


def _orthonormal(patterns: Sequence[Complex]) -> list[Complex]:
    """One small basis a line (Gram and Schmidt, twice is enough for two patterns)."""
    basis: list[Complex] = []
    for pattern in patterns:
        rest = pattern
        for _ in range(2):
            for known in basis:
                rest = rest - known * np.sum(known.conj() * rest, axis=0)
        size = np.sqrt(np.sum(np.abs(rest) ** 2, axis=0))
        sound = size > ROUNDING * np.sqrt(np.sum(np.abs(pattern) ** 2, axis=0))
        basis.append(np.where(sound, rest / np.where(sound, size, 1.0), 0.0))
    return basis


def profiled(
    problem: LinearProblem,
    sites: Sequence[Site],
    start: Real,
    *,
    limit: float | Real | None = None,
    share: float = SLIGHT,
) -> Profile:
    """Refit the parameters and the transient while forces at `sites` may be anything.

    Gauss and Newton steps within ``|z| <= limit`` on what is left (variable projection: Golub and Pereyra 1973),
    shortened while they don't improve.

    Parameters
    ----------
    limit
        By default parameters stay within their tolerances, but for those that start outside, which may be wrong by
        anything.
    share
        The first step that promises less of the misfit beyond noise is the last one: where much is left, a misfit's
        last digits tell nothing, and each step takes about nine tenths of what could still be gained.
    """
    limit = problem.limits(start) if limit is None else limit
    best = _fitted(problem, sites, start)
    for _ in range(PROFILE_STEPS):
        here = best.profile
        ((step, promised),) = _steps(problem, best, (limit,))
        gain = here.misfit + here.prior / 2 - promised - (here.z + step) @ (here.z + step) / 2
        improved = _searched(problem, here, step) if gain >= SLIGHT * here.expected**0.5 else None
        if improved is None:
            break
        best = improved
        if gain < share * (here.misfit - here.expected):
            break
    return best.profile


def with_own(problem: LinearProblem, found: Profile) -> Profile:
    """Give a profile of forces that know nothing of each other: each with what it prints alone."""
    fit = _fitted(problem, found.sites, found.z)
    shared = fit.out.shared(fit.out.settled(fit.residual))
    expected = max(float(fit.residual.size) - sum(shared.taken), 1.0)
    return replace(found, misfit=shared.rest, expected=expected, taken=shared.taken, own=tuple(shared.own.tolist()))


def promises(problem: LinearProblem, sites: Sequence[Site], z: Real, limits: Sequence[Real]) -> list[_Promise]:
    """Give the step in z, and the misfit that it promises, within each of some bounds on ``abs(z)``."""
    return _steps(problem, _fitted(problem, sites, z), limits)


def _steps(problem: LinearProblem, fit: _Fit, limits: Sequence[float | Real]) -> list[_Promise]:
    """Solve the linearised problem within bounds."""
    here = fit.profile
    z = here.z
    # Where forces and transients are large, so is what the parameters do to them (Kaufman 1975).
    slopes = problem.slopes(z, here.transient, list(zip(here.sites, here.forces, strict=True)))
    matrix, right = fit.out.rest(slopes), fit.out.rest(fit.residual)
    normal = matrix @ matrix.T + np.eye(z.size) / 2.0
    toward = matrix @ right - z / 2.0
    moved = [bounded_minimum(normal, toward, -limit - z, limit - z) for limit in limits]
    return [(step, float(np.sum((right - step @ matrix) ** 2))) for step in moved]


def bounded_minimum(normal: Real, toward: Real, low: Real, high: Real) -> Real:
    """Minimise ``x'Nx/2 - x't`` within bounds."""
    if not toward.size:
        return toward
    root, size = _root(normal)
    right = solve_triangular(root, toward / size, lower=True)
    plain = solve_triangular(root.T, right) / size
    if np.all(plain >= low) and np.all(plain <= high):
        return np.asarray(plain, dtype=np.float64)
    # A start on a bound is inside by rounding only.
    bounds = (np.minimum(low, -RIDGE) * size, np.maximum(high, RIDGE) * size)
    return np.asarray(lsq_linear(root.T, right, bounds=bounds, method="bvls").x / size, dtype=np.float64)


def _root(normal: Real) -> tuple[Real, Real]:
    """Factorise in units of each unknown's own curvature; give the lower factor and the units."""
    size: Real = np.sqrt(np.diag(normal))
    scaled = normal / size / size[:, None]
    try:
        root = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        # Slopes beside a transient that runs away are of any size, and what is alike but for rounding has no root.
        root = np.linalg.cholesky(scaled + RIDGE * np.eye(size.size))
    return np.asarray(root, dtype=np.float64), size


def _searched(problem: LinearProblem, best: Profile, step: Real) -> _Fit | None:
    share = 1.0
    for _ in range(4):
        found = _fitted(problem, best.sites, best.z + share * step)
        if found.profile.cost < best.cost:
            return found
        share *= SHORTER
    return None


def profile_at(problem: LinearProblem, sites: Sequence[Site], z: Real) -> Profile:
    """Profile at given parameters: only the forces and the transients are free."""
    return _fitted(problem, sites, z).profile


def _fitted(problem: LinearProblem, sites: Sequence[Site], z: Real) -> _Fit:
    view = problem.view(z)
    out = Elimination([problem.pattern(view, site) for site in sites], problem.transients(view))
    residual = np.asarray((problem.measured - view.forced()) * problem.weight, dtype=np.complex128)
    transient, forces = out.unknowns(residual)
    outputs, *others = problem.measured.shape
    profile = Profile(
        sites=tuple(sites),
        z=z,
        transient=transient,
        forces=tuple(forces),
        misfit=float(np.sum(out.rest(residual) ** 2)),
        expected=float(max(outputs - len(sites), 0) * np.prod(others)) or 1.0,
        prior=float(z @ z),
        taken=out.taken,
    )
    return _Fit(profile=profile, out=out, residual=residual)


def _real(spectra: Complex) -> Real:
    """``[..., segment, number]`` real and imaginary parts of ``[..., output, segment, line]``."""
    flat = np.ascontiguousarray(np.swapaxes(spectra, -2, -3), dtype=np.complex128)
    return flat.reshape(*flat.shape[:-2], flat.shape[-2] * flat.shape[-1]).view(np.float64)
