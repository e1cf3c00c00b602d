"""What is believed: sets of causes and an unknown force at each place share one probability."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.calibration import ANOTHER, WORTH
from chladni.gap.diagnosis.belief import Belief
from chladni.gap.diagnosis.search import Search
from chladni.gap.diagnosis.verdict import _verdict
from chladni.gap.explanation.evidence import Left
from chladni.gap.plant.places import Place, Site
from chladni.gap.records.diagnosis import PARAMETER, Candidate
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.fitted import LINES, SURE, as_probable, contestant, leaving, location

LAG = attached("lag", "hammer", {"time_constant": 1e-3})
DELAY = attached("delay", "hammer", {"delay": 1e-3})
RUB = attached("coulomb_friction", "j1", {"force": 5.0})
#: Share of the gap below which nothing gets a name: what a model is rounded by.
SHARE = 0.02
#: Three joints, three bodies, the ground, an input, three sensors.
SITES = {"joint": 3, "body": 3, "ground": 1, "input": 1, "output": 3}
#: Numbers that a discrepancy is worth along the force of one law, and elsewhere.
ALONG, ACROSS = 8, 60
#: Of the floor's power, what is uncertain: twice its standard deviation of a tenth, and 5 %.
DOUBT = 0.25
#: The same of what a fit leaves, unless it says otherwise.
OWN_DOUBT = 0.05
#: Nats of an unknown force at a place before the log is seen: that there is one, that it's there, and its numbers.
UNKNOWN = np.log(ANOTHER) - np.log(sum(SITES.values())) - ALONG


def place(misfit: float, *, places: int = 1, sensors: int = 3):
    """A force at one place, or at two, that leaves so many times the noise."""
    expected = (sensors - places) * LINES
    sites = tuple(Site(name=f"j{one}", kind="joint") for one in range(places))
    profile = SimpleNamespace(
        misfit=misfit * expected, expected=expected, prior=0.0, taken=(), own=(), forces=(None,) * places, sites=sites
    )
    return SimpleNamespace(profile=profile, places=tuple(Place(sites=(one,)) for one in sites))


def leaving_all(share: float) -> Left:
    """What leaves so many times the noise along and across."""
    return leaving(share, along=(share - 1.0) * LINES)


def student(energy: float, numbers: int) -> float:
    """Nats of a discrepancy of so many independent numbers, whose size nobody knows."""
    return -numbers * np.log(1 + energy / numbers)


def told(beyond: float, noise: float, doubt: float) -> float:
    """What counts beyond a noise that a fit tells."""
    return beyond**2 / (beyond + doubt * noise)


def weighed(*pairs):
    return [replace(one, log_evidence=as_probable(one, share)) for one, share in pairs]


def test_probabilities_of_all_sets_and_of_none_of_them_are_one() -> None:
    found = [contestant(log_evidence=-3.0), contestant(LAG, log_evidence=2.0), contestant(LAG, RUB, log_evidence=9.0)]
    for ranked in ([], [place(1.0)], [place(1.0), place(1.2), place(1.0, places=2)]):
        belief = Belief(location(ranked, misfit=1.1), found)
        assert sum(one.probability for one in belief.sets) + belief.unknown == pytest.approx(1.0)
        assert all(0.0 <= one.probability <= 1.0 for one in belief.sets)


def test_a_set_with_one_more_cause_pays_for_it_and_for_which_it_is() -> None:
    # All leave noise alone, so that they differ in nothing but their price.
    noise = leaving(1.0)
    belief = Belief(location(), [contestant(left=noise)])
    words = sum(SITES[kind] for one in CATALOGUE.values() for kind in one.sites if kind in SITES)
    nothing, one, two = (belief.nats(contestant(*effects, left=noise)) for effects in ((), (LAG,), (LAG, RUB)))
    assert nothing - one == pytest.approx(np.log(words / ANOTHER))
    assert one - two == pytest.approx(nothing - one)
    value = belief.nats(contestant(freed=("j1.stiffness",), left=noise))
    parameters = len(location().problem.tunables.names)
    assert nothing - value == pytest.approx(np.log(parameters / ANOTHER))
    # More values than words at sites there are not: so a wrong value is likelier than any one word.
    assert value > one


def test_forms_of_a_word_count_once_by_the_best_of_them() -> None:
    first, other = contestant(LAG, log_evidence=14.0), contestant(LAG, log_evidence=13.9)
    belief = Belief(location(), [contestant(), first, other, contestant(DELAY, log_evidence=14.0)])
    assert [len(one.causes) for one in belief.sets] == [1, 1, 0]
    assert belief.sets[0].probability == pytest.approx(belief.sets[1].probability)
    assert all(one.best is not other for one in belief.sets)


def test_what_leaves_less_than_the_floor_says_for_all_that_noise_is_less() -> None:
    # A sensor that clips looks noisy: of a floor four times too high, a quarter and a half are far apart, not alike.
    def low(share: float):
        return Left(along=share * 300.0, along_expected=300.0, across=share * 900.0, across_expected=900.0, force=1e7)

    nothing, best, worse = (
        contestant(left=low(1.0)),
        contestant(LAG, left=low(0.25)),
        contestant(DELAY, left=low(0.5)),
    )
    found = [replace(one, log_evidence=one.left.log_likelihood) for one in (nothing, best, worse)]
    assert [one.log_evidence for one in found] == [0.0, 0.0, 0.0]
    belief = Belief(location(), found)
    assert belief.level == pytest.approx(0.25)
    assert belief.nats(found[1]) - belief.nats(found[2]) == pytest.approx(-low(0.5).at(0.25).log_likelihood)
    assert belief.best is found[1]


def test_a_cause_that_does_nothing_is_none_where_one_floor_is_too_high() -> None:
    # Both leave noise alone: half of the first sensor's floor, all of the others'. The idle one prints on the second.
    alone = Left(
        along=150.0, along_expected=300.0, across=600.0, across_expected=600.0, force=1e7,
        outputs=(0.5, 1.0, 1.0), along_outputs=(300.0, 0.0, 0.0),
    )  # fmt: skip
    beside = replace(
        alone, along=450.0, along_expected=600.0, across=300.0, across_expected=300.0, sites=2,
        along_outputs=(300.0, 300.0, 0.0),
    )  # fmt: skip
    nothing = contestant(left=replace(alone, across=6e5, outputs=(500.0,) * 3))
    found = [nothing, contestant(LAG, left=alone), contestant(LAG, RUB, left=beside)]
    belief = Belief(location(), [replace(one, log_evidence=one.left.log_likelihood) for one in found])
    assert belief.level == pytest.approx((0.5, 1.0, 1.0))
    assert not np.any([belief.beyond(found[1]), belief.beyond(found[2])])
    assert {one.effect for one in belief.sets[0].causes} == {LAG.kind.name}


def test_what_an_idle_cause_makes_of_another_one_is_that_one_s() -> None:
    # A third word imitates the pair; without its second cause, too small for a name, the first one is worse than it.
    nothing = contestant(left=leaving(500.0), log_evidence=-600.0)
    lag, both = contestant(LAG, left=leaving(4.0), log_evidence=-300.0), contestant(LAG, RUB, left=leaving(1.0))
    belief = Belief(location(), [nothing, lag, both, contestant(DELAY, left=leaving(1.3), log_evidence=-150.0)])
    assert belief.sets[0].best is lag
    assert belief.sets[0].causes == {Candidate(effect="lag", site=LAG.site)}
    assert belief.sets[0].nats == pytest.approx(belief.nats(both))
    assert all(len(one.causes) < 2 for one in belief.sets)


def test_a_cause_of_one_sensor_counts_by_that_sensor_s_gap() -> None:
    # The first sensor's noise is small: its gap is nearly all of the energy. The second cause is at the other one.
    def left(*outputs: float) -> Left:
        return replace(leaving(float(np.mean(outputs))), outputs=outputs)

    nothing, lag = contestant(left=left(1e5, 60.0, 1.0)), contestant(LAG, left=left(1.0, 30.0, 1.0))
    both = contestant(LAG, RUB, left=left(1.0, 1.0, 1.0), log_evidence=1e3)
    assert {len(one.causes) for one in Belief(location(), [nothing, lag, both]).sets} == {0, 1, 2}


def test_a_fit_tells_the_noise_as_far_as_the_floor_allows_and_else_the_floor_does() -> None:
    most = 1.0 + 2.0 * DOUBT
    assert Belief(location(), [contestant(left=leaving_all(most - 0.01))]).level == pytest.approx(most - 0.01)
    assert Belief(location(), [contestant(left=leaving_all(most + 0.01))]).level == pytest.approx(most)


def test_a_cause_without_which_as_little_is_left_is_none() -> None:
    lag, both = contestant(LAG, left=leaving(2.0)), contestant(LAG, RUB, left=leaving(1.99), log_evidence=1e3)
    nothing = contestant(left=leaving(50.0))
    assert {len(one.causes) for one in Belief(location(), [nothing, lag, both]).sets} == {0, 1}
    # Of a gap of 49 times the noise the second explains 2 % and a little, beyond what the noise may be more by.
    energy = nothing.left.beyond / (3 * LINES)
    least = 1.5 * (SHARE * energy + OWN_DOUBT)
    lag, more = (
        contestant(LAG, left=leaving(1.0 + 1.001 * least)),
        contestant(LAG, RUB, log_evidence=1e3, left=leaving(1.0)),
    )
    belief = Belief(location(), [nothing, lag, more])
    assert belief.least == pytest.approx(SHARE * energy + OWN_DOUBT)
    assert {len(one.causes) for one in belief.sets} == {0, 1, 2}


def test_one_word_at_several_sites_of_a_kind_is_one_cause_more_and_which_of_them() -> None:
    # All leave noise alone, so that they differ in nothing but their price.
    noise = leaving(1.0)
    belief = Belief(location(), [contestant(left=noise)])
    alike = [replace(RUB, site=site) for site in ("j0", "j1", "j2")]
    one, two, three = (belief.nats(contestant(*alike[:count], left=noise)) for count in (1, 2, 3))
    joints = sum(SITES[kind] for kind in RUB.kind.sites)
    assert two - one == pytest.approx(np.log(ANOTHER) - np.log(math.comb(joints, 2)))
    assert three - one == pytest.approx(np.log(ANOTHER) - np.log(math.comb(joints, 3)))
    # Others share nothing, and pay each for itself.
    others = belief.nats(contestant(alike[0], LAG, left=noise))
    assert others - one == pytest.approx(belief.word)


def test_which_other_output_an_effect_listens_to_is_paid_for() -> None:
    noise = leaving(1.0)
    belief = Belief(location(), [contestant(left=noise)])
    gain = attached("gain_error", "a0", {"gain": 1.1})
    crossed = attached("cross_axis", "a0", {"coefficient": 0.1}, source="a1")
    plain, chosen = (belief.nats(contestant(one, left=noise)) for one in (gain, crossed))
    assert plain - chosen == pytest.approx(np.log(SITES["output"] - 1))


def test_words_that_take_no_part_share_no_prior() -> None:
    alone = Belief(location(), [contestant()], kinds=[CATALOGUE["lag"]])
    assert alone.word == pytest.approx(np.log(ANOTHER) - np.log(SITES["input"]))


def test_an_answer_set_is_the_shortest_that_holds_its_coverage() -> None:
    found = weighed((contestant(LAG), 0.7), (contestant(DELAY), 0.2), (contestant(), 0.1))
    belief = Belief(location(), found)
    lag, delay = (Candidate(effect=one.effect, site=one.site) for one in (LAG, DELAY))
    assert belief.answer_set(0.6 * SURE) == (lag,)
    assert belief.answer_set(0.85 * SURE) == (lag, delay)
    assert belief.answer_set(0.95 * SURE) == (lag, delay, Candidate(effect="none", site=""))


def test_a_group_is_as_probable_as_all_sets_with_any_of_it() -> None:
    found = weighed(
        (contestant(), 0.1), (contestant(LAG), 0.3), (contestant(LAG, RUB), 0.2), (contestant(DELAY, RUB), 0.15),
        (contestant(DELAY, freed=("j1.stiffness",)), 0.25),
    )  # fmt: skip
    belief = Belief(location(), found)
    lag, delay, rub = (Candidate(effect=one.effect, site=one.site) for one in (LAG, DELAY, RUB))
    assert belief.probability(lag) == pytest.approx(0.5 * SURE, abs=1e-3)
    assert belief.probability(rub) == pytest.approx(0.35 * SURE, abs=1e-3)
    # A set in which both stand counts once.
    assert belief.probability(lag, rub) == pytest.approx(0.65 * SURE, abs=1e-3)
    assert belief.probability(lag, delay) == pytest.approx(0.9 * SURE, abs=1e-3)
    assert belief.probability(Candidate(effect=PARAMETER, site="j1.stiffness")) == pytest.approx(
        0.25 * SURE, abs=1e-3
    )
    assert belief.probability(replace(rub, site="j2")) == 0.0


def test_a_name_is_as_narrow_as_the_log_allows() -> None:
    lag, delay, rub = (Candidate(effect=one.effect, site=one.site) for one in (LAG, DELAY, RUB))
    elsewhere = replace(rub, site="j2")

    def alike(cause: Candidate, *shares: float) -> tuple[Candidate, ...]:
        made = (LAG, DELAY, RUB, replace(RUB, site="j2"))
        rows = zip(made, shares, strict=False)
        belief = Belief(location(), weighed(*((contestant(one), share) for one, share in rows if share)))
        return belief.alike(cause)

    assert alike(lag, 0.6, 0.4) == (lag,)
    assert alike(lag, 0.4, 0.35, 0.25) == (lag, delay)
    # A word at several sites is one word.
    assert alike(rub, 0.25, 0.0, 0.4, 0.35) == (rub, elsewhere)


def test_a_force_of_any_shape_is_believed_where_no_law_explains_what_it_does() -> None:
    # A gap of a hundred times the noise, of which the word leaves a tenth and a force at one place nothing.
    where, nothing = location([place(1.0)], misfit=100.0), contestant(left=leaving(100.0))
    nothing = replace(nothing, log_evidence=nothing.left.log_likelihood)

    def unknown(chi: float) -> float:
        word = contestant(RUB, left=leaving(chi))
        return Belief(where, [nothing, replace(word, log_evidence=word.left.log_likelihood)]).unknown

    assert unknown(1.0) < 0.05
    assert unknown(10.0) > 0.95
    # Nor is it at two places where one is enough.
    one, two = (Belief(location([each], misfit=100.0), [nothing]) for each in (place(1.0), place(1.0, places=2)))
    first, both = (each.unknown_at(each._location.ranked[0]) for each in (one, two))
    assert first > both


@pytest.mark.parametrize(("chi", "level"), [(1.0, 1.0), (100.0, 1.0 + 2.0 * DOUBT)])
def test_an_unknown_force_pays_for_each_place_and_for_its_numbers_there(chi: float, level: float) -> None:
    # What the model leaves is all a force's; as many places as there are sensors take all of it.
    fit = contestant(left=leaving(chi))
    for places in (1, 2):
        where = location([place(1.0, places=places)], misfit=100.0)
        noise = level * places * LINES
        along = 3 * 100.0 * LINES - (3 - places) * LINES
        assert Belief(where, [fit]).unknown_at(where.ranked[0]) == pytest.approx(
            student(told(along - noise, noise, DOUBT), ALONG * places) + UNKNOWN * places
        )
    noise = level * 3 * LINES
    assert Belief(where, [fit]).anywhere == pytest.approx(
        student(told(100.0 * 3 * LINES - noise, noise, DOUBT), ALONG * 3) + UNKNOWN * 3
    )


def test_evidence_is_told_at_the_noise_that_is_believed() -> None:
    # Both fits leave less than a floor that is too high: by that alone neither would be worse.
    close, far = (contestant(left=leaving(share)) for share in (0.4, 0.9))
    belief = Belief(location([place(1.0)], misfit=100.0), [close, far])
    assert close.left.log_likelihood == far.left.log_likelihood == 0.0
    assert belief.evidence(close) > belief.evidence(far) + 10.0


def test_where_a_sensor_is_told_to_err_nothing_unknown_acts() -> None:
    where, left = location([place(1.0)], misfit=100.0), leaving(100.0)
    fit = contestant(left=left, log_evidence=left.log_likelihood)
    for told_to_err, site in (((), "j0"), (("j1",), "j0"), (("j0",), "")):
        assert Belief(where, [fit], told=told_to_err).answer_set(0.9) == (Candidate(effect="unknown", site=site),)


def test_where_nothing_was_found_to_act_no_force_is_believed() -> None:
    tuned = contestant(left=leaving(1.0))
    belief = Belief(location([place(1.0)], misfit=1.0), [tuned, contestant(RUB, left=leaving(1.0))])
    assert _verdict(belief) == "none"
    assert belief.best is tuned
    assert belief.unknown < belief.sets[0].probability


@pytest.mark.parametrize(
    ("shares", "verdict"),
    [
        ({"nothing": 0.6, "lag": 0.4}, "none"),
        ({"lag": 0.6, "nothing": 0.4}, "effect"),
        ({"value": 0.6, "nothing": 0.4}, "parameters"),
        ({"both": 0.6, "nothing": 0.4}, "effect"),
        # The likeliest, but as likely wrong as right: no name.
        ({"lag": 0.4, "rub": 0.3, "nothing": 0.3}, "unknown"),
        # But both are ways to be late at one place.
        ({"lag": 0.4, "delay": 0.3, "nothing": 0.3}, "effect"),
        # Neither set is, but what they have in common is.
        ({"lag and rub": 0.4, "lag": 0.3, "nothing": 0.3}, "effect"),
    ],
)
def test_a_name_is_given_when_it_is_more_probable_than_not(shares, verdict) -> None:
    made = {
        "nothing": contestant(),
        "lag": contestant(LAG),
        "delay": contestant(DELAY),
        "rub": contestant(RUB),
        "lag and rub": contestant(LAG, RUB),
        "value": contestant(freed=("j1.stiffness",)),
        "both": contestant(LAG, freed=("j1.stiffness",)),
    }
    assert _verdict(Belief(location(), weighed(*((made[name], share) for name, share in shares.items())))) == verdict


def test_nothing_is_no_answer_where_an_unknown_force_is_likelier() -> None:
    tuned = contestant(left=leaving(3.0))
    belief = Belief(location([place(1.0)], misfit=3.0), [replace(tuned, log_evidence=tuned.left.log_likelihood)])
    assert belief.unknown > 0.9
    assert _verdict(belief) == "unknown"


def is_open(best, nothing) -> bool:
    """Whether a search that believes what leaves one thing, where nothing leaves another, looks for another cause."""
    found = contestant(LAG, left=best, log_evidence=1e9)
    belief = Belief(location(), [contestant(left=nothing), found])
    return Search.is_open.fget(SimpleNamespace(best=found, belief=belief))


def test_a_further_cause_is_looked_for_where_it_may_be_worth_its_price_and_a_name() -> None:
    gap = leaving(1000.0)
    beyond = gap.beyond / (2 * LINES)
    assert is_open(leaving(900.0), gap)
    assert not is_open(leaving(1.0), gap)
    # Less than a name pays, however large its share is.
    assert leaving(1.01).unexplained < WORTH
    assert not is_open(leaving(1.01), leaving(1.02))
    # Far more than noise, and a share that is what a model is rounded by.
    rounded = leaving(1.0 + 0.5 * SHARE * beyond)
    assert rounded.unexplained > WORTH
    assert not is_open(rounded, gap)
    assert is_open(leaving(1.0 + 2.0 * SHARE * beyond), gap)


def test_details_of_its_own_law_ask_for_no_further_cause() -> None:
    gap = leaving(1000.0)
    force = 1e6
    assert not is_open(leaving(1.0, force=force, along=0.009 * force), gap)
    assert is_open(leaving(1.0, force=force, along=0.3 * force), gap)
