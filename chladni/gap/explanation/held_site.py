"""One site at held parameters: what forces there print, with other forces and transients taken away."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.calibration import RANK
from chladni.gap.location.profile import Elimination, Profile
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.models.effects.trial import Force
from chladni.signals.arrays import Complex, Real


class HeldSite:
    """Residual of a measurement at given parameters, and what forces at a site print of it.

    Parameters
    ----------
    problem
        Of the whole record.
    z
        ``[parameter]`` held.
    site
        Of the forces.
    others
        Sites whose force may be anything meanwhile.
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
