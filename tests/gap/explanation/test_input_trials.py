"""The screen at an input: what an actuator did to its command."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.hypotheses import effect_hypotheses
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from tests.gap.made_log import WORDS, band_noise, measured, three_bodies


@pytest.mark.nightly
@pytest.mark.parametrize(
    "words",
    [
        [one for one in WORDS if one.name in ("saturation", "gain_error", "delay")],
        pytest.param(WORDS, marks=pytest.mark.nightly),
    ],
    ids=["few", "catalogue"],
)
def test_a_limit_whose_knee_is_neither_sharp_nor_a_tanh_is_a_rounded_saturation(words):
    model, command, limit = three_bodies(), band_noise(3000), 90.0
    # Rapp's law of amplifiers (1991), whose knee lies between those of a clip and of a tanh.
    acts = command / (1.0 + np.abs(command / limit) ** 5) ** (1 / 5)
    log, floor = measured(model, acts, noise=0.005)
    log = replace(log, inputs=command)
    location = locate(model, log, floor, Tunables.of(model))
    forms = [one for one in screened(location, location.ranked, words) if one.trial.site.name == "hammer"]
    best = forms[0]
    assert (best.trial.effect, best.trial.form.variant) == ("saturation", "rounded")
    assert best.values["limit"] == pytest.approx(limit, rel=0.05)
    # Its law isn't ours, but leaves a tenth of what either of the others does.
    others = [one.chi for one in forms if one.trial.effect == "saturation" and one.trial.form.variant != "rounded"]
    assert len(others) == 2
    assert best.chi < 0.1 * min(others)
    (first, *_) = effect_hypotheses(forms, count=1)
    assert first.effects[0].values.keys() == {"limit", "knee"}
    assert "knee" in first.fitted[0]
