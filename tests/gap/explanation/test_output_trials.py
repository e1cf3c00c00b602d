"""The screen at an output: what a sensor did to its signal."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.hypotheses import effect_hypotheses
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from tests.gap.made_log import WORDS, band_noise, measured, three_bodies


@pytest.mark.nightly
def test_a_range_whose_end_is_round_is_told_though_the_floor_took_it_for_noise():
    model = three_bodies()
    log, floor = measured(model, band_noise(4000), outputs=[0, 2], noise=0.005)
    ends = 1.2 * float(np.std(log.outputs[0]))
    # Rapp's law of amplifiers (1991); the screen's own bends otherwise.
    clipped = log.outputs[0] / (1.0 + np.abs(log.outputs[0] / ends) ** 12) ** (1 / 12)
    lost = float(np.std(log.outputs[0] - clipped))
    log = replace(log, outputs=np.stack([clipped, log.outputs[1]]))
    # What nobody can predict with a line counts as noise, as long as nothing else is known.
    thought = floor.raised(np.array([lost, 0.0]))
    location = locate(model, log, thought, Tunables.of(model))
    forms = screened(location, location.ranked, WORDS)
    best = forms[0]
    assert (best.trial.effect, best.trial.form.variant, best.trial.site.name) == ("clipping", "rounded", "a0")
    assert best.values["limit"] == pytest.approx(ends, rel=0.05)
    others = {one.trial.form.variant: one.misfit for one in forms if one.trial.effect == "clipping"}
    assert best.misfit < others[None]
    # It explains nearly all of that noise: a line and a Gaussian floor leave as much as there was.
    assert best.chi < 0.6 * location.tuned.chi
    (first, *_) = effect_hypotheses(forms, count=1)
    assert first.effects[0].values.keys() == {"limit", "knee"}
    assert "knee" in first.fitted[0]
