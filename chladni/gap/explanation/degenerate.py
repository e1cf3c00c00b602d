"""Effects that a fit drove to where they are something else: a yield that is never reached is a spring."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.body_trials import STIFF_MOUNT
from chladni.gap.explanation.excited_band import excited_band_hz
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.explanation.joint_trials import share_risen
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.errors import ModelError

Matrix = NDArray[np.float64]
#: Of the usual way and pace of a joint: a yield below is friction's presliding, a presliding above a hysteresis loop.
_FRICTION, _LOOP = 0.12, 0.3
#: Damping ratio from which an attached mass is no oscillator: critical damping is 1, and fits aren't exact.
_DASHPOT = 2.0
#: Standard deviation over reach of a jump that is at 2 % of a log; instants at which a change is looked at.
_JUMP, _INSTANTS = 0.14, 1000


def is_degenerate(run: FreeRun, found: Contestant) -> bool:
    """Whether an effect of a fitted hypothesis does what a parameter or another effect does."""
    return any(_degenerate(run, found, effect) for effect in found.fit.effects)


def _degenerate(run: FreeRun, found: Contestant, effect: AttachedEffect) -> bool:
    values = effect.values
    if effect.effect == "varying_stiffness":
        return not _changes(effect.variant, values, run.measurement.duration_s)
    if effect.effect == "extra_mode":
        # Resonant well above all that moved, it's a mass; one that doesn't swing once is a spring to where it stands;
        # one that is damped far too much to swing is a mass that a dashpot carries.
        band_hz = excited_band_hz(run.measurement)[1]
        swings = values["damping_ratio"] < _DASHPOT
        return not (swings and 1.0 / run.measurement.duration_s < values["frequency"] < STIFF_MOUNT * band_hz)
    if effect.effect in (
        "hysteresis",
        "coulomb_friction",
        "stribeck_friction",
        "backlash",
        "one_sided_stop",
        "ripple",
    ):
        motion = _motion(run, found, effect)
        return motion is None or _never_seen(effect.effect, values, *motion)
    return False


def _changes(variant: str, values: Mapping[str, float], duration_s: float) -> bool:
    """Whether a log sees a stiffness change: what is over at once, or never comes, is a stiffness."""
    if variant != "step":
        return values["time"] > 0.1 * duration_s
    # A slow one may be seen though its middle lies outside of the log.
    share = share_risen(np.linspace(0.0, duration_s, _INSTANTS), values["time"], values["rise"])
    return float(np.std(share)) > _JUMP * float(np.ptp(share))


def _never_seen(word: str, values: Mapping[str, float], d: Matrix, s: Matrix) -> bool:
    reach = float(np.max(np.abs(d)))
    usual, pace = float(np.std(d)), float(np.sqrt(np.mean(s**2)))
    if word == "stribeck_friction" and _is_coulomb(values, s):
        return True
    if word == "hysteresis":
        # A loop that has closed after a small part of the way is friction, one that never yields a spring.
        stiff = values["yield"] < _FRICTION * usual and values.get("slip_speed", 0.0) < _FRICTION * pace
        return stiff or values["yield"] > 2.0 * reach
    if word in ("coulomb_friction", "stribeck_friction"):
        return values.get("presliding", 0.0) > _LOOP * usual
    if word == "backlash":
        return values["gap"] > 2.0 * reach
    if word == "one_sided_stop":
        touching = float(np.mean(values["side"] * d > values["clearance"]))
        return not 1e-4 < touching < 0.7
    # Fewer than two periods of a ripple are a spring that bends.
    return 2.0 * values["period"] > float(np.ptp(d)) if word == "ripple" else False


def _is_coulomb(values: Mapping[str, float], s: Matrix) -> bool:
    """Whether the drop from static to sliding friction is hardly there, or over before anything slides."""
    speed = float(np.sqrt(np.mean(s**2)))
    return values["static"] < 1.05 * values["coulomb"] or not 0.01 * speed < values["speed"] < 5.0 * speed


def _motion(run: FreeRun, found: Contestant, effect: AttachedEffect) -> tuple[Matrix, Matrix] | None:
    """Displacement and velocity that the effect's law saw, over the whole log; None when the run diverges."""
    compiled = run.compiled(found.fit.z, found.fit.effects)
    try:
        runs = run.integrations(found.fit.z, found.fit.effects, found.fit.initial)
    except ModelError:
        return None
    for row, port in enumerate(runs[0][1].ports):
        if compiled.ports[port].name == effect.site:
            displacement = np.concatenate([integration.displacement[row] for _, integration in runs])
            velocity = np.concatenate([integration.velocity[row] for _, integration in runs])
            return displacement, velocity
    return None
