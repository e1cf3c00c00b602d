"""Charts of analyses, ready to draw: time, Bode, Nyquist, roots."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.analysis.frequency_curve import FrequencyCurve
from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.precision_stability import PrecisionStability
from chladni.models.analysis.root_locus import RootLocus
from chladni.models.analysis.step_response import TransientResponse
from chladni.models.core.port import Terminal
from chladni.models.core.reading import Chart, Curve
from chladni.signals.arrays import Complex, Real

NOW = "now"
# A Nyquist plot of an integrator goes to infinity: beyond this many times its size at its first corner it is cut.
NYQUIST_REACH = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """Analyses of one setting, under the label that its curves carry."""

    label: str
    step: TransientResponse
    curve: FrequencyCurve
    path: LinearPath


def response_chart(name: str, title: str, responses: Sequence[tuple[str, TransientResponse]], output: str) -> Chart:
    """One output of several labelled responses; each setting is a curve."""
    terminal = next(terminal for terminal in responses[0][1].outputs if terminal.name == output)
    return Chart(
        name=name, title=title, x_label="time [s]", y_label=_axis(terminal), curves=_time_curves(responses, output)
    )


def magnitude_chart(title: str, shown: Sequence[Shown]) -> Chart:
    """Magnitude against frequency."""
    path = shown[0].path
    unit = _ratio(path.outputs[0].unit, path.source.unit)
    return Chart(
        name="bode.magnitude",
        title=title,
        x_label="frequency [Hz]",
        y_label="magnitude [dB]" if unit == "1" else f"magnitude [dB re 1 {unit}]",
        curves=tuple(_curve(one.label, one.curve.frequency_hz, _finite(one.curve.magnitude_db())) for one in shown),
        x_scale="log",
    )


def phase_chart(title: str, shown: Sequence[Shown]) -> Chart:
    """Phase against frequency."""
    return Chart(
        name="bode.phase",
        title=title,
        x_label="frequency [Hz]",
        y_label="phase [deg]",
        curves=tuple(_curve(one.label, one.curve.frequency_hz, one.curve.phase_deg) for one in shown),
        x_scale="log",
    )


def nyquist_chart(title: str, shown: Sequence[Shown]) -> Chart:
    """Locus of the frequency response in the complex plane, for positive frequencies, and -1 where it's near."""
    path = shown[0].path
    unit = _ratio(path.outputs[0].unit, path.source.unit)
    curves = []
    for one in shown:
        response = one.curve.response.copy()
        if one.path.integrators():
            reach = NYQUIST_REACH * float(np.median(np.abs(response)))
            response[np.abs(response) > reach] = np.nan
        curves.append(_curve(one.label, response.real, response.imag))
    # Beside a compliance of micrometres a newton the point would leave a dot of the curve, and say nothing.
    if max(float(np.nanmax(np.hypot(curve.x, curve.y), initial=0.0)) for curve in curves) > 1 / NYQUIST_REACH:
        curves.append(Curve(label="-1", x=np.array([-1.0]), y=np.zeros(1), points=True))
    return Chart(
        name="nyquist",
        title=title,
        x_label=with_unit("real part", unit),
        y_label=with_unit("imaginary part", unit),
        curves=tuple(curves),
        equal=True,
    )


def pole_chart(title: str, shown: Sequence[Shown]) -> Chart:
    """Poles and zeros in the complex plane."""
    curves = []
    for one in shown:
        curves.append(_points(f"poles {one.label}" if len(shown) > 1 else "poles", one.path.poles))
        if one.curve.zeros.size:
            curves.append(_points(f"zeros {one.label}" if len(shown) > 1 else "zeros", one.curve.zeros))
    return Chart(
        name="poles",
        title=title,
        x_label="real part [rad/s]",
        y_label="imaginary part [rad/s]",
        curves=tuple(curves),
    )


def locus_chart(title: str, locus: RootLocus) -> Chart:
    """Branches of a root locus, with where they begin and end."""
    marks = [(label, roots) for label, roots in (("poles", locus.start), ("zeros", locus.end)) if roots.size]
    return Chart(
        name="root-locus",
        title=title,
        x_label="real part [rad/s]",
        y_label="imaginary part [rad/s]",
        curves=(
            *(_curve(f"root {place + 1}", branch.real, branch.imag) for place, branch in enumerate(locus.roots)),
            *(_points(label, roots) for label, roots in marks),
        ),
    )


def precision_chart(title: str, field: PrecisionStability) -> Chart:
    """Real part of each root against the error that stays."""
    errors = {
        "step": "share of a step that is not followed",
        "ramp": "lag behind a ramp [s]",
        "parabola": "lag behind a parabola [s^2]",
    }
    return Chart(
        name="precision-stability",
        title=title,
        x_label=errors[field.follows],
        y_label="real part of the roots [1/s]",
        curves=tuple(
            _curve(f"root {place + 1}", field.error, branch.real) for place, branch in enumerate(field.roots)
        ),
        x_scale="log",
    )


def _time_curves(responses: Sequence[tuple[str, TransientResponse]], output: str) -> tuple[Curve, ...]:
    curves = []
    for label, response in responses:
        row = [terminal.name for terminal in response.outputs].index(output)
        curves.append(_curve(label, response.time_s[row], response.values[row]))
    return tuple(curves)


def _curve(label: str, x: Real, y: Real) -> Curve:
    return Curve(label=label, x=np.asarray(x, dtype=np.float64), y=np.asarray(y, dtype=np.float64))


def _points(label: str, roots: Complex) -> Curve:
    return Curve(label=label, x=roots.real.copy(), y=roots.imag.copy(), points=True)


def _finite(values: Real) -> Real:
    # A magnitude of zero has no level; a line with an infinite point isn't drawn at all.
    return np.where(np.isfinite(values), values, np.nan)


def with_unit(words: str, unit: str) -> str:
    """Give the label of an axis; a plain number has no unit to tell.

    Examples
    --------
    >>> with_unit("velocity", "m/s"), with_unit("gain", "1")
    ('velocity [m/s]', 'gain')
    """
    return words if unit == "1" else f"{words} [{unit}]"


def _axis(terminal: Terminal) -> str:
    return with_unit(terminal.name.replace("_", " "), terminal.unit)


def _ratio(over: str, under: str) -> str:
    if over == under:
        return "1"
    if under == "1":
        return over
    # Brackets only where a unit is itself a quotient or a product.
    top, bottom = (unit if unit.isalnum() else f"({unit})" for unit in (over, under))
    return f"{top}/{bottom}"
