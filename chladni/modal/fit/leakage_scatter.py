"""How errors of leakage scatter a mode: one error in all responses, and not independent from line to line."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, pi

import numpy as np

from chladni.modal.fit.model_lines import ModelLines
from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.provenance import Provenance
from chladni.spectral.leakage import SAMPLES, named_window

# Reach of a window's spectrum, and of the correlation between lines, in lines.
REACH, LAGS = 8, 3
# Lines on each side of a mode, in decay rates and at least.
NEAR_DECAYS, NEAR_LINES = 8.0, 60
# Lines between modes that are looked at one by one.
FEWEST_APART = 24.0
# Largest array held at once, in numbers (64 MB).
LARGEST_BLOCK = 2**22
FEWEST_STEPS, STEPS_A_DECAY, MOST_STEPS = 4, 4.0, 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LeakageScatter:
    """Second moments of the errors of H1 on some neighbouring lines, for white random excitation.

    A segment holds Y(k) = H X + R with R(k) the integral of W(k - nu)(H(nu) - H(k)) dZ(nu): the window mixes the
    neighbourhood of a line, over which a resonance varies. R doesn't repeat from segment to segment, so that it
    counts as noise; but it is the same for all responses but for the shape, and it depends on the excitation, so that
    its error u = mean conj(X) R / mean |X|^2 has a second moment E[u u] beside E[u conj(u)] (moments of Gaussian
    spectra: Bendat & Piersol 2010, section 9.1; window and overlap as in Welch 1967).

    Attributes
    ----------
    near
        The lines.
    modes
        ``[felt]`` modes that vary so fast there that R is computed for a unit residue of each.
    hermitian, plain
        ``[lag, source, source, line]``: E[u_r(k) conj(u_s(k + m))] and E[u_r(k) u_s(k + m)], m = 0 ... LAGS. Sources
        are the felt modes, then all else, which varies little over a line: R for a slope of one in a line.
    apparent
        ``[source, source, line]``: the power of u that the misfit within segments tells, as an estimated sigma does;
        segments that overlap repeat noise to another degree than leakage.
    noise
        ``[lag]`` correlation of the errors that noise makes, which is the same on all lines.
    """

    near: slice
    modes: Index
    hermitian: Complex
    plain: Complex
    apparent: Complex
    noise: Real

    def variance(self, hermitian_weights: Complex, plain_weights: tuple[Complex, Complex]) -> Real:
        """``[...]`` variance of Re sum b u.

        Parameters
        ----------
        hermitian_weights
            ``[..., pair, source, line]`` b of independent errors.
        plain_weights
            Two of ``[..., pair, source, line]``: b of the errors that the second moment couples.
        """
        first, second = plain_weights
        total = np.zeros(first.shape[:-3])
        for lag in range(len(self.hermitian)):
            stop = max(self.hermitian.shape[-1] - lag, 0)
            part = np.zeros_like(total)
            # Over sources one by one: products over lines are all that takes time.
            for row, column in np.ndindex(self.hermitian.shape[1:3]):
                moved = hermitian_weights[..., column, lag:].conj() * self.hermitian[lag, row, column, :stop]
                part += np.einsum("...pk,...pk->...", hermitian_weights[..., row, :stop], moved).real
                moved = second[..., column, lag:] * self.plain[lag, row, column, :stop]
                part += np.einsum("...pk,...pk->...", first[..., row, :stop], moved).real
            # Each distance between lines but zero occurs upwards and downwards.
            total += part if lag == 0 else 2 * part
        return np.asarray(total / 2)

    def noise_variance(self, weights: Complex) -> Real:
        """``[...]`` variance of Re sum b e over lines ``[..., line]``, for noise e of unit variance along H."""
        total = np.sum(np.abs(weights) ** 2, axis=-1)
        for lag in range(1, len(self.noise)):
            total += 2 * self.noise[lag] * np.sum(weights[..., lag:] * weights[..., :-lag].conj(), axis=-1).real
        return np.asarray(total)


def leakage_scatter(lines: ModelLines, poles: Complex, provenance: Provenance) -> tuple[LeakageScatter, ...]:
    """Compute the moments on all lines, stretch by stretch: around modes, and between; () where nothing leaks."""
    if lines.window is None:
        return ()
    segment_s, references = lines.window.segment_s, lines.values.shape[1]
    position, decays = lines.frequency_hz * segment_s, poles * segment_s
    free = max(provenance.effective_averages - references, 1.0)
    reach = NEAR_DECAYS * -decays.real / (2 * pi) + NEAR_LINES
    source = _Sources(order=lines.order, segment_s=segment_s, free=free, provenance=provenance)
    return tuple(
        _stretch(near, position[near], decays, reach, source) for near in _stretches(position, decays, reach)
    )


def _stretches(position: Real, decays: Complex, reach: Real) -> list[slice]:
    """Cut lines where the reach of a mode begins or ends, and where lines are missing."""
    place = decays.imag / (2 * pi)
    inside = np.any(np.abs(position - place[:, np.newaxis]) <= reach[:, np.newaxis], axis=0)
    apart = np.sort(place)
    middle = (apart[1:] + apart[:-1])[np.diff(apart) > FEWEST_APART] / 2
    # Midway between resonances errors hardly matter, and each stretch feels but a few modes.
    side = np.searchsorted(middle, position)
    cuts = (
        np.flatnonzero((inside[1:] != inside[:-1]) | (np.diff(side) > 0) | (np.abs(np.diff(position) - 1) > 1e-6)) + 1
    )
    return [slice(first, last) for first, last in pairwise([0, *map(int, cuts), position.size])]


def _stretch(near: slice, position: Real, decays: Complex, reach: Real, source: "_Sources") -> LeakageScatter:
    place = decays.imag / (2 * pi)
    felt = np.flatnonzero((place >= position[0] - reach) & (place <= position[-1] + reach))
    if felt.size:
        moments = _in_blocks(position, decays[felt], source)
    else:
        # Where no mode is felt all lines are alike.
        few = source.moments(position[0] + np.arange(LAGS + 1), decays[felt], FEWEST_STEPS)
        moments = tuple(np.repeat(moment[..., :1], position.size, axis=-1) for moment in few)
    return LeakageScatter(
        near=near, modes=felt, hermitian=moments[0], plain=moments[1], apparent=moments[2], noise=source.noise()
    )


def _in_blocks(position: Real, decays: Complex, source: "_Sources") -> tuple[Complex, ...]:
    """Compute moments over so many lines at a time as fit in memory."""
    slowest = -decays.real.max()
    steps = int(np.clip(ceil(2 * pi * STEPS_A_DECAY / slowest), FEWEST_STEPS, MOST_STEPS))
    size = max(LARGEST_BLOCK // ((decays.size + 1) * (2 * REACH * steps + 1)), 2 * LAGS)
    blocks = []
    for first in range(0, position.size, size):
        # Lines further on belong to the products, not to the answer.
        found = source.moments(position[first : first + size + LAGS], decays, steps)
        blocks.append(tuple(moment[..., :size] for moment in found))
    return tuple(np.concatenate(each, axis=-1) for each in zip(*blocks, strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sources:
    """What the moments depend on beside modes and lines; ``free`` averages beyond the references."""

    order: int
    segment_s: float
    free: float
    provenance: Provenance

    def moments(self, position: Real, decays: Complex, steps: int) -> tuple[Complex, Complex, Complex]:
        """Give hermitian, plain and apparent moments at lines given in units of their distance."""
        spectrum, offset = _window_spectrum(self.provenance.window, steps)
        s = 2j * pi * (position[:, np.newaxis] + offset) / self.segment_s
        # What a unit residue makes between the lines, less what H1 expects on the line.
        response = s**self.order / (s - decays[:, np.newaxis, np.newaxis] / self.segment_s)
        left = spectrum * (response - (response @ np.abs(spectrum) ** 2)[..., np.newaxis])
        slope = np.broadcast_to(spectrum * offset, (1, position.size, offset.size))
        left = np.concatenate([left, slope])
        apparent = np.stack([np.sum(one * left.conj(), axis=-1) for one in left]) / self.free
        lags = [self._moments_at(lag, left, spectrum, offset, steps) for lag in range(LAGS + 1)]
        hermitian, plain = (np.stack(each) for each in zip(*lags, strict=True))
        return hermitian, plain, np.asarray(apparent, dtype=np.complex128)

    def noise(self) -> Real:
        """``[lag]`` correlation of noise: as the mean |X|^2 by which is divided, so that it is the same for all."""
        noise = self._powers()
        divided = 1 + noise / self.free
        return np.asarray(noise * divided / divided[0])

    def _powers(self) -> Real:
        """``[lag]`` correlation of the mean |X|^2 of two lines."""
        spectrum, offset = _window_spectrum(self.provenance.window, FEWEST_STEPS)
        answer = np.zeros(LAGS + 1)
        for lag in range(LAGS + 1):
            far = _moved(spectrum, lag * FEWEST_STEPS).conj()
            for weight, hop in _segment_lags(self.provenance):
                answer[lag] += weight * abs(np.sum(np.exp(2j * pi * offset * hop) * spectrum * far)) ** 2
        return np.asarray(answer / answer[0])

    def _moments_at(
        self, lag: int, left: Complex, spectrum: Complex, offset: Real, steps: int
    ) -> tuple[Complex, Complex]:
        # The line `lag` further sees the same frequency at an offset smaller by `lag`.
        far = _moved(spectrum, lag * steps)
        far_left = _moved(_shifted(left.swapaxes(-1, -2), lag).swapaxes(-1, -2), lag * steps)
        hermitian = np.zeros((len(left), *left.shape[:2]), dtype=np.complex128)
        plain = np.zeros_like(hermitian)
        beside, back = np.zeros((2, *left.shape[:2]), dtype=np.complex128)
        for weight, hop in _segment_lags(self.provenance):
            # Turning by the position of the line cancels in each product below but for the part within a line.
            turn = np.exp(2j * pi * offset * hop)
            excitation = np.sum(turn * spectrum * far.conj())
            residual = np.stack([np.sum(one * turn * far_left.conj(), axis=-1) for one in left])
            hermitian += weight * excitation.conj() * residual
            here, there = left @ (far.conj() * turn), far_left @ (spectrum * turn).conj()
            plain += weight * here[:, np.newaxis] * there
            # What the error of each line has to do with the mean |X|^2 of the other.
            beside += weight * excitation.conj() * here
            back += weight * excitation * there
        # To second order, since that mean scatters as well: where errors cancel in a sum, this is what remains. On a
        # single line it is the n/(n - 1) of a quotient.
        divided = 1 + self._powers()[lag] / self.free
        return hermitian * divided + beside[:, np.newaxis] * back.conj(), plain * divided + beside[
            :, np.newaxis
        ] * back


def _window_spectrum(name: str, steps: int) -> tuple[Complex, Real]:
    """Spectrum of a window with unit power, and the offsets from the line, `steps` a line."""
    offset = np.arange(-REACH * steps, REACH * steps + 1) / steps
    spectrum = np.exp(2j * pi * np.outer(offset, np.arange(SAMPLES)) / SAMPLES) @ named_window(name)
    return spectrum / np.sqrt(np.sum(np.abs(spectrum) ** 2)), offset


def _segment_lags(provenance: Provenance) -> list[tuple[float, float]]:
    """Weight of each distance of two segments in the mean, and the distance in segment lengths."""
    count, hop = max(provenance.averages, 1), 1 - provenance.overlap
    reach = min(ceil(1 / hop - 1e-9) - 1, count - 1)
    return [((count - abs(lag)) / count**2, lag * hop) for lag in range(-reach, reach + 1)]


def _shifted(values: Complex, lag: int) -> Complex:
    """Bring element k + lag of the last axis to k; zero beyond the ends."""
    return _moved(values, -lag)


def _moved(values: Complex, places: int) -> Complex:
    """Move the last axis by `places` towards higher indices, filled with zeros."""
    moved = np.zeros_like(values)
    size = values.shape[-1]
    if abs(places) < size:
        target = slice(max(places, 0), size + min(places, 0))
        source = slice(max(-places, 0), size + min(-places, 0))
        moved[..., target] = values[..., source]
    return moved
