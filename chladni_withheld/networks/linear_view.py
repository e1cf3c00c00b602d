"""A network's exact linear response on frequency lines, and what its numbers change in the log."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from chladni_withheld.networks.excitation import Grid, Signal
from chladni_withheld.networks.network import GROUND, Matrix, Network, Sensor, Spectrum

_DECAYS = 9.0
"""Time constants of the slowest mode in the pause: what is left of it then is 1e-4."""


@dataclass(frozen=True, kw_only=True)
class LinearView:
    """Motion of a network without anything hidden, by Fourier transforms of run-in, log and a pause.

    The pause lets the motion die before the transform's period begins anew; so nothing of the beginning and end is
    lost, and the run from rest is the same as an integrator's.

    Attributes
    ----------
    network, grid, drives
        What moves, and by what.
    pause
        Samples of the pause; 0: as many as the network's slowest mode asks for.
    """

    network: Network
    grid: Grid
    drives: tuple[Signal, ...]
    pause: int = 0

    @property
    def per_sample(self) -> int:
        """Values a sample that signals are reduced to: held commands keep their images up to twice the log's rate."""
        return 4 if any(drive.jumps for drive in self.drives) else 1

    @cached_property
    def length(self) -> int:
        """Values of a period of the transform."""
        samples = self.grid.before + self.grid.samples + (self.pause or self.dying)
        return self.per_sample * next_fast_len(samples, real=True)

    @property
    def dying(self) -> int:
        """Samples in which the slowest mode dies."""
        return int(_DECAYS / -self.network.poles().real.max() * self.grid.rate_hz)

    @cached_property
    def omega(self) -> Matrix:
        """Lines in rad/s, as far as the inputs have anything, or to 1.5 of the log's rate."""
        spacing = 2 * np.pi * self.per_sample * self.grid.rate_hz / self.length
        spectra = np.abs([rfft(signal.values[: -1 : self._stride], self.length) for signal in self.drives])
        used = np.flatnonzero(np.any(spectra > 1e-6 * spectra.max(axis=1, keepdims=True), axis=0))
        omega: Matrix = np.arange(min(used[-1] + 1, int(1.5 / self.per_sample * self.length))) * spacing
        return omega

    @property
    def _stride(self) -> int:
        return 2 * self.grid.over // self.per_sample

    @cached_property
    def inputs(self) -> Spectrum:
        """Transforms of the inputs, ``[input, line]``."""
        return np.array([self.transform(signal) for signal in self.drives])

    def transform(self, signal: Signal) -> Spectrum:
        """Transform of a signal at ends and middles of steps."""
        lines: Spectrum = rfft(signal.values[: -1 : self._stride], self.length)[: len(self.omega)]
        if signal.jumps:
            # Each value stands until the next, which a comb of values doesn't say.
            turn = 1j * self.omega[1:] / (self.per_sample * self.grid.rate_hz)
            lines[1:] *= -np.expm1(-turn) / turn
        return lines

    @cached_property
    def receptance(self) -> Spectrum:
        """Ways by forces, ``[line, body, body]``."""
        mass, damping, stiffness = self.network.matrices()
        omega = self.omega[:, np.newaxis, np.newaxis]
        dynamic = (stiffness + 1j * omega * damping - omega**2 * mass).astype(np.complex128)
        return np.linalg.inv(dynamic)

    @cached_property
    def ground(self) -> Spectrum:
        """Acceleration of the ground, ``[line]``."""
        rows = [number for number, drive in enumerate(self.network.drives) if drive.where == "ground"]
        ground: Spectrum = self.inputs[rows].sum(axis=0)
        return ground

    @cached_property
    def ways(self) -> Spectrum:
        """Motion of the bodies relative to the ground, ``[line, body]``."""
        forces = self.inputs.T @ self.network.forces().T
        ways: Spectrum = np.einsum("lij,lj->li", self.receptance, forces)
        return ways

    def shown(self, sensor: Sensor, ways: Spectrum) -> Spectrum:
        """What a sensor shows of ways ``[line, body]``, without the ground's own motion, ``[line]``."""
        across = ways @ self.network.place(sensor)
        s = 1j * self.omega[: len(ways)]
        if sensor.measures == "force":
            joint = self.network.joints[sensor.at]
            return across * (joint.stiffness + s * joint.damping)
        return across * s ** ("displacement", "velocity", "acceleration").index(sensor.measures)

    @cached_property
    def outputs(self) -> Spectrum:
        """All outputs, ``[output, line]``."""
        rows = []
        for sensor in self.network.sensors:
            absolute = sensor.measures == "acceleration" and sensor.where == "body"
            rows.append(self.shown(sensor, self.ways) + (self.ground if absolute else 0.0))
        return np.array(rows)

    @property
    def below_half(self) -> int:
        """Lines up to half the log's rate, which are enough for derivatives."""
        return min(len(self.omega), self.length // self.per_sample // 2)

    def by_force(self, direction: Matrix) -> Spectrum:
        """Outputs by a unit force that resists along a direction, ``[output, line]``, force sensors' joints aside.

        Lines end at half the log's rate.
        """
        ways = -self.receptance[: self.below_half] @ direction
        return np.array([self.shown(sensor, ways) for sensor in self.network.sensors])

    @cached_property
    def sampled_inputs(self) -> Matrix:
        """Inputs at the log's samples, ``[input, sample]``; a command has taken its new value."""
        stride = 2 * self.grid.over
        rows = [drive.values[self.grid.before * stride :: stride][: self.grid.samples] for drive in self.drives]
        return np.array(rows)

    def at_samples(self, lines: Spectrum, direct: Matrix | None = None) -> Matrix:
        """Samples of the log, of transforms ``[..., line]``.

        `direct`, ``[..., input]``, is the part that follows the inputs at once: where these jump, so does that part,
        and only the rest is smooth enough for a transform that ends.
        """
        smooth = lines if direct is None else lines - direct @ self.inputs[:, : lines.shape[-1]]
        period = self.length // self.per_sample
        folded = np.zeros((*lines.shape[:-1], period // 2 + 1), dtype=np.complex128)
        # Sampling folds the lines above half the rate: first those below the rate, then those above.
        below = smooth[..., : period // 2 + 1]
        above = smooth[..., period : period + period // 2 + 1]
        mirrored = smooth[..., period - period // 2 : period + 1][..., ::-1].conj()
        folded[..., : below.shape[-1]] += below
        folded[..., : above.shape[-1]] += above
        folded[..., period // 2 + 1 - mirrored.shape[-1] :] += mirrored
        values: Matrix = irfft(folded, period, axis=-1) / self.per_sample
        sampled = values[..., self.grid.before :][..., : self.grid.samples]
        return sampled if direct is None else sampled + direct @ self.sampled_inputs

    def direct(self, accelerations: Matrix) -> Matrix:
        """What accelerometers show at once of the bodies' accelerations by inputs ``[body, input]``."""
        rows = [
            self.network.place(sensor) @ accelerations * (sensor.measures == "acceleration")
            for sensor in self.network.sensors
        ]
        return np.array(rows)

    def log(self) -> Matrix:
        """The log that this network would give, ``[output, sample]``."""
        at_once = self.network.forces() / np.array(self.network.masses)[:, np.newaxis]
        direct = self.direct(at_once)
        for number, drive in enumerate(self.network.drives):
            if drive.where == "ground":
                # What the ground does at once to a body is undone by the ground's own motion.
                direct[:, number] = 0.0
        return self.at_samples(self.outputs, direct)

    def resisting(self, name: str) -> tuple[Matrix, Spectrum]:
        """Of a number: the direction in which it resists, and how much by a unit of it, as a force ``[line]``."""
        owner, what = name.rsplit(".", 1)
        if owner in self.network.bodies:
            body = self.network.bodies.index(owner)
            return self.network.direction(GROUND, body), self.ground - self.omega**2 * self.ways[:, body]
        joint = [joint.name for joint in self.network.joints].index(owner)
        direction = self.network.joint_direction(joint)
        across = self.ways @ direction
        return direction, across if what == "stiffness" else 1j * self.omega * across

    def by_number(self, name: str) -> Spectrum:
        """Derivative of the outputs by a number, ``[output, line]``."""
        direction, force = self.resisting(name)
        force = force[: self.below_half]
        change = self.by_force(direction) * force
        owner = name.rsplit(".", 1)[0]
        for row, sensor in enumerate(self.network.sensors):
            if sensor.measures == "force" and self.network.joints[sensor.at].name == owner:
                change[row] += force
        return change

    def by_numbers(self, names: Sequence[str]) -> Matrix:
        """Derivatives of the log by numbers, ``[number, output, sample]``."""
        return np.array([self.at_samples(self.by_number(name), self._direct_by(name)) for name in names])

    def _direct_by(self, name: str) -> Matrix | None:
        owner = name.rsplit(".", 1)[0]
        if owner not in self.network.bodies:
            return None
        body = self.network.bodies.index(owner)
        at_once = np.zeros((len(self.network.bodies), len(self.drives)))
        held = [drive.where != "ground" for drive in self.network.drives]
        at_once[body] = -self.network.forces()[body] * held / self.network.masses[body] ** 2
        return self.direct(at_once)

    def motion(self, direction: Matrix) -> tuple[Matrix, Matrix]:
        """Ways and speeds along a direction, at the log's samples."""
        across = self.ways @ direction
        return self.at_samples(across), self.at_samples(1j * self.omega * across)
