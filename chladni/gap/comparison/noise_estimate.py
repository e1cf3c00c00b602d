"""How loud the noise of each measured output is, estimated without a model."""

from dataclasses import replace

import numpy as np
from scipy import fft

from chladni.gap.calibration import (
    CLEARLY,
    FAR,
    GRID,
    HARDLY_ANY,
    LINES_A_TERM,
    LITTLE,
    LOCAL_TERMS,
    MOST,
    SAME,
    SOME,
)
from chladni.gap.comparison.local_rational import POLES, ResidualSpectra, local_fit
from chladni.gap.comparison.periodicity import steady_periods
from chladni.gap.comparison.whitening import noise_floor_of
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Mask, Real


def estimate_noise(measurement: Measurement) -> NoiseFloor:
    """Estimate the floor that no model can get under.

    With a periodic input (two steady periods or more): scatter between periods, which nonlinear distortion, being
    periodic too, stays out of (Pintelon & Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed.,
    chapter 4); from one period to the next where the machine drifts slowly. Otherwise: the residual of a local
    rational fit of every frequency response. It holds distortion too, so it's an upper bound, unless it's as low
    where the machine responds as where it's quiet.

    Of either, only that is kept which the other outputs don't share, since a force that nobody modelled (distortion,
    a floor that shakes) reaches all sensors, while each has its own noise; the method then is ``incoherent
    residual``. A floor that a sensor's coarse steps or held samples make is an upper bound too.

    Returns
    -------
    NoiseFloor
        `std` is the relative standard deviation of `rms` by its degrees of freedom; bias by distortion isn't in it.
    """
    floor = _of_periods_or_fit(measurement)
    return replace(floor, upper_bound=floor.upper_bound | _stepped(measurement.outputs, floor))


def _of_periods_or_fit(measurement: Measurement) -> NoiseFloor:
    fitted = _of_fit(measurement)
    spectra = (
        None
        if measurement.period_samples is None
        else _between_periods(steady_periods(measurement.outputs, measurement))
    )
    if spectra is None:
        return fitted
    outputs = measurement.outputs
    floor = _floor(spectra, outputs, "periods", np.zeros(len(outputs), dtype=np.bool_))
    # A machine that changes, or is disturbed, between periods makes their scatter a poor bound.
    return chosen_floor(fitted.rms < floor.rms / SAME, floor, fitted)


def _stepped(outputs: Real, floor: NoiseFloor) -> Mask:
    """Whether coarse steps or held samples make up much of each floor; they look like noise, but a law gives them."""
    answers = []
    for row, rms in zip(outputs, floor.rms, strict=True):
        levels = np.unique(row)
        # Of samples that are all different, the distances say how many there are, not how coarse they are.
        few = 1 < levels.size < row.size / 2
        rounded = few and float(np.median(np.diff(levels))) ** 2 / 12 > MOST**2 * rms**2
        answers.append(rounded or float(np.mean(np.diff(row) == 0)) > SOME)
    return np.array(answers)


def _of_fit(measurement: Measurement) -> NoiseFloor:
    outputs = measurement.outputs
    spectra = local_fit(measurement.inputs, outputs)
    if spectra is None:
        return _of_top_quarter(outputs)
    floor = _floor(spectra, outputs, "fit residual", np.ones(len(outputs), dtype=np.bool_))
    # What the other outputs share of a residual is distortion, and some of it may be left.
    shared = np.array([method == "incoherent residual" for method in floor.method])
    return replace(floor, upper_bound=shared | _louder_than_quiet(spectra, outputs))


def smaller_floor(first: NoiseFloor, second: NoiseFloor) -> NoiseFloor:
    """Give, output by output, the floor that is lower; both hold the same outputs."""
    return chosen_floor(second.rms < first.rms, first, second)


def chosen_floor(lower: Mask, first: NoiseFloor, second: NoiseFloor) -> NoiseFloor:
    """Give the second floor for the outputs marked ``[output]``, else the first; both hold the same outputs."""
    lags = max(first.whitening.shape[1], second.whitening.shape[1])
    padded = [np.pad(one.whitening, ((0, 0), (0, lags - one.whitening.shape[1]))) for one in (first, second)]
    methods = zip(lower, first.method, second.method, strict=True)
    return NoiseFloor(
        rms=np.where(lower, second.rms, first.rms),
        whitening=np.where(lower[:, None], padded[1], padded[0]),
        innovation_rms=np.where(lower, second.innovation_rms, first.innovation_rms),
        method=tuple(theirs if lowest else ours for lowest, ours, theirs in methods),
        std=np.where(lower, second.std, first.std),
        upper_bound=np.where(lower, second.upper_bound, first.upper_bound),
    )


def _between_periods(periods: Real) -> ResidualSpectra | None:
    """Spectra of what differs between two periods and more; None when one is too short for that."""
    count, samples = periods.shape[1:]
    if count < 2:
        return None
    about_mean = (periods - periods.mean(axis=1, keepdims=True)) * np.sqrt(count / (count - 1))
    steps = np.diff(periods, axis=1) / np.sqrt(2)
    drifts = np.mean(about_mean**2) > SAME**2 * np.mean(steps**2)
    scatter = steps if drifts else about_mean
    # Neighbouring steps share a period: of n - 1 of them, two thirds count (von Neumann 1941).
    worth = (count - 1) * (2 / 3 if drifts and count > 2 else 1.0) / scatter.shape[1]
    lines = max(1, int(np.ceil(LINES_A_TERM * (2 * LOCAL_TERMS + POLES) / (worth * scatter.shape[1]))))
    blocks = (samples - 1) // 2 // lines
    if blocks < 1:
        return None
    spectra = fft.rfft(scatter, axis=2)[:, :, 1 : 1 + blocks * lines] / np.sqrt(samples)
    parts = spectra.reshape(*spectra.shape[:2], blocks, lines).transpose(2, 1, 3, 0)
    residual = parts.reshape(blocks, -1, len(periods))
    return ResidualSpectra(
        residual=residual / np.sqrt(residual.shape[1]),
        freedom=np.full((blocks, len(periods)), residual.shape[1] * worth),
        edges=(0.5 + np.arange(blocks + 1) * lines) / samples,
    )


def _floor(spectra: ResidualSpectra, outputs: Real, method: str, upper_bound: Mask) -> NoiseFloor:
    whole, own = spectra.densities(), spectra.incoherent_densities()
    lower = own.mean(axis=1) < (1 - LITTLE) ** 2 * whole.mean(axis=1)
    density = np.where(lower[:, None], own, whole)
    freedom = spectra.freedom.T - np.where(lower[:, None], len(outputs) - 1, 0)
    # Power in few blocks is known by the freedom of those only; each complex number counts twice.
    with np.errstate(invalid="ignore", divide="ignore"):
        effective = 2 * np.sum(density, axis=1) ** 2 / np.sum(density**2 / freedom, axis=1)
    return noise_floor_of(
        _on_grid(density, spectra.edges),
        samples=outputs.shape[1],
        freedom=np.nan_to_num(effective, nan=1.0),
        method=tuple("incoherent residual" if one else method for one in lower),
        upper_bound=upper_bound | lower,
        scale=np.std(outputs, axis=1),
    )


def _responses(spectra: ResidualSpectra, outputs: Real) -> Real:
    """``[output, block]`` power density of the outputs themselves."""
    blocks, lines = spectra.residual.shape[:2]
    power = np.abs(fft.rfft(outputs, axis=1)[:, 1 : 1 + blocks * lines]) ** 2 / outputs.shape[1]
    return np.asarray(power.reshape(len(outputs), blocks, lines).mean(axis=2))


def _louder_than_quiet(spectra: ResidualSpectra, outputs: Real) -> Mask:
    """Whether each residual is louder where the machine responds: then it may hold distortion."""
    left, own = spectra.densities(), spectra.incoherent_densities()
    answers = _responses(spectra, outputs) >= FAR * left
    verdict = np.ones(len(outputs), dtype=np.bool_)
    for place, loud in enumerate(answers):
        if HARDLY_ANY < np.mean(~loud) < 1:
            loudness = float(min(left[place, loud].mean(), own[place, loud].mean()))
            verdict[place] = loudness > CLEARLY * left[place, ~loud].mean()
    return verdict


def _of_top_quarter(outputs: Real) -> NoiseFloor:
    """Take the top quarter of the band for white noise: all that a very short log gives."""
    samples = outputs.shape[1]
    power = np.abs(fft.rfft(outputs - outputs.mean(axis=1, keepdims=True), axis=1)) ** 2 / samples
    top = power[:, 3 * power.shape[1] // 4 :]
    return noise_floor_of(
        np.repeat(top.mean(axis=1, keepdims=True), GRID + 1, axis=1),
        samples=samples,
        freedom=np.full(len(outputs), 2.0 * top.shape[1]),
        method=("quiet band",) * len(outputs),
        upper_bound=np.ones(len(outputs), dtype=np.bool_),
        scale=np.std(outputs, axis=1),
    )


def _on_grid(density: Real, edges: Real) -> Real:
    """Spread ``[output, block]`` over evenly spaced lines from 0 to half the rate; ends take the nearest block."""
    lines = np.linspace(0, 0.5, GRID + 1)
    block = np.clip(np.searchsorted(edges, lines, side="right") - 1, 0, density.shape[1] - 1)
    return np.asarray(density[:, block])
