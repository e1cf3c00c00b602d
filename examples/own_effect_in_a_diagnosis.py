"""An effect of one's own takes part in a diagnosis: drag in the elbow that grows with the cube of the speed.

One file holds all of it: the law, the record, and the call. Nothing has to be registered.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

import chladni
from chladni import EFFECTS, EffectKind, LawAtPort, Multisine, Parameter, Parameters, Port, Variant, arm_model

SECONDS, RATE_HZ, NOISE = 6.0, 1000.0, 0.01
COEFFICIENT = 200.0
#: Words of the catalogue that are weighed beside it; without `leave_out` all are, which takes a minute.
WEIGHED = {"coulomb_friction", "quadratic_damping", "hardening_stiffness", "saturation", "gain_error"}


def cubic_drag(_d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``coefficient s^3``."""
    return float(parameters[0] * s * s * s)


def _numbers(values: Mapping[str, float], _port: Port) -> tuple[float, ...]:
    return (values["coefficient"],)


CUBIC_DRAG = EffectKind(
    name="cubic_drag",
    family="damping",
    meaning="drag that grows with the cube of the speed",
    sites=("joint",),
    parameters=Parameters(
        (Parameter(name="coefficient", value=100.0, unit="N s^3/m^3", low=0.0, high=1e4, minimum=0.0, maximum=1e15),)
    ),
    neutral={"coefficient": 0.0},
    variants=(
        Variant(
            name="cubic",
            attach=LawAtPort(law=cubic_drag, numbers=_numbers),
            formula="F = coefficient s^3",
            odd=True,
        ),
    ),
)


def log_of_the_machine() -> chladni.TimeSeries:
    """Simulate the arm with the drag, and let noise fall on its sensors."""
    machine = arm_model().with_effects([chladni.attached(CUBIC_DRAG, "elbow", {"coefficient": COEFFICIENT})])
    push = Multisine(rms=150.0, period_s=3.0, band_hz=(5.0, 120.0))
    run = chladni.simulate(machine, push, duration_s=SECONDS, sample_rate_hz=RATE_HZ, seed=2)
    rng = np.random.default_rng(3)
    measured = run.outputs.values
    noise = NOISE * measured.std(axis=1, keepdims=True) * rng.normal(size=measured.shape)
    return replace(
        run.outputs,
        values=np.vstack([run.inputs.values, measured + noise]),
        channels=run.inputs.channels + run.outputs.channels,
    )


def main() -> None:
    """Diagnose with and without the effect of one's own."""
    log = log_of_the_machine()
    for title, own in (("without it", ()), ("with cubic_drag", (CUBIC_DRAG,))):
        found = chladni.diagnose_gap(arm_model(), log, own_effects=own, leave_out=EFFECTS.keys() - WEIGHED)
        print(f"{title}: {found.verdict}")
        for sentence in found.summary():
            print(f"  {sentence}")
    print(f"truth: cubic_drag of {COEFFICIENT:g} N s^3/m^3 at elbow")


if __name__ == "__main__":
    main()
