"""The force that a model lacks at a site, and the motion there, recovered from all sensors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.location.profile import Profile, Projection
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.linear_view import LinearView, Way
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import RecordLines, all_lines
from chladni.signals.arrays import Complex, Real
from chladni.signals.value import Value

#: Lines over which the power of an unknown force is taken for the same.
_SMOOTH = 31
#: Power over that of the lines that tell the force well, beyond which a line is believed only when it's so many times
#: its noise: where a pattern fades, a little more noise than was thought makes a force of any size.
_STRONGEST, _DOUBTED = 3.0, 30.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recovered(Value):
    """Unknown force and motion at one site over a whole record.

    Attributes
    ----------
    site
        Where.
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

    def _acting(self, problem: LinearProblem) -> tuple[LinearView, list[tuple[Way, Complex]]]:
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
    filter, with the force's power taken from its neighbours).

    Parameters
    ----------
    problem
        Of the whole record; its lines are those that trials will be weighed on.
    others
        Sites whose force may be anything meanwhile; what they move is part of the motion.
    """
    measurement = problem.measurement
    lines = all_lines(measurement.samples, measurement.sample_rate_hz)
    whole = problem.on(lines)
    view = whole.view(found.z)
    patterns = [whole.pattern(view, one)[:, 0] for one in (site, *others)]
    residual = ((whole.measured - view.forced()) * whole.weight)[:, 0]
    transients = whole.transients(view)[:, :, 0]
    first, *beside = (
        _unknown(pattern, [*patterns[:place], *patterns[place + 1 :]], residual, transients, found.transient)
        for place, pattern in enumerate(patterns)
    )
    ways = [whole.way(view, one) for one in (site, *others)]
    acting = [(way, one.force[None]) for way, one in zip(ways, (first, *beside), strict=True)]
    force = lines.signal(first.force[None])[0]
    if site.kind == "output" and ways[0].port is None:
        row = measurement.output_names.index(site.name)
        # Not what was measured less the force: where noise hides that, it would be the shaped signal again.
        seen = lines.signal(view.response(first.transient, acting[1:]))[row, 0]
        displacement, velocity = seen + measurement.outputs[row].mean(), np.zeros(lines.samples)
    elif site.kind == "input" and ways[0].port is None:
        row = measurement.input_names.index(site.name)
        displacement, velocity = measurement.inputs[row], np.zeros(lines.samples)
    else:
        motion = view.motion(view.compiled.port_index(site.name, site.kind), first.transient, acting)
        displacement, velocity = (lines.signal(one)[0] for one in motion)
    return Recovered(
        site=site,
        lines=problem.lines,
        force=force,
        displacement=displacement,
        velocity=velocity,
        reliable=first.reliable,
        z=found.z,
        transient=first.transient,
        beside=tuple((one, lines.signal(free.force[None])[0]) for one, free in zip(others, beside, strict=True)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Unknown:
    """A force ``[line]``, how far it's believed, and the transients ``[state, 1]`` beside it."""

    force: Complex
    reliable: Real
    transient: Real


def _unknown(
    pattern: Complex, beside: Sequence[Complex], residual: Complex, transients: Complex, transient: Real
) -> _Unknown:
    """Recover the force along a pattern ``[output, line]`` with what lies along those beside it taken away."""
    away = Projection([one[:, None] for one in beside]).away
    pattern, residual = away(pattern[:, None])[:, 0], away(residual[:, None])[:, 0]
    transients = away(transients[:, :, None])[:, :, 0]
    strength = np.sum(np.abs(pattern) ** 2, axis=0)
    thought = 1.0 / np.maximum(strength, 1e-200)
    for _ in range(2):
        left = residual - np.tensordot(transient[:, 0], transients, axes=1)
        plain = np.sum(pattern.conj() * left, axis=0) * thought
        # What no force explains says how much noise there is, where that is more than was thought.
        across = np.sum(np.abs(left) ** 2, axis=0) - np.abs(plain) ** 2 * strength
        noise = thought * np.maximum(_smooth(np.maximum(across, 0.0)) / max(len(pattern) - 1 - len(beside), 1), 1.0)
        # Neighbours count by how well they tell the force: where a pattern fades, as that of a force on
        # accelerometers does toward 0 Hz, those that still see it speak for those that don't.
        say = 1.0 / noise**2
        power = np.maximum(_smooth(say * (np.abs(plain) ** 2 - noise)) / np.maximum(_smooth(say), 1e-300), 0.0)
        sure = power > _DOUBTED * noise
        power = np.where(sure, power, np.minimum(power, _STRONGEST * _told(power, noise)))
        reliable = power / (power + noise)
        # What force and transient could both print goes to whichever needs less of itself for it.
        transient = _transient(transients, pattern, residual, reliable * thought)
    return _Unknown(force=np.asarray(reliable * plain, dtype=np.complex128), reliable=reliable, transient=transient)


def _transient(transients: Complex, pattern: Complex, residual: Complex, held: Real) -> Real:
    """Best transients ``[state, 1]`` when the force is random with a known power, by weighted least squares.

    Parameters
    ----------
    held
        ``[line]`` share of what lies along the pattern that the force takes, over the pattern's square.
    """
    along = np.sum(pattern.conj() * transients, axis=1)
    weighted = transients - pattern * (held * along)[:, None]
    normal = np.einsum("aol,bol->ab", weighted.conj(), transients).real
    toward = np.einsum("aol,ol->a", weighted.conj(), residual).real
    # Of a transient that lies along the force all but rounding is taken away: it is measured by what it was.
    own = np.finfo(np.float64).eps * np.sum(np.abs(transients) ** 2, axis=(1, 2))
    size = np.sqrt(np.maximum(np.maximum(np.diag(normal), own), 1e-300))
    scaled = np.linalg.lstsq(normal / size[:, None] / size, toward / size, rcond=1e-9)[0]
    return np.asarray(scaled / size, dtype=np.float64)[:, None]


def _told(power: Real, noise: Real) -> float:
    """Mean power of a force ``[line]``, each line counted by how well it tells it."""
    say = power / noise
    return float(say @ power / max(float(np.sum(say)), 1e-300))


def _smooth(power: Real) -> Real:
    if power.size < _SMOOTH:
        return np.full_like(power, power.mean())
    padded = np.pad(power, _SMOOTH // 2, mode="reflect")
    return np.asarray(np.convolve(padded, np.full(_SMOOTH, 1.0 / _SMOOTH), mode="valid"), dtype=np.float64)
