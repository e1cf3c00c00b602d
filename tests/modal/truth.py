"""Structures whose modes are known in closed form, their frequency responses and their records, with noise."""

from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries

FORCE, MOTION = "/force{}.z", "/mass{}.z"


@dataclass(frozen=True, kw_only=True)
class ModalTruth:
    """Real modes: ``frequency_hz[mode]``, ``damping_ratio[mode]``, unit-mass ``shapes[mode, mass]``."""

    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray

    @property
    def poles(self):
        """``[mode]`` in rad/s."""
        omega = 2 * np.pi * self.frequency_hz
        return -self.damping_ratio * omega + 1j * omega * np.sqrt(1 - self.damping_ratio**2)

    @property
    def unit_shapes(self):
        """``[mode, mass]`` with the largest component 1."""
        largest = np.argmax(np.abs(self.shapes), axis=1)[:, None]
        return self.shapes / np.take_along_axis(self.shapes, largest, axis=1)

    def receptance(self, frequency_hz, at):
        """``[mass, reference, frequency]``: sum of phi phi^T / (omega_r^2 - omega^2 + 2 j zeta_r omega_r omega)."""
        omega, omega_r = 2 * np.pi * frequency_hz, 2 * np.pi * self.frequency_hz[:, None]
        gain = 1 / (omega_r**2 - omega**2 + 2j * self.damping_ratio[:, None] * omega_r * omega)
        products = self.shapes[:, :, None] * self.shapes[:, None, list(at)]
        return np.einsum("mij,mf->ijf", products, gain)

    def accelerance(self, frequency_hz, at):
        """``[mass, reference, frequency]`` in (m/s^2)/N."""
        return self.receptance(frequency_hz, at) * -((2 * np.pi * frequency_hz) ** 2)

    def respond(self, forces, at, rate_hz):
        """``[mass, sample]`` accelerations under ``[reference, sample]`` forces that repeat with the record."""
        frequency_hz = np.fft.rfftfreq(forces.shape[1], 1 / rate_hz)
        spectra = np.einsum("ijf,jf->if", self.accelerance(frequency_hz, at), np.fft.rfft(forces))
        return np.fft.irfft(spectra, n=forces.shape[1])


def chain(*, first_hz=1.0, damping=0.01):
    """Five equal masses of 1 kg, ground - k - m - ... - k - m, every mode damped by the same ratio."""
    tie = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    tie[-1, -1] = 1
    eigenvalues, vectors = np.linalg.eigh(tie)
    frequency_hz = first_hz * np.sqrt(eigenvalues / eigenvalues[0])
    return ModalTruth(frequency_hz=frequency_hz, damping_ratio=np.full(5, damping), shapes=vectors.T)


def close_modes(*, frequency_hz=10.0, apart=0.002, damping=0.01, mac=0.6, masses=6):
    """Two modes with a MAC of 0.6, seen by six accelerometers; the first two masses tell them apart."""
    place = np.arange(masses) + 1.0
    one, other = np.sin(place * 1.1), np.cos(place * 1.1)
    one /= np.linalg.norm(one)
    other -= one * (one @ other)
    other /= np.linalg.norm(other)
    return ModalTruth(
        frequency_hz=frequency_hz * np.array([1 - apart / 2, 1 + apart / 2]),
        damping_ratio=np.full(2, damping),
        shapes=np.array([one, np.sqrt(mac) * one + np.sqrt(1 - mac) * other]),
    )


def channels(masses, at):
    """Accelerations of the masses and forces on some of them."""
    forces = tuple(
        Channel(name=FORCE.format(mass), unit="N", point=f"p{mass}", direction=(0.0, 0.0, 1.0), role="reference")
        for mass in at
    )
    motions = tuple(
        Channel(name=MOTION.format(mass), unit="m/s^2", point=f"p{mass}", direction=(0.0, 0.0, 1.0))
        for mass in range(masses)
    )
    return forces, motions


def noisy_response(truth, frequency_hz, at, *, noise, rng):
    """Accelerances with complex noise whose RMS on every line is ``noise`` times the magnitude there."""
    exact = truth.accelerance(frequency_hz, at)
    scatter = rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape)
    std = noise * np.abs(exact) / np.sqrt(2)
    forces, motions = channels(truth.shapes.shape[1], at)
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        values=exact + std * scatter,
        std=std,
        coherence=np.full((exact.shape[0], frequency_hz.size), 1 / (1 + noise**2)),
        excited=frequency_hz > 0,
        responses=motions,
        references=forces,
        # Lines without window over whole periods: each is independent of the next.
        provenance=Provenance(
            estimator="H1",
            window="boxcar",
            segment_s=1 / (frequency_hz[1] - frequency_hz[0]),
            averages=16,
            effective_averages=16.0,
            averaging="periodic",
        ),
    )


def record(truth, *, cycles, rng, at=(0,), noise=0.0, force_noise=None):
    """White random forces and the accelerations, sampled at 8 times the highest mode, each channel with white noise.

    ``noise`` and ``force_noise`` (None: the same) are shares of each channel's own RMS.
    """
    rate_hz = 8 * truth.frequency_hz.max()
    samples = round(cycles / truth.frequency_hz.min() * rate_hz)
    # Cut from a longer record that repeats, so that nothing starts at rest and nothing repeats.
    whole = next_fast_len(samples + 1, real=True)
    forces = rng.standard_normal((len(at), whole))
    motions = truth.respond(forces, at, rate_hz)
    return _series(forces[:, :samples], motions[:, :samples], at, rate_hz, rng, noise, force_noise)


def ambient_record(truth, *, cycles, rng, noise=0.0):
    """The same with independent white forces on all masses, of which nothing is measured."""
    masses = truth.shapes.shape[1]
    driven = record(truth, cycles=cycles, rng=rng, at=range(masses), noise=noise)
    return driven.select([MOTION.format(mass) for mass in range(masses)])


def noise_record(samples, *, rng, references=1, responses=4, rate_hz=64.0):
    """Forces and accelerations that have nothing to do with each other."""
    forces = rng.standard_normal((references, samples))
    return _series(forces, rng.standard_normal((responses, samples)), range(references), rate_hz, rng, 0.0, 0.0)


def _series(forces, motions, at, rate_hz, rng, noise, force_noise):
    shares = [noise if force_noise is None else force_noise] * len(forces) + [noise] * len(motions)
    values = np.concatenate([forces, motions])
    rms = np.sqrt(np.mean(values**2, axis=1))
    values = values + (np.array(shares) * rms)[:, None] * rng.standard_normal(values.shape)
    references, responses = channels(len(motions), at)
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=(*references, *responses))


def mac(one, other):
    """Modal assurance criterion of two vectors, written out here so that the product isn't its own judge."""
    return abs(np.vdot(one, other)) ** 2 / (np.vdot(one, one).real * np.vdot(other, other).real)
