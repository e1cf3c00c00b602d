"""Whether a log is long enough for an answer to mean anything."""

import numpy as np

from chladni.gap.calibration import EFFECTIVE_SAMPLES, TIMES, UNNOTICED, USUAL_S
from chladni.gap.records.measurement import Measurement
from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Complex, Real


def shortness(compiled: CompiledModel, measurement: Measurement) -> str | None:
    """Say how a log is too short for any name to be sure, None when it isn't.

    What lasts less than the model's own motion looks like a start, a trend, a gain: many causes make the same few
    samples, and each follows them down to the noise.
    """
    duration_s, found = measurement.duration_s, []
    if measurement.samples < EFFECTIVE_SAMPLES:
        found.append(f"{measurement.samples} samples, where {EFFECTIVE_SAMPLES} or more tell more")
    modes_hz, shown_s = modes_of(compiled), _shown_s(compiled)
    if duration_s < shown_s and modes_hz.size:
        cycles = f"{duration_s * modes_hz.min():.2g} cycles of the lowest mode ({modes_hz.min():.3g} Hz)"
        found.append(f"{duration_s:.3g} s hold {cycles}, where {TIMES:g} or more tell more")
    elif duration_s < shown_s:
        found.append(f"{duration_s:.3g} s, where the model shows what it does of itself in {shown_s:.2g} s")
    if not found:
        return None
    return (
        f"{measurement.log} is short: {'; '.join(found)}; many causes follow so few samples; take a longer part, "
        "or record longer"
    )


def modes_of(compiled: CompiledModel) -> Real:
    """Natural frequencies of the model's vibrating modes in Hz, one for each pair of poles."""
    poles = _poles(compiled)
    vibrating = poles.imag > UNNOTICED * float(np.abs(poles).max(initial=0.0))
    return np.asarray(np.abs(poles[vibrating]) / (2 * np.pi))


def _shown_s(compiled: CompiledModel) -> float:
    """Seconds in which a model shows what it does of itself; 0 when nothing in it moves by itself."""
    poles, modes_hz = _poles(compiled), modes_of(compiled)
    if not poles.size:
        return 0.0
    if modes_hz.size:
        return TIMES / float(modes_hz.min())
    rates = np.abs(poles)
    slowest = float(rates[rates > UNNOTICED * rates.max()].min(initial=np.inf))
    return min(USUAL_S, TIMES / slowest) if np.isfinite(slowest) else USUAL_S


def _poles(compiled: CompiledModel) -> Complex:
    return np.asarray(np.linalg.eigvals(compiled.a) if compiled.states else [], dtype=np.complex128)
