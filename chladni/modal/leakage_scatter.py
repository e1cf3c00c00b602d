"""How errors of leakage scatter a mode: one error in all responses, and not independent from line to line."""

from dataclasses import dataclass
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from chladni.modal.model_lines import ModelLines
from chladni.signals.provenance import Provenance
from chladni.spectral.leakage import SAMPLES, named_window

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]

# Reach of a window's spectrum, and of the correlation between lines, in lines.
REACH, LAGS = 8, 2
# Lines on each side of a mode, in decay rates and at least.
NEAR_DECAYS, NEAR_LINES = 8.0, 60
FEWEST_STEPS, STEPS_A_DECAY, MOST_STEPS = 4, 4.0, 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LeakageScatter:
    """Second moments of the error u that a unit residue leaves in H1 near one mode, for white random excitation.

    A segment holds Y(k) = H X + R with R(k) the integral of W(k - nu)(H(nu) - H(k)) dZ(nu): the window mixes the
    neighbourhood of a line, over which a resonance varies. R doesn't repeat from segment to segment, so that it
    counts as noise; but it is the same for all responses but for the shape, and it depends on the excitation, so that
    its error u = mean conj(X) R / mean |X|^2 has a second moment E[u u] beside E[u conj(u)] (moments of Gaussian
    spectra: Bendat & Piersol 2010, section 9.1; window and overlap as in Welch 1967).

    Attributes
    ----------
    near
        Lines that were looked at.
    modes
        ``[other]`` modes that are felt there.
    hermitian, plain
        ``[lag, other, other, line]``: E[u_r(k) conj(u_s(k + m))] and E[u_r(k) u_s(k + m)], m = 0 ... LAGS.
    """

    near: slice
    modes: NDArray[np.intp]
    hermitian: Complex
    plain: Complex

    def variance(self, hermitian_weights: Complex, plain_weights: tuple[Complex, Complex]) -> float:
        """Variance of Re sum b u.

        Parameters
        ----------
        hermitian_weights
            ``[pair, other, line]`` b of independent errors.
        plain_weights
            Two of ``[pair, other, line]``: b of the errors that the second moment couples.
        """
        first, second = plain_weights
        total = 0.0
        for lag in range(LAGS + 1):
            own = _shifted(hermitian_weights, lag).conj()
            part = np.sum(hermitian_weights[:, :, np.newaxis] * own[:, np.newaxis] * self.hermitian[lag]).real
            other = _shifted(second, lag)
            part += np.sum(first[:, :, np.newaxis] * other[:, np.newaxis] * self.plain[lag]).real
            # Each distance between lines but zero occurs upwards and downwards.
            total += part if lag == 0 else 2 * part
        return float(total / 2)

    def power(self) -> Complex:
        """``[other, other, line]`` E[u_r conj(u_s)] on one line."""
        return np.asarray(self.hermitian[0], dtype=np.complex128)


def leakage_scatter(lines: ModelLines, poles: Complex, mode: int, provenance: Provenance) -> LeakageScatter | None:
    """Compute the moments near a mode; None where segments lose nothing, or lines were left out near the mode."""
    if lines.window is None:
        return None
    segment_s = lines.window.segment_s
    near = _near(lines, poles[mode], segment_s)
    position = lines.frequency_hz[near] * segment_s
    if position.size < 2 * LAGS + 1 or np.any(np.abs(np.diff(position) - 1) > 1e-6):
        return None
    place = poles.imag * segment_s / (2 * pi)
    # A mode that lies outside still has its skirts among these lines.
    others = np.flatnonzero((place >= position[0] - NEAR_LINES) & (place <= position[-1] + NEAR_LINES))
    steps = int(
        np.clip(ceil(2 * pi * STEPS_A_DECAY / (-poles[others].real.max() * segment_s)), FEWEST_STEPS, MOST_STEPS)
    )
    hermitian, plain = _moments(position, poles[others] * segment_s, lines.order, segment_s, steps, provenance)
    return LeakageScatter(near=near, modes=others, hermitian=hermitian, plain=plain)


def _near(lines: ModelLines, pole: complex, segment_s: float) -> slice:
    reach_hz = (NEAR_DECAYS * -pole.real / (2 * pi)) + NEAR_LINES / segment_s
    frequency_hz = pole.imag / (2 * pi)
    first, last = np.searchsorted(lines.frequency_hz, [frequency_hz - reach_hz, frequency_hz + reach_hz])
    return slice(int(first), int(last))


def _moments(
    position: Floats, decays: Complex, order: int, segment_s: float, steps: int, provenance: Provenance
) -> tuple[Complex, Complex]:
    window = named_window(provenance.window)
    offset = np.arange(-REACH * steps, REACH * steps + 1) / steps
    spectrum = np.exp(2j * pi * np.outer(offset, np.arange(SAMPLES)) / SAMPLES) @ window
    spectrum /= np.sqrt(np.sum(np.abs(spectrum) ** 2))
    s = 2j * pi * (position[:, np.newaxis] + offset) / segment_s
    # What a unit residue makes between the lines, less what H1 expects on the line.
    response = s**order / (s - decays[:, np.newaxis, np.newaxis] / segment_s)
    left = spectrum * (response - (response @ np.abs(spectrum) ** 2)[..., np.newaxis])
    hermitian = np.zeros((LAGS + 1, len(decays), len(decays), position.size), dtype=np.complex128)
    plain = np.zeros_like(hermitian)
    for lag in range(LAGS + 1):
        # The line `lag` further sees the same frequency at an offset smaller by `lag`.
        far = _moved(spectrum, lag * steps)
        far_left = _moved(_shifted(left.swapaxes(-1, -2), lag).swapaxes(-1, -2), lag * steps)
        for weight, hop in _segment_lags(provenance):
            # Turning by the position of the line cancels in each product below but for the part within a line.
            turn = np.exp(2j * pi * offset * hop)
            excitation = np.sum(turn * spectrum * far.conj())
            residual = np.stack([np.sum(one * turn * far_left.conj(), axis=-1) for one in left])
            hermitian[lag] += weight * excitation.conj() * residual
            here, there = left @ (far.conj() * turn), far_left @ (spectrum * turn).conj()
            plain[lag] += weight * here[:, np.newaxis] * there
    return hermitian, plain


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
