"""What no linear system explains of the outputs: a local rational fit of the spectra, without a model."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from chladni.gap.calibration import FEWEST, LESS, LINES_A_TERM, LOCAL_TERMS, RIDGE
from chladni.signals.arrays import Complex, Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResidualSpectra:
    """Spectra of what isn't explained, in blocks of neighbouring lines.

    Attributes
    ----------
    residual
        ``[block, line, output]``, scaled so that the sum of its squares over lines is the power density, in cycles
        a sample: the mean density over 0..1/2 is the mean square.
    freedom
        ``[block, output]`` complex degrees of freedom of each residual.
    edges
        ``[block + 1]`` cycles a sample.
    """

    residual: Complex
    freedom: Real
    edges: Real

    def densities(self) -> Real:
        """``[output, block]`` power density."""
        return np.asarray(np.sum(np.abs(self.residual) ** 2, axis=1).T)

    def incoherent_densities(self) -> Real:
        """``[output, block]`` power density of what the other outputs don't share.

        With S the cross-spectral matrix of the residuals, 1/[S^-1]_jj is what is left of output j after regression
        on all others (Bendat & Piersol 2010, section 7.3). Noise of the sensors is their own; a force that nobody
        modelled reaches all of them, so it goes. For S = L L^H + N with N diagonal, 1/[S^-1]_jj >= N_jj: it bounds
        the sensor's noise from above. Of nu degrees of freedom the regression takes one for each other output.
        """
        products = np.einsum("bli,blj->bij", self.residual, self.residual.conj())
        power = np.einsum("bii->bi", products).real
        outputs = power.shape[1]
        left = self.freedom - (outputs - 1)
        if outputs == 1 or not np.all(power > 0) or np.any(left < FEWEST):
            return self.densities()
        # Outputs differ in size by orders of magnitude; with unit power each, inversion loses nothing.
        scale = np.sqrt(power)
        # Loaded, since residuals without noise can be one signal to the last digit.
        scaled = products / (scale[:, :, None] * scale[:, None, :]) + RIDGE * np.eye(outputs)
        own = power / np.einsum("bii->bi", np.linalg.inv(scaled)).real
        return np.asarray((own * self.freedom / left).T)


#: D has the terms of a polynomial but for the one.
POLES = LOCAL_TERMS - 1


def local_fit(inputs: Real, outputs: Real) -> ResidualSpectra | None:
    """Fit, block by block of lines, a rational function from the inputs to each output, and give the residual.

    Over the lines k + r of a block, with r scaled to -1..1,

        D(r) Y(k + r) = sum_i N_i(r) U_i(k + r) + T(r),   D = 1 + d_1 r + d_2 r^2,

    N and T of second degree. T holds what start and end of the record leak (the whole record is transformed without
    window, which makes it smooth). d comes from this equation by linear least squares, then N and T from the output
    error ``Y - (N U + T)/D`` (McKelvey & Guerin 2012; Pintelon & Schoukens 2012, section 7.2). Where D = 1 leaves
    less for its freedom, D is 1. There's None when the record has fewer lines than one block.

    Parameters
    ----------
    inputs, outputs
        ``[input, sample]``, ``[output, sample]``.
    """
    samples = outputs.shape[1]
    unknowns = LOCAL_TERMS * (len(inputs) + 1)
    lines = LINES_A_TERM * (unknowns + POLES)
    # The line at 0 Hz is a matter of offsets, the last one has no imaginary part.
    blocks = ((samples - 1) // 2 - 1) // lines
    if blocks < 1:
        return None
    used = slice(1, 1 + blocks * lines)
    scale = np.std(inputs, axis=1, keepdims=True)
    spectra_in = fft.rfft(inputs / np.where(scale > 0, scale, 1.0), axis=1)[:, used] / np.sqrt(samples)
    spectra_out = fft.rfft(outputs, axis=1)[:, used] / np.sqrt(samples)
    u = spectra_in.reshape(-1, blocks, lines).transpose(1, 2, 0)
    y = spectra_out.reshape(-1, blocks, lines).transpose(1, 2, 0)
    r = np.linspace(-1, 1, lines)
    signals = np.concatenate([u, np.ones((*u.shape[:2], 1))], axis=2)
    plain = unreached(_regressors(signals, r), y)
    shaped = np.stack([output_error(signals, y[:, :, place], r) for place in range(len(outputs))], axis=2)
    free = lines - unknowns
    # Where little but noise answers, poles are fitted to noise. All outputs go together, so that what they share
    # stays shared.
    power = np.sum(np.abs(plain) ** 2, axis=1), np.sum(np.abs(shaped) ** 2, axis=1)
    with_poles = np.any(power[1] / (free - POLES) < LESS * power[0] / free, axis=1)
    freedom = np.where(with_poles[:, None], free - POLES, free) * np.ones((1, len(outputs)))
    residual = np.where(with_poles[:, None, None], shaped, plain).astype(np.complex128)
    return ResidualSpectra(
        residual=residual / np.sqrt(freedom[:, None, :]),
        freedom=freedom,
        edges=(0.5 + np.arange(blocks + 1) * lines) / samples,
    )


def output_error(signals: Complex, y: Complex, r: Real) -> Complex:
    """Residual ``[block, line]`` of one output ``y [block, line]`` with poles of its own.

    Each of ``signals [block, line, signal]``, the inputs and 1 where the record's ends leak, gets a second-degree
    N(r). ``r [line]``, or ``[block, line]``, says where the lines lie, -1 to 1.
    """
    regressors, target = _regressors(signals, r), y[:, :, None]
    shifted = target * _powers(r, 1, 1 + POLES)
    d = _solved(unreached(regressors, shifted), unreached(regressors, target))
    denominator = 1 - _powers(r, 1, 1 + POLES) @ d
    return np.asarray(unreached(regressors / denominator, target)[:, :, 0])


def _regressors(signals: Complex, r: Real) -> Complex:
    """``[block, line, term]``: each signal times 1, r, r^2."""
    terms = signals[:, :, :, None] * _powers(r, 0, LOCAL_TERMS)[..., None, :]
    return np.asarray(terms.reshape(*signals.shape[:2], -1))


def _powers(r: Real, first: int, end: int) -> Complex:
    """``[..., line, power]``."""
    return np.asarray(r[..., None] ** np.arange(first, end), dtype=np.complex128)


def unreached(regressors: Complex, targets: Complex) -> Complex:
    """Give the part of targets ``[block, line, target]`` that regressors ``[block, line, term]`` don't reach."""
    q, _ = np.linalg.qr(regressors)
    return np.asarray(targets - q @ (q.conj().transpose(0, 2, 1) @ targets))


def _solved(regressors: Complex, targets: Complex) -> Complex:
    q, r = np.linalg.qr(regressors)
    # An output that is exactly zero has nothing to fit poles to.
    tiny = RIDGE * np.abs(r).max(axis=(1, 2), keepdims=True) + np.finfo(float).tiny
    loaded = r + tiny * np.eye(r.shape[-1])
    return np.asarray(np.linalg.solve(loaded, q.conj().transpose(0, 2, 1) @ targets))
