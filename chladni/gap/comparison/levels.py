"""What changes with the level of excitation: resonances, and the share that no linear system gives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import ALIKE, CLEARLY, LITTLE, NOTICED, OUTSIDE, SLIGHT
from chladni.gap.comparison.distortion import distortion_of
from chladni.gap.comparison.linear_approximation import best_linear_approximation, moving_inputs
from chladni.gap.comparison.local_rational import local_fit
from chladni.gap.comparison.outside_band import ProductsOutside, products_outside
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.peak import Peak
from chladni.spectral.peaks import find_response_peaks


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelResponse:
    """One measurement among several levels.

    Attributes
    ----------
    log, level
        Its log, and the RMS of its strongest input.
    response
        From every input that moves to every output.
    nonlinear
        By output: RMS of what no linear system gives (noise aside where the input is periodic) over RMS of it.
    outside
        What the distortion above a wholly excited band follows; None where there is no such band.
    """

    log: str
    level: float
    response: FrequencyResponse
    nonlinear: Mapping[str, float]
    outside: ProductsOutside | None = None


def level_responses(measurements: Sequence[Measurement]) -> tuple[LevelResponse, ...]:
    """Estimate the frequency responses of several measurements, by rising level of their strongest input."""
    moving = [one for one in measurements if moving_inputs(one)]
    if not moving:
        return ()
    # One input for all logs, so that the levels mean the same.
    name = moving_inputs(moving[0])[int(np.argmax([level_of(moving[0], one) for one in moving_inputs(moving[0])]))]
    levels = [
        LevelResponse(
            log=one.log,
            level=level_of(one, name),
            response=best_linear_approximation(one),
            nonlinear=dict(zip(one.output_names, _nonlinear(one).tolist(), strict=True)),
            outside=products_outside(one),
        )
        for one in moving
        if name in moving_inputs(one)
    ]
    return tuple(sorted(levels, key=lambda one: one.level))


def compare_levels(measurements: Sequence[Measurement]) -> tuple[str, ...]:
    """Say what changes with level.

    A linear machine has the same frequency response at every level. Here the strongest resonance of each output at
    the lowest level is followed to the highest one: a frequency that falls speaks for a stiffness that gives way
    (clearance, friction that slips), one that rises for hardening; a height that falls speaks for damping that
    grows with level, one that rises for damping that shrinks (Coulomb friction).

    Parameters
    ----------
    measurements
        Of one machine with one sensor set at different levels, in any order.

    Returns
    -------
    tuple of str
        Sentences; none for fewer than two levels.
    """
    levels = level_responses(measurements)
    if len(levels) < 2:
        return ()
    if levels[-1].level < ALIKE * levels[0].level:
        return (f"the levels differ by less than {ALIKE - 1:.0%}: they tell nothing about nonlinearity",)
    # A sensor that one log lacks can't be compared.
    outputs = [name for name in levels[0].nonlinear if all(name in one.nonlinear for one in levels)]
    return (*(sentence for name in outputs for sentence in _of_output(name, levels)), *_parity(levels))


def _parity(levels: Sequence[LevelResponse]) -> list[str]:
    """Sentences on distortion above the band at the lowest and the highest level."""
    return [
        f"at {one.level:.3g} RMS {one.outside.sentence()}"
        for one in (levels[0], levels[-1])
        if one.outside is not None
    ]


def _of_output(output: str, levels: Sequence[LevelResponse]) -> list[str]:
    reference = levels[0].response.references[0].name
    # Levels alone say nothing without the input that they are levels of.
    span = f"while {reference} rises from {levels[0].level:.3g} to {levels[-1].level:.3g} RMS"
    sentences = []
    peaks = followed_peak(output, levels)
    if peaks is not None:
        sentences.append(f"{output}: {_resonance(peaks[0], peaks[-1])} {span}")
    first, last = levels[0].nonlinear[output], levels[-1].nonlinear[output]
    if last > CLEARLY * first and last > NOTICED:
        sentences.append(
            f"{output}: what no linear system gives grows from {first:.2g} to {last:.2g} of its RMS {span}"
        )
    return sentences


def followed_peak(output: str, levels: Sequence[LevelResponse]) -> tuple[Peak, ...] | None:
    """Give the strongest resonance of the lowest level at every level; None where it's lost on the way.

    Between one level and the next it moves by at most a tenth.
    """
    followed: list[Peak] = []
    # Level by level: over the whole range a resonance may move past where its neighbour was.
    for level in levels:
        rows = level.response.select([output])
        peaks = [peak for peak in find_response_peaks(rows) if peak.channels[1] == rows.references[0].name]
        if followed:
            before = followed[-1].frequency_hz
            peaks = [peak for peak in peaks if abs(peak.frequency_hz - before) <= LITTLE * before]
        if not peaks:
            return None
        followed.append(max(peaks, key=lambda peak: peak.height))
    return tuple(followed)


def _resonance(first: Peak, last: Peak) -> str:
    shift_std = float(np.hypot(first.frequency_std_hz, last.frequency_std_hz))
    height_std = float(np.hypot(first.height_std, last.height_std))
    shift, growth = last.frequency_hz - first.frequency_hz, last.height - first.height
    moves = abs(shift) > max(OUTSIDE * shift_std, SLIGHT * first.frequency_hz)
    swells = abs(growth) > max(OUTSIDE * height_std, NOTICED * first.height)
    if not moves and not swells:
        return f"its resonance at {first.frequency_hz:.4g} Hz stays as it is"
    parts = []
    # What a change speaks for, in the words of the effects that cause it.
    if moves:
        word, why = ("falls", "a stiffness gives way") if shift < 0 else ("rises", "a stiffness hardens")
        parts.append(f"{word} from {first.frequency_hz:.4g} to {last.frequency_hz:.4g} Hz ({why})")
    if swells:
        word, why = ("falls", "damping grows") if growth < 0 else ("rises", "damping shrinks")
        parts.append(f"in height {word} from {first.height:.3g} to {last.height:.3g} ({why})")
    at = "" if moves else f" at {first.frequency_hz:.4g} Hz"
    return f"its resonance{at} {' and '.join(parts)}"


def level_of(measurement: Measurement, name: str) -> float:
    """RMS of an input about its mean."""
    return float(np.std(measurement.inputs[measurement.input_names.index(name)]))


def _nonlinear(measurement: Measurement) -> Real:
    """``[output]`` RMS share; without a period noise is in it."""
    # Periods tell noise apart; without them the residual of a linear fit is all there is.
    distortion = distortion_of(measurement)
    if distortion is not None:
        return np.asarray(np.sqrt([one.nonlinear for one in distortion.shares]))
    spectra = local_fit(measurement.inputs, measurement.outputs)
    if spectra is None:
        return np.zeros(len(measurement.output_names))
    power, whole = spectra.densities().mean(axis=1), np.var(measurement.outputs, axis=1)
    return np.asarray(np.sqrt(np.divide(power, whole, out=np.zeros_like(power), where=whole > 0)))
