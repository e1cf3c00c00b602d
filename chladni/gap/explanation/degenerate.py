"""Effects that a fit drove to where they are something else: a yield that is never reached is a spring."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.errors import ModelError

Matrix = NDArray[np.float64]


def is_degenerate(run: FreeRun, found: Contestant) -> bool:
    """Whether an effect of a fitted hypothesis does what a parameter or another effect does."""
    return any(_degenerate(run, found, effect) for effect in found.fit.effects)


def _degenerate(run: FreeRun, found: Contestant, effect: AttachedEffect) -> bool:
    values = effect.values
    if effect.effect == "varying_stiffness":
        share = values["time"] / run.measurement.duration_s
        # A change that is over at once, or never comes, is a stiffness.
        return not (0.02 < share < 0.98 if effect.variant == "step" else share > 0.1)
    if effect.effect in (
        "hysteresis",
        "coulomb_friction",
        "stribeck_friction",
        "backlash",
        "one_sided_stop",
        "ripple",
    ):
        motion = _displacement(run, found, effect)
        return motion is None or _never_seen(effect.effect, values, motion)
    return False


def _never_seen(word: str, values: Mapping[str, float], d: Matrix) -> bool:
    reach = float(np.max(np.abs(d)))
    if word == "hysteresis":
        return values["yield"] > 2.0 * reach
    if word in ("coulomb_friction", "stribeck_friction"):
        return values.get("presliding", 0.0) > 0.5 * reach
    if word == "backlash":
        return values["gap"] > 2.0 * reach
    if word == "one_sided_stop":
        touching = float(np.mean(values["side"] * d > values["clearance"]))
        return not 1e-4 < touching < 0.7
    # Fewer than two periods of a ripple are a spring that bends.
    return 2.0 * values["period"] > float(np.ptp(d)) if word == "ripple" else False


def _displacement(run: FreeRun, found: Contestant, effect: AttachedEffect) -> Matrix | None:
    """Displacement that the effect's law saw, over the whole log; None when the run diverges."""
    compiled = run.compiled(found.fit.z, found.fit.effects)
    try:
        runs = run.integrations(found.fit.z, found.fit.effects, found.fit.initial)
    except ModelError:
        return None
    for port in runs[0][1].ports:
        if compiled.ports[port].name == effect.site:
            row = runs[0][1].ports.index(port)
            return np.concatenate([integration.displacement[row] for _, integration in runs])
    return None
