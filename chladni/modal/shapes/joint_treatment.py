"""What a damper or a spring between two neighbours would do to a mode, and which joint to treat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.modal.shapes.mode_words import capital, mode_name
from chladni.modal.shapes.relative_motion import kilogram_scale
from chladni.signals.engineering import engineering
from chladni.signals.mode_set import ModeSet
from chladni.signals.relative_motion import RelativeMotion

# A joint that hardly moves can't be treated: its relative motion is lost in its own error bar.
_SIGNIFICANT = 2.0
# A change that a designer would notice, small enough for the linear law.
_FREQUENCY_STEP = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTreatment:
    """The effect of treating one joint on one mode, to first order.

    Attributes
    ----------
    mode
        Row of the mode.
    between
        The two points (channels where the log knows no points).
    ratio, ratio_std
        Relative motion over the largest motion of the mode, and one sigma of it.
    damping_gain, damping_gain_std
        Added damping ratio per N s/m, and one sigma of it from those of shape and modal mass; None when unscaled.
    stiffness_gain_hz
        Added natural frequency per N/m; None when unscaled.
    damper
        N s/m that would double the damping of the mode; None when unscaled.
    spring
        N/m that would raise its natural frequency by a tenth; None when unscaled.
    sentence
        The same in words.
    """

    mode: int
    between: tuple[str, str]
    ratio: float
    ratio_std: float | None
    damping_gain: float | None
    damping_gain_std: float | None
    stiffness_gain_hz: float | None
    damper: float | None
    spring: float | None
    sentence: str


def treatments(modes: ModeSet, motions: Sequence[RelativeMotion]) -> tuple[JointTreatment, ...]:
    """Name for each mode the joint where a damper or a spring does most, by rising frequency.

    Parameters
    ----------
    motions
        Relative motion of the same modes; see `chladni.modal.shapes.relative_motion.relative_motion`.

    Returns
    -------
    One for each mode in which some joint moves by more than twice its own error bar.

    Notes
    -----
    A damper c between two points adds delta zeta = c (delta phi)^2/(2 omega), a spring k delta omega =
    k (delta phi)^2/(2 omega), with shapes of unit modal mass: the first-order change of an eigenvalue (Fox & Kapoor
    1968, AIAA Journal 6(12)); for complex modes see `relative_motion`. Both grow with the square of the relative
    motion, so that the joint that moves most is the one to treat. The linear law holds while the change stays small
    against the value itself; a damper that is far larger locks the joint instead of damping it.
    """
    best: dict[int, RelativeMotion] = {}
    for motion in motions:
        if motion.ratio is None or motion.ratio <= _SIGNIFICANT * (motion.ratio_std or 0.0):
            continue
        leader = best.get(motion.mode)
        if leader is None or leader.ratio is None or motion.ratio > leader.ratio:
            best[motion.mode] = motion
    return tuple(_treatment(modes, best[mode]) for mode in sorted(best))


def best_joint(
    modes: ModeSet, motions: Sequence[RelativeMotion], *, mode: int | None = None
) -> JointTreatment | None:
    """Name the one joint to treat.

    Parameters
    ----------
    mode
        Row of the mode to calm; None takes the mode with the least damping, whose resonance is the sharpest.

    Returns
    -------
    JointTreatment or None
        None when no joint moves by more than its error bar in that mode, or in any.
    """
    candidates = [one for one in treatments(modes, motions) if mode in (None, one.mode)]
    return min(candidates, key=lambda one: float(modes.damping_ratio[one.mode]), default=None)


def _treatment(modes: ModeSet, motion: RelativeMotion) -> JointTreatment:
    ratio = 0.0 if motion.ratio is None else motion.ratio
    gain, stiffness_gain = motion.damping_gain, motion.stiffness_gain_hz
    damper = spring = None
    # A joint that doesn't move has no gain, and in a complex mode one can be negative: no damper is large enough.
    if gain is not None and stiffness_gain is not None and gain > 0 and stiffness_gain > 0:
        damper = max(float(modes.damping_ratio[motion.mode]), 0.0) / gain
        spring = _FREQUENCY_STEP * float(modes.frequency_hz[motion.mode]) / stiffness_gain
    return JointTreatment(
        mode=motion.mode,
        between=motion.between,
        ratio=ratio,
        ratio_std=motion.ratio_std,
        damping_gain=gain,
        damping_gain_std=_gain_std(modes, motion, ratio),
        stiffness_gain_hz=stiffness_gain,
        damper=damper,
        spring=spring,
        sentence=_sentence(modes, motion, ratio, damper, spring),
    )


def _gain_std(modes: ModeSet, motion: RelativeMotion, ratio: float) -> float | None:
    """The gain goes with the square of the ratio over the modal mass, whose relative errors add as independent."""
    if motion.damping_gain is None or motion.ratio_std is None or modes.scale is None:
        return None
    mass = float(kilogram_scale(modes)[motion.mode])
    relative = np.hypot(2 * motion.ratio_std / ratio, float(modes.scale.modal_mass_std[motion.mode]) / mass)
    return float(abs(motion.damping_gain) * relative) if np.isfinite(relative) else None


def _sentence(
    modes: ModeSet, motion: RelativeMotion, ratio: float, damper: float | None, spring: float | None
) -> str:
    error = "" if motion.ratio_std is None else f" ± {motion.ratio_std:.2g}"
    start = (
        f"{capital(mode_name(modes, motion.mode))}: {motion.between[0]} and {motion.between[1]} move most against "
        f"each other ({ratio:.2f}{error} of the largest motion)"
    )
    if damper is None or spring is None:
        return (
            f"{start}; treat that joint first. By how much a damper or a spring helps there takes scaled modes: "
            "measure a driving point, force in N and motion at the same point and direction."
        )
    frequency_hz, damping = float(modes.frequency_hz[motion.mode]), float(modes.damping_ratio[motion.mode])
    return (
        f"{start}; a damper of {engineering(damper, None, 'N s/m')} between the two would double the damping of "
        f"{100 * damping:.2g} % and a spring of {engineering(spring, None, 'N/m')} raise the frequency by "
        f"{_FREQUENCY_STEP * frequency_hz:.2g} Hz, to first order."
    )
