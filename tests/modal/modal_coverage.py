"""Monte Carlo of modes with known truth: how often nominal intervals hold it."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.modal.fit.maximum_likelihood import refine
from chladni.modal.fit.modal_model import ModalModel
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from tests.modal.truth import noisy_response, record

SIGMAS = 1.959964


def started(truth, at, rng, *, off=0.05, responses=None):
    """Model to begin from: poles off by a share of the decay rate, participation off by the same share."""
    masses = truth.shapes.shape[1] if responses is None else responses
    scatter = rng.standard_normal((2, truth.poles.size))
    poles = truth.poles - off * truth.poles.real * (scatter[0] + 1j * scatter[1])
    vectors = truth.shapes[:, list(at)] * (1 + off * rng.standard_normal((truth.poles.size, len(at))))
    nothing = np.zeros((masses, len(at)), dtype=complex)
    return ModalModel(
        poles=poles,
        shapes=np.ones((poles.size, masses), dtype=complex),
        participation=vectors.astype(complex),
        lower=nothing,
        upper=nothing,
    )


@dataclass
class Coverage:
    """Hits of the 95 % intervals, by what was estimated: ``inside[name]`` is a list of boolean arrays, one a run."""

    inside: dict

    @classmethod
    def empty(cls):
        return cls({name: [] for name in ("frequency", "damping", "shape", "mass")})

    def add(self, fitted, truth, at):
        """Compare one fit with the truth, mode by mode."""
        model = fitted.model
        self._add("frequency", model.frequency_hz - truth.frequency_hz, fitted.frequency_std_hz)
        self._add("damping", model.damping_ratio - truth.damping_ratio, fitted.damping_std)
        off, free = model.shapes - truth.unit_shapes, fitted.shape_std.real > 0
        self._add(
            "shape",
            np.concatenate([off.real[free], off.imag[free]]),
            np.concatenate([fitted.shape_std.real[free], fitted.shape_std.imag[free]]),
        )
        largest = np.argmax(np.abs(truth.shapes), axis=1)
        mass = truth.shapes[np.arange(largest.size), largest] ** -2.0
        modal_a = model.shapes[:, at[0]] / model.participation[:, 0]
        found = (modal_a / (2j * model.poles.imag)).real
        self._add("mass", found - mass, fitted.modal_mass_std[:, at[0], 0])

    def _add(self, name, off, std):
        self.inside[name].append(np.abs(off) < SIGMAS * std)

    def share(self, name):
        """Share of intervals that hold the truth."""
        return float(np.mean(np.concatenate(self.inside[name])))


def independent_noise(truth, rng, *, at, noise=0.03, lines=600, band_hz=(0.25, 8.0)):
    """Functions whose lines carry independent circular noise of known variance."""
    response = noisy_response(truth, np.linspace(*band_hz, lines), at, noise=noise, rng=rng)
    known = replace(response.provenance, averages=10_000, effective_averages=1e4)
    return replace(response, provenance=known)


def few_periods(truth, rng, *, at, noise=0.05, lines=600, band_hz=(0.25, 8.0), periods=8):
    """Means over periods, with a variance estimated from their scatter: chi-square with 2 (M - 1) degrees."""
    response = noisy_response(truth, np.linspace(*band_hz, lines), at, noise=noise, rng=rng)
    freedom = 2 * (periods - 1)
    estimated = response.std * np.sqrt(rng.chisquare(freedom, response.std.shape) / freedom)
    few = replace(response.provenance, averages=periods, effective_averages=float(periods))
    return replace(response, std=estimated, provenance=few)


def averaged_random(truth, rng, *, at, noise=0.01, force_noise=None, cycles=1500, resolution_hz=None, window="hann"):
    """H1 of records of white random forces, each channel with white noise, averaged over windowed segments."""
    series = record(truth, cycles=cycles, rng=rng, at=at, noise=noise, force_noise=force_noise)
    spectra = cross_spectra(series, resolution_hz=resolution_hz, window=window)
    names = [channel.name for channel in series.channels if channel.role == "reference"]
    return frequency_response(spectra, references=names)


def coverage(truth, make, *, runs, at=(0,), seed=0, band_hz=(0.3, 7.5), **options):
    """Repeat measurement and fit; give the coverage of everything."""
    total = Coverage.empty()
    for run in range(runs):
        rng = np.random.default_rng([seed, run])
        response = make(truth, rng, at=at, **options)
        total.add(refine(response, started(truth, at, rng), band_hz=band_hz), truth, at)
    return total
