"""Effects that a fit drove to where they are something else: a yield that is never reached is a spring."""

from chladni.gap.explanation.excited_band import excited_band_hz
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.clues import FittedForm
from chladni.signals.errors import ModelError


def is_degenerate(run: FreeRun, found: Contestant) -> bool:
    """Whether an effect of a fitted hypothesis does what a parameter or another effect does."""
    return any(is_another(run, found, effect) for effect in found.fit.effects)


def is_another(run: FreeRun, found: Contestant, effect: AttachedEffect) -> bool:
    """Whether one effect of a fit does what a parameter or another effect does."""
    judge = effect.kind.clues.is_degenerate
    if judge is None:
        return False
    fitted = FittedForm(
        variant=effect.variant,
        values=effect.values,
        duration_s=run.measurement.duration_s,
        band_hz=excited_band_hz(run.measurement),
        motion=lambda: run.law_motion(found.fit.z, found.fit.effects, found.fit.initial, site=effect.site),
    )
    try:
        return judge(fitted)
    except ModelError:
        # A run that diverges shows no law at work.
        return True
