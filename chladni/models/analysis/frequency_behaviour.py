"""Behaviour against frequency in numbers: resonance, critical frequency, bandwidth, margins."""

from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.models.analysis.frequency_curve import FrequencyCurve, frequency_curve
from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.margins import FrequencyMarks, Margin
from chladni.models.analysis.resolvent import Resolvent
from chladni.models.analysis.step_behaviour import none
from chladni.models.core.reading import Quantity
from chladni.signals.arrays import Complex

# How many quarter turns the phase of a displacement lags behind that of an output in this unit.
DISPLACEMENT_QUARTERS = {"m/s": 1, "rad/s": 1, "m/s^2": 2, "rad/s^2": 2}
# More damped than this a pair makes no oscillation to see.
OVERDAMPED = 1 - 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class FrequencyBehaviour:
    """What happens where in frequency; angular frequencies in rad/s, None where it doesn't happen.

    Attributes
    ----------
    curve
        The frequency response.
    pair
        First oscillating pole (positive imaginary part).
    peak
        Where the magnitude peaks, and how high.
    critical
        Where the phase of the displacement reaches -180 degrees.
    bandwidth
        Where the magnitude has fallen by 3 dB from that at zero frequency.
    gain_margins, phase_margins
        Every crossing.
    """

    curve: FrequencyCurve
    pair: complex | None
    peak: tuple[float, float] | None
    critical: float | None
    bandwidth: float | None
    gain_margins: tuple[Margin, ...]
    phase_margins: tuple[Margin, ...]


def frequency_behaviour(path: LinearPath) -> FrequencyBehaviour:
    """Find what happens where in frequency, each to rounding."""
    resolvent = Resolvent(path)
    curve = frequency_curve(path, resolvent=resolvent)
    marks = FrequencyMarks(curve, resolvent, float(path.dead_time_s[0]))
    return FrequencyBehaviour(
        curve=curve,
        pair=first_pair(path.poles),
        peak=marks.peak(),
        critical=_first(marks.phase_crossings(critical_level_deg(path, curve.sign), falling_only=True)),
        bandwidth=_bandwidth(path, marks, curve),
        gain_margins=tuple(marks.gain_margins()),
        phase_margins=tuple(marks.phase_margins()),
    )


def first_pair(poles: Complex) -> complex | None:
    """Give the oscillating pole of lowest frequency, the one with positive imaginary part; None when none does."""
    pairs = poles[(poles.imag > 0) & (np.abs(poles.real) < OVERDAMPED * np.abs(poles))]
    return complex(pairs[np.argmin(np.abs(pairs))]) if pairs.size else None


def critical_level_deg(path: LinearPath, sign: float) -> float:
    """Phase of the output at which the displacement lags by 180 degrees, the sign of the path left out."""
    quarters = DISPLACEMENT_QUARTERS.get(path.outputs[0].unit, 0)
    return -180.0 + 90.0 * quarters + (180.0 if sign < 0 else 0.0)


def frequency_quantities(path: LinearPath, found: FrequencyBehaviour) -> list[Quantity]:
    """Tell behaviour against frequency in numbers, with the definition of each in words."""
    name = path.outputs[0].name
    return [
        *_pair_quantities(found.pair),
        _hertz(
            "peak_frequency",
            found.peak and found.peak[0],
            f"frequency at which the magnitude of {name} peaks",
            "the magnitude has no peak",
        ),
        _hertz(
            "critical_frequency",
            found.critical,
            f"frequency at which the phase of {_displacement(path)} falls through -180 degrees",
            "the phase doesn't fall so far",
        ),
        _hertz(
            "bandwidth",
            found.bandwidth,
            f"frequency from which the magnitude of {name} lies 3 dB and more under that at 0 Hz",
            "the magnitude at 0 Hz is zero or has no bound, or never falls so far",
        ),
        *_margin_quantities(found),
    ]


def _pair_quantities(pair: complex | None) -> list[Quantity]:
    reason = "no pole oscillates"
    frequency = None if pair is None else pair.imag
    resonance = _hertz("resonance_frequency", frequency, "damped frequency of the first oscillating pair", reason)
    definition = "damping ratio of the first oscillating pair"
    if pair is None:
        return [resonance, none("damping_ratio", "1", definition, reason)]
    return [resonance, Quantity(name="damping_ratio", value=-pair.real / abs(pair), unit="1", definition=definition)]


def _margin_quantities(found: FrequencyBehaviour) -> list[Quantity]:
    # Of several crossings the nearest to the limit of stability counts, on either side.
    gain = min(found.gain_margins, key=lambda margin: abs(np.log(margin.gain)), default=None)
    phase = min(found.phase_margins, key=lambda margin: abs(margin.phase_deg), default=None)
    texts = (
        ("gain_margin", "dB", "how much the gain may rise before unit negative feedback swings for ever"),
        ("phase_margin", "deg", "how much the phase may fall before unit negative feedback swings for ever"),
    )
    return [
        none(*texts[0], "the phase never passes -180 degrees")
        if gain is None
        else Quantity(name=texts[0][0], value=float(20 * np.log10(gain.gain)), unit="dB", definition=texts[0][2]),
        none(*texts[1], "the magnitude never passes 1")
        if phase is None
        else Quantity(name=texts[1][0], value=phase.phase_deg, unit="deg", definition=texts[1][2]),
    ]


def _hertz(name: str, omega: float | None, definition: str, reason: str) -> Quantity:
    if omega is None:
        return none(name, "Hz", definition, reason)
    return Quantity(name=name, value=omega / (2 * pi), unit="Hz", definition=definition)


def _displacement(path: LinearPath) -> str:
    name, quarters = path.outputs[0].name, DISPLACEMENT_QUARTERS.get(path.outputs[0].unit, 0)
    return ("", "the displacement whose rate is ", "the displacement whose second rate is ")[quarters] + name


def _bandwidth(path: LinearPath, marks: FrequencyMarks, curve: FrequencyCurve) -> float | None:
    if path.integrators() or np.any(curve.zeros == 0):
        return None
    return _first(marks.magnitude_crossings(abs(path.final_value()) / np.sqrt(2), falling_only=True))


def _first(found: list[float]) -> float | None:
    return found[0] if found else None
