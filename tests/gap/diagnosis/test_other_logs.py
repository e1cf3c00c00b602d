"""What one log told, tried on others."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from chladni.gap.diagnosis.other_logs import tried_elsewhere
from chladni.gap.diagnosis.study import study_of
from chladni.gap.diagnosis.verdict import causes_found
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, band_noise, chain, measured


def machine():
    return chain([2.0, 1.5], [5e4, 6e4], [12.0, 9.0])


def hardening():
    return machine().with_effects((attached("hardening_stiffness", "j1", {"cubic": 3e9}),))


@pytest.fixture(scope="module")
def answer():
    """A spring that gets stiffer, and nothing else to name."""
    log, _ = measured(hardening(), band_noise(1500), seed=7)
    study = study_of(machine(), log, leave_out=frozenset(CATALOGUE) - {"hardening_stiffness"}, own={})
    return causes_found(study, [].append)


@pytest.mark.nightly
@pytest.mark.slow
def test_another_log_closes_and_one_on_which_the_model_diverges_is_told(answer):
    study, causes = answer
    assert causes.verdict == "effect"
    log, _ = measured(hardening(), band_noise(1500, seed=3), seed=8)
    # Far beyond anything that a hammer does.
    loud = replace(log, log="absurd.mcap", inputs=1e12 * log.inputs)
    (closing,), (sentence,) = tried_elsewhere(study, causes, [log, loud], seed=0)
    assert closing.closed > 0.95
    assert sentence.startswith("absurd.mcap: the model diverges there")


@pytest.mark.nightly
def test_a_floor_that_shakes_says_nothing_of_other_logs(answer):
    study, causes = answer
    assert tried_elsewhere(study, replace(causes, shaken=object()), [study.measurement], seed=0) == ((), ())


def axis():
    """A carriage on a guide, its position the only output."""
    free = chain([95.0], [0.0], [200.0])
    return replace(free, outputs=(StructureOutput(name="position", measures="displacement", at="b0"),))


def pushed(seed: int, count: int):
    """Slow pushes; the same again and again where there's more than one."""
    rng = np.random.default_rng(seed)
    slow = sosfiltfilt(butter(2, 3.0, fs=RATE_HZ, output="sos"), rng.standard_normal((1, 4096)))
    return np.tile(80.0 * slow / slow.std(), count)


@pytest.mark.nightly
def test_a_log_without_periods_is_begun_by_what_its_quiet_band_tells():
    rubbing = axis().with_effects((attached("coulomb_friction", "j0", {"force": 30.0}),))
    first, _ = measured(rubbing, pushed(1, 4), noise=1e-5, seed=7)
    study = study_of(axis(), first, leave_out=frozenset(CATALOGUE) - {"coulomb_friction"}, own={})
    study, causes = causes_found(study, [].append)
    assert causes.verdict == "effect"
    assert study.windows is not None
    second, _ = measured(rubbing, pushed(2, 1), noise=1e-5, seed=8)
    (closing,), _ = tried_elsewhere(study, causes, [second], seed=0)
    # With the residual of a fit for noise the states that windows begin in would be anyone's guess.
    assert closing.noise < 1e-3
    assert closing.after < 0.2 * closing.before
