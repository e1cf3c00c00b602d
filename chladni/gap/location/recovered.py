"""The force that a model lacks at a site, and the motion there, recovered from all sensors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import DOUBTED, FAR, RIDGE, ROUNDING, SLIGHT, SMOOTH, ZERO
from chladni.gap.location.profile import Profile, Projection
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.linear_view import View, Way
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import RecordLines, all_lines
from chladni.signals.arrays import Complex, Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recovered(Value):
    """Unknown force and motion at one site over a whole record.

    Attributes
    ----------
    lines
        On which trials are weighed.
    force
        ``[sample]`` as in `Port`: a joint's resists, an input's adds to the command, an output's to what is measured.
    displacement, velocity
        ``[sample]`` at the port; of an input the command, of an output the signal without its error.
    z, transient
        Parameters and transients with which it was recovered.
    beside
        Other sites at which a force was free, with it ``[sample]``.
    reliable
        ``[line]`` share of the force's power that is no noise, on `all_lines`.
    """

    site: Site
    lines: RecordLines
    force: Real
    displacement: Real
    velocity: Real
    reliable: Real
    z: Real
    transient: Real
    beside: tuple[tuple[Site, Real], ...] = ()

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def time_s(self) -> Real:
        """``[sample]`` from the start of the record."""
        return np.asarray(np.arange(self.force.size) / self.lines.sample_rate_hz, dtype=np.float64)

    @property
    def s(self) -> Complex:
        """``[line]`` j omega."""
        return np.asarray(2j * np.pi * self.lines.frequency_hz, dtype=np.complex128)

    @property
    def believed(self) -> Real:
        """``[line]`` of `lines`: share of the force's power that is no noise."""
        return np.asarray(self.reliable[self.lines.index - 1], dtype=np.float64)

    def position_at(self, problem: LinearProblem, port: int) -> Real:
        """``[sample]`` displacement at another port, under the same forces."""
        view, acting = self._acting(problem)
        motion = view.motion(port, self.transient, acting)
        return np.asarray(view.lines.signal(motion[0])[0], dtype=np.float64)

    def states(self, problem: LinearProblem) -> Real:
        """``[state, sample]`` of the linear part under the same forces, in the order of the compiled model's."""
        view, acting = self._acting(problem)
        found = view.states(self.transient, acting)
        return np.asarray(view.lines.signal(found)[:, 0], dtype=np.float64)

    def _acting(self, problem: LinearProblem) -> tuple[View, list[tuple[Way, Complex]]]:
        """Give the model on all lines, and the forces on it with the ways that they take in."""
        whole = problem.on(all_lines(problem.measurement.samples, problem.measurement.sample_rate_hz))
        view, forces = whole.view(self.z), ((self.site, self.force), *self.beside)
        return view, [(whole.way(view, site), whole.lines.spectrum(force)) for site, force in forces]

    def spectrum(self, signal: Real) -> Complex:
        """``[line]`` of a signal ``[sample]``."""
        return np.asarray(self.lines.spectrum(signal)[0], dtype=np.complex128)


def recovered(problem: LinearProblem, found: Profile, site: Site, others: Sequence[Site] = ()) -> Recovered:
    """Recover force and motion at a site, with the parameters of a profile of that place.

    On each line the force is the one that explains most, held back where noise would make most of it (Wiener's
    filter, with the force's power taken from its neighbours). The problem is of the whole record; its lines are those
    that trials will be weighed on. Forces at other sites may be anything meanwhile; what they move is part of the
    motion.
    """
    measurement = problem.measurement
    lines = all_lines(measurement.samples, measurement.sample_rate_hz)
    whole = problem.on(lines)
    view = whole.view(found.z)
    patterns = [whole.pattern(view, one)[:, 0] for one in (site, *others)]
    residual = ((whole.measured - view.forced()) * whole.weight)[:, 0]
    transients = whole.transients(view)[:, :, 0]
    start = _starts(view, whole.measured, whole.weight)
    forces, reliable, transient = _unknowns(patterns, residual, transients, found.transient, start)
    ways = [whole.way(view, one) for one in (site, *others)]
    acting = [(way, one[None]) for way, one in zip(ways, forces, strict=True)]
    force = lines.signal(forces[:1])[0]
    if site.kind == "output" and ways[0].port is None:
        row = measurement.output_names.index(site.name)
        # Not what was measured less the force: where noise hides that, it would be the shaped signal again.
        seen = lines.signal(view.response(transient, acting[1:]))[row, 0]
        displacement, velocity = seen + measurement.outputs[row].mean(), np.zeros(lines.samples)
    elif site.kind == "input" and ways[0].port is None:
        row = measurement.input_names.index(site.name)
        displacement, velocity = measurement.inputs[row], np.zeros(lines.samples)
    else:
        motion = view.motion(view.compiled.port_index(site.name, site.kind), transient, acting)
        displacement, velocity = (lines.signal(one)[0] for one in motion)
    return Recovered(
        site=site,
        lines=problem.lines,
        force=force,
        displacement=displacement,
        velocity=velocity,
        reliable=reliable,
        z=found.z,
        transient=transient,
        beside=tuple((one, lines.signal(free[None])[0]) for one, free in zip(others, forces[1:], strict=True)),
    )


def _unknowns(
    patterns: Sequence[Complex], residual: Complex, transients: Complex, transient: Real, start: Real
) -> tuple[Complex, Real, Real]:
    """Recover forces along patterns ``[output, line]``, random, of the power that each shows beside the others.

    Beside the forces ``[site, line]`` it gives how far the first is believed, and the transients ``[state, 1]``.
    """
    along = np.moveaxis(np.asarray(patterns), -1, 0)
    reach = along.transpose(0, 2, 1)
    for _ in range(2):
        left = residual - np.tensordot(transient[:, 0], transients, axes=1)
        shown = [_power(one, [*patterns[:place], *patterns[place + 1 :]], left) for place, one in enumerate(patterns)]
        power, reliable = np.array([one[0] for one in shown]).T, shown[0][1]
        # The quietest view of the noise is that from where the fewest forces can hide it.
        noise = np.min([one[2] for one in shown], axis=0)
        # Where two patterns are one, forces beside each other could be of any size: noise is no less than rounding.
        noise += RIDGE * np.sum(power * np.sum(np.abs(along) ** 2, axis=2), axis=1)
        covariance = (reach * power[:, None]) @ along.conj() + noise[:, None, None] * np.eye(len(residual))
        weight = np.linalg.inv(covariance)
        # What forces and transients could both print goes to whichever needs less of itself for it.
        transient = _transient(transients, weight, residual, start)
    left = residual - np.tensordot(transient[:, 0], transients, axes=1)
    force = power * np.einsum("lko,lop,pl->lk", along.conj(), weight, left, optimize=True)
    return np.asarray(force.T, dtype=np.complex128), reliable, transient


def _power(pattern: Complex, beside: Sequence[Complex], left: Complex) -> tuple[Real, Real, Real]:
    """``[line]`` power of a force along a pattern, how far it's believed, and the noise over what was thought."""
    away = Projection([one[:, None] for one in beside]).away
    pattern, left = away(pattern[:, None])[:, 0], away(left[:, None])[:, 0]
    strength = np.sum(np.abs(pattern) ** 2, axis=0)
    thought = 1.0 / np.maximum(strength, ZERO)
    plain = np.sum(pattern.conj() * left, axis=0) * thought
    # What no force explains says how much noise there is, where that is more than was thought.
    across = np.sum(np.abs(left) ** 2, axis=0) - np.abs(plain) ** 2 * strength
    louder = np.maximum(_smooth(np.maximum(across, 0.0)) / max(len(pattern) - 1 - len(beside), 1), 1.0)
    noise = thought * louder
    # Neighbours count by how well they tell the force: where a pattern fades, as that of a force on
    # accelerometers does toward 0 Hz, those that still see it speak for those that don't.
    say = 1.0 / noise**2
    power = np.maximum(_smooth(say * (np.abs(plain) ** 2 - noise)) / np.maximum(_smooth(say), ZERO), 0.0)
    power = np.where(power > DOUBTED * noise, power, np.minimum(power, FAR * _told(power, noise)))
    return power, power / (power + noise), louder


def _starts(view: View, measured: Complex, weight: Real) -> Real:
    """``[state, state]`` inverse covariance of the transients: a machine starts and ends where it goes through.

    A start that a force beside this one could print as well is told by next to nothing but noise.
    """
    states, forced = view.states(None, ())[:, 0], view.forced() * weight
    driven = float(np.sum(np.abs(forced) ** 2))
    spread = 4 * np.einsum("al,bl->ab", states, states.conj()).real / view.lines.samples
    size = np.sqrt(np.diag(spread))
    if not (driven > 0 and np.all(size > 0)):
        return np.zeros_like(spread)
    # What the log shows beyond the inputs' doing moves the states too.
    more = max(float(np.sum(np.abs(measured * weight) ** 2)) / driven, 1.0)
    related = spread / size / size[:, None] + SLIGHT * np.eye(size.size)
    return np.asarray(np.linalg.inv(related) / size / size[:, None] / more)


def _transient(transients: Complex, weight: Complex, residual: Complex, start: Real) -> Real:
    """Best transients ``[state, 1]`` when forces and noise are random, by weighted least squares.

    The weight is the ``[line, output, output]`` inverse covariance of forces and noise together, `start` that of the
    transients, ``[state, state]``.
    """
    weighted = np.einsum("aol,lop->apl", transients.conj(), weight, optimize=True)
    # Lines are complex, of unit variance: twice the sums are those of real numbers.
    normal = np.einsum("apl,bpl->ab", weighted, transients).real + start / 2
    toward = np.einsum("apl,pl->a", weighted, residual).real
    # Of a transient that lies along the forces all but rounding is taken away: it is measured by what it was.
    own = np.finfo(np.float64).eps * np.sum(np.abs(transients) ** 2, axis=(1, 2))
    size = np.sqrt(np.maximum(np.maximum(np.diag(normal), own), ZERO))
    scaled = np.linalg.lstsq(normal / size[:, None] / size, toward / size, rcond=ROUNDING)[0]
    return np.asarray(scaled / size, dtype=np.float64)[:, None]


def _told(power: Real, noise: Real) -> float:
    """Mean power of a force ``[line]``, each line counted by how well it tells it."""
    say = power / noise
    return float(say @ power / max(float(np.sum(say)), ZERO))


def _smooth(power: Real) -> Real:
    if power.size < SMOOTH:
        return np.full_like(power, power.mean())
    padded = np.pad(power, SMOOTH // 2, mode="reflect")
    return np.asarray(np.convolve(padded, np.full(SMOOTH, 1.0 / SMOOTH), mode="valid"), dtype=np.float64)
