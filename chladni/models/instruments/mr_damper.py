"""The instrument of the magnetorheological damper: its loops over current (figure 8)."""

from collections.abc import Mapping
from math import ceil, pi

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument
from chladni.models.core.model import Model
from chladni.models.core.reading import Chart, Curve
from chladni.models.drives.drive_model import DriveModel
from chladni.models.drives.mr_damper import MR_DAMPER
from chladni.models.drives.mr_shipped import MEASURED_STROKE_M
from chladni.models.instruments.drive_pages import drive_at
from chladni.signals.arrays import Real

#: Currents whose loops are laid beside that of the knob, A.
_BESIDE = (0.0, 0.25, 0.5, 0.75, 1.0)
# After one period from rest the loop has closed to a hundredth of its height.
_PERIODS, _SAMPLES = 2, 200
#: Steps a sample up to the measured stroke; the law is the stiffer the further the rod goes in one.
_STEPS, _MOST_STEPS = 4, 400


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> DriveModel:
    return drive_at(MR_DAMPER, values, options)


def loop_charts(model: Model) -> tuple[Chart, ...]:
    """Loops of the second period of a sinus from rest, and what they dissipate, over current.

    The equivalent damping is that of the viscous damper which dissipates as much:
    ``c = W/(pi omega X^2)`` for the energy W of a period (Inman, Engineering Vibration, section 2.7).
    """
    numbers = model.parameters.numbers()
    currents = sorted({*_BESIDE, numbers["current"]})
    amplitude, omega = numbers["stroke"], 2.0 * pi * numbers["frequency"]
    loops = {
        current: _loop(model.with_values({"current": current}).compile(), amplitude, omega) for current in currents
    }
    labels = {current: f"{current:g} A" + (" (now)" if current == numbers["current"] else "") for current in currents}
    displacement = tuple(Curve(label=labels[i], x=1e3 * x, y=f) for i, (x, _, f) in loops.items())
    velocity = tuple(Curve(label=labels[i], x=v, y=f) for i, (_, v, f) in loops.items())
    # The loop closes on itself, so the trapezoidal rule goes once around it.
    energy = np.array([np.trapezoid(f, x) for x, _, f in loops.values()])
    damping = Curve(label="equivalent damping", x=np.array(currents), y=energy / (pi * omega * amplitude**2))
    return (
        Chart(
            name="loop.displacement", title="Force over displacement", x_label="displacement [mm]",
            y_label="force [N]", curves=displacement,
        ),
        Chart(
            name="loop.velocity", title="Force over velocity", x_label="velocity [m/s]", y_label="force [N]",
            curves=velocity,
        ),
        Chart(
            name="equivalent-damping", title="Viscous damper that dissipates as much", x_label="current [A]",
            y_label="damping [N s/m]", curves=(damping,),
        ),
    )  # fmt: skip


def _loop(compiled: CompiledModel, amplitude: float, omega: float) -> tuple[Real, Real, Real]:
    """Displacement, velocity and force of one closed period; of every law at the joint."""
    # numba takes a moment to import; a page that shows no loop doesn't need it.
    from chladni.models.integrator.known_motion import force_along_motion

    times_s = np.linspace(0.0, _PERIODS * 2.0 * pi / omega, _PERIODS * _SAMPLES + 1)
    x, v = amplitude * np.sin(omega * times_s), amplitude * omega * np.cos(omega * times_s)
    steps = min(_MOST_STEPS, ceil(_STEPS * max(1.0, amplitude / MEASURED_STROKE_M)))
    force = np.sum([force_along_motion(law, x, v, times_s, substeps=steps) for law in compiled.laws], axis=0)
    last = slice(-_SAMPLES - 1, None)
    return x[last], v[last], force[last]


INSTRUMENT = Instrument(
    name=MR_DAMPER.name,
    title=MR_DAMPER.title,
    parameters=MR_DAMPER.parameters,
    build=_build,
    options=MR_DAMPER.options,
    # A step of a prescribed displacement has no finite velocity; the size is that of other excitations.
    step_size=MEASURED_STROKE_M / 2,
    extra_charts=loop_charts,
    views=(),
)
