"""Noise as the quiet band tells it, where a law promises to explain what was taken for noise."""

from dataclasses import replace

import numpy as np

from chladni.gap.comparison.noise_estimate import chosen_floor
from chladni.gap.comparison.quiet_floor import quiet_floor
from chladni.gap.diagnosis.causes import Causes
from chladni.gap.diagnosis.finer_floor import LOWER
from chladni.gap.diagnosis.pairs import promises_another
from chladni.gap.diagnosis.search import ALONE
from chladni.gap.diagnosis.study import Study, over_floor


def quieter_study(study: Study, causes: Causes) -> Study | None:
    """Give the study over the quiet band's noise behind a single effect; None unless a law promises to explain more.

    Of two sensors nothing tells which distortion they share, and it stays in the floor behind the first effect too.
    Then noise is between that floor and what quiet lines say, which is too little where noise is coloured. Such noise
    follows no law, though: where one at another place, screened over the lower floor, promises to explain much of
    what is left, it's worth another round.
    """
    measurement, noise, best = study.measurement, study.contest.noise, causes.best
    effects = len(best.hypothesis.effects)
    if len(measurement.output_names) < 2 or effects != 1 or causes.instead is not None or causes.shaken is not None:
        return None
    left = measurement.outputs - best.fit.outputs
    quiet = quiet_floor(replace(measurement, outputs=left))
    more = np.mean(left**2, axis=1) > ALONE * quiet.rms**2
    lower = noise.upper_bound & (quiet.rms < LOWER * noise.rms) & more
    if not lower.any():
        return None
    over = over_floor(study, chosen_floor(lower, noise, quiet))
    held = best.held * (noise.rms / over.contest.noise.rms) ** 2
    return over if promises_another(over, replace(best, held=held)) else None
