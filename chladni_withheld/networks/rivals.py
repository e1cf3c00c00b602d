"""Whether a wrong number or a missing link could be another: one change of a network for another's, exactly.

Any of them resists along one direction by a dynamic stiffness z(omega), so that Sherman and Morrison's formula gives
the changed response from the unchanged one: by many sizes of all of them in a moment.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from chladni_withheld.networks.linear_view import LinearView
from chladni_withheld.networks.network import Matrix, Spectrum

_LINES = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A number or link that may be changed: its name, direction, and what it is.

    `kind`: ``stiffness``, ``damping``, ``mass``, ``link``; `value` is a number's own.
    """

    name: str
    direction: Matrix
    kind: str
    value: float


@dataclass(frozen=True, kw_only=True)
class Rivals:
    """Changes of a network that could stand for what is true.

    Attributes
    ----------
    base
        Response of the model with its wrong numbers, without what it lacks.
    truth
        Change of the outputs that the truth makes, ``[output, line]``, on the base's lines below half the rate.
    steps
        One sigma of each number.
    weights
        What turns a change of an output into one over the pooled noise.
    ratio
        The truth's change over the noise, which `left` refers to.
    """

    base: LinearView
    truth: Spectrum
    steps: dict[str, float]
    weights: Matrix
    ratio: float

    def nearest(self, without: frozenset[str]) -> tuple[float, str]:
        """What the best rival leaves over the noise, and its name; `without` names those that are true."""
        begun = [
            (*min(self._grid(change), key=lambda entry: entry[0]), change)
            for change in self.changes()
            if change.name not in without
        ]
        begun.sort(key=lambda entry: entry[0])
        ended = [(self._refined(change, sizes), change.name) for _, sizes, change in begun[:3]]
        return min(ended, default=(np.inf, ""))

    def changes(self) -> list[Change]:
        """All numbers of the model, and all links that it could lack."""
        network = self.base.network
        found = []
        for name, value in network.numbers().items():
            kind = name.rsplit(".", 1)[1].replace("inertia", "mass")
            found.append(Change(name=name, direction=self.base.resisting(name)[0], kind=kind, value=value))
        for first, second in network.apart():
            name = network.pair_name(first, second)
            found.append(Change(name=name, direction=network.direction(first, second), kind="link", value=0.0))
        return found

    def _grid(self, change: Change) -> Iterator[tuple[float, tuple[float, ...]]]:
        if change.kind != "link":
            for factor in np.geomspace(0.05, 20, 30):
                yield self.left(change, (np.log(factor),)), (float(np.log(factor)),)
            return
        springs, dampers = self._scales
        for part in np.geomspace(1e-3, 30, 20):
            for loss in (1e-3, 1.0):
                sizes = (float(np.log(part * springs)), float(np.log(loss * part * dampers)))
                yield self.left(change, sizes), sizes
            sizes = (float(np.log(1e-6 * springs)), float(np.log(10 * part * dampers)))
            yield self.left(change, sizes), sizes

    @cached_property
    def _scales(self) -> tuple[float, float]:
        joints = self.base.network.joints
        springs = [joint.stiffness for joint in joints if joint.stiffness]
        dampers = [joint.damping for joint in joints if joint.damping]
        return float(np.median(springs)), float(np.median(dampers))

    def _refined(self, change: Change, sizes: tuple[float, ...]) -> float:
        def left(x: Matrix) -> float:
            return self.left(change, tuple(x.tolist()))

        return float(minimize(left, np.array(sizes), method="Nelder-Mead", options={"maxiter": 60}).fun)

    def left(self, change: Change, sizes: tuple[float, ...]) -> float:
        """What a change leaves of the truth over the noise, numbers tuned inside their tolerances beside it.

        `sizes`: logarithm of the factor on a number, or of the stiffness and damping of a link.
        """
        rest = (self._truth - self._changed(change, sizes)) * self.weights
        flat = np.concatenate([rest.real.ravel(), rest.imag.ravel()]) * self._scale
        tuned = self._basis[: len(flat)].T @ flat
        energy = max(float(flat @ flat - tuned @ tuned), 0.0)
        return float(np.sqrt(energy / self._count))

    @cached_property
    def _lines(self) -> Matrix:
        every = self.base.below_half
        return np.unique(np.linspace(1, every - 1, min(_LINES, every - 1)).astype(int))

    @cached_property
    def _truth(self) -> Spectrum:
        return self.truth[:, self._lines]

    @cached_property
    def _count(self) -> int:
        return self.base.grid.samples * len(self.truth)

    @cached_property
    def _scale(self) -> float:
        """What makes the truth's lines as large as its samples over the noise."""
        size = np.sqrt(np.sum(np.abs(self._truth * self.weights) ** 2))
        return self.ratio * float(np.sqrt(self._count) / size)

    @cached_property
    def _basis(self) -> Matrix:
        """Orthonormal columns of what tuning does to the lines, with each number's price below."""
        columns = []
        for name, step in self.steps.items():
            lines = self.base.by_number(name)[:, self._lines] * self.weights * step * self._scale
            columns.append(np.concatenate([lines.real.ravel(), lines.imag.ravel()]))
        basis: Matrix = np.linalg.qr(np.vstack([np.array(columns).T, np.eye(len(columns))]))[0]
        return basis

    def _changed(self, change: Change, sizes: tuple[float, ...]) -> Spectrum:
        """Change of the outputs by a change of the network, ``[output, line]``."""
        omega, (across, receptance, shown, own) = self.base.omega[self._lines], self._along(change)
        resists = across
        if change.kind == "link":
            z = np.exp(sizes[0]) + 1j * omega * np.exp(sizes[1])
        else:
            more = change.value * np.expm1(sizes[0])
            z = more * {"stiffness": 1.0 + 0j, "damping": 1j * omega, "mass": -(omega**2) + 0j}[change.kind]
            if change.kind == "mass":
                # A mass resists its acceleration in space, the ground's included.
                resists = across - self.base.ground[self._lines] / omega**2
        force = z * resists / (1 + z * receptance)
        changed: Spectrum = shown * force + own[:, np.newaxis] * force
        return changed

    def _along(self, change: Change) -> tuple[Spectrum, Spectrum, Spectrum, Matrix]:
        """Along a change's direction: way, way by force, outputs by force, and which output shows the force."""
        if change.name not in self._known:
            lines, direction = self._lines, change.direction
            across = self.base.ways[lines] @ direction
            receptance = self.base.receptance[lines] @ direction @ direction
            joint = change.name.rsplit(".", 1)[0]
            own = [
                sensor.measures == "force" and self.base.network.joints[sensor.at].name == joint
                for sensor in self.base.network.sensors
            ]
            shown = self.base.by_force(direction)[:, lines]
            self._known[change.name] = across, receptance, shown, np.array(own, dtype=np.float64)
        return self._known[change.name]

    @cached_property
    def _known(self) -> dict[str, tuple[Spectrum, Spectrum, Spectrum, Matrix]]:
        return {}
