"""What one log told, tried on others."""

from dataclasses import replace

import pytest

from chladni.gap.diagnosis.causes import causes_of
from chladni.gap.diagnosis.other_logs import tried_elsewhere
from chladni.gap.diagnosis.study import study_of
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.made_log import band_noise, chain, measured


def machine():
    return chain([2.0, 1.5], [5e4, 6e4], [12.0, 9.0])


def hardening():
    return machine().with_effects((attached("hardening_stiffness", "j1", {"cubic": 3e9}),))


@pytest.fixture(scope="module")
def answer():
    """A spring that gets stiffer, and nothing else to name."""
    log, _ = measured(hardening(), band_noise(1500), seed=7)
    study = study_of(machine(), log, leave_out=frozenset(CATALOGUE) - {"hardening_stiffness"}, own={})
    return study, causes_of(study, [].append)


def test_another_log_closes_and_one_on_which_the_model_diverges_is_told(answer):
    study, causes = answer
    assert causes.verdict == "effect"
    log, _ = measured(hardening(), band_noise(1500, seed=3), seed=8)
    # Far beyond anything that a hammer does.
    loud = replace(log, log="absurd.mcap", inputs=1e12 * log.inputs)
    (closing,), (sentence,) = tried_elsewhere(study, causes, [log, loud], seed=0)
    assert closing.closed > 0.95
    assert sentence.startswith("absurd.mcap: the model diverges there")


def test_a_floor_that_shakes_says_nothing_of_other_logs(answer):
    study, causes = answer
    assert tried_elsewhere(study, replace(causes, shaken=object()), [study.measurement], seed=0) == ((), ())
