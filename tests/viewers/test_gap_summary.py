"""A diagnosis in sentences and tables."""

import re
from dataclasses import replace

import pytest

from chladni.gap.records.diagnosis import AnyLaw, Candidate, Cause, FittedNumber, PairShare
from chladni.models.effects.catalogue import CATALOGUE
from chladni.signals.engineering import engineering, percent
from chladni.viewers import gap_tables as tables
from chladni.viewers.effect_words import cause_law, cause_phrase, effect_at, effect_heading, effect_name
from chladni.viewers.gap_summary import caveats, headline, naive_sentence, summary
from tests import made_diagnosis as made


def cause(effect: str, site: str, **numbers: tuple[float, float | None, str]) -> Cause:
    parameters = {name: FittedNumber(value=v, std=s, unit=u) for name, (v, s, u) in numbers.items()}
    return made.friction(effect=effect, site=site, parameters=parameters, variant=None)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (cause("coulomb_friction", "elbow", force=(8.1, 0.2, "N")), "Coulomb friction of 8.10 ± 0.20 N at elbow"),
        (cause("delay", "hammer", delay=(0.0031, 5e-5, "s")), "a delay of 3.100 ± 0.050 ms at hammer"),
        (cause("backlash", "elbow", gap=(2e-4, 1e-6, "m")), "backlash of 200.0 ± 1.0 µm at elbow"),
        (cause("gain_error", "acc", gain=(0.92, 0.01, "1")), "a gain error at acc (gain 0.920 ± 0.010)"),
        (
            cause("extra_mode", "wrist", mass=(0.31, 0.02, "kg"), frequency=(48.2, 0.3, "Hz")),
            "an extra mode at wrist (mass 0.310 ± 0.020 kg, frequency 48.20 ± 0.30 Hz)",
        ),
        (cause("base_vibration", "ground"), "base vibration of the ground"),
        (cause("magnetic_brake", "elbow", drag=(3.0, None, "N s/m")), "magnetic brake of 3 N s/m at elbow"),
    ],
)  # fmt: skip
def test_a_cause_is_said_with_its_size_and_site(given: Cause, said: str) -> None:
    assert cause_phrase(given) == said


@pytest.mark.parametrize("effect", CATALOGUE)
def test_every_word_of_the_catalogue_has_words_for_people(effect: str) -> None:
    assert effect_name(effect)
    assert "_" not in effect_name(effect)
    assert effect_at(effect, "x").endswith(" x")
    assert not effect_heading(effect).startswith(("a ", "an "))


def test_the_law_is_told_with_its_variant() -> None:
    told = cause_law(made.friction(variant="bristle"))
    assert told.startswith("dry friction of one size, whatever the speed: F = force w")
    assert told.endswith("(bristle)")
    crossed = replace(cause("cross_axis", "acc_x"), source="acc_y")
    assert "heard from acc_y" in cause_law(crossed)
    assert cause_law(made.friction(effect="magnetic_brake")) == ""


def test_an_effect_is_the_answer_with_how_far_it_goes() -> None:
    said = summary(made.diagnosis())
    assert said == (
        "Most likely Coulomb friction of 8.10 ± 0.20 N at elbow (97 %).",
        (
            "It explains 93 % of the gap that tuning leaves; adding it brings the error from 28 % to 1.0 % on "
            "stretches that no fit saw, noise 1.0 %."
        ),
        "Adding it closes 99.5 % of the gap above the noise (95 % interval 99.0 to 99.8 %).",
    )


def test_how_sure_it_is_shows_in_the_first_word() -> None:
    for probability, word in ((0.95, "Most likely"), (0.7, "Probably"), (0.4, "Perhaps")):
        found = replace(made.diagnosis(), causes=(made.friction(probability=probability),))
        assert headline(found).startswith(f"{word} Coulomb friction")


def test_two_causes_are_told_together_with_the_less_certain_ones_word() -> None:
    said = summary(made.two_causes())
    assert said[0].startswith("Probably two causes at once: Coulomb friction")
    assert "(97 %) and a gain error at acc_wrist" in said[0]
    assert said[1].startswith("Together they explain 95 % of the gap that tuning leaves; ")
    assert said[2] == (
        "Without Coulomb friction at elbow 70 % of it and without a gain error at acc_wrist 20 % of it comes back."
    )


def test_what_was_read_off_a_signal_was_not_held() -> None:
    rows = tables.cause_table(made.hidden_floor())[1]
    assert [row[2:] for row in rows] == [("level", "0.31 m/s²"), ("band", "40 Hz"), ("band start", "2 Hz")]


def test_the_form_of_a_law_stands_in_the_table_where_there_are_several() -> None:
    lag = made.friction(
        effect="lag", site="shaker", variant="second_order",
        parameters={"time_constant": FittedNumber(value=1e-3, std=None, unit="s")},
    )  # fmt: skip
    for cause, told in (
        (made.friction(variant="bristle"), "Coulomb friction (bristle)"),
        (lag, "lag (second order)"),
        (replace(lag, effect="delay", variant="dead_time"), "delay"),
        (made.friction(variant=None), "Coulomb friction"),
        (made.friction(effect="magnetic_brake", variant="own"), "magnetic brake"),
    ):
        rows = tables.cause_table(replace(made.diagnosis(), causes=(cause,)))[1]
        assert {row[0] for row in rows} == {told}


def test_no_share_is_told_where_none_is_known() -> None:
    found = made.two_causes()
    untold = replace(
        found,
        causes=tuple(replace(one, share=None) for one in found.causes),
        gap=replace(found.gap, explained=None),
    )
    said = summary(untold)
    assert said[1].startswith("Adding them brings the error from 28 % to 1.0 %")
    assert any(one.startswith("Adding them closes 99.5 %") for one in said)
    assert not any("comes back" in one for one in said)


def test_sites_and_effects_that_cant_be_told_apart_are_named() -> None:
    said = summary(made.indistinguishable())
    assert "These sensors can't tell elbow from shoulder." in said
    assert "This log can't tell Coulomb friction at elbow from hysteresis at elbow." in said


def test_a_word_that_is_told_for_its_family_says_whose_the_probability_is() -> None:
    found = made.indistinguishable()
    cause = replace(found.causes[0], probability=0.62, probability_of=("coulomb_friction", "hysteresis"))
    said = " ".join(summary(replace(found, causes=(cause,))))
    assert "from hysteresis at elbow: 62 % is that of its family there." in said


def test_nothing_missing_is_told_with_what_was_tuned() -> None:
    said = summary(made.agreeing())
    assert said[0].startswith("Nothing is missing: the model's error is 1.0 %")
    assert said[1] == "No force, error or change at any of 4 places explains anything beyond the noise."
    assert "elbow.stiffness is 20.400 ± 0.080 kN/m where the model has 20 kN/m" in said[2]
    assert not any("closed" in one.lower() for one in said)


@pytest.mark.parametrize("kind", ["effect", "unknown", "none", "parameters", "periodic"])
def test_noise_that_is_a_bound_is_told_as_one_wherever_it_is_told(kind: str) -> None:
    found = made.every_kind()[kind]
    bound = replace(
        found,
        gap=replace(found.gap, noise_at_most=True, before=2.0 * found.gap.noise),
        elsewhere=tuple(replace(one, noise_at_most=True) for one in found.elsewhere),
    )
    told = [one for one in summary(bound) if re.search(r"noise (at most )?\d", one)]
    assert told
    assert all(re.search(r"noise at most \d", one) for one in told)
    assert not any("times the noise" in one for one in summary(bound))
    first, *_ = found.where.channels
    where = replace(found.where, channels=(replace(first, noise_at_most=True, noise=0.068),))
    assert tables.channel_table(where)[1][0][2] == "at most 6.8 %"


def test_wrong_values_are_told_against_the_nominal_ones() -> None:
    said = summary(made.wrong_values())
    assert "elbow.stiffness is 31.000 ± 0.090 kN/m where the model has 20 kN/m (96 %)" in said[0]
    assert "on stretches that no fit saw" in said[1]
    alone = summary(replace(made.wrong_values(), tuned_parameters={}))
    assert "elbow.stiffness is 31.000 ± 0.090 kN/m (96 %)" in alone[0]


def test_what_any_law_explains_is_told_beside_the_named_one() -> None:
    law = AnyLaw(site="elbow", group=(), force=0.999, law=0.994, named=0.93)
    told = summary(replace(made.diagnosis(), any_law=law))
    assert (
        "Any smooth law of what moves at elbow explains 99.4 % of what the best parameters leave, the named one 93 %."
    ) in told
    assert not any("smooth law" in one for one in summary(made.diagnosis()))


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.97, ("A smooth law of what moves at elbow or wrist explains 97 % of what the best parameters leave: none "
                "that took part does.")),
        (0.41, ("Any smooth law of what moves at elbow or wrist explains 41 % of what the best parameters leave, any "
                "force there 98 %: what acts has a memory, follows something else, or acts elsewhere, too.")),
    ],
)  # fmt: skip
def test_an_unknown_gap_is_told_with_whether_a_law_of_the_motion_explains_it(share: float, words: str) -> None:
    law = AnyLaw(site="elbow", group=("wrist",), force=0.98, law=share, named=None)
    assert words in summary(replace(made.unknown(), any_law=law))


def test_an_unknown_gap_is_told_with_where_it_lies_and_what_is_nearest() -> None:
    said = summary(made.unknown())
    assert said[0] == (
        "There is a gap that no known effect explains: the best parameters leave an error of 21 % (28 % before), "
        "noise 1.0 %."
    )
    assert said[1] == "93 % of what they leave can come from elbow, and 85 % of it lies between 16 and 30 Hz."
    assert said[2].startswith("Nearest, but not good enough: Coulomb friction at elbow, hysteresis at elbow")
    assert said[-1] == "Measure the wrist's rotation, too."
    # One sensor tells bands, and no sites.
    left = made.unknown().left
    assert left is not None
    blind = replace(made.unknown(), left=replace(left, sites=()))
    assert summary(blind)[1] == "85 % of what they leave lies between 16 and 30 Hz."


def test_how_it_was_measured_is_told_where_it_was_not_by_free_run() -> None:
    assert any("windows of 500 ms" in one or "windows of 0.5 s" in one for one in summary(made.drifting()))
    assert any("predicted from the others" in one for one in summary(made.hidden_floor()))


def test_a_gap_near_the_noise_is_called_faint() -> None:
    found = made.diagnosis()
    faint = replace(found, gap=replace(found.gap, before=0.018, noise=0.01, closed=None, interval=None))
    said = summary(faint)
    assert "The gap is faint: the error is 1.8 times the noise." in said
    assert "The gap is too near to the noise to say which share of it closes." in said
    assert not any("faint" in one for one in summary(found))


def test_the_naive_answer_is_told_only_when_it_differs() -> None:
    assert naive_sentence(made.diagnosis()) is not None
    same = replace(made.diagnosis(), naive=Candidate(effect="coulomb_friction", site="elbow"))
    assert naive_sentence(same) is None
    assert naive_sentence(replace(same, naive=None)) is None


def test_tables_are_in_the_order_that_one_reads() -> None:
    found = made.diagnosis()
    assert [row[0] for row in tables.channel_table(found.where)[1]] == ["acc_column", "acc_wrist"]
    assert [row[1] for row in tables.channel_table(found.where)[1]] == sorted(
        (percent(one.gap) for one in found.where.channels), reverse=True
    )
    assert [row[0] for row in tables.site_table(found.where)[1]] == ["elbow", "shoulder", "shaker", "acc_wrist"]
    assert len(tables.band_table(found.where, least=0.15)[1]) == 2
    mixed = replace(found.where, bands=found.where.bands[::-1])
    assert [row[0] for row in tables.band_table(mixed)[1]] == ["0.5 to 8", "8 to 16", "16 to 30"]
    assert [row[0] for row in tables.site_table(found.where, count=2)[1]] == ["elbow", "shoulder"]
    assert len(tables.ranking_table(found)[1]) == tables.RANKED
    assert tables.ranking_table(found, count=9)[1][-1] == ("delay", "shaker", "under 1 %", "–", "–")


def test_parameters_that_moved_or_were_held_are_listed_and_no_others() -> None:
    rows = tables.parameter_table(made.diagnosis())[1]
    assert rows == [
        ("elbow.stiffness", "20 kN/m", "20.400 ± 0.080 kN/m", "+2.0 %"),
        ("shoulder.damping", "400 N s/m", "400 N s/m", "not determined"),
    ]


@pytest.mark.parametrize(
    ("value", "std", "unit", "printed"),
    [
        (0.0, None, "N", "0 N"),
        (0.0, 0.05, "N", "0.000 ± 0.050 N"),
        (61234.0, 1500.0, "1", "61234 ± 1500"),
        (1.5e12, 1e11, "1", "1.50e+12 ± 1.0e+11"),
        (1.5e12, 1e11, "kg", "(1.50e+12 ± 1.0e+11) kg"),
        (-3e-4, 1e-5, "m/s", "-300 ± 10 µm/s"),
        (2.5e-9, float("nan"), "s", "2.5 ns"),
        (3.1e-5, None, "kg", "3.1e-05 kg"),
        (12.0, 1.0, "m^2", "12.0 ± 1.0 m²"),
        (2e-4, None, "m^2", "0.0002 m²"),
        (0.05, None, "mol", "0.05 mol"),
    ],
)
def test_quantities_have_the_digits_and_prefix_they_deserve(
    value: float, std: float | None, unit: str, printed: str
) -> None:
    assert engineering(value, std, unit) == printed


@pytest.mark.parametrize(
    ("share", "printed"),
    [(1.0, "100 %"), (0.99949, "99.9 %"), (0.9996, "100 %"), (0.985, "98 %"), (1.12, "112 %"), (0.0996, "10 %"),
     (-0.02, "-2.0 %"), (1e-12, "0 %")],
)  # fmt: skip
def test_percents_have_two_digits(share: float, printed: str) -> None:
    assert percent(share) == printed


def test_another_log_is_told_with_its_own_numbers() -> None:
    told = summary(made.periodic())
    assert not any("carry over" in one for one in told)
    assert "On louder.mcap, which nothing was fitted to, the error goes from 28 % to 3.1 %, noise 1.0 %." in told


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("effect", ()),
        ("group", ("These sensors can't tell elbow from shoulder.", "This log can't tell")),
        ("periodic", ("On louder.mcap",)),
        ("windows", ("Errors are those of windows",)),
        ("unknown", ("Measure the wrist's rotation",)),
        ("none", ()),
    ],
)
def test_caveats_are_those_sentences_that_limit_the_answer(kind: str, told: tuple[str, ...]) -> None:
    found = made.every_kind()[kind]
    limiting = caveats(found)
    assert len(limiting) == len(told)
    assert all(one.startswith(begun) for one, begun in zip(limiting, told, strict=True))
    assert set(limiting) <= set(summary(found)[1:])


def test_a_gap_near_the_noise_is_a_caveat() -> None:
    found = made.diagnosis()
    near = replace(found, gap=replace(found.gap, noise=found.gap.before / 1.5, closed=None))
    faint, unclear = caveats(near)
    assert faint.startswith("The gap is faint")
    assert unclear.startswith("The gap is too near to the noise")


def test_a_cause_that_makes_another_log_worse_is_said_not_to_carry_over() -> None:
    found = made.periodic()
    worse = replace(found.elsewhere[0], before=0.52, after=0.71)
    told = summary(replace(found, elsewhere=(worse,)))
    assert any(one.endswith("noise 1.0 %: what was found doesn't carry over.") for one in told)


def test_a_cause_that_closes_little_of_another_log_is_said_to() -> None:
    found = made.periodic()
    little = replace(found.elsewhere[0], before=0.52, after=0.41, closed=0.2, interval=(0.1, 0.3))
    told = summary(replace(found, elsewhere=(little,)))
    assert any(one.endswith("noise 1.0 %: little of what was found carries over.") for one in told)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        # A constant force has a sign: it's known to be near zero beside the friction. A sigma far above is none.
        (cause("coulomb_friction", "elbow", force=(8.1, 0.2, "N"), offset=(0.02, 0.05, "N")), "20 ± 50 mN"),
        (cause("coulomb_friction", "elbow", force=(8.1, 0.2, "N"), offset=(-0.0087, 2e3, "N")), "not determined"),
        # What is positive is fitted by its logarithm: this one isn't known within a factor of e.
        (cause("coulomb_friction", "elbow", force=(1e-5, 1.2e-5, "N")), "not determined"),
    ],
)
def test_a_number_that_nothing_tells_is_not_shown_as_one(given: Cause, said: str) -> None:
    assert tables.cause_table(replace(made.diagnosis(), causes=(given,)))[1][-1][-1] == said


def test_the_answer_itself_shows_no_number_that_nothing_tells() -> None:
    friction = cause("coulomb_friction", "damper", force=(1.3e-5, 0.013, "N"))
    assert cause_phrase(friction) == "Coulomb friction of undetermined size at damper"
    mode = cause("extra_mode", "wrist", mass=(1e-6, 1e-3, "kg"), frequency=(48.2, 0.3, "Hz"))
    assert cause_phrase(mode) == "an extra mode at wrist (mass not determined, frequency 48.20 ± 0.30 Hz)"


def test_what_is_left_to_causes_that_were_not_weighed_has_a_row() -> None:
    found = made.diagnosis()
    likely = replace(found.ranking[0], probability=0.84)
    rows = tables.ranking_table(replace(found, ranking=(likely, *found.ranking[1:])))[1]
    assert rows[-1][:3] == ("none of these", "–", "13 %")
    # Two causes at once share their probability: no sum tells what is left.
    both = replace(made.two_causes(), ranking=(likely, *found.ranking[1:]))
    assert all(row[0] != "none of these" for row in tables.ranking_table(both)[1])


def test_a_row_whose_numbers_are_of_a_pair_says_so() -> None:
    found = made.diagnosis()
    half = replace(found.ranking[1], beside=(Candidate(effect="time_offset", site="acc_wrist"),))
    rows = tables.ranking_table(replace(found, ranking=(found.ranking[0], half)))[1]
    assert [row[:2] for row in rows[:2]] == [
        ("Coulomb friction", "elbow"),
        ("hysteresis", "elbow (with time offset at acc_wrist)"),
    ]


def test_candidates_without_a_chance_stand_by_their_evidence() -> None:
    found = made.unknown()
    hidden = tuple(
        replace(one, probability=chance, log_evidence=nats)
        for one, chance, nats in zip(found.ranking, (1e-9, 1e-4, 1e-6), (-130.0, -150.0, -140.0), strict=False)
    )
    rows = tables.ranking_table(replace(found, ranking=hidden))[1]
    assert [row[-1] for row in rows[:-1]] == ["-130.0", "-140.0", "-150.0"]
    assert rows[-1][0] == "none of these"


def test_regimes_have_their_unit() -> None:
    where = made.diagnosis().where
    assert tables.regime_table(where)[1] == [("elbow.velocity", "-10 to 10 mm/s", "60 %", "20 %")]
    bare = replace(where, regimes=(replace(where.regimes[0], unit="", time=None),))
    assert tables.regime_table(bare)[1][0] == ("elbow.velocity", "-0.01 to 0.01", "60 %", "–")


def test_sites_that_look_the_same_share_a_row() -> None:
    first, second, *others = made.diagnosis().where.sites
    alike = (replace(first, group=("wrist",)), second, replace(first, name="wrist", group=("elbow",)), *others)
    where = replace(made.diagnosis().where, sites=alike)
    assert tables.site_table(where)[1][:2] == [("elbow, wrist", "93 %"), ("shoulder", "31 %")]
    assert len(tables.site_table(where)[1]) == 2 + len(others)
    pair = PairShare(groups=(("elbow", "wrist"), ("shaker",)), share=0.99)
    assert tables.site_table(replace(where, pair=pair))[1][0] == ("elbow, wrist and shaker", "99.0 %")
    left = replace(made.unknown(), left=where)
    assert any("can come from elbow or wrist" in sentence for sentence in summary(left))


def test_where_even_lines_are_excited_too_the_sum_is_told() -> None:
    found = made.periodic()
    assert tables.distortion_title(found.distortion) == "Linear, even, odd and noise"
    assert tables.distortion_table(found)[0][2:4] == ("Even", "Odd")
    summed = replace(found, distortion=tuple(replace(one, even=None, odd=None) for one in found.distortion))
    assert tables.distortion_title(summed.distortion) == "Linear, nonlinear and noise"
    assert tables.distortion_table(summed) == (
        ("Output", "Linear", "Nonlinear", "Noise"),
        [("acc_column", "93 %", "6.9 %", "0.10 %"), ("acc_wrist", "88 %", "12 %", "0.10 %")],
    )


def test_it_is_told_once_what_the_noise_was_estimated_from() -> None:
    where = made.diagnosis().where
    assert tables.noise_told(where) == "Noise is estimated from what differs between periods of the input."
    first, second = where.channels
    mixed = replace(where, channels=(first, replace(second, noise_from="quiet band")))
    assert tables.noise_told(mixed) == (
        "Noise is estimated from what differs between periods of the input (acc_column); from the quietest part "
        "of the band (acc_wrist)."
    )
    assert tables.noise_told(replace(where, channels=(replace(first, noise_from=""),))) is None
    assert [row[2] for row in tables.band_table(where)[1]] == ["40 %", "under 1 %", "–"]
    torques = replace(where, bands=tuple(replace(one, noise=None) for one in where.bands))
    assert tables.band_table(torques)[0] == ("Band [Hz]", "Share")


def test_the_stretch_of_the_log_with_most_of_the_gap_comes_first() -> None:
    where = made.diagnosis().where
    assert tables.time_table(where)[1] == [("2 to 2.5", "31 %"), ("0.25 to 1", "27 %")]
    assert tables.time_table(where, least=0.3)[1] == [("2 to 2.5", "31 %")]


def test_of_an_unknown_gap_the_tables_tell_where_the_rest_lies() -> None:
    assert tables.where_told(made.diagnosis()) is made.diagnosis().where
    told = tables.where_told(made.unknown())
    assert told.channels == made.unknown().where.channels
    assert [one.share for one in told.bands] == [0.05, 0.1, 0.85]


def test_parameters_that_moved_without_being_determined_show_both() -> None:
    loose = FittedNumber(value=93.3, std=None, unit="N/m", nominal=223.0)
    rows = tables.parameter_table(replace(made.diagnosis(), tuned_parameters={"damper.stiffness": loose}))[1]
    assert rows == [("damper.stiffness", "223 N/m", "93.3 N/m", "-58 %, not determined")]


def test_large_changes_and_round_values_have_no_exponent() -> None:
    found = FittedNumber(value=8000.0, std=100.0, unit="N s/m", nominal=1000.0)
    row = tables.parameter_table(replace(made.diagnosis(), tuned_parameters={"a.damping": found}))[1][0]
    assert row == ("a.damping", "1000 N s/m", "8000 ± 100 N s/m", "+700 %")
