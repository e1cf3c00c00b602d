"""Linear effects are found beside the parameters, which move resonances as they do."""

import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.linear_words import fitted_beside, linear_beside, linear_elsewhere, linear_hypotheses
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from tests.gap.arm import all_but, arm, measured, with_outputs
from tests.gap.made_log import WORDS

#: As heavy as what they sit on, and more: resonances move far.
LOADS = [
    ("added_mass", "wrist", {"mass": 4.0}, ("acc_column", "acc_wrist")),
    ("added_mass", "arm", {"mass": 6.0}, ("acc_column",)),
    ("extra_mode", "arm", {"mass": 2.0, "frequency": 40.0, "damping_ratio": 0.02}, ("acc_column", "acc_arm")),
]


def loaded(word: str, site: str, values: dict[str, float], outputs: tuple[str, ...]) -> Measurement:
    return with_outputs(measured((chladni.attached(word, site, values),), noise=0.003), outputs)


@pytest.mark.nightly
@pytest.mark.parametrize(("word", "site", "values", "outputs"), LOADS)
def test_a_heavy_load_is_found_beside_the_parameters(
    word: str, site: str, values: dict[str, float], outputs: tuple[str, ...]
) -> None:
    log = loaded(word, site, values, outputs)
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    candidates = screened(location, location.ranked, WORDS)
    found = linear_hypotheses(arm(), location, candidates)
    best = next(one for one in found if one.effects[0].effect == word)
    # Noise of 0.3 % beside as much that a floor grants to any law is half of the floor, less what ten numbers take of
    # 1500 lines: 0.497, with a spread of 0.013 for one sensor.
    assert 0.45 < fitted_beside(arm(), location, best.effects[0], best.start_z).chi < 1.1
    assert best.effects[0].site == site
    # Parameters of the machine are off, by three per cent each: masses are known no better.
    assert best.effects[0].values["mass"] == pytest.approx(values["mass"], rel=0.05)


@pytest.mark.nightly
def test_and_named() -> None:
    found = diagnose(arm(), [loaded(*LOADS[0])], leave_out=all_but("added_mass", "extra_mode"))
    assert found.verdict == "effect"
    assert (found.causes[0].effect, found.causes[0].site) == ("added_mass", "wrist")
    assert found.gap.closed > 0.99


@pytest.mark.nightly
def test_a_coupling_that_is_no_force_at_any_one_place_is_found_by_its_first_step() -> None:
    log = measured((chladni.attached("gyroscopic", "column~wrist", {"coefficient": 60.0}),))
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    best = linear_elsewhere(arm(), location, WORDS, ())[0]
    (effect,) = best.effects
    assert (effect.effect, effect.site) == ("gyroscopic", "column~wrist")
    assert effect.values["coefficient"] == pytest.approx(60.0, rel=0.05)
    assert fitted_beside(arm(), location, effect, best.start_z).chi < 1.1


def test_nothing_is_fitted_elsewhere_where_the_model_is_right() -> None:
    log = measured()
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    assert linear_elsewhere(arm(), location, WORDS, ()) == []


def test_a_second_linear_word_is_found_beside_a_first_one() -> None:
    late = chladni.attached("time_offset", "acc_arm", {"offset": 8e-4})
    load = chladni.attached("added_mass", "wrist", {"mass": 1.5})
    log = measured((late, load))
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    best = linear_beside(arm(), location, WORDS, (late,), location.tuned.z, location.tuned.chi)[0]
    assert [(one.effect, one.site) for one in best.effects] == [("time_offset", "acc_arm"), ("added_mass", "wrist")]
    assert best.effects[1].values["mass"] == pytest.approx(1.5, rel=0.1)


@pytest.mark.nightly
def test_the_search_names_what_is_no_force_at_any_place() -> None:
    log = measured((chladni.attached("gyroscopic", "column~wrist", {"coefficient": 60.0}),))
    found = diagnose(arm(), [log], leave_out=all_but("gyroscopic"))
    assert [(one.effect, one.site) for one in found.causes] == [("gyroscopic", "column~wrist")]
